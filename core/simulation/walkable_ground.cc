#include "core/simulation/walkable_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/sensor/scanner_model.h"

namespace vantage::simulation {
namespace {

constexpr double kMostRise = 0.21;  // m: the steepest stairs that building codes allow
constexpr double kKnee = 0.45;      // m: two steps ahead, which legs clear
constexpr double kTall = 1.7;       // m, of somebody who carries a tripod
constexpr double kHalfWidth = 0.3;  // m
constexpr double kRelief = 0.05;    // m: thresholds and rugs
constexpr double kSlope = 0.25;     // of the ground below a tripod, which its legs even out
constexpr double kFeet = 0.25;      // m from the middle of a tripod to its feet

}  // namespace

WalkableGround::WalkableGround(const SimulatedScanner& tracer, const Eigen::AlignedBox3d& bounds,
                               const Eigen::Vector3d& start)
    : tracer_(tracer),
      bounds_(bounds),
      columns_(static_cast<int>(bounds.sizes().x() / kSpacing) + 1),
      rows_(static_cast<int>(bounds.sizes().y() / kSpacing) + 1),
      index_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_)) {
  const Eigen::Vector2d from = (start - bounds.min()).head<2>() / kSpacing;
  const std::optional<double> below = GroundBelow(start.head<2>(), start.z());
  if (!below) return;
  for (int dc = 0; dc <= 1; ++dc) {
    for (int dr = 0; dr <= 1; ++dr) {
      Reach(static_cast<int>(std::floor(from.x())) + dc,
            static_cast<int>(std::floor(from.y())) + dr, *below);
    }
  }
  // In the order of discovery, each place is asked for its neighbours once.
  for (size_t i = 0; i < places_.size(); ++i) {
    const Place place = places_[i];
    Reach(place.column - 1, place.row, place.height);
    Reach(place.column + 1, place.row, place.height);
    Reach(place.column, place.row - 1, place.height);
    Reach(place.column, place.row + 1, place.height);
  }
}

std::optional<double> WalkableGround::GroundBelow(const Eigen::Vector2d& at, double from) const {
  const TraceHit hit = tracer_.tracer().Trace(Eigen::Vector3d(at.x(), at.y(), from).cast<float>(),
                                              -Eigen::Vector3f::UnitZ(), 0);
  if (!hit.hit) return std::nullopt;
  return from - hit.distance;
}

bool WalkableGround::HasRoom(const Eigen::Vector2d& at, double ground) const {
  return tracer_.tracer().CylinderFree(at, kHalfWidth, ground + kKnee, ground + kTall);
}

std::optional<size_t> WalkableGround::Lookup(int column, int row, double height) const {
  if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return std::nullopt;
  std::optional<size_t> best;
  for (const size_t i : index_[static_cast<size_t>(row) * static_cast<size_t>(columns_) +
                               static_cast<size_t>(column)]) {
    const double off = std::abs(places_[i].height - height);
    if (off <= kMostRise && (!best || off < std::abs(places_[*best].height - height))) best = i;
  }
  return best;
}

void WalkableGround::Reach(int column, int row, double from) {
  if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return;
  const Eigen::Vector2d at = bounds_.min().head<2>() + kSpacing * Eigen::Vector2d(column, row);
  const std::optional<double> ground = GroundBelow(at, from + kKnee);
  if (!ground || std::abs(*ground - from) > kMostRise) return;
  std::vector<size_t>& here = index_[static_cast<size_t>(row) * static_cast<size_t>(columns_) +
                                     static_cast<size_t>(column)];
  const bool known = std::any_of(here.begin(), here.end(), [&](size_t i) {
    return std::abs(places_[i].height - *ground) < 0.5 * kRelief;
  });
  if (known || !HasRoom(at, *ground)) return;
  here.push_back(places_.size());
  places_.push_back({column, row, *ground});
}

Eigen::Vector3d WalkableGround::At(size_t place) const {
  const Place& p = places_[place];
  return {bounds_.min().x() + kSpacing * p.column, bounds_.min().y() + kSpacing * p.row, p.height};
}

std::vector<size_t> WalkableGround::Around(size_t place) const {
  std::vector<size_t> around;
  const Place& p = places_[place];
  for (int dr = -1; dr <= 1; ++dr) {
    for (int dc = -1; dc <= 1; ++dc) {
      if (dc == 0 && dr == 0) continue;
      const std::optional<size_t> next = Lookup(p.column + dc, p.row + dr, p.height);
      if (next) around.push_back(*next);
    }
  }
  return around;
}

std::vector<Eigen::Vector3d> WalkableGround::Stations(double height, double clearance,
                                                      double spacing) const {
  const auto stands = [&](const Eigen::Vector2d& at, double ground) {
    if (!tracer_.tracer().CylinderFree(at, clearance, ground + kRelief + kSlope * clearance,
                                       ground + height)) {
      return false;
    }
    for (int k = 0; k < 8; ++k) {
      const double bearing = k * sensor::kPi / 4;
      const Eigen::Vector2d foot =
          at + kFeet * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
      const std::optional<double> below = GroundBelow(foot, ground + kKnee);
      if (!below || std::abs(*below - ground) > kRelief + kSlope * kFeet) return false;
    }
    return true;
  };
  std::vector<Eigen::Vector3d> stations;
  const int columns = static_cast<int>(bounds_.sizes().x() / spacing) + 1;
  const int rows = static_cast<int>(bounds_.sizes().y() / spacing) + 1;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d at = bounds_.min().head<2>() + spacing * Eigen::Vector2d(column, row);
      const Eigen::Vector2d cell = (at - bounds_.min().head<2>()) / kSpacing;
      std::vector<double> levels;
      for (int dr = 0; dr <= 1; ++dr) {
        for (int dc = 0; dc <= 1; ++dc) {
          const int c = static_cast<int>(std::floor(cell.x())) + dc;
          const int r = static_cast<int>(std::floor(cell.y())) + dr;
          if (c >= columns_ || r >= rows_) continue;
          for (const size_t i : index_[static_cast<size_t>(r) * static_cast<size_t>(columns_) +
                                       static_cast<size_t>(c)]) {
            const std::optional<double> ground = GroundBelow(at, places_[i].height + kKnee);
            if (ground && std::abs(*ground - places_[i].height) <= kMostRise) {
              levels.push_back(*ground);
            }
          }
        }
      }
      std::sort(levels.begin(), levels.end());
      double last = -std::numeric_limits<double>::infinity();
      for (const double ground : levels) {
        if (ground - last < kMostRise) continue;
        last = ground;
        if (stands(at, ground)) stations.emplace_back(at.x(), at.y(), ground + height);
      }
    }
  }
  return stations;
}

}  // namespace vantage::simulation
