// JSON documents read with errors that say where.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>

namespace freevoxel {

/// Throws InputError with line and column.
nlohmann::json parseJson(const std::string& text, const std::string& name);

/// A value in a document and the way there ("points[2].color"), which every error names. Refers to the document.
class JsonPlace {
 public:
  JsonPlace(const nlohmann::json& value, std::string file) : value_(&value), file_(std::move(file)) {}

  [[noreturn]] void fail(const std::string& what) const;

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
  const nlohmann::json& value() const { return *value_; }

 private:
  JsonPlace(const nlohmann::json& value, std::string file, std::string way)
      : value_(&value), file_(std::move(file)), way_(std::move(way)) {}
  std::string found() const;

  const nlohmann::json* value_;
  std::string file_;
  std::string way_;
};

}  // namespace freevoxel
