// Headers of NRRD files, attached and detached (teem's format, versions NRRD0001 to NRRD0005).
#pragma once

#include "volume/file_start.h"
#include "volume/payload.h"

namespace freevoxel {

bool isNrrd(const FileStart& start);

/// Strict about what is needed to find and place the values, lenient about the rest: unknown fields and key:=value
/// pairs are passed over, `space directions` do without `space`, lines may end in CR LF.
/// Encodings raw, gzip and ascii. `space directions` and `space origin` are turned from the space named into ours;
/// failing these, `spacings`, then `axis mins` and `axis maxs` with `centers`. A fourth axis is chosen from by
/// options.component if it comes first and by options.frame if it comes last. Throws InputError naming the line.
Payload readNrrdHeader(const FileStart& start, const VolumeOptions& options);

}  // namespace freevoxel
