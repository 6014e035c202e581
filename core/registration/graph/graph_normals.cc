#include "core/registration/graph/graph_normals.h"

#include <map>
#include <utility>

namespace vantage::registration {

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
  factor_.compute(matrix);
  solvable_ = factor_.info() == Eigen::Success && factor_.vectorD().allFinite() &&
              factor_.vectorD().minCoeff() > 0;
}

size_t GraphNormals::Weakest() const {
  if (unknowns_ == 0 || factor_.info() != Eigen::Success) return 0;
  Eigen::Index pivot = 0;
  factor_.vectorD().minCoeff(&pivot);
  // P moves unknown i to pivot P(i).
  Eigen::Index unknown = 0;
  for (Eigen::Index i = 0; i < unknowns_; ++i) {
    if (factor_.permutationP().indices()[i] == pivot) unknown = i;
  }
  for (size_t i = 0; i < at_.size(); ++i) {
    if (at_[i] != kNone && unknown >= at_[i] && unknown < at_[i] + 6) return i;
  }
  return 0;
}

std::vector<sensor::Vector6d> GraphNormals::Step() const {
  std::vector<sensor::Vector6d> step(at_.size(), sensor::Vector6d::Zero());
  if (unknowns_ == 0) return step;
  const Eigen::VectorXd solution = factor_.solve(gradient_);
  for (size_t i = 0; i < at_.size(); ++i) {
    if (at_[i] != kNone) step[i] = -solution.segment<6>(at_[i]);
  }
  return step;
}

std::vector<sensor::Matrix6d> GraphNormals::Column(size_t node) const {
  std::vector<sensor::Matrix6d> column(at_.size(), sensor::Matrix6d::Zero());
  if (at_[node] == kNone) return column;
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(unknowns_, 6);
  units.middleRows<6>(at_[node]).setIdentity();
  const Eigen::MatrixXd solution = factor_.solve(units);
  for (size_t i = 0; i < at_.size(); ++i) {
    if (at_[i] != kNone) column[i] = solution.middleRows<6>(at_[i]);
  }
  return column;
}

}  // namespace vantage::registration
