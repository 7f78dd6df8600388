#include "volume/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <vector>

#include "base/error.h"
#include "base/grid.h"

namespace freevoxel {

namespace {

class PlainSource final : public ByteSource {
 public:
  PlainSource(std::string path, uint64_t offset) : path_(std::move(path)), offset_(offset) {
    // Not blocking: opening a pipe nobody writes to would wait for ever.
    descriptor_ = open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor_ < 0) throw InputError(fmt::format("{}: cannot open: {}", path_, std::strerror(errno)));
    struct stat status {};
    if (fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
      close(descriptor_);
      throw InputError(fmt::format("{}: is not a regular file", path_));
    }
    size_ = uint64_t(status.st_size);
  }
  PlainSource(const PlainSource&) = delete;
  PlainSource& operator=(const PlainSource&) = delete;
  ~PlainSource() override { close(descriptor_); }

  const std::string& path() const { return path_; }
  uint64_t offset() const { return offset_; }
  uint64_t atMost() const override { return size_ > offset_ ? size_ - offset_ : 0; }

  size_t read(std::span<std::byte> out) override {
    out = out.first(std::min<uint64_t>(out.size(), atMost()));
    size_t done = 0;
    while (done < out.size()) {
      const ssize_t got = pread(descriptor_, out.data() + done, out.size() - done, off_t(offset_));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) {
        throw InputError(fmt::format("{}: cannot read at byte {}: {}", path_, offset_, std::strerror(errno)));
      }
      if (got == 0) break;  // shrunk since it was opened
      done += size_t(got);
      offset_ += uint64_t(got);
    }
    return done;
  }

 private:
  std::string path_;
  int descriptor_ = -1;
  uint64_t size_ = 0;
  uint64_t offset_ = 0;
};

class InflatedSource final : public ByteSource {
 public:
  InflatedSource(const std::string& path, uint64_t offset) : file_(path, offset), input_(kInputBytes) {
    constexpr int kLargestWindow = 15;
    constexpr int kGzipOrZlib = 32;
    if (inflateInit2(&stream_, kLargestWindow + kGzipOrZlib) != Z_OK) {
      throw MachineError(fmt::format("{}: no memory to inflate it; close other programs", path));
    }
  }
  InflatedSource(const InflatedSource&) = delete;
  InflatedSource& operator=(const InflatedSource&) = delete;
  ~InflatedSource() override { inflateEnd(&stream_); }

  uint64_t atMost() const override {
    constexpr uint64_t kLargestRatio = 1032;
    const uint64_t stored = file_.atMost() + stream_.avail_in;
    return checkedProduct(stored + 1, kLargestRatio).value_or(std::numeric_limits<uint64_t>::max());
  }

  size_t read(std::span<std::byte> out) override {
    size_t done = 0;
    while (done < out.size() && !ended_) {
      fillInput();
      const auto room = uInt(std::min<size_t>(out.size() - done, std::numeric_limits<uInt>::max()));
      stream_.next_out = reinterpret_cast<Bytef*>(out.data() + done);
      stream_.avail_out = room;
      const int result = inflate(&stream_, Z_NO_FLUSH);
      done += room - stream_.avail_out;
      if (result == Z_STREAM_END) {
        startNextMember();
      } else if (result == Z_BUF_ERROR) {
        throw InputError(fmt::format("{}: compressed data cut off at byte {}", file_.path(), file_.offset()));
      } else if (result != Z_OK) {
        throw InputError(fmt::format("{}: compressed data damaged before byte {}: {}", file_.path(),
                                     file_.offset() - stream_.avail_in, stream_.msg ? stream_.msg : "no zlib stream"));
      }
    }
    return done;
  }

 private:
  static constexpr size_t kInputBytes = size_t(1) << 16;

  void fillInput() {
    if (stream_.avail_in > 0) return;
    stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
    stream_.avail_in = uInt(file_.read(input_));
  }

  void startNextMember() {
    fillInput();
    ended_ = stream_.avail_in == 0;
    if (!ended_) inflateReset(&stream_);
  }

  PlainSource file_;
  std::vector<std::byte> input_;
  z_stream stream_{};
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<ByteSource> openPlain(const std::string& path, uint64_t offset) {
  return std::make_unique<PlainSource>(path, offset);
}

std::unique_ptr<ByteSource> openInflated(const std::string& path, uint64_t offset) {
  return std::make_unique<InflatedSource>(path, offset);
}

bool isGzip(std::span<const std::byte> bytes) {
  // The third byte is the method; deflate is the only one there is.
  return bytes.size() >= 3 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b} && bytes[2] == std::byte{8};
}

}  // namespace freevoxel
