// JSON documents read with errors that say where.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace freevoxel {

/// Throws InputError with line and column.
nlohmann::json parseJson(const std::string& text, const std::string& name);

/// Lines, from 1, of the values of a document by the way there, as JsonPlace writes it ("" is the document).
using JsonLines = std::map<std::string, int>;
/// Of a text that parseJson accepts.
std::shared_ptr<const JsonLines> jsonLines(const std::string& text);

/// A value in a document and the way there ("points[2].color"), which every error names. Refers to the document.
class JsonPlace {
 public:
  /// With `lines` errors name the line too.
  JsonPlace(const nlohmann::json& value, std::string file, std::shared_ptr<const JsonLines> lines = nullptr)
      : value_(&value), file_(std::move(file)), lines_(std::move(lines)) {}

  [[noreturn]] void fail(const std::string& what) const;
  /// What errors begin with: file, line, and the way there.
  std::string where() const;

  bool has(const char* key) const { return value_->is_object() && value_->contains(key); }
  /// Fails unless this is an object with that key.
  JsonPlace member(const char* key) const;
  /// Fails if this is no object, or one with a key that is not listed.
  void onlyKeys(std::initializer_list<const char*> keys) const;

  size_t size() const { return value_->size(); }
  /// Fails unless this is an array of `least` to `most` elements, which `what` describes.
  void size(size_t least, size_t most, const char* what) const;
  JsonPlace element(size_t index) const;

  /// Fails unless this is a number in low..high.
  double number(double low, double high) const;
  /// Fails unless this is a whole number in low..high.
  int64_t whole(int64_t low, int64_t high) const;
  /// Fails unless this is a text that is not empty.
  std::string text() const;
  /// Fails unless this is true or false.
  bool flag() const;
  /// Fails unless this is an array of three numbers, each in low..high; `what` describes it.
  glm::dvec3 triple(double low, double high, const char* what) const;
  const nlohmann::json& value() const { return *value_; }

 private:
  JsonPlace inside(const nlohmann::json& value, std::string way) const {
    JsonPlace place(value, file_, lines_);
    place.way_ = std::move(way);
    return place;
  }
  /// With the line of another place.
  std::string whereAt(const std::string& place) const;
  /// Fails with the line of another place.
  [[noreturn]] void failAt(const std::string& place, const std::string& what) const;
  std::string found() const;

  const nlohmann::json* value_;
  std::string file_;
  std::shared_ptr<const JsonLines> lines_;
  std::string way_;
};

}  // namespace freevoxel
