#include "core/planning/expectation/flights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>

#include "core/planning/feasibility/floor_pieces.h"

namespace vantage::planning {
namespace {

// Floor this near to a storey's, m, is of that storey: thresholds, the first steps of its stairs,
// sunken rooms (Storeys).
constexpr double kBelongsToStorey = 0.6;
constexpr double kLeastRise = 0.9;        // m from the storey: platforms and stages are lower
constexpr double kLeastArea = 0.3;        // m2 of floor: a step and a half of a narrow stair
constexpr double kLastStep = 0.1;         // m, by which the last step's floor differs
constexpr double kStoodThere = 1.2;       // m from the end: a landing's length
constexpr double kUsualHeight = 2.8;      // m from floor to floor, of houses; offices have up to 4
constexpr double kStoreyKnownNear = 1.0;  // m: a storey that is known there is the one it leads to
constexpr uint32_t kColumnsOfFlightsBetweenLooks = 8192;

std::optional<size_t> StoreyOf(const Storeys& storeys, double z) {
  for (size_t i = 0; i < storeys.count(); ++i) {
    const std::optional<double> height = storeys.Height(i);
    if (height.has_value() && std::abs(z - *height) <= kBelongsToStorey) return i;
  }
  return std::nullopt;
}

double HeightOfStoreys(const Storeys& storeys) {
  if (storeys.count() < 2) return kUsualHeight;
  const auto apart = static_cast<double>(storeys.count() - 1);
  return (*storeys.Height(storeys.count() - 1) - *storeys.Height(0)) / apart;
}

// The height of the storey that is known there, m.
std::optional<double> KnownAt(const Storeys& storeys, double z) {
  for (size_t i = 0; i < storeys.count(); ++i) {
    if (std::abs(z - *storeys.Height(i)) <= kStoreyKnownNear) return storeys.Height(i);
  }
  return std::nullopt;
}

// Floor between storeys that hangs together.
struct Piece {
  std::vector<Eigen::Vector3d> floors;  // m, middles of columns
  std::set<size_t> storeys;             // that it is joined to
};

class Pieces {
 public:
  Pieces(const FloorMap& floor, double voxel)
      : floor_(floor), voxel_(voxel), seen_(floor.columns().floors().size(), 0) {}

  bool Seen(const Floor& here) const { return seen_[Index(here)] != 0; }
  Piece From(const Eigen::Vector2i& column, const Floor& first) {
    struct Place {
      Eigen::Vector2i at;
      const Floor* here;
    };
    static const std::array<Eigen::Vector2i, 4> kBesideStep = {
        Eigen::Vector2i(-1, 0), Eigen::Vector2i(1, 0), Eigen::Vector2i(0, -1),
        Eigen::Vector2i(0, 1)};
    Piece piece;
    std::vector<Place> front = {{column, &first}};
    seen_[Index(first)] = 1;
    for (size_t head = 0; head < front.size(); ++head) {
      const Place place = front[head];
      piece.floors.emplace_back((place.at.x() + 0.5) * voxel_, (place.at.y() + 0.5) * voxel_,
                                static_cast<double>(place.here->height));
      for (const Eigen::Vector2i& side : kBesideStep) {
        const Eigen::Vector2i to = place.at + side;
        if (!floor_.columns().Inside(to.x(), to.y())) continue;
        for (const Floor& there : floor_.columns().At(to.x(), to.y())) {
          if (static_cast<double>(std::abs(there.height - place.here->height)) > kMaxStep) continue;
          if (const auto storey = StoreyOf(floor_.storeys(), static_cast<double>(there.height))) {
            piece.storeys.insert(*storey);
          } else if (seen_[Index(there)] == 0) {
            seen_[Index(there)] = 1;
            front.push_back({to, &there});
          }
        }
      }
    }
    return piece;
  }

 private:
  size_t Index(const Floor& here) const {
    return static_cast<size_t>(&here - floor_.columns().floors().data());
  }

  const FloorMap& floor_;
  const double voxel_;
  std::vector<uint8_t> seen_;
};

std::optional<Flight> Lead(const Piece& piece, const Storeys& storeys, double voxel,
                           const std::vector<model::Station>& stations) {
  if (piece.storeys.size() != 1) return std::nullopt;
  if (static_cast<double>(piece.floors.size()) * voxel * voxel < kLeastArea) return std::nullopt;
  Flight flight;
  flight.storey_floor = *storeys.Height(*piece.storeys.begin());
  const auto away = [&](const Eigen::Vector3d& p) { return std::abs(p.z() - flight.storey_floor); };
  const Eigen::Vector3d farthest =
      *std::max_element(piece.floors.begin(), piece.floors.end(),
                        [&](const auto& a, const auto& b) { return away(a) < away(b); });
  if (away(farthest) < kLeastRise) return std::nullopt;
  const double apart = HeightOfStoreys(storeys);
  flight.other_floor = flight.storey_floor + (farthest.z() > flight.storey_floor ? apart : -apart);
  if (const auto known = KnownAt(storeys, flight.other_floor)) flight.other_floor = *known;
  if (away(farthest) > std::abs(flight.other_floor - flight.storey_floor)) return std::nullopt;
  size_t count = 0;
  for (const Eigen::Vector3d& p : piece.floors) {
    if (std::abs(p.z() - farthest.z()) > kLastStep) continue;
    flight.end += p;
    ++count;
  }
  flight.end /= static_cast<double>(count);
  for (const model::Station& station : stations) {
    const Eigen::Vector3d foot(station.position.x(), station.position.y(), station.floor_height);
    if ((foot - flight.end).norm() <= kStoodThere) return std::nullopt;
    if (std::abs(foot.z() - flight.other_floor) <= kBelongsToStorey) return std::nullopt;
  }
  return flight;
}

}  // namespace

std::optional<std::vector<Flight>> FindFlights(const model::PlanningView& model,
                                               const FloorMap& floor,
                                               const parallel::Cancellation& cancelled) {
  std::vector<Flight> flights;
  if (!floor.found() || floor.columns().floors().front().source == FloorSource::kGiven ||
      !floor.storeys().Height(0).has_value()) {
    return flights;
  }
  Pieces pieces(floor, model.voxel_size());
  for (uint32_t column = 0; column < floor.columns().columns(); ++column) {
    if (column % kColumnsOfFlightsBetweenLooks == 0 && cancelled.Requested()) return std::nullopt;
    for (const Floor& here : floor.columns().In(column)) {
      if (pieces.Seen(here)) continue;
      if (StoreyOf(floor.storeys(), static_cast<double>(here.height)).has_value()) continue;
      const Piece piece = pieces.From(floor.columns().Voxel(column), here);
      const auto flight = Lead(piece, floor.storeys(), model.voxel_size(), model.stations());
      if (flight.has_value()) flights.push_back(*flight);
    }
  }
  return flights;
}

}  // namespace vantage::planning
