#include "volume/json_reading.h"

#include <algorithm>
#include <cmath>
#include <iterator>
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

/// Reads a text and remembers how far it got.
struct WatchedText {
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  const char* at;
  const char** furthest;

  reference operator*() const { return *at; }
  WatchedText& operator++() {
    *furthest = ++at;
    return *this;
  }
  WatchedText operator++(int) {
    const WatchedText before = *this;
    ++*this;
    return before;
  }
  bool operator==(const WatchedText& other) const { return at == other.at; }
  bool operator!=(const WatchedText& other) const { return at != other.at; }
};

/// Notes the line of every value.
class LineHandler final : public nlohmann::json_sax<nlohmann::json> {
 public:
  LineHandler(const char* start, const char*& furthest) : counted_(start), furthest_(furthest) {}

  JsonLines lines;

  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(int64_t) override { return value(); }
  bool number_unsigned(uint64_t) override { return value(); }
  bool number_float(double, const std::string&) override { return value(); }
  bool string(std::string&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(size_t) override { return open(false); }
  bool start_array(size_t) override { return open(true); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(std::string& name) override {
    levels_.back().key = name;
    return true;
  }
  bool parse_error(size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  struct Level {
    std::string way;
    bool array;
    size_t next = 0;
    std::string key;
  };

  std::string way() {
    if (levels_.empty()) return {};
    Level& level = levels_.back();
    if (level.array) return fmt::format("{}[{}]", level.way, level.next++);
    return level.way.empty() ? level.key : level.way + "." + level.key;
  }
  /// The last character read may be one beyond the value.
  int line() {
    for (; counted_ < furthest_ - 1; ++counted_)
      line_ += *counted_ == '\n';
    return line_;
  }
  bool value() {
    lines[way()] = line();
    return true;
  }
  bool open(bool array) {
    const std::string here = way();
    lines[here] = line();
    levels_.push_back({here, array});
    return true;
  }
  bool close() {
    levels_.pop_back();
    return true;
  }

  const char* counted_;
  const char*& furthest_;
  int line_ = 1;
  std::vector<Level> levels_;
};

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

std::shared_ptr<const JsonLines> jsonLines(const std::string& text) {
  const char* furthest = text.data();
  LineHandler handler(text.data(), furthest);
  nlohmann::json::sax_parse(WatchedText{text.data(), &furthest}, WatchedText{text.data() + text.size(), &furthest},
                            &handler);
  return std::make_shared<const JsonLines>(std::move(handler.lines));
}

void JsonPlace::fail(const std::string& what) const {
  failAt(way_, what);
}

void JsonPlace::failAt(const std::string& place, const std::string& what) const {
  throw InputError(fmt::format("{}: {}", whereAt(place), what));
}

std::string JsonPlace::where() const {
  return whereAt(way_);
}

std::string JsonPlace::whereAt(const std::string& place) const {
  std::string where = file_;
  if (lines_ != nullptr) {
    if (const auto line = lines_->find(place); line != lines_->end()) where += fmt::format(": line {}", line->second);
  }
  return way_.empty() ? where : fmt::format("{}: {}", where, way_);
}

std::string JsonPlace::found() const {
  if (value_->is_array()) return fmt::format("an array of {}", value_->size());
  if (value_->is_object()) return "an object";
  return inQuotes(value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

JsonPlace JsonPlace::member(const char* key) const {
  if (!value_->is_object()) fail("expected an object, found " + found());
  if (!has(key)) fail(fmt::format("expected a key '{}', found none", key));
  return inside((*value_)[key], way_.empty() ? std::string(key) : way_ + "." + key);
}

void JsonPlace::onlyKeys(std::initializer_list<const char*> keys) const {
  if (!value_->is_object()) fail("expected an object, found " + found());
  for (const auto& item : value_->items()) {
    if (std::find(keys.begin(), keys.end(), item.key()) != keys.end()) continue;
    std::string known;
    for (const char* key : keys)
      known += fmt::format("{}{}", known.empty() ? "" : ", ", key);
    failAt(way_.empty() ? item.key() : way_ + "." + item.key(),
           fmt::format("unknown key {}, expected {}", inQuotes(item.key()), known));
  }
}

void JsonPlace::size(size_t least, size_t most, const char* what) const {
  if (!value_->is_array() || value_->size() < least || value_->size() > most) {
    fail(fmt::format("expected {}, found {}", what, found()));
  }
}

JsonPlace JsonPlace::element(size_t index) const {
  return inside((*value_)[index], fmt::format("{}[{}]", way_, index));
}

double JsonPlace::number(double low, double high) const {
  const double number = value_->is_number() ? value_->get<double>() : NAN;
  if (!(number >= low && number <= high)) {
    fail(fmt::format("expected a number in {}..{}, found {}", low, high, found()));
  }
  return number;
}

int64_t JsonPlace::whole(int64_t low, int64_t high) const {
  const double found = value_->is_number() ? value_->get<double>() : NAN;
  if (!(found >= double(low) && found <= double(high)) || found != std::floor(found)) {
    fail(fmt::format("expected a whole number in {}..{}, found {}", low, high, this->found()));
  }
  return int64_t(found);
}

std::string JsonPlace::text() const {
  if (!value_->is_string() || value_->get_ref<const std::string&>().empty()) {
    fail("expected a text that is not empty, found " + found());
  }
  return value_->get<std::string>();
}

bool JsonPlace::flag() const {
  if (!value_->is_boolean()) fail("expected true or false, found " + found());
  return value_->get<bool>();
}

glm::dvec3 JsonPlace::triple(double low, double high, const char* what) const {
  size(3, 3, what);
  return {element(0).number(low, high), element(1).number(low, high), element(2).number(low, high)};
}

}  // namespace freevoxel
