#include "core/registration/bound/move_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/registration/align/align.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Samples that say how much holds at a shift: a share of a half is known to 6 %, one sigma. Fewer
// than the least say nothing, and most shifts are told to be none after a quarter of them.
constexpr size_t kHoldSamples = 64;
constexpr size_t kFewestHoldSamples = 8;
constexpr size_t kFirstHoldSamples = 16;
// Of those that notice a shift so many have to be held that a pose is looked at, of near ones,
// which hold by what does not notice them, of all: what OpenRivals() asks, less two sigma, less
// what a shift that is not quite the twin's loses.
constexpr double kWorthALook = 0.30;
constexpr double kNearWorthALook = 0.78;
// After the first samples: less two sigma of them.
constexpr double kFirstLess = 0.2;
// Of a square of shifts, samples of walls: floors notice none. Less two sigma of sixty-four.
constexpr size_t kSquareSamples = 128;
constexpr double kAskedWall = 0.7;  // cosine to the vertical, at most
constexpr double kSquareLess = 0.12;
// Samples of level surface that a rise is asked of.
constexpr size_t kLevelSamples = 64;
// Moves that are looked at closely, those where most may hold: where a site repeats itself in more
// places than that, it does in these.
constexpr size_t kLookedAt = 600;
// Twins are refined from the best shift among neighbours; as many as an alignment compares
// (kFineMinima), and some for those that end in the same one or where the scan is.
constexpr size_t kRefined = 8;
constexpr double kSamePlaceOfMoves = 0.3;  // m, as in lattices (kNotTheSame)
// Between turns that are tried: half of it moves a wall five metres off by its samples' reach.
constexpr double kTurnStep = sensor::Radians(3);
constexpr double kSameTurnOfMoves = sensor::Radians(12);
// Whether a square of `side` shifts from (x, y), in steps, comes as near as that.
bool ComesWithin(double reach, double step, int x, int y, int side) {
  const Eigen::Vector2d nearest(std::clamp(0, x, x + side - 1), std::clamp(0, y, y + side - 1));
  return step * nearest.norm() <= reach;
}

// Calls leaf(x, y) for the shifts within `reach` in squares that may(level, x, y) allows, in steps.
template <typename May, typename Leaf>
void Descend(double reach, double step, const May& may, const Leaf& leaf, int level, int x, int y) {
  const int side = CoarseSurface::Side(level);
  if (!ComesWithin(reach, step, x, y, side) || !may(level, x, y)) return;
  if (level == 0) {
    leaf(x, y);
    return;
  }
  const int part = CoarseSurface::Side(level - 1);
  for (int j = 0; j < side; j += part) {
    for (int i = 0; i < side; i += part) {
      Descend(reach, step, may, leaf, level - 1, x + i, y + j);
    }
  }
}

template <typename May, typename Leaf>
void ForEachShift(double reach, double step, const May& may, const Leaf& leaf) {
  constexpr int kTop = CoarseSurface::kLevels - 1;
  constexpr int kSide = CoarseSurface::Side(kTop);
  const int steps = static_cast<int>(reach / step);
  for (int y = -steps; y <= steps; y += kSide) {
    for (int x = -steps; x <= steps; x += kSide) Descend(reach, step, may, leaf, kTop, x, y);
  }
}

// The best first; of those that fit alike the order in which a lattice is read.
void SortMoves(std::vector<ScanMove>& moves) {
  std::stable_sort(moves.begin(), moves.end(), [](const ScanMove& a, const ScanMove& b) {
    if (a.fits != b.fits) return a.fits > b.fits;
    if (a.turn != b.turn) return a.turn < b.turn;
    if (a.by.z() != b.by.z()) return a.by.z() < b.by.z();
    return a.by.y() != b.by.y() ? a.by.y() < b.by.y() : a.by.x() < b.by.x();
  });
}

// Those where most may hold.
void KeepMost(std::vector<ScanMove>& moves) {
  SortMoves(moves);
  if (moves.size() > kLookedAt) moves.resize(kLookedAt);
}

