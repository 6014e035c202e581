#include "core/planning/feasibility/hidden_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/planning/feasibility/floor_pieces.h"
#include "core/planning/feasibility/raised_stations.h"

namespace vantage::planning {
namespace {

// Stairs go on by as many steps beyond the two ends of what is hidden: one is also that to the next
// of two terraces.
constexpr int kStepsBeyond = 2;
constexpr double kGoing = 0.45;  // m that a tread is deep at most, with what hides its edge

const std::array<Eigen::Vector2i, 8> kDirections = {
    Eigen::Vector2i(1, 0), Eigen::Vector2i(-1, 0), Eigen::Vector2i(0, 1),  Eigen::Vector2i(0, -1),
    Eigen::Vector2i(1, 1), Eigen::Vector2i(-1, 1), Eigen::Vector2i(1, -1), Eigen::Vector2i(-1, -1)};

class Search {
 public:
  Search(const model::PlanningView& model, const FloorColumns& floor)
      : model_(model), floor_(floor), raised_(model, floor), voxel_(model.voxel_size()) {}

  void Around(const model::Station& station) {
    const int reach = static_cast<int>(std::ceil(kBlindCone * kHighestTripod / voxel_));
    const Eigen::Vector2i at = model_.At(station.position).head<2>();
    for (int y = at.y() - reach; y <= at.y() + reach; ++y) {
      for (int x = at.x() - reach; x <= at.x() + reach; ++x) {
        for (const Floor& upper : floor_.At(x, y)) {
          const double over = station.position.z() - static_cast<double>(upper.height);
          if (over <= 0 || over > kHighestTripod) continue;
          for (const Eigen::Vector2i& step : kDirections) {
            Cross(station, {x, y}, upper.height, step);
          }
        }
      }
    }
  }

  std::vector<PlacedFloor> Take() {
    std::vector<PlacedFloor> steps = MeanOfLines(std::move(found_), kMaxStep);
    std::erase_if(steps, [&](const PlacedFloor& step) {
      const Eigen::Vector2i at = floor_.Voxel(step.column);
      return floor_.Near(at.x(), at.y(), step.floor.height, kMaxStep) != nullptr;
    });
    return steps;
  }

 private:
  // Down a line from the edge of what is known, to where floor is known again.
  void Cross(const model::Station& station, const Eigen::Vector2i& from, float upper,
             const Eigen::Vector2i& step) {
    const double length = step.cast<double>().norm() * voxel_;
    std::optional<float> lower;
    int count = 0;  // columns in between
    for (;; ++count) {
      const Eigen::Vector2i at = from + (count + 1) * step;
      const double across = (count + 1) * length;
      // What is below lies where stairs could lead, or the line goes on to nothing.
      lower = HighestBetween(at, upper - Fall(across), upper + static_cast<float>(kMaxStep));
      if (lower.has_value()) break;
      const double cone =
          kBlindCone * (station.position.z() - static_cast<double>(upper - Fall(across)));
      if (!floor_.Inside(at.x(), at.y()) || Away(station, at) > cone) return;
    }
    if (count == 0 || static_cast<double>(upper - *lower) <= kMaxStep) return;
    const int beyond = StepsBeyond(from + (count + 1) * step, *lower, step, -1) +
                       StepsBeyond(from, upper, -step, 1);
    if (beyond < kStepsBeyond) return;  // an edge with ground below it, and no stairs
    // From the edge of one step to somewhere on another: between, steps lie up to their rise below
    // the line.
    const auto height = [&](int k) {
      const float line =
          upper + static_cast<float>(k) / static_cast<float>(count + 1) * (*lower - upper);
      return std::max(*lower, line - static_cast<float>(kMaxStep / 2));
    };
    for (int k = 1; k <= count; ++k) {
      const Eigen::Vector2i at = from + k * step;
      const float lowest = height(k) - static_cast<float>(kMaxStep / 2);
      if (OpenBelow(model_, at, lowest) && !raised_.Assumed(at, lowest)) return;
    }
    for (int k = 1; k <= count; ++k) {
      const Eigen::Vector2i at = from + k * step;
      found_.push_back({floor_.ColumnOf(at.x(), at.y()), {height(k), FloorSource::kHidden}});
    }
  }

  // m that stairs fall at most across so many, from the edge of one step onto another.
  static float Fall(double across) {
    return static_cast<float>(kMaxStep + kSteepestStairs * across);
  }
  double Away(const model::Station& station, const Eigen::Vector2i& at) const {
    const Eigen::Vector2d centre = (at.cast<double>().array() + 0.5) * voxel_;
    return (station.position.head<2>() - centre).norm();
  }
  std::optional<float> HighestBetween(const Eigen::Vector2i& at, float low, float high) const {
    std::optional<float> highest;
    for (const Floor& here : floor_.At(at.x(), at.y())) {
      if (here.height >= low && here.height <= high) highest = here.height;
    }
    return highest;
  }
  // How many steps the floor along the line rises (`up` 1) or falls (-1), one after the other, each
  // within a tread.
  int StepsBeyond(Eigen::Vector2i at, float height, const Eigen::Vector2i& step, int up) const {
    const int most = static_cast<int>(kGoing / (step.cast<double>().norm() * voxel_));
    for (int steps = 0;; ++steps) {
      if (steps == kStepsBeyond) return steps;
      std::optional<float> next;
      for (int k = 1; k <= most && !next.has_value(); ++k) {
        at += step;
        for (const Floor& here : floor_.At(at.x(), at.y())) {
          const double over = up * static_cast<double>(here.height - height);
          if (over > kRoughness && over <= kMaxStep + kRoughness) next = here.height;
        }
      }
      if (!next.has_value()) return steps;
      height = *next;
    }
  }

  const model::PlanningView& model_;
  const FloorColumns& floor_;
  const RaisedStations raised_;
  const double voxel_;
  std::vector<PlacedFloor> found_;
};

}  // namespace

std::optional<std::vector<PlacedFloor>> HiddenSteps(const model::PlanningView& model,
                                                    const FloorColumns& floor,
                                                    const parallel::Cancellation& cancelled) {
  Search search(model, floor);
  for (const model::Station& station : model.stations()) {
    if (cancelled.Requested()) return std::nullopt;
    search.Around(station);
  }
  return search.Take();
}

}  // namespace vantage::planning
