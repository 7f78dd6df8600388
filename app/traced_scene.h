// The objects of a scene file, read and put where they belong.
#pragma once

#include "app/scene_objects.h"
#include "app/session.h"
#include "voxlink/scene.h"

namespace freevoxel {

/// Everything in world space. What was left out of files is told and counted in the statistics. Throws InputError or
/// MachineError.
TracedScene readTracedScene(const SceneObjects& objects, Session& session);

/// A mesh or spheres alone, as a scene has them.
SceneObjects sceneOfFile(const std::string& path);

}  // namespace freevoxel
