#include "volume/read_volume.h"

#include <algorithm>
#include <filesystem>
#include <new>
#include <stdexcept>

#include "base/error.h"
#include "volume/axis_order.h"
#include "volume/child_reader.h"
#include "volume/component.h"
#include "volume/dat_header.h"
#include "volume/file_pattern.h"
#include "volume/file_start.h"
#include "volume/library_formats.h"
#include "volume/meta_image.h"
#include "volume/nifti.h"
#include "volume/nrrd.h"
#include "volume/numpy_array.h"
#include "volume/payload.h"
#include "volume/vtk_legacy.h"

namespace freevoxel {

namespace {

/// A format that says of itself what it holds. The first that recognises a file reads it; what nobody recognises is
/// raw.
struct Format {
  const char* name;
  bool (*recognises)(const FileStart&);
  Payload (*readHeader)(const FileStart&, const VolumeOptions&);
};

constexpr Format kFormats[] = {
    {"NRRD", isNrrd, readNrrdHeader},         {"MetaImage", isMetaImage, readMetaImageHeader},
    {"NIfTI", isNifti, readNiftiHeader},      {"legacy VTK", isLegacyVtk, readLegacyVtkHeader},
    {"NumPy", isNumpyArray, readNumpyHeader}, {"DAT header", isDatHeader, readDatHeader},
};

Payload rawPayload(const FileStart& start, const VolumeOptions& options) {
  if (!options.dims || !options.type) {
    std::string names;
    for (const Format& format : kFormats)
      names += fmt::format("{}, ", format.name);
    throw InputError(
        fmt::format("{}: not a format that describes itself ({}{}); a raw file needs --dims X,Y,Z and --type",
                    start.path, names, libraryFormatNames()));
  }
  chooseComponent(numberedComponents(1), options.component, start.path);
  chooseFrame(options.frame, 1, start.path);
  Payload payload;
  payload.header.dims = *options.dims;
  payload.header.type = *options.type;
  payload.files = {start.path};
  payload.byteSkip = options.skip;
  payload.compressed = start.compressed;
  payload.byteOrder = options.byteOrder;
  payload.advice = "; check --dims, --type and --skip";
  return payload;
}

void refuseRawOptions(const std::string& path, const std::string& format, const VolumeOptions& options) {
  if (!options.dims && !options.type && options.skip == 0) return;
  throw InputError(fmt::format("{}: {} says itself what it holds; leave out --dims, --type and --skip", path, format));
}

Payload readPayload(const FileStart& start, const VolumeOptions& options) {
  for (const Format& format : kFormats) {
    if (!format.recognises(start)) continue;
    refuseRawOptions(start.path, format.name, options);
    return format.readHeader(start, options);
  }
  return rawPayload(start, options);
}

std::unique_ptr<VolumeSource> openFile(const std::string& path, const VolumeOptions& options) {
  Payload payload = readPayload(readFileStart(path), options);
  VolumeHeader& header = payload.header;
  if (options.spacing) header.placement.spacing = *options.spacing;
  header.labels = options.labels;
  if (!payload.zFastest) return openPayload(path, std::move(payload));
  checkVolumeHeader(path, header);
  const VolumeHeader wanted = header;
  std::swap(header.dims.x, header.dims.z);
  return withAxesReversed(openPayload(path, std::move(payload)), wanted, path);
}

/// The file that a pattern and --frame name.
std::string frameFile(const std::string& pattern, const VolumeOptions& options) {
  const std::vector<int> numbers = numbersOfPattern(pattern);
  if (numbers.empty()) throw InputError(fmt::format("{}: no file of that pattern exists", pattern));
  const std::string choice = numbers.size() == 1 ? fmt::format("--frame {}", numbers.front())
                                                 : fmt::format("--frame {} to {}", numbers.front(), numbers.back());
  if (!options.frame) throw InputError(fmt::format("{}: names several volumes; choose one with {}", pattern, choice));
  if (!std::binary_search(numbers.begin(), numbers.end(), *options.frame)) {
    throw InputError(fmt::format("{}: there is no file {}; choose one with {}", pattern,
                                 *expandPattern(pattern, *options.frame), choice));
  }
  return *expandPattern(pattern, *options.frame);
}

std::unique_ptr<VolumeSource> openByName(const std::string& path, const VolumeOptions& options) {
  if (std::optional<LibraryRequest> request = libraryRequest(path)) {
    refuseRawOptions(path, request->formatName, options);
    chooseFrame(options.frame, 1, path);
    request->component = options.component;
    request->spacing = options.spacing;
    request->labels = options.labels;
    return openWithLibrary(*request);
  }
  std::error_code ignored;
  if (isPattern(path) && !std::filesystem::exists(path, ignored)) {
    VolumeOptions ofFrame = options;
    ofFrame.frame.reset();
    return openVolume(frameFile(path, options), ofFrame);
  }
  return openFile(path, options);
}

}  // namespace

std::unique_ptr<VolumeSource> openVolume(const std::string& path, const VolumeOptions& options) {
  std::unique_ptr<VolumeSource> source = openByName(path, options);
  if (options.labels && isFloatingPoint(source->header().type)) {
    throw InputError(fmt::format("{}: labels are whole numbers, but the file holds values of type {}", path,
                                 valueTypeName(source->header().type)));
  }
  return source;
}

Volume readAll(VolumeSource& source, const std::string& name) {
  Volume volume;
  volume.header = source.header();
  const uint64_t bytes = volume.header.bytes();
  const int slices = volume.header.dims.z;
  const uint64_t sliceBytes = bytes / uint64_t(slices);
  try {
    // Memory is reserved for all, but only used as slices arrive: a compressed file may hold less than it says.
    volume.data.reserve(bytes);
    constexpr uint64_t kPortion = uint64_t(1) << 24;
    const int portion = int(std::clamp<uint64_t>(kPortion / sliceBytes, 1, uint64_t(slices)));
    for (int z = 0; z < slices; z += portion) {
      const int count = std::min(portion, slices - z);
      const size_t before = volume.data.size();
      volume.data.resize(before + uint64_t(count) * sliceBytes);
      source.readSlices(count, std::span(volume.data).subspan(before));
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(
        fmt::format("{}: no memory for {} bytes of values; free some, or reduce the volume", name, bytes));
  } catch (const std::length_error&) {
    throw MachineError(fmt::format("{}: {} bytes of values are more than this machine can address", name, bytes));
  }
  return volume;
}

Volume readVolume(const std::string& path, const VolumeOptions& options) {
  return readAll(*openVolume(path, options), path);
}

}  // namespace freevoxel
