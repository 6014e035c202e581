#include "core/registration/graph/residuals.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace vantage::registration {
namespace {

// Of two eigenvalues, a share that counts as nothing: rounding.
constexpr double kNothing = 1e-13;

Eigen::Vector3d RotationVector(const Eigen::Matrix3d& turn) {
  Eigen::Quaterniond q(turn);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  // Of small angles 2 sin(angle / 2) is the angle, to the third order.
  if (sine < 1e-9) return 2 * q.vec();
  return (2 * std::atan2(sine, q.w()) / sine) * q.vec();
}

// How log(exp(e) exp(r)) changes with a small e: the inverse of the left Jacobian of SO(3).
Eigen::Matrix3d InverseLeftJacobian(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  const Eigen::Matrix3d cross = CrossMatrix(r);
  // 1/angle^2 - (1 + cos) / (2 angle sin), and its limit.
  double factor = 1.0 / 12;
  if (angle > 1e-4) {
    factor = (1 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  }
  return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
}

}  // namespace

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

sensor::Matrix6d RootOf(const sensor::Matrix6d& information) {
  // Scaled first, so that a direction which is known to a metre counts beside one known to a
  // microradian.
  sensor::Vector6d scale = sensor::Vector6d::Zero();
  sensor::Vector6d inverse = sensor::Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    if (!(information(i, i) > 0)) continue;
    scale[i] = std::sqrt(information(i, i));
    inverse[i] = 1 / scale[i];
  }
  const sensor::Matrix6d unit = inverse.asDiagonal() * information * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> solver(0.5 * (unit + unit.transpose()));
  const double least = kNothing * solver.eigenvalues()[5];
  const sensor::Vector6d roots = (solver.eigenvalues().array() > least)
                                     .select(solver.eigenvalues().cwiseMax(0).cwiseSqrt(), 0.0);
  return roots.asDiagonal() * solver.eigenvectors().transpose() * scale.asDiagonal();
}

PoseTerm TermOf(const ScanLink& link, size_t a, size_t b) {
  PoseTerm term;
  term.a = a;
  term.b = b;
  term.measured = link.T_a_b;
  term.w = RootOf(link.information);
  return term;
}

PoseTerm TermOf(const AbsolutePose& absolute, size_t node) {
  PoseTerm term;
  term.kind = PoseTerm::Kind::kAbsolute;
  term.a = node;
  term.measured = absolute.T_world_scan;
  term.w = RootOf(absolute.information);
  return term;
}

void AddEvidence(const ScanNode& node, size_t index, std::vector<PoseTerm>& terms) {
  for (const AbsolutePose& absolute : node.absolute) terms.push_back(TermOf(absolute, index));
  for (const TargetTie& target : node.targets) {
    PoseTerm term;
    term.kind = PoseTerm::Kind::kTarget;
    term.a = index;
    term.in_scan = target.in_scan;
    term.in_world = target.in_world;
    term.sigma = target.sigma;
    terms.push_back(term);
  }
  if (node.inclinometer.has_value()) {
    PoseTerm term;
    term.kind = PoseTerm::Kind::kInclinometer;
    term.a = index;
    term.in_scan = node.inclinometer->up_in_scan;
    term.sigma = node.inclinometer->sigma;
    terms.push_back(term);
  }
}

sensor::Vector6d PoseDifference(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  sensor::Vector6d difference;
  difference << RotationVector(to.linear() * from.linear().transpose()),
      to.translation() - from.translation();
  return difference;
}

Eigen::Isometry3d ChangedPose(const Eigen::Isometry3d& pose, const sensor::Vector6d& change) {
  const Eigen::Vector3d w = change.head<3>();
  const double angle = w.norm();
  Eigen::Isometry3d changed = pose;
  if (angle > 0) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, w / angle));
    changed.linear() = (turn * Eigen::Quaterniond(pose.linear())).normalized().toRotationMatrix();
  }
  changed.translation() += change.tail<3>();
  return changed;
}

Residual ResidualOf(const PoseTerm& term, std::span<const Eigen::Isometry3d> poses) {
  const Eigen::Isometry3d& a = poses[term.a];
  Residual residual;
  residual.value.resize(term.size());
  residual.by_a.setZero(term.size(), 6);
  switch (term.kind) {
    case PoseTerm::Kind::kLink: {
      const Eigen::Isometry3d& b = poses[term.b];
      const Eigen::Matrix3d to_a = a.linear().transpose();
      const Eigen::Vector3d arm = b.translation() - a.translation();
      Eigen::Isometry3d relative = Eigen::Isometry3d::Identity();
      relative.linear() = to_a * b.linear();
      relative.translation() = to_a * arm;
      const sensor::Vector6d difference = PoseDifference(term.measured, relative);
      const Eigen::Matrix3d turns = InverseLeftJacobian(difference.head<3>()) * to_a;
      sensor::Matrix6d by_a = sensor::Matrix6d::Zero();
      by_a.topLeftCorner<3, 3>() = -turns;
      by_a.bottomLeftCorner<3, 3>() = to_a * CrossMatrix(arm);
      by_a.bottomRightCorner<3, 3>() = -to_a;
      sensor::Matrix6d by_b = sensor::Matrix6d::Zero();
      by_b.topLeftCorner<3, 3>() = turns;
      by_b.bottomRightCorner<3, 3>() = to_a;
      residual.value = term.w * difference;
      residual.by_a = term.w * by_a;
      residual.by_b = term.w * by_b;
      break;
    }
    case PoseTerm::Kind::kAbsolute: {
      const sensor::Vector6d difference = PoseDifference(term.measured, a);
      sensor::Matrix6d by = sensor::Matrix6d::Identity();
      by.topLeftCorner<3, 3>() = InverseLeftJacobian(difference.head<3>());
      residual.value = term.w * difference;
      residual.by_a = term.w * by;
      break;
    }
    case PoseTerm::Kind::kTarget: {
      const Eigen::Vector3d arm = a.linear() * term.in_scan;
      residual.value = (arm + a.translation() - term.in_world) / term.sigma;
      residual.by_a.leftCols<3>() = -CrossMatrix(arm) / term.sigma;
      residual.by_a.rightCols<3>() = Eigen::Matrix3d::Identity() / term.sigma;
      break;
    }
    case PoseTerm::Kind::kInclinometer: {
      const Eigen::Vector3d up = a.linear() * term.in_scan;
      residual.value = up.head<2>() / term.sigma;
      residual.by_a.leftCols<3>() = -CrossMatrix(up).topRows<2>() / term.sigma;
      break;
    }
  }
  return residual;
}

}  // namespace vantage::registration
