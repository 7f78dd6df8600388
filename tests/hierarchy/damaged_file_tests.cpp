// Files that are cut short, damaged or made to mislead: all are refused with one line, none is read out of bounds.
#include <gtest/gtest.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "hierarchy/attenuation_file.h"
#include "precompute/checksums.h"
#include "precompute/precompute.h"
#include "tests/precompute/test_volumes.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

std::string makeFile(glm::ivec3 dims, uint32_t seed, Layout layout) {
  const std::string path = test::temporaryFolder() + "/made.fvx";
  precompute(test::randomBytes(dims, seed), test::veilAndRamp(), path,
             {Classification::voxel, layout, 8, "made by a test", 0, 1}, test::silentProgress());
  return test::readBytes(path);
}

/// A valid file of one brick; small, since the tests below read it once for every byte.
const std::string& oneBrick(Layout layout = Layout::dense) {
  static const std::string kDense = makeFile({5, 7, 6}, 41, Layout::dense);
  static const std::string kCompact = makeFile({5, 7, 6}, 41, Layout::compact);
  return layout == Layout::dense ? kDense : kCompact;
}

/// A valid file of several bricks in a box that leaves much of its cube empty.
const std::string& manyBricks(Layout layout = Layout::dense) {
  static const std::string kDense = makeFile({9, 33, 20}, 42, Layout::dense);
  static const std::string kCompact = makeFile({9, 33, 20}, 42, Layout::compact);
  return layout == Layout::dense ? kDense : kCompact;
}

/// The message of the InputError that opening and verifying throws; empty if there is none.
std::string complaint(const std::string& path) {
  try {
    AttenuationFile(path).verify();
    return {};
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
    return error.what();
  }
}

class DamagedFile : public testing::TestWithParam<Layout> {};
INSTANTIATE_TEST_SUITE_P(Layouts, DamagedFile, testing::Values(Layout::dense, Layout::compact),
                         [](const auto& tested) { return std::string(layoutName(tested.param)); });

TEST_P(DamagedFile, everyTruncationIsFound) {
  const std::string path = test::temporaryFolder() + "/cut.fvx";
  const std::string& whole = oneBrick(GetParam());
  test::writeBytes(path, whole);
  ASSERT_EQ(complaint(path), "");
  for (size_t bytes = whole.size(); bytes-- > 0;) {
    std::filesystem::resize_file(path, bytes);
    ASSERT_NE(complaint(path), "") << bytes;
  }
}

TEST_P(DamagedFile, everyChangedByteIsFound) {
  const std::string path = test::temporaryFolder() + "/flipped.fvx";
  const std::string& bytes = oneBrick(GetParam());
  test::writeBytes(path, bytes);
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&](size_t at, char byte) { file.seekp(std::streamoff(at)).put(byte).flush(); };
  for (size_t at = 0; at < bytes.size(); ++at) {
    put(at, char(bytes[at] ^ (1 << at % 8)));
    ASSERT_NE(complaint(path), "") << at;
    put(at, char(~bytes[at]));
    ASSERT_NE(complaint(path), "") << at;
    put(at, bytes[at]);
  }
  EXPECT_EQ(complaint(path), "");
}

/// Cut after it was opened: to nothing, in the middle, in its last page.
TEST_P(DamagedFile, cutWhileItIsMappedIsFound) {
  const std::string path = test::temporaryFolder() + "/cut.fvx";
  const std::string& whole = manyBricks(GetParam());
  for (const size_t bytes : {size_t(0), whole.size() / 2, whole.size() - 1}) {
    test::writeBytes(path, whole);
    const AttenuationFile file(path);
    file.checkIntact();
    std::filesystem::resize_file(path, bytes);
    [[maybe_unused]] volatile uint32_t seen = 0;  // so that every byte is read
    for (size_t i = 0; i < file.brickCount(); ++i) {
      try {
        const BrickView brick = file.brick(i);
        for (size_t step = 0; step < brick.curve.size(); ++step)
          seen = brick.code(step) + brick.attenuations[0][step] + brick.attenuations[25][step];
      } catch (const InputError&) {  // zeros are no frame
      }
    }
    EXPECT_THROW(file.checkIntact(), InputError);
    EXPECT_THROW(file.verify(), InputError);
  }
}

