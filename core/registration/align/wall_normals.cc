#include "core/registration/align/wall_normals.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace vantage::registration {
namespace {

// rad: beyond this a surface is no wall of the hypothesis.
constexpr double kFarthest = 0.2;

}  // namespace

WallNormals::WallNormals(std::span<const SurfaceSample> samples, double spacing, double max_tilt) {
  // m^2: a door leaf. In two directions: the smaller holds a twentieth of all, the end wall of a
  // corridor that is ten times as long as wide.
  constexpr double kLeastArea = 2;
  constexpr double kLeastShare = 0.05;
  // Normals of single samples are noisy: half as much again is allowed to them.
  const double steepest = std::sin(1.5 * max_tilt);
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d n = s.normal.cast<double>();
    if (std::abs(n.z()) > steepest) continue;
    normals_.push_back(n);
    scatter += n.head<2>() * n.head<2>().transpose();
  }
  const double least = kLeastArea / (spacing * spacing);
  if (static_cast<double>(normals_.size()) < least) return;
  const Eigen::Vector2d spread =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter).eigenvalues();
  tell_up_ = spread.x() >= kLeastShare * (spread.x() + spread.y());
}

double WallNormals::Misfit(const Eigen::Vector3d& up) const {
  if (normals_.empty()) return 0;
  double sum = 0;
  for (const Eigen::Vector3d& n : normals_) sum += std::min(std::abs(n.dot(up)), kFarthest);
  return sum / static_cast<double>(normals_.size());
}

Eigen::Vector3d WallNormals::Up(const Eigen::Vector3d& from) const {
  // Least absolute values by weighted least squares, which lets outliers count little; from 20
  // degrees off it has settled to hundredths of a degree within ten rounds.
  constexpr int kRounds = 20;
  constexpr double kLeast = 0.002;  // rad: weights stay finite
  Eigen::Vector3d up = from;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& n : normals_) {
      const double off = std::abs(n.dot(up));
      // The first rounds look farther, since `from` may be that far off itself.
      if (round >= kRounds / 2 && off > kFarthest) continue;
      scatter += n * n.transpose() / std::max(off, kLeast);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
    const Eigen::Vector3d least = solver.eigenvectors().col(0);
    up = least.dot(from) < 0 ? Eigen::Vector3d(-least) : least;
  }
  return up;
}

}  // namespace vantage::registration
