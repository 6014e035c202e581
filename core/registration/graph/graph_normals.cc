#include "core/registration/graph/graph_normals.h"

#include <cmath>
#include <map>
#include <utility>

namespace vantage::registration {
namespace {

// Of an unknown's information, that elimination leaves by rounding where nothing holds it. What is
// held by 100 m beside a sigma of 0.1 mm leaves 1e-12.
constexpr double kRoundingShare = 1e-13;

}  // namespace

GraphNormals::GraphNormals(std::span<const PoseTerm> terms,
                           std::span<const Eigen::Isometry3d> poses, const std::vector<bool>& held)
    : at_(poses.size(), kNone) {
  for (size_t i = 0; i < poses.size(); ++i) {
    if (held[i]) continue;
    at_[i] = unknowns_;
    unknowns_ += 6;
  }
  gradient_.setZero(unknowns_);
  // Blocks of the lower triangle by (column, row), so that sums are in an order of their own.
  std::map<std::pair<Eigen::Index, Eigen::Index>, sensor::Matrix6d> blocks;
  const auto add = [&](Eigen::Index row, Eigen::Index column, const sensor::Matrix6d& block) {
    blocks.try_emplace({column, row}, sensor::Matrix6d::Zero()).first->second += block;
  };
  for (const PoseTerm& term : terms) {
    const Residual residual = ResidualOf(term, poses);
    const Eigen::Index a = at_[term.a];
    if (a != kNone) {
      add(a, a, residual.by_a.transpose() * residual.by_a);
      gradient_.segment<6>(a) += residual.by_a.transpose() * residual.value;
    }
    if (term.kind != PoseTerm::Kind::kLink) continue;
    const Eigen::Index b = at_[term.b];
    if (b == kNone) continue;
    add(b, b, residual.by_b.transpose() * residual.by_b);
    gradient_.segment<6>(b) += residual.by_b.transpose() * residual.value;
    if (a == kNone) continue;
    if (a < b) {
      add(b, a, residual.by_b.transpose() * residual.by_a);
    } else {
      add(a, b, residual.by_a.transpose() * residual.by_b);
    }
  }
  if (unknowns_ == 0) {
    solvable_ = true;
    return;
  }
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * blocks.size());
  for (const auto& [place, block] : blocks) {
    for (int c = 0; c < 6; ++c) {
      for (int r = 0; r < 6; ++r) {
        if (place.first == place.second && r < c) continue;
        entries.emplace_back(place.second + r, place.first + c, block(r, c));
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(unknowns_, unknowns_);
  matrix.setFromTriplets(entries.begin(), entries.end());
  // To a diagonal of ones, so that metres and radians meet in no pivot, and a pivot is what is left
  // of an unknown's information when others are free: of a direction that nothing holds, rounding.
  scale_.setZero(unknowns_);
  for (Eigen::Index i = 0; i < unknowns_; ++i) {
    const double own = matrix.coeff(i, i);
    if (own > 0) scale_[i] = 1 / std::sqrt(own);
  }
  matrix = (scale_.asDiagonal() * matrix * scale_.asDiagonal()).eval();
  factor_.compute(matrix);
  if (factor_.info() != Eigen::Success || !factor_.vectorD().allFinite()) return;
  double least = 1;
  Eigen::Index at_least = 0;
  for (Eigen::Index i = 0; i < unknowns_; ++i) {
    const double pivot = factor_.vectorD()[factor_.permutationP().indices()[i]];
    if (pivot < least) {
      least = pivot;
      at_least = i;
    }
  }
  solvable_ = least > kRoundingShare;
  for (size_t i = 0; i < at_.size(); ++i) {
    if (at_[i] != kNone && at_least >= at_[i] && at_least < at_[i] + 6) weakest_ = i;
  }
}

std::vector<sensor::Vector6d> GraphNormals::Step() const {
  std::vector<sensor::Vector6d> step(at_.size(), sensor::Vector6d::Zero());
  if (unknowns_ == 0) return step;
  const Eigen::VectorXd solution =
      scale_.cwiseProduct(factor_.solve(scale_.cwiseProduct(gradient_)));
  for (size_t i = 0; i < at_.size(); ++i) {
    if (at_[i] != kNone) step[i] = -solution.segment<6>(at_[i]);
  }
  return step;
}

std::vector<sensor::Matrix6d> GraphNormals::Column(size_t node) const {
  std::vector<sensor::Matrix6d> column(at_.size(), sensor::Matrix6d::Zero());
  if (at_[node] == kNone) return column;
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(unknowns_, 6);
  units.middleRows<6>(at_[node]) = scale_.segment<6>(at_[node]).asDiagonal();
  const Eigen::MatrixXd solution = scale_.asDiagonal() * factor_.solve(units);
  for (size_t i = 0; i < at_.size(); ++i) {
    if (at_[i] != kNone) column[i] = solution.middleRows<6>(at_[i]);
  }
  return column;
}

}  // namespace vantage::registration
