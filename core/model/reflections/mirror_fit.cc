#include "core/model/reflections/mirror_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

namespace vantage::model {
namespace {

// The mean of the places where rays to points behind a plane cross it.
std::optional<Eigen::Vector3d> MeanCrossing(const ReflectingPlane& plane,
                                            const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  size_t behind = 0;
  for (const Eigen::Vector3d& point : points) {
    if (plane.Above(point) >= 0) continue;
    sum += plane.Crossing(point);
    ++behind;
  }
  if (behind == 0) return std::nullopt;
  return sum / static_cast<double>(behind);
}

// One step of least squares (Gauss and Newton) towards the plane that reflects points onto the
// surfaces which a scan measured: of all that come back to within `within` (m), the distances
// from the tangent planes of what they come back to.
ReflectingPlane Fitted(const ReturnTest& own, const ReflectingPlane& plane,
                       const std::vector<Eigen::Vector3d>& behind, double within) {
  // What a plane is off by before the step, one sigma: directions that no point tells stay.
  constexpr double kTurn = sensor::Radians(0.5);
  constexpr double kShift = 0.02;  // m
  const Eigen::Vector3d across = plane.normal.unitOrthogonal();
  const Eigen::Vector3d up = plane.normal.cross(across);
  const std::optional<Eigen::Vector3d> through = MeanCrossing(plane, behind);
  if (!through) return plane;
  const double weight = 1 / (within * within);
  Eigen::Matrix3d information =
      Eigen::Vector3d(1 / (kTurn * kTurn), 1 / (kTurn * kTurn), 1 / (kShift * kShift)).asDiagonal();
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : behind) {
    const double above = plane.Above(point);
    if (above >= 0) continue;
    const Eigen::Vector3d back = plane.Reflected(point);
    const auto measured = own.MeasuredTowards(back);
    if (!measured) continue;
    const Eigen::Vector3d& facing = measured->normal;
    const double off = facing.dot(back - measured->point);
    if (std::abs(off) > within) continue;
    // The plane turns about where the returns came through, and its normal by a small vector.
    const auto by_turn = [&](const Eigen::Vector3d& change) {
      return -2 *
             (change.dot(point - *through) * facing.dot(plane.normal) + above * facing.dot(change));
    };
    const Eigen::Vector3d row(by_turn(across), by_turn(up), -2 * facing.dot(plane.normal));
    information += weight * row * row.transpose();
    towards -= weight * off * row;
  }
  const Eigen::Vector3d step = information.ldlt().solve(towards);
  if (!step.allFinite()) return plane;
  const Eigen::Vector3d normal = (plane.normal + step[0] * across + step[1] * up).normalized();
  return {normal, -normal.dot(*through) + step[2], plane.behind};
}

}  // namespace

int StrideOf(const RangeSurface& surface, double cells) {
  const double all = static_cast<double>(surface.columns()) * surface.rows();
  return std::max(1, static_cast<int>(std::sqrt(all / cells)));
}

size_t ComeBack(std::span<const MirrorWitness> witnesses, const ReflectingPlane& plane,
                const std::vector<Eigen::Vector3d>& behind, double within) {
  return static_cast<size_t>(
      std::count_if(behind.begin(), behind.end(), [&](const Eigen::Vector3d& point) {
        const Eigen::Vector3d back = plane.Reflected(point);
        return std::any_of(witnesses.begin(), witnesses.end(), [&](const MirrorWitness& witness) {
          return witness.measured->Compare(witness.T_witness_scan * back, within) == Back::kAgrees;
        });
      }));
}

ReflectingPlane Straighten(std::span<const MirrorWitness> witnesses, const ReflectingPlane& plane,
                           const std::vector<Eigen::Vector3d>& behind) {
  constexpr int kMostTurn = 8;  // of kTurn, to either side: two degrees; mirrors lean by one
  // rad: half of it at seven metres behind a mirror, twice, is three centimetres, as
  // ReturnTest::Closely at a noise of up to 1 cm.
  constexpr double kTurn = sensor::Radians(0.25);
  constexpr int kMostShift = 3;  // cm: what the search before it, by centimetres, may be wrong
  // By the noisiest of them: it says most of the returns that do not come back.
  double roughly = 0;
  double closely = 0;
  for (const MirrorWitness& witness : witnesses) {
    roughly = std::max(roughly, witness.measured->Agreement());
    closely = std::max(closely, witness.measured->Closely());
  }
  ReflectingPlane best = plane;
  for (const double within : {roughly, closely, closely}) {
    size_t most = ComeBack(witnesses, best, behind, within);
    const auto try_out = [&](const ReflectingPlane& other) {
      const size_t agree = ComeBack(witnesses, other, behind, within);
      if (agree <= most) return;
      most = agree;
      best = other;
    };
    for (const bool lean : {false, true}) {
      const ReflectingPlane from = best;
      const std::optional<Eigen::Vector3d> through = MeanCrossing(from, behind);
      if (!through) return best;
      const Eigen::Vector3d axis = lean ? from.normal.cross(Eigen::Vector3d::UnitZ()).normalized()
                                        : Eigen::Vector3d::UnitZ();
      for (int turn = -kMostTurn; turn <= kMostTurn; ++turn) {
        const Eigen::Vector3d normal = Eigen::AngleAxisd(turn * kTurn, axis) * from.normal;
        try_out({normal, -normal.dot(*through), from.behind});
      }
    }
    const ReflectingPlane from = best;
    for (int shift = -kMostShift; shift <= kMostShift; ++shift) {
      try_out({from.normal, from.distance + 0.01 * shift, from.behind});
    }
  }
  return best;
}

ReflectingPlane Fit(const ReturnTest& own, const ReflectingPlane& plane,
                    const std::vector<Eigen::Vector3d>& behind) {
  ReflectingPlane fitted = plane;
  for (const double within : {own.Agreement(), own.Closely(), own.Closely(), own.Closely()}) {
    fitted = Fitted(own, fitted, behind, within);
  }
  return fitted;
}

void StartPastItsWall(const std::vector<ScanPlane>& planes,
                      const std::vector<Eigen::Vector3d>& points, ReflectingPlane& mirror) {
  constexpr double kParallel = 0.995;  // cosine, 6 degrees: mirrors are sought up to two askew
  const std::optional<Eigen::Vector3d> through = MeanCrossing(mirror, points);
  if (!through) return;
  const double past = mirror.behind;
  for (const ScanPlane& wall : planes) {
    if (wall.normal.dot(mirror.normal) < kParallel) continue;
    const double before = wall.Above(*through);
    if (before < ReflectingPlane::kProud) mirror.behind = std::max(mirror.behind, past + before);
  }
}

Aperture ApertureOf(const RangeSurface& surface, const ReflectingPlane& plane,
                    const std::vector<ScanCell>& cells) {
  std::vector<Eigen::Vector3d> crossings;
  crossings.reserve(cells.size());
  for (const ScanCell& cell : cells) {
    crossings.push_back(plane.Crossing(surface.Direction(cell.column, cell.row)));
  }
  return {plane.normal, plane.distance, crossings};
}

}  // namespace vantage::model
