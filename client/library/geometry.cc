#include "client/library/geometry.h"

namespace vantage::client {

v1::Vector3 ToProto(const Eigen::Vector3d& v) {
  v1::Vector3 out;
  out.set_x(v.x());
  out.set_y(v.y());
  out.set_z(v.z());
  return out;
}

v1::Pose ToProto(const Eigen::Isometry3d& pose) {
  v1::Pose out;
  Eigen::Quaterniond q(pose.linear());
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  out.mutable_rotation()->set_w(q.w());
  out.mutable_rotation()->set_x(q.x());
  out.mutable_rotation()->set_y(q.y());
  out.mutable_rotation()->set_z(q.z());
  *out.mutable_translation() = ToProto(Eigen::Vector3d(pose.translation()));
  return out;
}

v1::PosePrior ToProto(const sensor::PosePrior& prior) {
  v1::PosePrior out;
  *out.mutable_pose() = ToProto(prior.T_world_scan);
  if (prior.covariance) {
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 6; ++column)
        out.add_covariance((*prior.covariance)(row, column));
    }
  }
  if (prior.levelled_sigma) out.set_levelled_sigma_rad(*prior.levelled_sigma);
  out.set_trusted(prior.trusted);
  if (prior.from_file_header) out.set_source(v1::POSE_PRIOR_SOURCE_FILE_HEADER);
  return out;
}

v1::ScannerModel ToProto(const sensor::ScannerModel& scanner, const std::string& id) {
  v1::ScannerModel out;
  out.set_id(id);
  out.set_azimuth_span_rad(scanner.azimuth_span);
  out.set_min_elevation_rad(scanner.elevation_min);
  out.set_max_elevation_rad(scanner.elevation_max);
  out.set_azimuth_step_rad(scanner.azimuth_step);
  out.set_elevation_step_rad(scanner.elevation_step);
  out.set_min_range_m(scanner.range_min);
  out.set_max_range_m(scanner.range_max);
  out.set_range_noise_m(scanner.range_noise);
  out.set_range_noise_ppm(scanner.range_noise_ppm);
  out.set_max_incidence_rad(scanner.max_incidence);
  out.set_clearance_m(scanner.clearance);
  out.set_positioning_error_m(scanner.positioning_error);
  return out;
}

Eigen::Vector3d FromProto(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Isometry3d FromProto(const v1::Pose& pose) {
  const v1::Quaternion& r = pose.rotation();
  Eigen::Quaterniond q(r.w(), r.x(), r.y(), r.z());
  if (q.norm() < 1e-9) q = Eigen::Quaterniond::Identity();
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = q.normalized().toRotationMatrix();
  out.translation() = FromProto(pose.translation());
  return out;
}

sensor::ScannerModel FromProto(const v1::ScannerModel& scanner) {
  sensor::ScannerModel out;
  if (!scanner.id().empty()) out.name = scanner.id();
  if (scanner.has_azimuth_span_rad()) out.azimuth_span = scanner.azimuth_span_rad();
  if (scanner.has_min_elevation_rad()) out.elevation_min = scanner.min_elevation_rad();
  if (scanner.has_max_elevation_rad()) out.elevation_max = scanner.max_elevation_rad();
  if (scanner.has_azimuth_step_rad()) out.azimuth_step = scanner.azimuth_step_rad();
  if (scanner.has_elevation_step_rad()) out.elevation_step = scanner.elevation_step_rad();
  if (scanner.has_min_range_m()) out.range_min = scanner.min_range_m();
  if (scanner.has_max_range_m()) out.range_max = scanner.max_range_m();
  if (scanner.has_range_noise_m()) out.range_noise = scanner.range_noise_m();
  if (scanner.has_range_noise_ppm()) out.range_noise_ppm = scanner.range_noise_ppm();
  if (scanner.has_max_incidence_rad()) out.max_incidence = scanner.max_incidence_rad();
  if (scanner.has_clearance_m()) out.clearance = scanner.clearance_m();
  if (scanner.has_positioning_error_m()) out.positioning_error = scanner.positioning_error_m();
  return out;
}

}  // namespace vantage::client
