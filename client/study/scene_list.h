// The scenes of a study, by name.
#ifndef VANTAGE_CLIENT_STUDY_SCENE_LIST_H_
#define VANTAGE_CLIENT_STUDY_SCENE_LIST_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/simulated_job/site.h"

namespace vantage::study {

// Generated scenes are 'flat-N', 'two-rooms-N', 'office-N' (250 m^2) and 'hall-N', N being the
// seed: below 100 for tuning, from 100 on for reporting, so that nothing is reported that the
// planner was tuned on. 'small-house' and 'bookstore' are meshes from a folder, for reporting.
enum class SceneUse { kTuning, kReporting };

// What `vantage study` runs without --scene; `small`: three of them.
std::vector<std::string> DefaultScenes(SceneUse use, bool small);

// NOT_FOUND: no scene of that name, or its file is not in `data_folder`. Builds nothing.
absl::Status CheckScene(const std::string& name, const std::string& data_folder);

// Builds the scene, with a start of its own that a study replaces. NOT_FOUND as CheckScene().
absl::StatusOr<simulated_job::Site> BuildScene(const std::string& name,
                                               const std::string& data_folder);

// The number of scans after which a job in the scene ends at the latest.
int MostScans(const std::string& scene);

// 'tuning' where the name says so.
SceneUse UseOf(const std::string& scene);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_SCENE_LIST_H_
