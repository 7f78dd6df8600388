// Numbers in words, handed on as the bytes of values.
#pragma once

#include <memory>
#include <string>

#include "volume/byte_source.h"
#include "volume/volume.h"

namespace freevoxel {

/// Reads numbers that white space separates as values of `type` in this machine's byte order. read() takes room for
/// whole values; asked for less it returns 1 if there is one more number, else 0. What is no number of that type is an
/// InputError naming `path` and which number it is. atMost() is in bytes of values.
std::unique_ptr<ByteSource> readText(std::string path, std::unique_ptr<ByteSource> characters, ValueType type);

}  // namespace freevoxel
