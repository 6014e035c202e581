// Conversion from the core to the wire. Positions and poses get the session's origin added: world =
// model + origin.
#ifndef VANTAGE_SERVER_CONVERSION_TO_PROTO_H_
#define VANTAGE_SERVER_CONVERSION_TO_PROTO_H_

#include <Eigen/Geometry>
#include <span>

#include "absl/time/time.h"
#include "core/model/partial_model.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/plan/coverage.h"
#include "core/planning/plan/patch.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/plan/storey.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/levelling.h"
#include "google/protobuf/duration.pb.h"
#include "google/protobuf/timestamp.pb.h"
#include "vantage/v1/coverage.pb.h"
#include "vantage/v1/geometry.pb.h"
#include "vantage/v1/plan.pb.h"
#include "vantage/v1/plan_service.pb.h"
#include "vantage/v1/registration.pb.h"
#include "vantage/v1/scan.pb.h"
#include "vantage/v1/site.pb.h"

namespace vantage::conversion {

// Patches that travel in one answer at most; the first are the most important.
inline constexpr int kMaxPatches = 8000;
// The same of openings.
inline constexpr int kMaxOpenings = 1000;

google::protobuf::Timestamp WriteTime(absl::Time time);
absl::Time ReadTime(const google::protobuf::Timestamp& time);
// To the nanosecond. 0 for a figure that is no time span (negative, not finite, or beyond 292
// years).
google::protobuf::Duration WriteDuration(double seconds);
double ReadDuration(const google::protobuf::Duration& duration);  // s

v1::Vector3 WriteVector(const Eigen::Vector3d& vector);
// The inverse, for vectors that were checked, or that the server wrote itself.
Eigen::Vector3d ReadOwnVector(const v1::Vector3& vector);
// A pose that a file states, in the world's frame, as a prior; and a model of the scanner that made
// a scan in a file. Both as the command line writes them.
v1::PosePrior WriteStatedPose(const Eigen::Isometry3d& T_world_scan);
v1::ScannerModel WriteScannerModel(const sensor::ScannerModel& scanner, const std::string& id);
v1::Pose WritePose(const Eigen::Isometry3d& T_model_scan, const Eigen::Vector3d& origin);
// The inverse, for poses that the server wrote itself.
Eigen::Isometry3d ReadOwnPose(const v1::Pose& pose, const Eigen::Vector3d& origin);

v1::SurfaceKind WriteKind(model::SurfaceKind kind);
v1::RegistrationVerdict WriteVerdict(const registration::RegistrationVerdict& verdict);
v1::Registration WriteRegistration(const registration::RegistrationResult& result,
                                   uint64_t model_version, const Eigen::Vector3d& origin);
// The inverse of what it writes of residuals.
registration::PairResiduals ReadOwnResiduals(const v1::Registration& registration);
v1::Levelling WriteLevelling(const registration::Levelling& levelling,
                             const Eigen::Vector3d& origin);
// SiteChange::since has to be the name of a scan.
v1::MergeReport WriteMergeReport(const model::MergeReport& report, const Eigen::Vector3d& origin);
v1::Coverage WriteCoverage(const planning::Coverage& coverage, double required_density,
                           const Eigen::Vector3d& origin);
v1::Storey WriteStorey(const planning::Storey& storey, const Eigen::Vector3d& origin);

// `patches` are those that view.patch_scores points into. Of a view that was not checked, location,
// region and verdict are absent.
v1::RankedView WriteView(const planning::RankedView& view, std::span<const planning::Patch> patches,
                         const Eigen::Vector3d& origin);
v1::Patch WritePatch(const planning::Patch& patch, const Eigen::Vector3d& origin);

// `full`: with patches and map of scores.
v1::PlanResult WritePlanResult(const planning::Plan& plan, const v1::PlanningConfig& config,
                               bool full, const Eigen::Vector3d& origin);
// Removes from a result what only the full view has.
void StripToBasic(v1::PlanResult& result);

v1::EvaluateViewResponse WriteEvaluation(const planning::ViewEvaluation& evaluation,
                                         const Eigen::Vector3d& origin);

// Puts the id of the last station's scan into what says where a view is; nothing where it is empty.
void NameLastStation(const std::string& scan, v1::RankedView& view);
void NameLastStation(const std::string& scan, v1::PlanResult& result);

}  // namespace vantage::conversion

#endif  // VANTAGE_SERVER_CONVERSION_TO_PROTO_H_
