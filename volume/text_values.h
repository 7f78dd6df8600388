// Numbers in words, handed on as the bytes of values.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "volume/byte_source.h"
#include "volume/volume.h"

namespace freevoxel {

/// What to say where a file ends in that number.
std::string endsInNumber(std::string_view word);

/// Reads numbers, white space after each, as values of `type` in this machine's byte order. read() takes room for whole
/// values; asked for less it returns 1 if there is one more number, else 0. What is no number of that type is an
/// InputError naming `path` and which number it is, and so is a number that the file ends with: "12" may be what was
/// left of "123". atMost() is in bytes of values.
std::unique_ptr<ByteSource> readText(std::string path, std::unique_ptr<ByteSource> characters, ValueType type);

}  // namespace freevoxel