TEST(DamagedFiles, bytesAfterTheEndAreFound) {
  const std::string path = test::temporaryFolder() + "/long.fvx";
  test::writeBytes(path, oneBrick() + std::string(1, '\0'));
  EXPECT_NE(complaint(path).find("bytes in the file"), std::string::npos);
}

TEST(DamagedFiles, otherFilesAreRefused) {
  const std::string folder = test::temporaryFolder();
  for (const std::string& bytes : {std::string(), std::string("NRRD0004\n"), std::string(5000, '\0'),
                                   std::string("\x89"
                                               "FVX\n\x1a\n\n",
                                               8) +
                                       std::string(100, ' ')}) {
    test::writeBytes(folder + "/other.fvx", bytes);
    EXPECT_NE(complaint(folder + "/other.fvx").find("magic"), std::string::npos);
  }
  EXPECT_NE(complaint(folder + "/missing.fvx"), "");
  EXPECT_NE(complaint(folder), "");
}

/// A file whose fields can be changed and whose checksums can then be made right again, as someone who wants to mislead
/// the reader would.
class Forgery {
 public:
  explicit Forgery(std::string original) : bytes(std::move(original)) {}

  FileHeader header() const { return at<FileHeader>(0); }
  size_t entryOffset(const std::string& type) const {
    for (size_t i = 0; i < header().sectionCount; ++i) {
      const size_t offset = sizeof(FileHeader) + i * sizeof(SectionEntry);
      if (bytes.compare(offset, 4, type) == 0) return offset;
    }
    ADD_FAILURE() << "no section " << type;
    return 0;
  }
  size_t sectionOffset(const std::string& type) const { return at<SectionEntry>(entryOffset(type)).offset; }

  template <class T>
  T at(size_t offset) const {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof(T));
    return value;
  }
  template <class T>
  void set(size_t offset, T value) {
    std::memcpy(bytes.data() + offset, &value, sizeof(T));
  }

  /// Makes every checksum fit that covers bytes inside the file.
  void seal() {
    FileHeader h = header();
    const size_t room = (bytes.size() - sizeof(FileHeader)) / sizeof(SectionEntry);
    std::vector<SectionEntry> sections;
    for (size_t i = 0; i < std::min<size_t>(h.sectionCount, room); ++i) {
      const size_t offset = sizeof(FileHeader) + i * sizeof(SectionEntry);
      SectionEntry entry = at<SectionEntry>(offset);
      const bool inside = entry.offset <= bytes.size() && entry.bytes <= bytes.size() - entry.offset;
      const std::string type(entry.type.data(), entry.type.size());
      constexpr const char* kOfBricks[] = {"CODE", "ATTB", "ATTF", "ZCOD", "ZFCB", "ZFCF"};
      const bool ofBricks = std::find(std::begin(kOfBricks), std::end(kOfBricks), type) != std::end(kOfBricks);
      // Those have hashes of the hashes in BRIK.
      if (inside && !ofBricks) {
        entry.hash = contentHash(std::as_bytes(std::span(bytes)).subspan(entry.offset, entry.bytes));
      }
      set(offset, entry);
      sections.push_back(entry);
    }
    h.hash = headerHash(h, sections);
    set(0, h);
  }

  std::string bytes;
};

std::string complaintOf(const Forgery& forgery) {
  const std::string path = test::temporaryFolder() + "/forged.fvx";
  test::writeBytes(path, forgery.bytes);
  return complaint(path);
}

TEST(ForgedFile, sealedWithoutChangeIsAccepted) {
  for (const std::string* original :
       {&oneBrick(), &manyBricks(), &oneBrick(Layout::compact), &manyBricks(Layout::compact)}) {
    Forgery forgery(*original);
    forgery.seal();
    EXPECT_EQ(forgery.bytes, *original);
    EXPECT_EQ(complaintOf(forgery), "");
  }
}

