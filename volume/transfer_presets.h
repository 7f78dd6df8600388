// Transfer functions that need no file: made from the values of the volume they are for.
#pragma once

#include <string>
#include <vector>

#include "volume/transfer_function.h"
#include "volume/volume.h"

namespace freevoxel {

struct TransferPreset {
  std::string name;
  std::string description;
  TransferFunction (*make)(const Volume&);
};

/// "auto" first. Each gives the same for the same volume, whatever the number of threads.
const std::vector<TransferPreset>& transferPresets();

/// What "auto" is: values as frequent on the surface of the box as its background are invisible; away from them
/// opacity rises with how rare a value is. Labels get a colour each.
TransferFunction automaticTransfer(const Volume& volume);

/// A colour each for the labels that occur, 0 invisible; neighbouring numbers differ well.
TransferFunction labelTransfer(const Volume& volume);

/// A function of labels that is what `transfer` is at whole numbers. Throws InputError if its range holds more than
/// 65533 of them.
TransferFunction asLabels(const TransferFunction& transfer, const std::string& name);

/// What the user means for this volume: the name of a preset, or a file (readTransferFunction). A table without values
/// (.1dt) whose entries are too few for the volume's values, or which are no whole numbers, is spread over their range.
/// Of a volume of labels it is made a function of labels. Throws InputError.
TransferFunction chooseTransfer(const std::string& nameOrPath, const Volume& volume);

/// The same where values are not at hand: throws InputError for presets, and for tables without values, which are made
/// from them.
TransferFunction chooseTransfer(const std::string& nameOrPath, const VolumeHeader& header);

}  // namespace freevoxel
