#include "client/cli/scan_poses.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

Eigen::Vector3d PointOf(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Isometry3d PoseOf(const v1::Pose& pose) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  const v1::Quaternion& q = pose.rotation();
  out.linear() = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized().toRotationMatrix();
  out.translation() = PointOf(pose.translation());
  return out;
}

// 'pose 1', as 'scan accept' numbers them.
std::string NameOf(const v1::ComparedPose& pose) {
  switch (pose.kind()) {
    case v1::COMPARED_POSE_KIND_ALIGNED:
      return "pose 1";
    case v1::COMPARED_POSE_KIND_RIVAL:
      return absl::StrCat("pose ", pose.rival_pose() + 1);
    default:
      return "as given";
  }
}

std::string OriginOf(const v1::ComparedPose& pose) {
  switch (pose.kind()) {
    case v1::COMPARED_POSE_KIND_ALIGNED:
      return "where the alignment put it";
    case v1::COMPARED_POSE_KIND_RIVAL:
      return "where it may have been made instead";
    default:
      return "where its prior has it";
  }
}

std::vector<std::string> FiguresOf(const v1::ComparedPose& pose) {
  return {
      absl::StrFormat("fits %s of the scan, residual %s (rms); contradicts %.1f %%",
                      Percent(pose.overlap_share()), Length(pose.rms_residual_m()),
                      100 * pose.contradiction_share()),
      absl::StrFormat("fits nothing %s, nothing known there %s; sees through %.1f of the %.1f m²"
                      " of known surface in sight",
                      Percent(pose.fits_nothing_share()), Percent(pose.nothing_known_share()),
                      pose.surface_seen_through_m2(), pose.surface_in_sight_m2())};
}

std::string Words(const v1::Disagreement& place) {
  return absl::StrFormat("%.1f m² around %s: %s", place.area_m2(), Text(place.centre()),
                         place.description());
}

picture::PosePicture::Mark MarkOf(int agreement) {
  switch (agreement) {
    case v1::SAMPLE_AGREEMENT_FITS:
      return picture::PosePicture::Mark::kFits;
    case v1::SAMPLE_AGREEMENT_FITS_NOTHING:
      return picture::PosePicture::Mark::kFitsNothing;
    case v1::SAMPLE_AGREEMENT_IN_EMPTY_SPACE:
      return picture::PosePicture::Mark::kInEmptySpace;
    case v1::SAMPLE_AGREEMENT_BEHIND_SURFACE:
      return picture::PosePicture::Mark::kBehindSurface;
    default:
      return picture::PosePicture::Mark::kNothingKnown;
  }
}

// The end of the scale: residuals of the pose that fits best are told apart, and what is three
// times as large is as wrong as anything.
double LargestResidual(const v1::PoseComparison& comparison) {
  double least = comparison.reach_m();
  for (const v1::ComparedPose& pose : comparison.poses()) {
    if (pose.rms_residual_m() > 0) least = std::min(least, pose.rms_residual_m());
  }
  for (const double end : {0.005, 0.01, 0.02, 0.05, 0.1}) {
    if (end >= 3 * least) return end;
  }
  return comparison.reach_m();
}

