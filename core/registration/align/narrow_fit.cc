#include "core/registration/align/narrow_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/registration/align/align_stages.h"
#include "core/registration/align/pose_step.h"

namespace vantage::registration {
namespace {

using sensor::Matrix6d;
using sensor::Vector6d;

// Scales that a start moves a sample by, rms. Places that hold themselves are some scales apart:
// within one a step leads from one to the other, and correspondences change beyond a voxel.
constexpr double kStarts[] = {-6, -3, 3, 6};
// Steps of a start: they end sooner where one changes nothing.
constexpr int kSteps = 8;
// Share of what fits: two scores of 4000 samples differ by 1 % by chance.
constexpr double kBetter = 0.01;
// Of the strongest direction's information: what has less is left alone, since nothing but noise
// holds it.
constexpr double kHeld = 1e-6;

struct Row {
  Vector6d moves;  // residual by change of the pose, its turn in units of 1 / reach
  double residual = 0;
  double scale = 0;    // m, of its weight
  double certain = 0;  // 1 / variance
};

double ScoreOf(const std::vector<Row>& rows, const Vector6d& change) {
  double score = 0;
  for (const Row& row : rows) score += Tukey(row.residual + row.moves.dot(change), row.scale);
  return score;
}

Vector6d Settle(const std::vector<Row>& rows, Vector6d change, double still) {
  for (int step = 0; step < kSteps; ++step) {
    Matrix6d h = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    for (const Row& row : rows) {
      const double residual = row.residual + row.moves.dot(change);
      const double w = Tukey(residual, row.scale) * row.certain;
      if (w <= 0) continue;
      h.selfadjointView<Eigen::Lower>().rankUpdate(row.moves, w);
      b += (w * residual) * row.moves;
    }
    h = Matrix6d(h.selfadjointView<Eigen::Lower>());
    h.diagonal().array() += std::max(1e-12, kHeld * h.diagonal().maxCoeff());
    const Vector6d move = h.ldlt().solve(b);
    change -= move;
    if (move.norm() < still) break;
  }
  return change;
}

}  // namespace

NarrowFit FindNarrowFit(std::span<const Correspondence> correspondences, double scale) {
  NarrowFit fit;
  if (correspondences.size() < 6) return fit;
  for (const Correspondence& c : correspondences) fit.about += c.point;
  fit.about /= static_cast<double>(correspondences.size());
  double reach = 0;  // m, rms
  for (const Correspondence& c : correspondences) reach += (c.point - fit.about).squaredNorm();
  reach = std::sqrt(reach / static_cast<double>(correspondences.size()));
  if (!(reach > 0)) return fit;

  std::vector<Row> rows;
  rows.reserve(correspondences.size());
  Matrix6d information = Matrix6d::Zero();
  for (const Correspondence& c : correspondences) {
    Row row;
    row.moves << (c.point - fit.about).cross(c.normal) / reach, c.normal;
    row.residual = c.residual;
    row.scale = std::max(scale, kTukeySigmas * std::sqrt(c.variance));
    row.certain = 1 / c.variance;
    information += row.moves * row.moves.transpose();
    rows.push_back(row);
  }
  information /= static_cast<double>(rows.size());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> directions(information);
  const double least = kHeld * directions.eigenvalues()[5];
  double best = (1 + kBetter) * ScoreOf(rows, fit.change);
  for (int k = 0; k < 6; ++k) {
    const double held = directions.eigenvalues()[k];
    if (held <= least) continue;
    for (const double times : kStarts) {
      const Vector6d start = times * scale / std::sqrt(held) * directions.eigenvectors().col(k);
      const Vector6d change = Settle(rows, start, 0.01 * scale);
      const double score = ScoreOf(rows, change);
      if (score <= best) continue;
      best = score;
      fit.change = change;
      fit.better = true;
    }
  }
  fit.change.head<3>() /= reach;
  return fit;
}

}  // namespace vantage::registration