TEST(ForgedFile, headerFields) {
  const auto expectRefused = [](const char* what, const std::function<void(Forgery&)>& change) {
    Forgery forgery(manyBricks());
    change(forgery);
    forgery.seal();
    EXPECT_NE(complaintOf(forgery).find(what), std::string::npos) << what << ": " << complaintOf(forgery);
  };
  expectRefused("version: expected 1, found 2", [](Forgery& f) { f.set<uint32_t>(8, 2); });
  expectRefused("number of sections", [](Forgery& f) { f.set<uint32_t>(12, 0xffffffffu); });
  expectRefused("number of sections", [](Forgery& f) { f.set<uint32_t>(12, 1025); });
  expectRefused("META", [](Forgery& f) {
    f.set<uint32_t>(12, 0);
    f.bytes.resize(32);
    f.set<uint64_t>(16, 32);
  });
  expectRefused("bytes in the file", [](Forgery& f) { f.set<uint64_t>(16, ~uint64_t(0)); });
}

TEST(ForgedFile, sectionTable) {
  struct Change {
    const char* section;
    size_t field;
    uint64_t value;
    const char* what;
  };
  constexpr uint64_t kHuge = ~uint64_t(0);
  const size_t codes = Forgery(manyBricks()).sectionOffset("CODE");
  for (const Change& change : std::vector<Change>{
           {"CODE", offsetof(SectionEntry, offset), kHuge - 4095, "CODE: bytes"},
           {"CODE", offsetof(SectionEntry, offset), codes + 8, "offset"},
           {"ATTB", offsetof(SectionEntry, offset), codes, "offset"},
           {"XFER", offsetof(SectionEntry, offset), 0, "offset"},
           {"XFER", offsetof(SectionEntry, offset), kHuge - 7, "XFER: bytes"},
           {"CODE", offsetof(SectionEntry, bytes), kHuge, "bytes"},
           {"CODE", offsetof(SectionEntry, bytes), uint64_t(1) << 62, "bytes"},
           {"ATTF", offsetof(SectionEntry, bytes), 0, "after the last section"},
           {"CODE", offsetof(SectionEntry, items), 0, "section CODE"},
           {"CODE", offsetof(SectionEntry, items), kHuge / 512 + 1, "section CODE"},
           {"ATTB", offsetof(SectionEntry, items), 1, "section ATTB"},
           {"ATTF", offsetof(SectionEntry, items), 1, "section ATTF"},
           {"BRIK", offsetof(SectionEntry, items), kHuge / 40 + 2, "brick directory"},
           {"BRIK", offsetof(SectionEntry, items), 0, "brick directory"},
           {"BRIK", offsetof(SectionEntry, bytes), 40, "brick directory"},
           {"META", offsetof(SectionEntry, bytes), 239, "metadata"},
           {"META", offsetof(SectionEntry, items), 2, "metadata"},
           {"XFER", offsetof(SectionEntry, items), 2, "XFER"},
           {"DIRS", offsetof(SectionEntry, items), 25, "directions"},
       }) {
    Forgery forgery(manyBricks());
    forgery.set(forgery.entryOffset(change.section) + change.field, change.value);
    forgery.seal();
    EXPECT_NE(complaintOf(forgery).find(change.what), std::string::npos)
        << change.section << ' ' << change.field << ' ' << change.value << ": " << complaintOf(forgery);
  }
}

TEST(ForgedFile, sectionTypesAndFlags) {
  Forgery forgery(manyBricks());
  const size_t command = forgery.entryOffset("CMND");
  forgery.bytes.replace(command, 4, "XTRA");
  forgery.seal();
  EXPECT_EQ(complaintOf(forgery), "") << "an unknown section that may be skipped";
  forgery.set<uint32_t>(command + 4, 0);
  forgery.seal();
  EXPECT_NE(complaintOf(forgery).find("XTRA"), std::string::npos);
  forgery.set<uint32_t>(command + 4, 3);
  forgery.seal();
  EXPECT_NE(complaintOf(forgery).find("flags"), std::string::npos);
  forgery.set<uint32_t>(command + 4, 1);
  forgery.bytes.replace(command, 4, "META");
  forgery.seal();
  EXPECT_NE(complaintOf(forgery).find("a second one"), std::string::npos);
  for (const char* needed : {"META", "XFER", "DIRS", "BRIK", "CODE", "ATTB", "ATTF"}) {
    Forgery without(manyBricks());
    const size_t entry = without.entryOffset(needed);
    without.bytes.replace(entry, 4, "GONE");
    without.set<uint32_t>(entry + 4, kSectionOptional);
    without.seal();
    EXPECT_NE(complaintOf(without).find(needed), std::string::npos);
  }
}

