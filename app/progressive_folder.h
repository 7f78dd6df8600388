// The folder of render --progressive.
#pragma once

#include <filesystem>
#include <vector>

namespace freevoxel {

/// Makes the folder if it is not there. What an earlier `freevoxel render --progressive` left in it: files named 00.png
/// or 00.exr and so on whose metadata name such a command. Throws InputError at a file so named that holds no such
/// command, MachineError if the folder can be neither made nor read.
std::vector<std::filesystem::path> picturesOfEarlierRun(const std::filesystem::path& folder);

/// Throws MachineError.
void removeAll(const std::vector<std::filesystem::path>& files);

}  // namespace freevoxel
