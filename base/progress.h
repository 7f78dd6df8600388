// How long-running library code tells how far it is; what is shown is decided in app/.
#pragma once

#include <cstdint>
#include <string>

namespace freevoxel {

/// Receives progress. Calls may come from any thread, one at a time. The default does nothing.
class Progress {
 public:
  virtual ~Progress() = default;
  /// A stage starts; `total` steps of `unit` ("voxels", "bricks", "rays") will follow.
  virtual void begin(const std::string& /*stage*/, uint64_t /*total*/, const std::string& /*unit*/) {}
  /// `steps` more are done.
  virtual void advance(uint64_t /*steps*/) {}
  virtual void end() {}
};

/// Tells nobody.
inline Progress& silentProgress() {
  static Progress progress;
  return progress;
}

}  // namespace freevoxel