Eigen::Vector3f ThirdsOf(const google::protobuf::RepeatedField<float>& numbers, int i) {
  return {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
}

absl::Status CheckLengths(const v1::PoseComparison& comparison) {
  const int samples = comparison.sample_points_size();
  const int pieces = comparison.surface_points_size();
  bool fit = samples % 3 == 0 && comparison.sample_normals_size() == samples && pieces % 3 == 0 &&
             comparison.surface_normals_size() == pieces;
  for (const v1::ComparedPose& pose : comparison.poses()) {
    fit = fit && 3 * pose.agreements_size() == samples && 3 * pose.residuals_m_size() == samples &&
          3 * pose.sights_size() == pieces;
  }
  return fit ? absl::OkStatus()
             : absl::InternalError("lists of the server's comparison differ in length");
}

picture::PosePicture::Pose PanelOf(const v1::PoseComparison& comparison,
                                   const v1::ComparedPose& pose, const Eigen::Vector3d& origin) {
  picture::PosePicture::Pose out;
  std::string name = NameOf(pose);
  name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
  out.title = absl::StrCat(name, ": ", OriginOf(pose));
  out.figures = {absl::StrCat("at ", Text(pose.pose()))};
  for (std::string& line : FiguresOf(pose)) out.figures.push_back(std::move(line));
  Eigen::Isometry3d T_shown_scan = PoseOf(pose.pose());
  T_shown_scan.translation() -= origin;
  out.station = T_shown_scan.translation();
  out.ahead = T_shown_scan.linear().col(0).head<2>().stableNormalized();
  for (int i = 0; i < pose.agreements_size(); ++i) {
    const Eigen::Vector3d point = ThirdsOf(comparison.sample_points(), i).cast<double>();
    const Eigen::Vector3d normal = ThirdsOf(comparison.sample_normals(), i).cast<double>();
    out.samples.push_back({T_shown_scan * point, (T_shown_scan.linear() * normal).cast<float>(),
                           pose.residuals_m(i), MarkOf(pose.agreements(i))});
  }
  for (int i = 0; i < pose.sights_size(); ++i) {
    if (pose.sights(i) == v1::SURFACE_SIGHT_SEEN_THROUGH) {
      out.seen_through.push_back(static_cast<size_t>(i));
    }
  }
  for (const v1::Disagreement& place : pose.disagreements()) {
    out.places.push_back({PointOf(place.centre()) - origin,
                          Eigen::AlignedBox3d(PointOf(place.box().min()) - origin,
                                              PointOf(place.box().max()) - origin),
                          Words(place)});
  }
  return out;
}

}  // namespace

std::string PosesReport(const v1::PoseComparison& comparison) {
  std::string out;
  if (comparison.in_model()) {
    absl::StrAppend(&out,
                    "  compared  with a model that holds the scan itself: where it was merged it "
                    "agrees with itself\n");
  }
  for (const v1::ComparedPose& pose : comparison.poses()) {
    absl::StrAppendFormat(&out, "  %-9s %s, %s\n", NameOf(pose), Text(pose.pose()), OriginOf(pose));
    for (const std::string& line : FiguresOf(pose))
      absl::StrAppend(&out, "            ", line, "\n");
    for (const v1::Disagreement& place : pose.disagreements()) {
      absl::StrAppend(&out, "            contradicts ", Words(place), "\n");
    }
  }
  return out;
}

absl::StatusOr<picture::PosePicture> PictureOf(const v1::Scan& scan,
                                               const v1::PoseComparison& comparison) {
  if (absl::Status fit = CheckLengths(comparison); !fit.ok()) return fit;
  picture::PosePicture out;
  out.title = absl::StrCat(
      client::IdOf(scan.name()), " (", scan.display_name(), "): ", Word(scan.state()),
      comparison.poses_size() > 1 ? absl::StrFormat(", %d poses", comparison.poses_size())
                                  : std::string());
  if (!scan.state_message().empty()) out.figures.push_back(scan.state_message());
  if (comparison.in_model()) {
    out.figures.push_back(
        "The model holds the scan itself: where it was merged it agrees with itself.");
  }
  const Eigen::Vector3d origin = PointOf(comparison.surface_origin());
  if (origin.norm() > 0) {
    out.figures.push_back(
        absl::StrCat("Axes count from ", Text(comparison.surface_origin()), " of the world."));
  }
  for (int i = 0; 3 * i < comparison.surface_points_size(); ++i) {
    out.surface.push_back({ThirdsOf(comparison.surface_points(), i).cast<double>(),
                           ThirdsOf(comparison.surface_normals(), i)});
  }
  out.surface_spacing = comparison.surface_spacing_m();
  out.largest_residual = LargestResidual(comparison);
  for (const v1::ComparedPose& pose : comparison.poses()) {
    out.poses.push_back(PanelOf(comparison, pose, origin));
  }
  return out;
}

}  // namespace vantage::cli
