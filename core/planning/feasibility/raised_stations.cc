#include "core/planning/feasibility/raised_stations.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/planning/feasibility/floor_pieces.h"

namespace vantage::planning {

int LayerOf(float height, double voxel) {
  return static_cast<int>(std::floor(static_cast<double>(height) / voxel));
}

bool OpenBelow(const model::PlanningView& model, const Eigen::Vector2i& at, float height) {
  const int layer =
      LayerOf(height - 0.1f * static_cast<float>(model.voxel_size()), model.voxel_size());
  return model.Empty({at.x(), at.y(), layer - 1}) || model.Empty({at.x(), at.y(), layer - 2});
}

RaisedStations::RaisedStations(const model::PlanningView& model, const FloorColumns& floor)
    : voxel_(model.voxel_size()) {
  for (const model::Station& station : model.stations()) {
    const Eigen::Vector2i at = model.At(station.position).head<2>();
    const double highest = station.position.z() - station.clearance;
    std::optional<double> under;  // the highest floor that was measured below the scanner
    for (int y = at.y() - 1; y <= at.y() + 1; ++y) {
      for (int x = at.x() - 1; x <= at.x() + 1; ++x) {
        for (const Floor& here : floor.At(x, y)) {
          const auto height = static_cast<double>(here.height);
          if (here.source != FloorSource::kMeasured || height > highest) continue;
          under = std::max(under.value_or(height), height);
        }
      }
    }
    if (station.floor_found && under.has_value() && *under > station.floor_height + kRoughness) {
      raised_.push_back({station, *under});
    }
  }
}

bool RaisedStations::Has(const model::Station& station) const {
  return std::any_of(raised_.begin(), raised_.end(), [&](const Raised& raised) {
    return raised.station.position == station.position;
  });
}

bool RaisedStations::Assumed(const Eigen::Vector2i& at, float height) const {
  return std::any_of(raised_.begin(), raised_.end(), [&](const Raised& raised) {
    const Eigen::Vector2d centre = (at.cast<double>().array() + 0.5) * voxel_;
    const double away = (raised.station.position.head<2>() - centre).norm();
    const auto z = static_cast<double>(height);
    return away <= raised.station.clearance + 1.5 * voxel_ &&
           z > raised.station.floor_height + kRoughness &&
           z <= raised.floor + kMaxStep + kSteepestStairs * away;
  });
}

}  // namespace vantage::planning
