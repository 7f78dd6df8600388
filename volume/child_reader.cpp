#include "volume/child_reader.h"

#include <algorithm>

#include "base/error.h"
#include "volume/payload.h"

namespace freevoxel {

namespace {

ChildTask taskOf(const LibraryRequest& request) {
  RequestWriter bytes;
  bytes.add(uint32_t(request.format));
  bytes.add(uint32_t(request.component.has_value()));
  bytes.add(uint32_t(request.spacing.has_value()));
  bytes.add(uint32_t(request.labels));
  const glm::dvec3 spacing = request.spacing.value_or(glm::dvec3(1.0));
  for (int axis = 0; axis < 3; ++axis)
    bytes.add(spacing[axis]);
  bytes.addText(request.component.value_or(std::string()));
  for (const std::string& file : request.files)
    bytes.addText(file);
  return {kReaderArgument, request.formatName, request.path, request.files, bytes.take()};
}

class LibrarySource final : public VolumeSource {
 public:
  LibrarySource(const LibraryRequest& request, const ChildProgram& program) : child_(taskOf(request), program) {
    const MessageStart start = child_.receiveStart();
    HeaderMessage message;
    if (ChildMessage(start.kind) != ChildMessage::header || start.size != sizeof message) child_.failNonsense();
    child_.receive(std::as_writable_bytes(std::span(&message, 1)));
    if (message.type > uint32_t(ValueType::f64)) child_.failNonsense();
    header_.type = ValueType(message.type);
    header_.labels = request.labels;
    for (int axis = 0; axis < 3; ++axis) {
      header_.dims[axis] = message.dims[size_t(axis)];
      header_.placement.spacing[axis] = message.spacing[size_t(axis)];
      header_.placement.origin[axis] = message.origin[size_t(axis)];
      for (int row = 0; row < 3; ++row)
        header_.placement.direction[axis][row] = message.direction[size_t(3 * axis + row)];
    }
    checkVolumeHeader(request.path, header_);
    left_ = header_.bytes();
  }

  const VolumeHeader& header() const override { return header_; }

  void readSlices(int count, std::span<std::byte> out) override {
    checkEqual(uint64_t(out.size()), uint64_t(count) * (header_.bytes() / uint64_t(header_.dims.z)),
               "size of the room for slices");
    check(out.size() <= left_, "no more slices are asked for than the volume has");
    while (!out.empty()) {
      if (leftInMessage_ == 0) startMessage(ChildMessage::values);
      const std::span<std::byte> part = out.first(std::min<uint64_t>(out.size(), leftInMessage_));
      child_.receive(part);
      out = out.subspan(part.size());
      leftInMessage_ -= part.size();
      left_ -= part.size();
      if (left_ == 0) startMessage(ChildMessage::end);
    }
  }

 private:
  void startMessage(ChildMessage expected) {
    const MessageStart start = child_.receiveStart();
    const bool fits = expected == ChildMessage::end ? start.size == 0 : start.size > 0 && start.size <= left_;
    if (ChildMessage(start.kind) != expected || leftInMessage_ != 0 || !fits) child_.failNonsense();
    leftInMessage_ = start.size;
  }

  ChildProcess child_;
  VolumeHeader header_;
  uint64_t left_ = 0;
  uint64_t leftInMessage_ = 0;
};

}  // namespace

std::unique_ptr<VolumeSource> openWithLibrary(const LibraryRequest& request) {
  return std::make_unique<LibrarySource>(request, childProgram());
}

}  // namespace freevoxel
