#include "tests/volume/library_outcomes.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <exception>

#include "base/address_sanitizer.h"
#include "base/error.h"
#include "tests/support/test_data.h"
#include "volume/library_formats.h"
#include "volume/payload.h"
#include "volume/slice_sink.h"

namespace freevoxel::test {

namespace {

constexpr size_t kBatch = 400;
constexpr unsigned kSeconds = 2;  // some fifty times what a tiny file takes
constexpr uint64_t kMemoryBytes = uint64_t(1) << 30;
constexpr uint64_t kMostBytes = uint64_t(256) << 20;

/// Counts what arrives.
class CountingSink final : public SliceSink {
 public:
  explicit CountingSink(std::string path) : path_(std::move(path)) {}
  void header(const VolumeHeader& header) override {
    checkVolumeHeader(path_, header);
    // Whoever asked would have to find room for it.
    if (header.bytes() > kMostBytes) throw InputError(fmt::format("{}: {} bytes of values", path_, header.bytes()));
    left_ = header.bytes();
  }
  void values(std::span<const std::byte> bytes) override {
    tooMuch_ = tooMuch_ || bytes.size() > left_;
    left_ -= std::min<uint64_t>(left_, bytes.size());
  }
  bool complete() const { return left_ == 0 && !tooMuch_; }

 private:
  std::string path_;
  uint64_t left_ = 1;
  bool tooMuch_ = false;
};

LibraryOutcome outcomeOf(const std::string& path) {
  try {
    const std::optional<LibraryRequest> request = libraryRequest(path);
    if (!request) return LibraryOutcome::refused;  // no format at all
    CountingSink sink(path);
    readWithLibrary(*request, sink);
    return sink.complete() ? LibraryOutcome::read : LibraryOutcome::incomplete;
  } catch (const InternalError&) {
    throw;  // a bug of ours: die of it
  } catch (const std::exception&) {
    return LibraryOutcome::refused;
  }
}

[[noreturn]] void readBatch(const std::string& path, LibraryOutcome* outcomes, size_t first, size_t end,
                            const std::function<std::string(size_t)>& content, const std::string& talk) {
  const int said = open(talk.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
  dup2(said, STDOUT_FILENO);
  dup2(said, STDERR_FILENO);
  const rlimit memory{kMemoryBytes, kMemoryBytes};
  if (!kUnderAddressSanitizer) setrlimit(RLIMIT_AS, &memory);
  const rlimit noCore{0, 0};
  setrlimit(RLIMIT_CORE, &noCore);
  for (size_t i = first; i < end; ++i) {
    outcomes[i] = LibraryOutcome::died;
    writeBytes(path, content(i));
    alarm(kSeconds);
    outcomes[i] = outcomeOf(path);
  }
  _exit(0);
}

}  // namespace

size_t LibraryOutcomes::count(LibraryOutcome outcome) const {
  return size_t(std::count(each.begin(), each.end(), outcome));
}

LibraryOutcomes libraryOutcomes(const std::string& path, size_t count,
                                const std::function<std::string(size_t)>& content) {
  void* shared = mmap(nullptr, count, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  EXPECT_NE(shared, MAP_FAILED);
  auto* outcomes = static_cast<LibraryOutcome*>(shared);
  LibraryOutcomes result;
  const std::string talk = path + ".talk";
  for (size_t next = 0; next < count;) {
    const size_t end = std::min(next + kBatch, count);
    const pid_t child = fork();
    if (child == 0) readBatch(path, outcomes, next, end, content, talk);
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) {
      ADD_FAILURE() << "no process to read with";
      break;
    }
    const size_t before = next;
    while (next < end && outcomes[next] != LibraryOutcome::notRun)
      ++next;
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) outcomes[next - 1] = LibraryOutcome::hung;
    if (status != 0) {
      const std::string said = readBytes(talk);
      result.talk = said.substr(said.size() - std::min<size_t>(said.size(), 3000));
    }
    if (next == before) {
      ADD_FAILURE() << "the reading process does not start";
      break;
    }
  }
  result.each.assign(outcomes, outcomes + count);
  munmap(shared, count);
  return result;
}

}  // namespace freevoxel::test
