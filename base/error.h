// The three kinds of error. Library code throws them; only app/ prints or exits.
#pragma once

#include <fmt/core.h>

#include <stdexcept>
#include <string>

namespace freevoxel {

/// The user's input will not do. The text is one line: the file, where in it (offset or line), what was expected and
/// what was found.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The machine will not do: no EGL, no memory, disk full. The text is one line: what is missing and what to try.
struct MachineError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Our own bug: something that should hold does not.
struct InternalError : std::logic_error {
  using std::logic_error::logic_error;
};

/// Throws InternalError naming both values unless they are equal.
template <class A, class B>
void checkEqual(const A& found, const B& expected, const char* what) {
  if (!(found == expected)) {
    throw InternalError(fmt::format("internal error: {} is {}, expected {}", what, found, expected));
  }
}

/// Throws InternalError with `what` unless `holds`.
inline void check(bool holds, const char* what) {
  if (!holds) throw InternalError(fmt::format("internal error: {}", what));
}

}  // namespace freevoxel
