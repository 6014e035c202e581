// The scenes of a study, by name.
#ifndef VANTAGE_CLIENT_STUDY_SCENE_LIST_H_
#define VANTAGE_CLIENT_STUDY_SCENE_LIST_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/simulated_job/site.h"
#include "core/simulation/scenes/scene_use.h"

namespace vantage::study {

// Generated scenes are 'flat-N', 'two-rooms-N', 'office-N' (250 m^2) and 'hall-N', N being the
// seed, which says whether they are for tuning or for reporting; 'small-house', for tuning, and
// 'bookstore', for reporting, are meshes from a folder. core/simulation/scenes/scene_use.h says
// why. A name that ends in '.ply' is the path of any other mesh, in metres, which is for reporting;
// JobName() has what files of its jobs are called by.
using simulation::SceneUse;

// What `vantage study` runs without --scene; `small`: three of them. Of the meshes those that
// report.
std::vector<std::string> DefaultScenes(SceneUse use, bool small);

// NOT_FOUND: no scene of that name, or its file is not in `data_folder`. Builds nothing.
absl::Status CheckScene(const std::string& name, const std::string& data_folder);

// Builds the scene, with a start of its own that a study replaces. NOT_FOUND as CheckScene().
absl::StatusOr<simulated_job::Site> BuildScene(const std::string& name,
                                               const std::string& data_folder);

// A scene's name as a part of a file's: of a path its last part.
std::string JobName(const std::string& scene);

// The number of scans after which a job in the scene ends at the latest.
int MostScans(const std::string& scene);

// kReporting where there is no such scene.
SceneUse UseOf(const std::string& scene);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_SCENE_LIST_H_
