// Conversion from the wire to the core. Everything is checked here, once: each violation is added
// to a list under the path of its field.
//
// Positions and poses on the wire are in the world frame, the core's in the model frame: model =
// world - origin.
#ifndef VANTAGE_SERVER_CONVERSION_FROM_PROTO_H_
#define VANTAGE_SERVER_CONVERSION_FROM_PROTO_H_

#include <Eigen/Core>
#include <string>

#include "absl/strings/string_view.h"
#include "core/model/view/model_config.h"
#include "core/planning/plan/planning_config.h"
#include "core/sensor/pose_prior.h"
#include "core/sensor/scanner_model.h"
#include "server/contract/error.h"
#include "vantage/v1/geometry.pb.h"
#include "vantage/v1/planning_config.pb.h"
#include "vantage/v1/scanner_model.pb.h"
#include "vantage/v1/session.pb.h"
#include "vantage/v1/target.pb.h"

namespace vantage::conversion {

// A vector whose parts are finite and at most 1e8.
Eigen::Vector3d ReadVector(const v1::Vector3& vector, const std::string& field,
                           contract::Violations& violations);

// A heading, rad, that is finite and at most a hundred.
double ReadHeading(double heading_rad, const std::string& field, contract::Violations& violations);

// The heading of a rotation, rad, of a scanner that stands upright: within 15 degrees, as far as a
// floor would correct it. A violation where it is tilted by more, or is no rotation.
double ReadUpright(const v1::Quaternion& rotation, const std::string& field,
                   contract::Violations& violations);

sensor::ScannerModel ReadScannerModel(const v1::ScannerModel& scanner, const std::string& field,
                                      contract::Violations& violations);

model::ModelConfig ReadModelConfig(const v1::ModelConfig& config, const std::string& field,
                                   contract::Violations& violations);

// Names, places and sigmas as target.proto wants them.
void CheckTargets(const google::protobuf::RepeatedPtrField<v1::TargetSighting>& targets,
                  const std::string& field, contract::Violations& violations);

sensor::PosePrior ReadPosePrior(const v1::PosePrior& prior, const Eigen::Vector3d& origin,
                                const std::string& field, contract::Violations& violations);

// The session's configuration for one of its scanners and its model: site rules and rejections
// included (those of `rejections` that have not expired).
planning::PlanningConfig ReadPlanningConfig(const v1::PlanningConfig& config,
                                            const v1::SiteRules& rules,
                                            const Eigen::Vector3d& origin, double voxel_size,
                                            const std::string& config_field,
                                            const std::string& rules_field,
                                            contract::Violations& violations);

// Fills in the defaults of absent fields.
void FillDefaults(v1::ScannerModel& scanner);
void FillDefaults(v1::ModelConfig& config);
void FillDefaults(v1::PlanningConfig& config);

// Replaces fields of `config` by those that `overrides` has.
void Override(const v1::PlanningConfig& overrides, v1::PlanningConfig& config);

// Checks a session as a whole: names, lengths, all of its configuration, and that its scanners
// reach the density. `prefix` is put before field names, such as 'session.'.
void CheckSession(const v1::Session& session, const std::string& prefix,
                  contract::Violations& violations);

// Checks a text for people: at most `max` characters. Protobuf guarantees valid UTF-8.
void CheckText(absl::string_view text, size_t max, const std::string& field,
               contract::Violations& violations);

// Empty, or 1 to 128 printable ASCII characters.
void CheckRequestId(absl::string_view request_id, contract::Violations& violations);

}  // namespace vantage::conversion

#endif  // VANTAGE_SERVER_CONVERSION_FROM_PROTO_H_
