#include "core/registration/graph/lone_holds.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/sensor/pose_prior.h"

namespace vantage::registration {
namespace {

// What no constraint holds by more than this share is left open by all of them: noise of normals
// feigns as much (0.1 rad, squared), which OverlapGeometry sees.
constexpr double kHolds = 0.01;
// Of the constraint that holds a direction most: those that hold a twentieth of it hold it, too.
constexpr double kHoldsToo = 0.05;

// How each constraint moves with the pose, turns about the middle of all in units of what moves it
// as far as a slide does.
std::vector<sensor::Vector6d> RowsOf(std::span<const Constraint> constraints) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Constraint& c : constraints) middle += c.position;
  const double count = std::max(1.0, static_cast<double>(constraints.size()));
  middle /= count;
  double squared = 0;
  for (const Constraint& c : constraints) squared += (c.position - middle).squaredNorm();
  const double radius = std::sqrt(squared / count);
  std::vector<sensor::Vector6d> rows(constraints.size(), sensor::Vector6d::Zero());
  if (radius <= 0) return rows;
  for (size_t i = 0; i < rows.size(); ++i) {
    const Constraint& c = constraints[i];
    rows[i] << (c.position - middle).cross(c.normal) / radius, c.normal;
  }
  return rows;
}

}  // namespace

size_t ReleaseLoneHolds(std::span<Constraint> constraints, double fewest) {
  const std::vector<sensor::Vector6d> rows = RowsOf(constraints);
  std::vector<double> holds(rows.size());
  size_t released = 0;
  // What is released leaves other directions than before: each time from the beginning.
  for (bool found = true; found;) {
    found = false;
    sensor::Matrix6d h = sensor::Matrix6d::Zero();
    for (size_t i = 0; i < rows.size(); ++i) {
      if (constraints[i].weight > 0) h.selfadjointView<Eigen::Lower>().rankUpdate(rows[i]);
    }
    const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> eigen(h);
    for (int k = 0; k < 6 && !found; ++k) {
      double most = 0;
      double sum = 0;
      double squares = 0;
      for (size_t i = 0; i < rows.size(); ++i) {
        const double along = rows[i].dot(eigen.eigenvectors().col(k));
        holds[i] = constraints[i].weight > 0 ? along * along : 0;
        most = std::max(most, holds[i]);
        sum += holds[i];
        squares += holds[i] * holds[i];
      }
      // Alike ones count as many as they are, those that hold less in proportion.
      if (most < kHolds || sum * sum >= fewest * squares) continue;
      for (size_t i = 0; i < rows.size(); ++i) {
        if (holds[i] <= kHoldsToo * most) continue;
        constraints[i].weight = 0;
        ++released;
        found = true;
      }
    }
  }
  return released;
}

}  // namespace vantage::registration
