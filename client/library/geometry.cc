#include "client/library/geometry.h"

namespace vantage {

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

v1::PosePrior ToProto(const PosePrior& prior) {
  v1::PosePrior out;
  *out.mutable_pose() = ToProto(prior.T_world_scan);
  if (prior.covariance) {
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 6; ++column)
        out.add_covariance((*prior.covariance)(row, column));
    }
  }
  if (prior.levelled_sigma) out.set_levelled_sigma(*prior.levelled_sigma);
  out.set_trusted(prior.trusted);
  return out;
}

v1::ScannerModel ToProto(const ScannerModel& scanner, const std::string& id) {
  v1::ScannerModel out;
  out.set_id(id);
  out.set_azimuth_span(scanner.azimuth_span);
  out.set_elevation_min(scanner.elevation_min);
  out.set_elevation_max(scanner.elevation_max);
  out.set_azimuth_step(scanner.azimuth_step);
  out.set_elevation_step(scanner.elevation_step);
  out.set_range_min(scanner.range_min);
  out.set_range_max(scanner.range_max);
  out.set_range_noise(scanner.range_noise);
  out.set_range_noise_ppm(scanner.range_noise_ppm);
  out.set_max_incidence(scanner.max_incidence);
  out.set_clearance(scanner.clearance);
  out.set_positioning_error(scanner.positioning_error);
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

ScannerModel FromProto(const v1::ScannerModel& scanner) {
  ScannerModel out;
  if (!scanner.id().empty()) out.name = scanner.id();
  if (scanner.has_azimuth_span()) out.azimuth_span = scanner.azimuth_span();
  if (scanner.has_elevation_min()) out.elevation_min = scanner.elevation_min();
  if (scanner.has_elevation_max()) out.elevation_max = scanner.elevation_max();
  if (scanner.has_azimuth_step()) out.azimuth_step = scanner.azimuth_step();
  if (scanner.has_elevation_step()) out.elevation_step = scanner.elevation_step();
  if (scanner.has_range_min()) out.range_min = scanner.range_min();
  if (scanner.has_range_max()) out.range_max = scanner.range_max();
  if (scanner.has_range_noise()) out.range_noise = scanner.range_noise();
  if (scanner.has_range_noise_ppm()) out.range_noise_ppm = scanner.range_noise_ppm();
  if (scanner.has_max_incidence()) out.max_incidence = scanner.max_incidence();
  if (scanner.has_clearance()) out.clearance = scanner.clearance();
  if (scanner.has_positioning_error()) out.positioning_error = scanner.positioning_error();
  return out;
}

}  // namespace vantage