TEST(ForgedFile, metadata) {
  const auto expectRefused = [](const char* what, size_t field, auto value) {
    Forgery forgery(manyBricks());
    forgery.set(forgery.sectionOffset("META") + field, value);
    forgery.seal();
    EXPECT_NE(complaintOf(forgery).find(what), std::string::npos) << what << ": " << complaintOf(forgery);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  expectRefused("dims", offsetof(Metadata, dims), int32_t(0));
  expectRefused("dims", offsetof(Metadata, dims) + 4, int32_t(-1));
  expectRefused("dims", offsetof(Metadata, dims) + 8, kMaxDim + 1);
  expectRefused("voxels", offsetof(Metadata, dims) + 8, kMaxDim);
  expectRefused("brick edge", offsetof(Metadata, brickEdge), uint32_t(0));
  expectRefused("brick edge", offsetof(Metadata, brickEdge), uint32_t(64));
  expectRefused("section CODE", offsetof(Metadata, brickEdge), uint32_t(16));
  expectRefused("spacing", offsetof(Metadata, spacing), 0.0);
  expectRefused("spacing", offsetof(Metadata, spacing) + 16, kNan);
  expectRefused("origin", offsetof(Metadata, origin), kInfinity);
  expectRefused("direction", offsetof(Metadata, direction), 0.0);
  expectRefused("direction", offsetof(Metadata, direction), kNan);
  expectRefused("value of code 0", offsetof(Metadata, codeLow), kNan);
  expectRefused("value step", offsetof(Metadata, codeStep), 0.0);
  expectRefused("value of the largest code", offsetof(Metadata, codeStep), 1e308);
  expectRefused("largest code", offsetof(Metadata, codeLargest), uint32_t(0));
  expectRefused("largest code", offsetof(Metadata, codeLargest), uint32_t(65536));
  expectRefused("bytes per code", offsetof(Metadata, codeLargest), uint32_t(256));
  expectRefused("bytes per code", offsetof(Metadata, codeBytes), uint32_t(0));
  expectRefused("classification", offsetof(Metadata, classification), uint32_t(2));
  expectRefused("layout", offsetof(Metadata, layout), uint32_t(2));
  expectRefused("a section ZCOD, found none", offsetof(Metadata, layout), uint32_t(1));
  expectRefused("a section LEVL, found none", offsetof(Metadata, levels), uint32_t(2));
  expectRefused("levels", offsetof(Metadata, levels), uint32_t(0));
  expectRefused("levels", offsetof(Metadata, levels), uint32_t(5));
  expectRefused("hierarchy", offsetof(Metadata, hierarchy), uint32_t(1));
  expectRefused("reserved", offsetof(Metadata, zero1), uint64_t(1));
  expectRefused("voxels", offsetof(Metadata, voxels), uint64_t(1));
  expectRefused("stored voxels", offsetof(Metadata, storedVoxels), uint64_t(1));
  expectRefused("visible voxels", offsetof(Metadata, visibleVoxels), uint64_t(1));
  expectRefused("non-finite voxels", offsetof(Metadata, nonFinite), ~uint64_t(0));
  expectRefused("hash of the transfer function", offsetof(Metadata, opacityHash), uint64_t(1));
  expectRefused("largest value error", offsetof(Metadata, largestValueError), kNan);
}

TEST(ForgedFile, transferFunctionAndDirections) {
  Forgery forgery(manyBricks());
  forgery.bytes[forgery.sectionOffset("XFER")] = '[';
  forgery.seal();
  EXPECT_NE(complaintOf(forgery).find("transfer function"), std::string::npos);
  forgery = Forgery(manyBricks());
  forgery.set<int8_t>(forgery.sectionOffset("DIRS") + 5, 0);
  forgery.seal();
  EXPECT_NE(complaintOf(forgery).find("direction 1: expected 0 -1 -1, found 0 -1 0"), std::string::npos);
}

TEST(ForgedFile, brickDirectory) {
  const auto expectRefused = [](const char* what, const std::function<void(Forgery&, size_t)>& change) {
    Forgery forgery(manyBricks());
    change(forgery, forgery.sectionOffset("BRIK"));
    forgery.seal();
    EXPECT_NE(complaintOf(forgery).find(what), std::string::npos) << what << ": " << complaintOf(forgery);
  };
  const size_t last = sizeof(BrickEntry) *
                      (Forgery(manyBricks()).at<SectionEntry>(Forgery(manyBricks()).entryOffset("BRIK")).items - 1);
  expectRefused("Hilbert index", [](Forgery& f, size_t at) { f.set(at + 40, f.at<uint64_t>(at)); });
  expectRefused("Hilbert index", [](Forgery& f, size_t at) { f.set(at + 80, f.at<uint64_t>(at + 40)); });
  expectRefused("Hilbert index", [&](Forgery& f, size_t at) { f.set(at + last, ~uint64_t(0)); });
  expectRefused("Hilbert index", [&](Forgery& f, size_t at) { f.set(at + last, uint64_t(512)); });  // 8^3 in the cube
  expectRefused("position of brick", [&](Forgery& f, size_t at) { f.set(at + last, uint64_t(511)); });
  expectRefused("visible voxels of brick", [](Forgery& f, size_t at) { f.set<uint32_t>(at + 8, 513); });
  expectRefused("visible voxels", [](Forgery& f, size_t at) { f.set<uint32_t>(at + 8, 0); });
  expectRefused("reserved", [](Forgery& f, size_t at) { f.set<uint32_t>(at + 12, 1); });
  for (const size_t field : {16, 24, 32}) {
    expectRefused("checksum of section", [&](Forgery& f, size_t at) { f.set<uint64_t>(at + field, 1); });
  }
}

/// A compact file whose frames can be exchanged.
class CompactForgery : public Forgery {
 public:
  CompactForgery() : Forgery(manyBricks(Layout::compact)) {}

  size_t frameEntry(size_t brick) const { return sectionOffset("FRAM") + brick * sizeof(FrameEntry); }
  size_t frameOffset(size_t which, size_t brick) const {
    constexpr const char* kSections[] = {"ZCOD", "ZFCB", "ZFCF"};
    return sectionOffset(kSections[which]) + at<FrameEntry>(frameEntry(brick)).offset[which];
  }
  size_t frameBytes(size_t which, size_t brick) const { return at<FrameEntry>(frameEntry(brick)).bytes[which]; }

  /// Puts `frame` in the place of one of the last section, ZFCF, which may grow. Every checksum fits afterwards.
  void replaceLast(size_t brick, const std::string& frame) {
    const size_t old = frameBytes(2, brick);
    bytes.replace(frameOffset(2, brick), old, frame);
    const uint64_t from = at<FrameEntry>(frameEntry(brick)).offset[2];
    const auto count = at<SectionEntry>(entryOffset("BRIK")).items;
    for (size_t i = 0; i < count; ++i) {
      auto entry = at<FrameEntry>(frameEntry(i));
      if (entry.offset[2] > from) entry.offset[2] += frame.size() - old;
      if (i == brick) entry.bytes[2] = uint32_t(frame.size());
      set(frameEntry(i), entry);
    }
    auto section = at<SectionEntry>(entryOffset("ZFCF"));
    section.bytes += frame.size() - old;
    set(entryOffset("ZFCF"), section);
    set<uint64_t>(offsetof(FileHeader, fileBytes), bytes.size());
    hashBricks();
  }

  /// Makes the hashes of bricks and of the sections that hold them fit.
  void hashBricks() {
    const auto count = at<SectionEntry>(entryOffset("BRIK")).items;
    constexpr const char* kSections[] = {"ZCOD", "ZFCB", "ZFCF"};
    for (size_t which = 0; which < 3; ++which) {
      std::vector<uint64_t> hashes;
      for (size_t i = 0; i < count; ++i) {
        const auto frame = std::as_bytes(std::span(bytes)).subspan(frameOffset(which, i), frameBytes(which, i));
        hashes.push_back(contentHash(frame));
        set(sectionOffset("BRIK") + i * sizeof(BrickEntry) + 16 + 8 * which, hashes.back());
      }
      auto section = at<SectionEntry>(entryOffset(kSections[which]));
      section.hash = contentHash(std::as_bytes(std::span(hashes)));
      set(entryOffset(kSections[which]), section);
    }
    seal();
  }
};

/// A frame that holds `contents`.
std::string frameOf(const std::string& contents, uint8_t prediction = 0) {
  std::string frame(1 + ZSTD_compressBound(contents.size()), char(prediction));
  frame.resize(1 + ZSTD_compress(frame.data() + 1, frame.size() - 1, contents.data(), contents.size(), 1));
  return frame;
}

constexpr size_t kFaceBytes = 1588;  // of a pass at edge 8

TEST(ForgedFile, framesThatAreWhatTheySayAreAccepted) {
  for (const uint8_t prediction : {0, 1}) {
    CompactForgery forgery;
    forgery.replaceLast(1, frameOf(std::string(kFaceBytes, char(200)), prediction));
    EXPECT_EQ(complaintOf(forgery), "");
  }
}

TEST(ForgedFile, framesThatLie) {
  const auto expectRefused = [](const char* what, const std::string& frame) {
    CompactForgery forgery;
    forgery.replaceLast(1, frame);
    const std::string found = complaintOf(forgery);
    EXPECT_NE(found.find(what), std::string::npos) << what << ": " << found;
    EXPECT_NE(found.find("brick 1 in section ZFCF"), std::string::npos) << found;
  };
  const std::string right = frameOf(std::string(kFaceBytes, char(200)));
  expectRefused("expected a frame of 1588 bytes, found 1587", frameOf(std::string(kFaceBytes - 1, char(200))));
  expectRefused("expected a frame of 1588 bytes, found 1589", frameOf(std::string(kFaceBytes + 1, char(200))));
  expectRefused("expected a frame of 1588 bytes, found 0", frameOf(""));
  // 256 MiB in a few kilobytes.
  expectRefused("expected a frame of 1588 bytes, found 268435456", frameOf(std::string(size_t(1) << 28, '\0')));
  expectRefused("prediction", '\2' + right.substr(1));
  expectRefused("one zstd frame", right + std::string(1, '\0'));
  expectRefused("one zstd frame", right + right.substr(1));
  expectRefused("one zstd frame", right.substr(0, right.size() - 1));
  expectRefused("expected a frame, found 1 bytes", right.substr(0, 1));
  expectRefused("a zstd frame that knows its size", '\0' + std::string("no frame at all"));
  std::string lying = right;  // the size of contents stands in bytes 6 and 7, less 256
  ASSERT_EQ(uint8_t(lying[6]) + 256 * uint8_t(lying[7]) + 256, int(kFaceBytes));
  lying[6] = char(uint8_t(lying[6]) + 1);
  expectRefused("expected a frame of 1588 bytes, found 1589", lying);
  std::string longer = frameOf(std::string(kFaceBytes + 1, char(200)));  // and one that says less than it holds
  longer[6] = char(uint8_t(longer[6]) - 1);
  expectRefused("damaged zstd frame", longer);
}

TEST(ForgedFile, frameDirectory) {
  const auto expectRefused = [](const char* what, const std::function<void(FrameEntry&, FrameEntry&)>& change) {
    CompactForgery forgery;
    auto first = forgery.at<FrameEntry>(forgery.frameEntry(0)), second = forgery.at<FrameEntry>(forgery.frameEntry(1));
    change(first, second);
    forgery.set(forgery.frameEntry(0), first);
    forgery.set(forgery.frameEntry(1), second);
    forgery.seal();
    EXPECT_NE(complaintOf(forgery).find(what), std::string::npos) << what << ": " << complaintOf(forgery);
  };
  constexpr uint64_t kHuge = ~uint64_t(0);
  for (size_t which = 0; which < 3; ++which) {
    expectRefused("offset of brick", [&](FrameEntry& a, FrameEntry&) { a.offset[which] += 1; });
    expectRefused("offset of brick", [&](FrameEntry& a, FrameEntry&) { a.offset[which] = kHuge; });
    expectRefused("offset of brick", [&](FrameEntry& a, FrameEntry& b) { a.offset[which] = b.offset[which]; });
    expectRefused("offset of brick", [&](FrameEntry& a, FrameEntry&) { a.bytes[which] -= 1; });
    expectRefused("of brick", [&](FrameEntry& a, FrameEntry&) { a.bytes[which] = 0xffffffffu; });
    expectRefused("of brick", [&](FrameEntry&, FrameEntry& b) { b.bytes[which] = 0; });
  }
  expectRefused("reserved", [](FrameEntry& a, FrameEntry&) { a.zero = 1; });
  // Frames may lie in any order, but then the hashes of bricks are wrong.
  expectRefused("checksum of brick 0", [](FrameEntry& a, FrameEntry& b) { std::swap(a, b); });
}

TEST(ForgedFile, compactSections) {
  for (const char* needed : {"FRAM", "ZCOD", "ZFCB", "ZFCF"}) {
    CompactForgery without;
    const size_t entry = without.entryOffset(needed);
    without.bytes.replace(entry, 4, "GONE");
    without.set<uint32_t>(entry + 4, kSectionOptional);
    without.seal();
    EXPECT_NE(complaintOf(without).find(needed), std::string::npos);
    CompactForgery miscounted;
    miscounted.set<uint64_t>(miscounted.entryOffset(needed) + offsetof(SectionEntry, items), 1);
    miscounted.seal();
    EXPECT_NE(complaintOf(miscounted).find(needed), std::string::npos) << complaintOf(miscounted);
  }
  CompactForgery dense;
  dense.set(dense.sectionOffset("META") + offsetof(Metadata, layout), uint32_t(0));
  dense.seal();
  EXPECT_NE(complaintOf(dense).find("a section CODE, found none"), std::string::npos);
}

/// A brick is damaged under a checksum that fits: whoever unpacks it is told, whatever he asks for.
TEST(ForgedFile, unpackingTellsOfDamage) {
  CompactForgery forgery;
  forgery.replaceLast(1, frameOf(std::string(kFaceBytes - 1, char(200))));
  const std::string path = test::temporaryFolder() + "/brick.fvx";
  test::writeBytes(path, forgery.bytes);
  const AttenuationFile file(path);
  file.brick(0);
  file.brick(1, DirectionSet(0));
  file.brick(1, DirectionSet(1) << 3);
  EXPECT_THROW(file.brick(1, DirectionSet(1) << 13), InputError);
  EXPECT_THROW(file.brick(1), InputError);
}

/// Damage that no checksum covers while bricks are read: an error, or some bytes, and never anything out of bounds.
TEST(DamagedFiles, changedFramesAreReadWithoutHarm) {
  const std::string path = test::temporaryFolder() + "/flipped.fvx";
  const std::string& bytes = oneBrick(Layout::compact);
  const size_t first = Forgery(bytes).sectionOffset("ZCOD");
  size_t refused = 0;
  for (size_t at = first; at < bytes.size(); ++at) {
    std::string changed = bytes;
    changed[at] = char(changed[at] ^ (1 << at % 8));
    test::writeBytes(path, changed);
    try {
      const AttenuationFile file(path);
      file.brick(0);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0u);
}

TEST(ForgedFile, paddingIsCheckedByVerify) {
  Forgery forgery(manyBricks());
  const size_t padding = forgery.sectionOffset("CODE") - 1;
  forgery.bytes[padding] = 1;
  forgery.seal();
  EXPECT_NE(complaintOf(forgery).find("padding"), std::string::npos);
}

TEST(ForgedFile, oneDamagedBrickIsFoundByItself) {
  Forgery forgery(manyBricks());
  forgery.bytes[forgery.sectionOffset("ATTF") + 13 * 512 + 5] ^= 4;  // of brick 1
  const std::string path = test::temporaryFolder() + "/brick.fvx";
  test::writeBytes(path, forgery.bytes);
  const AttenuationFile file(path);
  file.verifyBrick(0);
  EXPECT_THROW(file.verifyBrick(1), InputError);
  file.verifyBrick(2);
  EXPECT_THROW(file.verify(), InputError);
}

}  // namespace
}  // namespace freevoxel
