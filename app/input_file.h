// What kind of file the user named.
#pragma once

#include <cstdint>
#include <string>

namespace freevoxel {

/// Whether this is a file that starts like an attenuation file. Throws InputError for one that a run has not finished,
/// which may look whole in the moment before it gets its name.
bool isAttenuationFile(const std::string& path);

/// Size of the file itself, without others it may name; of a folder, its files; 0 for a name that stands for several.
uint64_t fileBytes(const std::string& path);

/// Whether this is a NumPy array of more than two axes: a volume, not spheres. Throws InputError.
bool isVolumeArray(const std::string& path);

/// "png" for "a/b.PNG", empty if there is none.
std::string lowerCaseExtension(const std::string& path);

}  // namespace freevoxel
