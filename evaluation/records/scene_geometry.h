#pragma once

#include <nlohmann/json.hpp>

#include "feeler/env/scene/scene.h"

namespace feeler::evaluation {

/// What a replay draws (docs/file-formats.md, "Scenes"): bodies with their joints, and the geoms that one sees, lids
/// left out.
nlohmann::ordered_json SceneJson(const env::Scene& scene);

/// Where the scene of a task stands beside the records of its episodes: FOLDER/TASK.scene.json.
std::string SceneFile(const std::string& folder, const std::string& task);

/// Writes the scene there, whole or not at all. Throws InputError if it cannot be written.
void WriteSceneFile(const env::Scene& scene, const std::string& folder);

}  // namespace feeler::evaluation
