// Errors in parallel loops.
#pragma once

#include <exception>
#include <mutex>

namespace freevoxel {

/// Lets a parallel loop end before the first of its exceptions goes on: no exception may leave an OpenMP region.
class FirstException {
 public:
  /// Calls f and keeps what it throws, if it is the first. From many threads.
  template <class F>
  void guard(F&& f) noexcept {
    try {
      f();
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!first_) first_ = std::current_exception();
    }
  }
  /// After the loop.
  void rethrow() const {
    if (first_) std::rethrow_exception(first_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr first_;
};

}  // namespace freevoxel
