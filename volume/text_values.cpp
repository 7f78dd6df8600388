#include "volume/text_values.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/grid.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

/// The value that a word stands for, if it is one of type T.
template <class T>
std::optional<T> parseValue(const std::string& word) {
  if (const std::optional<T> number = parseNumber<T>(word)) return number;
  const std::optional<double> number = parseNumber<double>(lowerCase(word));
  if (!number) return std::nullopt;
  if constexpr (std::is_floating_point_v<T>) {
    return T(*number);  // what a float cannot hold becomes infinite or 0
  } else {
    // "7.0" is a whole number too.
    const bool whole = *number == std::floor(*number) && *number >= double(std::numeric_limits<T>::min()) &&
                       *number <= double(std::numeric_limits<T>::max());
    return whole ? std::optional<T>(T(*number)) : std::nullopt;
  }
}

class TextSource final : public ByteSource {
 public:
  TextSource(std::string path, std::unique_ptr<ByteSource> characters, ValueType type)
      : path_(std::move(path)), characters_(std::move(characters)), type_(type) {}

  uint64_t atMost() const override {
    return checkedProduct(characters_->atMost() / 2 + 1, bytesPerValue(type_))
        .value_or(std::numeric_limits<uint64_t>::max());
  }

  size_t read(std::span<std::byte> out) override {
    const size_t valueBytes = bytesPerValue(type_);
    if (out.size() < valueBytes) return !out.empty() && nextWord() ? 1 : 0;
    size_t done = 0;
    while (out.size() - done >= valueBytes && nextWord()) {
      if (atEnd_) throw InputError(fmt::format("{}: value {}: {}", path_, count_, endsInNumber(word_)));
      store(out.subspan(done, valueBytes));
      done += valueBytes;
      ++count_;
    }
    return done;
  }

 private:
  static bool isBlank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  std::optional<char> nextCharacter() {
    if (at_ == filled_) {
      filled_ = characters_->read(buffer_);
      at_ = 0;
      if (filled_ == 0) return std::nullopt;
    }
    return char(buffer_[at_++]);
  }

  /// Leaves the next word in word_; false at the end.
  bool nextWord() {
    constexpr size_t kLongest = 400;  // the longest double in plain digits
    word_.clear();
    for (std::optional<char> c = nextCharacter(); c; c = nextCharacter()) {
      if (!isBlank(*c)) {
        word_ += *c;
        if (word_.size() > kLongest) fail();
      } else if (!word_.empty()) {
        return true;
      }
    }
    atEnd_ = true;
    return !word_.empty();
  }

  [[noreturn]] void fail() const {
    throw InputError(fmt::format("{}: value {}: expected a number of type {}, found {}", path_, count_,
                                 valueTypeName(type_), inQuotes(word_)));
  }

  template <class T>
  void storeAs(std::span<std::byte> out) const {
    const std::optional<T> value = parseValue<T>(word_);
    if (!value) fail();
    std::memcpy(out.data(), &*value, sizeof(T));
  }

  void store(std::span<std::byte> out) const {
    switch (type_) {
      case ValueType::u8:
        return storeAs<uint8_t>(out);
      case ValueType::i8:
        return storeAs<int8_t>(out);
      case ValueType::u16:
        return storeAs<uint16_t>(out);
      case ValueType::i16:
        return storeAs<int16_t>(out);
      case ValueType::u32:
        return storeAs<uint32_t>(out);
      case ValueType::i32:
        return storeAs<int32_t>(out);
      case ValueType::f32:
        return storeAs<float>(out);
      case ValueType::f64:
        break;
    }
    storeAs<double>(out);
  }

  std::string path_;
  std::unique_ptr<ByteSource> characters_;
  ValueType type_;
  std::array<std::byte, 1 << 16> buffer_{};
  size_t at_ = 0, filled_ = 0;
  std::string word_;
  bool atEnd_ = false;  ///< no blank follows the word
  uint64_t count_ = 0;
};

}  // namespace

std::string endsInNumber(std::string_view word) {
  return fmt::format(
      "expected a blank or a new line after every number, found the end of the file after {}: it is cut "
      "short, or lacks its last new line",
      inQuotes(word));
}

std::unique_ptr<ByteSource> readText(std::string path, std::unique_ptr<ByteSource> characters, ValueType type) {
  return std::make_unique<TextSource>(std::move(path), std::move(characters), type);
}

}  // namespace freevoxel
