// Conversion between the geometry and scanner models of the wire and those of the core.
#ifndef VANTAGE_CLIENT_LIBRARY_GEOMETRY_H_
#define VANTAGE_CLIENT_LIBRARY_GEOMETRY_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/sensor/pose_prior.h"
#include "core/sensor/scanner_model.h"
#include "vantage/v1/geometry.pb.h"
#include "vantage/v1/scanner_model.pb.h"

namespace vantage::client {

v1::Vector3 ToProto(const Eigen::Vector3d& v);
v1::Pose ToProto(const Eigen::Isometry3d& pose);
v1::PosePrior ToProto(const sensor::PosePrior& prior);
// `id` must suit the service: 1 to 63 of [a-z0-9-], starting with a letter.
v1::ScannerModel ToProto(const sensor::ScannerModel& scanner, const std::string& id);

Eigen::Vector3d FromProto(const v1::Vector3& v);
// The rotation is normalised.
Eigen::Isometry3d FromProto(const v1::Pose& pose);
// Absent fields take the core's defaults.
sensor::ScannerModel FromProto(const v1::ScannerModel& scanner);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_GEOMETRY_H_
