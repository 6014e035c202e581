#include "client/cli/pose_flags.h"

#include <cmath>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "client/cli/file.h"
#include "client/library/error.h"
#include "core/sensor/scanner_model.h"

namespace vantage::cli {
namespace {

// One sigma of poses from a vendor's registration, m and degrees: centimetres within a storey (the
// visual tracking of a tripod that is carried, a cloud-to-cloud fit), more after stairs. What is
// farther off than four of them is for a person to judge. A choice, not measured.
constexpr double kVendorPosition = 0.05;
constexpr double kVendorRotation = 0.5;

sensor::Matrix6d CovarianceOf(double position, double degrees) {
  sensor::Matrix6d covariance = sensor::Matrix6d::Zero();
  const double rotation = sensor::Radians(degrees);
  covariance.diagonal().head<3>().setConstant(rotation * rotation);
  covariance.diagonal().tail<3>().setConstant(position * position);
  return covariance;
}

Eigen::Isometry3d FromNumbers(const std::vector<double>& n) {
  const auto angle = [&](size_t i) { return n.size() > i ? sensor::Radians(n[i]) : 0.0; };
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(angle(3), Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(angle(4), Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(angle(5), Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(n[0], n[1], n[2]);
  return pose;
}

}  // namespace

void AddPoseFlags(CLI::App& command, PoseFlags& flags) {
  command
      .add_option("--prior", flags.prior,
                  "Believed pose: x,y,z in m, then heading in degrees, counter-clockwise [, pitch, "
                  "roll]")
      ->delimiter(',')
      ->expected(4, 6)
      ->allow_extra_args(false);
  command.add_option("--prior-file", flags.prior_file,
                     "Poses by name: lines of 'NAME' and 16 numbers, the 4x4 matrix row by row");
  command.add_option("--levelled", flags.levelled,
                     "An inclinometer fixed roll and pitch to within this, degrees, one sigma");
  command
      .add_option("--sigma", flags.sigma,
                  "How good the prior is: one sigma of position (m) and of rotation (degrees)")
      ->delimiter(',')
      ->expected(2)
      ->allow_extra_args(false);
  CLI::Option* trusted =
      command.add_flag("--trusted", flags.trusted,
                       "The pose is a vendor's or control network's: check it, don't replace it");
  command
      .add_flag("--vendor-registered", flags.vendor_registered,
                "The pose is from a vendor's registration: right to 5 cm and half a degree, one "
                "sigma; it is refined")
      ->excludes(trusted)
      ->excludes("--sigma");
}

absl::StatusOr<std::vector<std::pair<std::string, Eigen::Isometry3d>>> ParsePoses(
    const std::string& text, const std::string& what) {
  std::vector<std::pair<std::string, Eigen::Isometry3d>> poses;
  int number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    line = line.substr(0, line.find('#'));
    const std::vector<std::string> words =
        absl::StrSplit(line, absl::ByAnyChar(" \t\r,"), absl::SkipEmpty());
    if (words.empty()) continue;
    const auto bad = [&](const std::string& why) {
      return client::WithFix(
          absl::InvalidArgumentError(absl::StrCat(what, ":", number, ": ", why)),
          "a line is a name and 16 numbers, the 4x4 matrix from scanner to world, row "
          "by row, in m");
    };
    if (words.size() != 17) return bad(absl::StrCat(words.size(), " words instead of 17"));
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; ++i) {
      if (!absl::SimpleAtod(words[i + 1], &m(i / 4, i % 4)) || !std::isfinite(m(i / 4, i % 4))) {
        return bad(absl::StrCat("'", words[i + 1], "' is not a number"));
      }
    }
    const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
    if ((r * r.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-3 || r.determinant() < 0 ||
        (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-6) {
      return bad("the matrix is not a rigid transform");
    }
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = Eigen::Quaterniond(r).normalized().toRotationMatrix();
    pose.translation() = m.topRightCorner<3, 1>();
    poses.emplace_back(words[0], pose);
  }
  return poses;
}

absl::StatusOr<std::optional<sensor::PosePrior>> PriorFrom(
    const PoseFlags& flags, const std::string& scan_name,
    const std::optional<Eigen::Isometry3d>& stated) {
  std::optional<sensor::PosePrior> prior;
  if (!flags.prior.empty()) {
    prior.emplace();
    prior->T_world_scan = FromNumbers(flags.prior);
  } else if (!flags.prior_file.empty()) {
    const auto text = ReadFile(flags.prior_file);
    if (!text.ok()) return text.status();
    const auto poses = ParsePoses(*text, flags.prior_file);
    if (!poses.ok()) return poses.status();
    std::vector<std::string> names;
    for (const auto& [name, pose] : *poses) {
      names.push_back(name);
      if (name != scan_name) continue;
      prior.emplace();
      prior->T_world_scan = pose;
    }
    if (!prior) {
      return client::WithFix(absl::InvalidArgumentError(absl::StrCat(
                                 flags.prior_file, " has no pose for '", scan_name, "'")),
                             absl::StrCat("it has ", absl::StrJoin(names, ", "),
                                          "; --name chooses which one is meant"));
    }
  }
  if (!prior && stated) {
    prior.emplace();
    prior->T_world_scan = *stated;
    prior->from_file_header = true;
  }
  if (!prior) {
    if (flags.levelled || !flags.sigma.empty() || flags.trusted || flags.vendor_registered) {
      return client::WithFix(
          absl::InvalidArgumentError(
              "--levelled, --sigma, --trusted and --vendor-registered say how good a pose is, but "
              "no pose was given, and the file states none"),
          "give one with --prior or --prior-file");
    }
    return prior;
  }
  if (flags.levelled) prior->levelled_sigma = sensor::Radians(*flags.levelled);
  if (flags.sigma.size() == 2) prior->covariance = CovarianceOf(flags.sigma[0], flags.sigma[1]);
  if (flags.vendor_registered) prior->covariance = CovarianceOf(kVendorPosition, kVendorRotation);
  if (flags.trusted && flags.sigma.empty()) {
    return client::WithFix(
        absl::InvalidArgumentError("--trusted does not say how good the pose is"),
        "--sigma 0.002,0.01 of a control network (m, degrees), or --vendor-registered instead");
  }
  prior->trusted = flags.trusted;
  return prior;
}

}  // namespace vantage::cli
