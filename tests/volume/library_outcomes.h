// Reading damaged files with libraries, thousands of them: what a child of volume/child_reader.h does, without starting
// a program for each.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace freevoxel::test {

enum class LibraryOutcome : uint8_t {
  notRun,
  died,       ///< by a signal or a sanitizer: the parent would say so in one line
  hung,       ///< went on for longer than tests wait; the parent's patience would end too
  refused,    ///< with an error
  read,       ///< to the end, and it is a volume
  incomplete  ///< without an error, but the parent would not take it
};

struct LibraryOutcomes {
  std::vector<LibraryOutcome> each;
  std::string talk;  ///< what was said on stderr where a process died, its end
  size_t count(LibraryOutcome outcome) const;
};

/// Writes `content(0)` ... `content(count - 1)` to `path`, one after the other, and reads each as the reading child
/// would, in processes forked for some hundred of them; one that dies only takes the file it was reading with it.
LibraryOutcomes libraryOutcomes(const std::string& path, size_t count,
                                const std::function<std::string(size_t)>& content);

}  // namespace freevoxel::test
