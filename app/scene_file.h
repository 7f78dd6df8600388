// Scene files: what render and trace are told by options, in JSON (docs/scenes.md; docs/scene.schema.json).
#pragma once

#include <string>

#include "app/light_options.h"
#include "app/options.h"
#include "app/picture_output.h"
#include "app/scene_objects.h"

namespace freevoxel {

/// The options of a command that a scene file may set.
struct SceneOptions {
  std::string& input;     ///< in: the scene file; out: its one volume
  std::string& transfer;  ///< empty: none
  VolumeOptions& raw;
  CameraOptions& camera;
  LightOptions& light;
  PictureOptions& picture;
  SceneObjects* objects = nullptr;  ///< several objects, if the command can show them; then input stays the scene
};

/// Whether a file is taken for a scene, by its extension.
bool isSceneFile(const std::string& path);

/// Fills the options from the scene file, those that were given on the command line aside: any of --eye, --target,
/// --up, --orbit replaces the scene's point of view, any lamp all of its lamps, any option of raw volumes all of its
/// own. Names of files are relative to the scene's folder. Throws InputError with the line and what was expected.
void useScene(const CLI::App& command, const SceneOptions& options);

}  // namespace freevoxel
