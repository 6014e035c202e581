#include "server/conversion/pose_comparison_proto.h"

#include <algorithm>

#include "google/protobuf/repeated_field.h"
#include "server/conversion/to_proto.h"

namespace vantage::conversion {
namespace {

// m and rad: a hand's breadth, and as far as the heading moves a wall 10 m away by that.
constexpr double kSameSpot = 0.1;
constexpr double kSameHeading = 0.01;

bool AreSame(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Isometry3d apart = a.inverse() * b;
  return apart.translation().norm() < kSameSpot &&
         Eigen::AngleAxisd(apart.linear()).angle() < kSameHeading;
}

v1::SampleAgreement WriteState(registration::SampleState state) {
  switch (state) {
    case registration::SampleState::kFits:
      return v1::SAMPLE_AGREEMENT_FITS;
    case registration::SampleState::kNothingKnown:
      return v1::SAMPLE_AGREEMENT_NOTHING_KNOWN;
    case registration::SampleState::kFitsNothing:
      return v1::SAMPLE_AGREEMENT_FITS_NOTHING;
    case registration::SampleState::kInEmptySpace:
      return v1::SAMPLE_AGREEMENT_IN_EMPTY_SPACE;
    case registration::SampleState::kBehindSurface:
      return v1::SAMPLE_AGREEMENT_BEHIND_SURFACE;
  }
  return v1::SAMPLE_AGREEMENT_UNSPECIFIED;
}

v1::SurfaceSight WriteSight(registration::SurfaceSight sight) {
  switch (sight) {
    case registration::SurfaceSight::kOutOfSight:
      return v1::SURFACE_SIGHT_OUT_OF_SIGHT;
    case registration::SurfaceSight::kSeen:
      return v1::SURFACE_SIGHT_SEEN;
    case registration::SurfaceSight::kSeenThrough:
      return v1::SURFACE_SIGHT_SEEN_THROUGH;
    case registration::SurfaceSight::kHidden:
      return v1::SURFACE_SIGHT_HIDDEN;
    case registration::SurfaceSight::kNoReturn:
      return v1::SURFACE_SIGHT_NO_RETURN;
  }
  return v1::SURFACE_SIGHT_UNSPECIFIED;
}

v1::DisagreementKind WriteKind(registration::DisagreementKind kind) {
  switch (kind) {
    case registration::DisagreementKind::kInEmptySpace:
      return v1::DISAGREEMENT_KIND_IN_EMPTY_SPACE;
    case registration::DisagreementKind::kBehindSurface:
      return v1::DISAGREEMENT_KIND_BEHIND_SURFACE;
    case registration::DisagreementKind::kSeenThrough:
      return v1::DISAGREEMENT_KIND_SEEN_THROUGH;
  }
  return v1::DISAGREEMENT_KIND_UNSPECIFIED;
}

void Append(const Eigen::Vector3f& vector, google::protobuf::RepeatedField<float>& to) {
  for (int axis = 0; axis < 3; ++axis) to.Add(vector[axis]);
}

v1::ComparedPose WritePose(const registration::ComparedPose& pose, const PoseOfScan& of,
                           const Eigen::Vector3d& origin) {
  v1::ComparedPose out;
  out.set_kind(of.kind);
  out.set_rival_pose(of.rival_pose);
  *out.mutable_pose() = conversion::WritePose(pose.T_world_scan, origin);
  out.set_overlap_share(pose.overlap_share);
  out.set_rms_residual_m(pose.rms_residual);
  out.set_contradiction_share(pose.contradiction_share);
  out.set_fits_nothing_share(pose.fits_nothing_share);
  out.set_nothing_known_share(pose.nothing_known_share);
  out.set_surface_in_sight_m2(pose.surface_in_sight);
  out.set_surface_seen_through_m2(pose.surface_seen_through);
  for (const registration::Disagreement& group : pose.disagreements) {
    v1::Disagreement& to = *out.add_disagreements();
    to.set_kind(WriteKind(group.kind));
    *to.mutable_centre() = WriteVector(group.centre + origin);
    *to.mutable_box()->mutable_min() = WriteVector(group.box.min() + origin);
    *to.mutable_box()->mutable_max() = WriteVector(group.box.max() + origin);
    to.set_area_m2(group.area);
    to.set_description(group.words);
  }
  for (const registration::SampleState state : pose.states) {
    out.add_agreements(WriteState(state));
  }
  out.mutable_residuals_m()->Add(pose.residuals.begin(), pose.residuals.end());
  for (const registration::SurfaceSight sight : pose.sights) out.add_sights(WriteSight(sight));
  return out;
}

}  // namespace

std::vector<PoseOfScan> PosesOf(const v1::Scan& scan, const Eigen::Vector3d& origin) {
  const v1::Registration& registration = scan.registration();
  std::vector<PoseOfScan> poses = {
      {ReadOwnPose(registration.pose(), origin), v1::COMPARED_POSE_KIND_ALIGNED, 0}};
  for (int i = 0; i < registration.rival_poses_size(); ++i) {
    poses.push_back({ReadOwnPose(registration.rival_poses(i).pose(), origin),
                     v1::COMPARED_POSE_KIND_RIVAL, i + 1});
  }
  if (!scan.has_prior()) return poses;
  const Eigen::Isometry3d prior = ReadOwnPose(scan.prior().pose(), origin);
  const bool known = std::any_of(poses.begin(), poses.end(), [&](const PoseOfScan& pose) {
    return AreSame(pose.T_model_scan, prior);
  });
  if (!known) poses.push_back({prior, v1::COMPARED_POSE_KIND_PRIOR, 0});
  return poses;
}

v1::PoseComparison WritePoseComparison(const registration::PoseComparison& comparison,
                                       std::span<const PoseOfScan> poses,
                                       const Eigen::Vector3d& origin) {
  v1::PoseComparison out;
  for (size_t i = 0; i < poses.size(); ++i) {
    *out.add_poses() = WritePose(comparison.poses[i], poses[i], origin);
  }
  for (const Eigen::Vector3f& point : comparison.points) {
    Append(point, *out.mutable_sample_points());
  }
  for (const Eigen::Vector3f& normal : comparison.normals) {
    Append(normal, *out.mutable_sample_normals());
  }
  *out.mutable_surface_origin() = WriteVector(origin);
  for (const registration::SurfacePiece& piece : comparison.surface.pieces) {
    Append(piece.centroid, *out.mutable_surface_points());
    Append(piece.normal, *out.mutable_surface_normals());
    out.add_surface_areas_m2(piece.area);
  }
  out.set_surface_spacing_m(comparison.surface.spacing);
  out.set_reach_m(comparison.reach);
  return out;
}

}  // namespace vantage::conversion
