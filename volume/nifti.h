// NIfTI-1 and NIfTI-2: .nii, .nii.gz, and .hdr with .img.
#pragma once

#include "volume/file_start.h"
#include "volume/payload.h"

namespace freevoxel {

bool isNifti(const FileStart& start);

/// Either byte order (sizeof_hdr tells). Placement from sform, else qform, else pixdim; millimetres, RAS. Values are
/// scaled and f32 where scl_slope is neither 0 nor 1, or scl_inter not 0. Dimensions 4 and 5 are chosen from by
/// options.frame and options.component. Throws InputError with the offset.
Payload readNiftiHeader(const FileStart& start, const VolumeOptions& options);

}  // namespace freevoxel
