#include "volume/json_reading.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

/// nlohmann says "[json.exception.parse_error.101] parse error at line 3, column 5: what is wrong".
std::string syntaxMessage(std::string_view text) {
  if (const size_t tag = text.find("] "); tag != std::string_view::npos) text.remove_prefix(tag + 2);
  constexpr std::string_view kPrefix = "parse error at ";
  if (text.starts_with(kPrefix)) text.remove_prefix(kPrefix.size());
  std::string message(text);
  std::replace(message.begin(), message.end(), '\n', ' ');
  return message;
}

}  // namespace

nlohmann::json parseJson(const std::string& text, const std::string& name) {
  // A key given twice would silently win over the first.
  std::vector<std::set<std::string>> keys;
  std::string repeated;
  const auto watchKeys = [&](int, nlohmann::json::parse_event_t event, nlohmann::json& parsed) {
    using Event = nlohmann::json::parse_event_t;
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(parsed.get<std::string>()).second) {
      repeated = parsed.get<std::string>();
    }
    return true;
  };
  nlohmann::json document;
  try {
    document = nlohmann::json::parse(text, watchKeys);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: {}", name, syntaxMessage(error.what())));
  }
  if (!repeated.empty()) throw InputError(fmt::format("{}: key {} is given twice", name, inQuotes(repeated)));
  return document;
}

void JsonPlace::fail(const std::string& what) const {
  throw InputError(way_.empty() ? fmt::format("{}: {}", file_, what) : fmt::format("{}: {}: {}", file_, way_, what));
}

std::string JsonPlace::found() const {
  if (value_->is_array()) return fmt::format("an array of {}", value_->size());
  if (value_->is_object()) return "an object";
  return inQuotes(value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

JsonPlace JsonPlace::member(const char* key) const {
  if (!value_->is_object()) fail("expected an object, found " + found());
  if (!has(key)) fail(fmt::format("expected a key '{}', found none", key));
  return {(*value_)[key], file_, way_.empty() ? std::string(key) : way_ + "." + key};
}

void JsonPlace::onlyKeys(std::initializer_list<const char*> keys) const {
  if (!value_->is_object()) fail("expected an object, found " + found());
  for (const auto& item : value_->items()) {
    if (std::find(keys.begin(), keys.end(), item.key()) != keys.end()) continue;
    std::string known;
    for (const char* key : keys)
      known += fmt::format("{}{}", known.empty() ? "" : ", ", key);
    fail(fmt::format("unknown key {}, expected {}", inQuotes(item.key()), known));
  }
}

void JsonPlace::size(size_t least, size_t most, const char* what) const {
  if (!value_->is_array() || value_->size() < least || value_->size() > most) {
    fail(fmt::format("expected {}, found {}", what, found()));
  }
}

JsonPlace JsonPlace::element(size_t index) const {
  return {(*value_)[index], file_, fmt::format("{}[{}]", way_, index)};
}

double JsonPlace::number(double low, double high) const {
  const double number = value_->is_number() ? value_->get<double>() : NAN;
  if (!(number >= low && number <= high)) {
    fail(fmt::format("expected a number in {}..{}, found {}", low, high, found()));
  }
  return number;
}

}  // namespace freevoxel
