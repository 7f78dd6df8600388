// The child's side of volume/child_reader.h.
#include "base/error.h"
#include "volume/child_answer.h"
#include "volume/slice_sink.h"

namespace freevoxel {

namespace {

LibraryRequest parseRequest(const std::string& path, RequestReader& reader) {
  LibraryRequest request;
  request.path = path;
  request.format = LibraryFormat(reader.take<uint32_t>());
  const bool hasComponent = reader.take<uint32_t>() != 0;
  const bool hasSpacing = reader.take<uint32_t>() != 0;
  request.labels = reader.take<uint32_t>() != 0;
  glm::dvec3 spacing;
  for (int axis = 0; axis < 3; ++axis)
    spacing[axis] = reader.take<double>();
  if (hasSpacing) request.spacing = spacing;
  const std::string component = reader.takeText();
  if (hasComponent) request.component = component;
  while (!reader.done())
    request.files.push_back(reader.takeText());
  return request;
}

class SendingSink final : public SliceSink {
 public:
  SendingSink(AnswerWriter& answer, const LibraryRequest& request) : answer_(answer), request_(request) {}

  void header(const VolumeHeader& header) override {
    Placement placement = header.placement;
    if (request_.spacing) placement.spacing = *request_.spacing;
    HeaderMessage message;
    message.type = uint32_t(header.type);
    for (int axis = 0; axis < 3; ++axis) {
      message.dims[size_t(axis)] = header.dims[axis];
      message.spacing[size_t(axis)] = placement.spacing[axis];
      message.origin[size_t(axis)] = placement.origin[axis];
      for (int row = 0; row < 3; ++row)
        message.direction[size_t(3 * axis + row)] = placement.direction[axis][row];
    }
    answer_.send(ChildMessage::header, std::as_bytes(std::span(&message, 1)));
  }
  void values(std::span<const std::byte> bytes) override {
    if (!bytes.empty()) answer_.send(ChildMessage::values, bytes);
  }

 private:
  AnswerWriter& answer_;
  const LibraryRequest& request_;
};

}  // namespace

void readWithLibrary(const LibraryRequest& request, SliceSink& sink) {
  switch (request.format) {
    case LibraryFormat::imageStack:
      return readImageStack(request, sink);
    case LibraryFormat::dicom:
      return readDicom(request, sink);
    case LibraryFormat::vdb:
      return readVdb(request, sink);
  }
  throw InternalError("internal error: no such format of a library");
}

void runLibraryReader() {
  answerRequest([](const std::string& path, RequestReader& reader, AnswerWriter& answer) {
    const LibraryRequest request = parseRequest(path, reader);
    SendingSink sink(answer, request);
    readWithLibrary(request, sink);
  });
}

}  // namespace freevoxel
