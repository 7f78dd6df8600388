#include "voxlink/raw_spheres.h"

#include "base/error.h"
#include "volume/text_parsing.h"
#include "volume/text_values.h"

namespace freevoxel {

bool TextLines::next() {
  if (rest_.empty()) return false;
  ++number_;
  const size_t end = rest_.find('\n');
  ended_ = end != std::string_view::npos;
  line_ = rest_.substr(0, end);
  rest_.remove_prefix(ended_ ? end + 1 : rest_.size());
  if (line_.ends_with('\r')) line_.remove_suffix(1);
  return true;
}

void TextLines::fail(const std::string& what) const {
  throw InputError(fmt::format("{}: line {}: {}", path_, number_, what));
}

double TextLines::number(std::string_view word, const std::string& what) const {
  const std::string_view text = trimmed(word);
  const std::optional<double> value = parseNumber<double>(text);
  if (!value) fail(fmt::format("expected {}, a number, found {}", what, inQuotes(text)));
  if (!ended_ && text.data() + text.size() == line_.data() + line_.size()) fail(endsInNumber(text));
  return *value;
}

}  // namespace freevoxel
