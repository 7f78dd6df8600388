#include "precompute/code_spool.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "base/error.h"
#include "base/give_back.h"

namespace freevoxel {

namespace {

/// Voxels converted at once.
constexpr size_t kPortion = size_t(1) << 18;

MachineError failure(const std::string& path, const char* doing, int error) {
  const char* advice = error == ENOSPC ? "; free some space or choose another output folder" : "";
  return MachineError(fmt::format("{}: {} the value codes beside it: {}{}", path, doing, std::strerror(error), advice));
}

}  // namespace

CodeSpool::CodeSpool(const std::string& path, glm::ivec3 dims, int bytesPerCode)
    : path_(path), planeVoxels_(uint64_t(dims.x) * uint64_t(dims.y)), bytesPerCode_(bytesPerCode) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::string name = ((folder.empty() ? "." : folder) / ".freevoxel-codes-XXXXXX").string();
  descriptor_ = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) throw failure(path_, "cannot create a file for", errno);
  unlink(name.c_str());
  const uint64_t bytes = rowBytes() * uint64_t(dims.z);
  if (const int error = posix_fallocate(descriptor_, 0, off_t(bytes)); error != 0) {
    close(descriptor_);
    throw failure(path_, "cannot reserve space for", error);
  }
}

CodeSpool::~CodeSpool() {
  close(descriptor_);
}

void CodeSpool::append(std::span<const uint16_t> codes) {
  while (!codes.empty()) {
    const auto part = codes.first(std::min(codes.size(), kPortion));
    std::span<const std::byte> bytes = std::as_bytes(part);
    if (bytesPerCode_ == 1) {
      narrow_.assign(part.begin(), part.end());
      bytes = std::as_bytes(std::span(narrow_));
    }
    while (!bytes.empty()) {
      const ssize_t written = pwrite(descriptor_, bytes.data(), bytes.size(), off_t(appended_));
      if (written < 0) {
        if (errno == EINTR) continue;
        throw failure(path_, "cannot write", errno);
      }
      appended_ += uint64_t(written);
      bytes = bytes.subspan(size_t(written));
    }
    codes = codes.subspan(part.size());
  }
}

std::span<const uint16_t> CodeSpool::planes(int pass, int first, int count) {
  std::vector<uint16_t>& window = windows_[size_t(pass)];
  const size_t voxels = size_t(count) * planeVoxels_;
  if (voxels > window.capacity()) {  // not old and new at once, nor more than is asked for
    giveBack(window);
    window.reserve(voxels);
  }
  window.resize(voxels);
  uint64_t offset = uint64_t(first) * rowBytes();
  for (size_t done = 0; done < window.size();) {
    const size_t portion = std::min(window.size() - done, kPortion);
    narrow_.resize(portion);
    auto* bytes = bytesPerCode_ == 1 ? narrow_.data() : reinterpret_cast<uint8_t*>(window.data() + done);
    for (size_t left = portion * size_t(bytesPerCode_); left > 0;) {
      const ssize_t got = pread(descriptor_, bytes, left, off_t(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) throw failure(path_, "cannot read", got < 0 ? errno : EIO);
      bytes += got;
      offset += uint64_t(got);
      left -= size_t(got);
    }
    if (bytesPerCode_ == 1) std::copy(narrow_.begin(), narrow_.end(), window.begin() + ptrdiff_t(done));
    done += portion;
  }
  return window;
}

}  // namespace freevoxel