// A few that are not neighbours.
std::vector<ScanMove> BestApart(std::vector<ScanMove> moves) {
  SortMoves(moves);
  std::vector<ScanMove> apart;
  for (const ScanMove& move : moves) {
    if (apart.size() >= kRefined) break;
    const bool same = std::any_of(apart.begin(), apart.end(), [&](const ScanMove& other) {
      return (move.by - other.by).norm() < kSamePlaceOfMoves &&
             std::abs(std::remainder(move.turn - other.turn, 2 * sensor::kPi)) < kSameTurnOfMoves;
    });
    if (!same) apart.push_back(move);
  }
  return apart;
}

}  // namespace

Eigen::Isometry3d Moved(const Eigen::Vector3d& position, const ScanMove& move) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = position + move.by;
  pose.linear() = Eigen::AngleAxisd(move.turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

// The samples that squares of shifts are asked of: of walls, and with a rise of all, since floors
// notice that.
struct MoveSearch::Asked {
  struct Sample {
    Eigen::Vector3d point;                             // m, world, moved
    uint8_t facing = 0;                                // turned
    double moved = 0;                                  // m, along its normal, by rise and turn
    Eigen::Vector2d normal = Eigen::Vector2d::Zero();  // where the scan is
  };
  std::vector<Sample> samples;

  Asked(std::span<const SurfaceSample> of, const Eigen::Vector3d& position, double rise,
        double turn) {
    const Eigen::Vector3d up(0, 0, rise);
    const Eigen::Matrix3d rotation =
        Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    for (const SurfaceSample& s : of) {
      if (samples.size() == kSquareSamples) break;
      const Eigen::Vector3d normal = s.normal.cast<double>();
      if (rise == 0 && std::abs(normal.z()) > kAskedWall) continue;
      const Eigen::Vector3d point = s.point.cast<double>();
      const Eigen::Vector3d moved = rotation * point + up;
      samples.push_back({position + moved, CoarseSurface::Facing(rotation * normal),
                         normal.dot(moved - point), normal.head<2>()});
    }
  }
};

double MoveSearch::MayBeHeld(const Asked& asked, int level, int x, int y) const {
  const double step = coarse_.step();
  const double half = 0.5 * (CoarseSurface::Side(level) - 1) * step;
  const double radius = std::sqrt(2.0) * half;
  const Eigen::Vector2d corner(x * step, y * step);
  const Eigen::Vector2d middle = corner + Eigen::Vector2d(half, half);
  size_t may = 0;
  size_t notice = 0;
  for (const Asked::Sample& s : asked.samples) {
    const double moved = std::abs(s.moved + s.normal.dot(middle));
    const double within = s.normal.norm() * radius;
    if (moved - within >= kApart) ++notice;
    if (moved + within < kApart) continue;
    const Eigen::Vector3d point = s.point + Eigen::Vector3d(corner.x(), corner.y(), 0);
    may += coarse_.MayLieOn(level, point, s.facing) ? 1 : 0;
  }
  return notice < kFewestHoldSamples ? 1 : static_cast<double>(may) / static_cast<double>(notice);
}

double MoveSearch::Held(const ScanMove& move) const {
  const bool near = move.turn == 0 && move.by.norm() < kNearMove;
  const double least = near ? kNearWorthALook : kWorthALook;
  // A near one is not to be held by what pulls it back to where the scan is.
  const double reach = near ? kFineReach : kWidestReach;
  const Eigen::Isometry3d pose = Moved(position_, move);
  size_t asked = 0;
  size_t held = 0;
  const auto share = [&] { return static_cast<double>(held) / static_cast<double>(asked); };
  for (const SurfaceSample& s : samples_) {
    const Eigen::Vector3d normal = s.normal.cast<double>();
    const Eigen::Vector3d from = s.point.cast<double>();
    const Eigen::Vector3d point = pose * from;
    if (!near && std::abs(normal.dot(point - position_ - from)) < kApart) continue;
    ++asked;
    held += search_.FindsAny(point, pose.linear() * normal, reach) ? 1 : 0;
    if (asked == kFirstHoldSamples && share() < least - kFirstLess) return 0;
    if (asked == kHoldSamples) break;
  }
  if (asked < kFewestHoldSamples) return 1;  // nothing speaks against it
  return share() >= least ? share() : 0;
}

std::vector<ScanMove> MoveSearch::HeldOf(std::vector<ScanMove> moves) const {
  KeepMost(moves);
  for (ScanMove& move : moves) move.fits = Held(move);
  std::erase_if(moves, [](const ScanMove& move) { return !(move.fits > 0); });
  return BestApart(std::move(moves));
}

std::vector<ScanMove> MoveSearch::With(double shift, double rise, double turn) const {
  const Asked asked(samples_, position_, rise, turn);
  const double step = coarse_.step();
  const auto near = [&](int level, int x, int y) {
    return turn == 0 && std::abs(rise) < kNearMove &&
           ComesWithin(kNearMove, step, x, y, CoarseSurface::Side(level));
  };
  double share = 1;  // of the shift that was asked last
  const auto may = [&](int level, int x, int y) {
    share = near(level, x, y) ? 1 : MayBeHeld(asked, level, x, y);
    return share >= kWorthALook - kSquareLess;
  };
  std::vector<ScanMove> found;
  ForEachShift(shift, step, may, [&](int x, int y) {
    const bool moved = turn != 0 || rise != 0 || x != 0 || y != 0;
    if (moved) found.push_back({{step * x, step * y, rise}, turn, share});
  });
  return HeldOf(std::move(found));
}

bool MoveSearch::MayRise(double rise) const {
  size_t asked = 0;
  size_t again = 0;
  for (const SurfaceSample& s : samples_) {
    if (std::abs(s.normal.z()) < kLevelSurface) continue;
    const double height = position_.z() + static_cast<double>(s.point.z()) + rise;
    again += coarse_.HasLevel(height, s.normal.z() > 0) ? 1 : 0;
    if (++asked == kLevelSamples) break;
  }
  const auto share = [&] { return static_cast<double>(again) / static_cast<double>(asked); };
  return asked < kFewestHoldSamples || share() >= kWorthALook;
}

std::vector<ScanMove> MoveSearch::Twins(const MoveReach& reach) const {
  std::vector<ScanMove> found = With(reach.shift, 0, 0);
  const auto add = [&](std::vector<ScanMove> of) {
    of = BestApart(std::move(of));
    found.insert(found.end(), of.begin(), of.end());
  };
  std::vector<ScanMove> risen;
  const int rises = static_cast<int>(reach.rise / coarse_.step() + 1e-9);
  for (int k = -rises; k <= rises; ++k) {
    const double rise = k * coarse_.step();
    if (k == 0 || !MayRise(rise)) continue;
    const std::vector<ScanMove> best = With(reach.shift, rise, 0);
    risen.insert(risen.end(), best.begin(), best.end());
  }
  add(std::move(risen));
  if (reach.turn < kLeastTwinTurn) return found;
  std::vector<ScanMove> turned;
  const int first = static_cast<int>(std::ceil(kLeastTwinTurn / kTurnStep));
  const int last = static_cast<int>(std::min(reach.turn, sensor::kPi) / kTurnStep + 1e-9);
  for (int k = first; k <= last; ++k) {
    const double by = k * kTurnStep;
    const bool half_turn = by > sensor::kPi - 0.5 * kTurnStep;
    for (const double side : {1.0, -1.0}) {
      if (half_turn && side < 0) continue;  // the same
      const std::vector<ScanMove> best = With(reach.shift, 0, side * by);
      turned.insert(turned.end(), best.begin(), best.end());
    }
  }
  add(std::move(turned));
  return found;
}

}  // namespace vantage::registration
