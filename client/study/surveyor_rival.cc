#include "client/study/surveyor_rival.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "core/planning/expectation/expectation.h"

namespace vantage::study {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTripod = 1.5;       // m over the floor, as near as one may
constexpr double kSameFloor = 0.5;    // m: floors that differ by less are one
constexpr double kStep = 0.25;        // m that the floors of neighbouring spots differ by at most
constexpr double kInDoorway = 0.3;    // m on either side of its middle that belong to a doorway
constexpr double kNearDoorway = 0.7;  // m from its middle: a scan from there is one in the doorway
constexpr double kLeastRoom = 0.25;   // m^2 of spots
constexpr double kWorthAScan = 1.0;   // m from the other scans of a room
constexpr int kMostInARoom = 20;      // scans

// Half the width of a tripod is on either side of the jambs' line, too.
bool LiesIn(const planning::Opening& doorway, const Vector3d& floor) {
  if (std::abs(floor.z() - doorway.centre.z()) > kSameFloor) return false;
  const Vector2d off = (floor - doorway.centre).head<2>();
  const Vector2d direction = doorway.direction.head<2>();
  return std::abs(off.dot(direction)) <= kInDoorway &&
         std::abs(off.x() * direction.y() - off.y() * direction.x()) <=
             doorway.width / 2 + kInDoorway;
}

Vector3d FloorOf(const Spot& spot) { return {spot.at.x(), spot.at.y(), spot.floor}; }

double Apart(const Vector3d& a, const Vector3d& b) { return (a - b).head<2>().norm(); }

// Distance to the nearest of `places`; infinity for none.
double FromAll(const Vector3d& at, const std::vector<Vector3d>& places) {
  double least = std::numeric_limits<double>::infinity();
  for (const Vector3d& place : places) least = std::min(least, Apart(at, place));
  return least;
}

std::vector<Spot> SpotsOf(const planning::FeasibleViews& feasible) {
  std::vector<Spot> spots;
  std::map<std::tuple<int, int, long>, size_t> by_column;  // x, y, floor in steps of kSameFloor
  for (size_t i = 0; i < feasible.cells().size(); ++i) {
    const planning::FeasibleViews::CellIndex& cell = feasible.cells()[i];
    const Vector3d at = feasible.Centre(i);
    const double height = feasible.HeightOverFloor(at);
    if (std::isnan(height)) continue;
    const double floor = at.z() - height;
    const auto [known, is_new] = by_column.emplace(
        std::tuple(cell.x(), cell.y(), std::lround(floor / kSameFloor)), spots.size());
    if (is_new) {
      spots.push_back({at, cell.head<2>(), floor});
      continue;
    }
    Spot& spot = spots[known->second];
    const auto off = [](double z, double over) { return std::abs(z - over - kTripod); };
    if (off(at.z(), floor) < off(spot.at.z(), spot.floor)) spot = {at, cell.head<2>(), floor};
  }
  return spots;
}

// The spot nearest to a place, out of `among`.
size_t NearestTo(const Vector2d& place, const std::vector<Spot>& spots,
                 const std::vector<size_t>& among) {
  return *std::min_element(among.begin(), among.end(), [&](size_t a, size_t b) {
    return (spots[a].at.head<2>() - place).squaredNorm() <
           (spots[b].at.head<2>() - place).squaredNorm();
  });
}

// Where to scan next in a room that was scanned from `stations`; nothing where no place is worth
// it.
std::optional<size_t> NextIn(const std::vector<size_t>& room, const std::vector<Spot>& spots,
                             const std::vector<Vector3d>& stations, const Vector3d& from) {
  Eigen::AlignedBox2d box;
  for (const size_t i : room) box.extend(Vector2d(spots[i].at.head<2>()));
  const int axis = box.sizes().x() >= box.sizes().y() ? 0 : 1;
  std::vector<size_t> halves;
  for (const double share : {0.25, 0.75}) {
    Vector2d middle = box.center();
    middle[axis] = box.min()[axis] + share * box.sizes()[axis];
    halves.push_back(NearestTo(middle, spots, room));
  }
  if (stations.empty()) return NearestTo(from.head<2>(), spots, halves);
  const std::vector<size_t>& among = stations.size() == 1 ? halves : room;
  const size_t farthest = *std::max_element(among.begin(), among.end(), [&](size_t a, size_t b) {
    return FromAll(spots[a].at, stations) < FromAll(spots[b].at, stations);
  });
  if (FromAll(spots[farthest].at, stations) < kWorthAScan) return std::nullopt;
  return farthest;
}

class AsSurveyorsDo final : public Rival {
 public:
  Proposal Propose(const PlanningSituation& s) override {
    planning::PlanningConfig config = s.problem.config();
    config.station_basis = planning::StationBasis::kExpected;
    const auto prepared = planning::PlanningProblem::Prepare(
        {s.problem.model(), s.problem.scanner(), config, &s.problem}, s.parallel);
    if (!prepared.ok()) return {std::nullopt, std::nullopt, prepared.status().ToString()};
    const planning::PlanningProblem& problem = **prepared;
    const std::vector<Spot> spots = SpotsOf(problem.feasible());
    std::vector<planning::Opening> doorways;
    for (const planning::Opening& opening : problem.openings().openings) {
      if (opening.doorway() && opening.lintel) doorways.push_back(opening);
    }
    const auto rooms = RoomsOf(spots, problem.feasible().cell_size(), doorways);
    const std::vector<std::vector<Vector3d>> scans = ByRoom(s.stations, spots, rooms, doorways);

    std::vector<size_t> wanted;
    for (const planning::Opening& doorway : doorways) AddDoorway(doorway, spots, s, wanted);
    size_t scanned = 2;  // in each room, before it goes on
    do {
      for (size_t i = 0; i < rooms.size(); ++i) {
        if (scans[i].size() >= scanned) continue;
        const auto next = NextIn(rooms[i], spots, scans[i], s.stations.back());
        if (next.has_value()) wanted.push_back(*next);
      }
    } while (wanted.empty() && ++scanned <= kMostInARoom);
    if (wanted.empty()) {
      return {std::nullopt, std::nullopt, "all rooms and doorways that it knows of are done"};
    }
    const auto way = [&](size_t i) {
      const Vector3d& at = spots[i].at;
      return problem.feasible().reach().Travel(at).value_or(2 * Apart(at, s.stations.back()));
    };
    const size_t nearest = *std::min_element(wanted.begin(), wanted.end(),
                                             [&](size_t a, size_t b) { return way(a) < way(b); });
    Proposal proposal{spots[nearest].at, std::nullopt, ""};
    if (problem.BasisOf(spots[nearest].at) == planning::StationBasis::kExpected) {
      proposal.expected.emplace();
      proposal.expected->radius = planning::kStationRadius;
      const auto behind = problem.expectation()->Behind(spots[nearest].at);
      if (behind.has_value()) {
        proposal.expected->doorway = problem.openings().openings[*behind].centre;
      }
    }
    return proposal;
  }

 private:
  // Each station belongs to the room with the nearest spot, unless it is in a doorway.
  static std::vector<std::vector<Vector3d>> ByRoom(const std::vector<Vector3d>& stations,
                                                   const std::vector<Spot>& spots,
                                                   const std::vector<std::vector<size_t>>& rooms,
                                                   const std::vector<planning::Opening>& doorways) {
    std::vector<std::vector<Vector3d>> scans(rooms.size());
    for (const Vector3d& station : stations) {
      std::optional<size_t> room;
      double least = kWorthAScan;
      for (size_t r = 0; r < rooms.size(); ++r) {
        for (const size_t i : rooms[r]) {
          // A storey further up or down is no nearer for being above.
          if (std::abs(spots[i].at.z() - station.z()) > 2 * kSameFloor) continue;
          const double apart = Apart(spots[i].at, station);
          if (apart >= least) continue;
          least = apart;
          room = r;
        }
      }
      const bool in_doorway =
          std::any_of(doorways.begin(), doorways.end(), [&](const planning::Opening& doorway) {
            return LiesIn(doorway, {station.x(), station.y(), doorway.centre.z()}) &&
                   std::abs(station.z() - doorway.centre.z()) < 2 * kTripod;
          });
      if (room.has_value() && !in_doorway) scans[*room].push_back(station);
    }
    return scans;
  }

  // Adds the spot of a doorway that was not scanned from.
  static void AddDoorway(const planning::Opening& doorway, const std::vector<Spot>& spots,
                         const PlanningSituation& s, std::vector<size_t>& wanted) {
    const auto near = [&](const Vector3d& at) {
      return Apart(at, doorway.centre) <= kNearDoorway &&
             std::abs(at.z() - doorway.centre.z()) < 2 * kTripod;
    };
    if (std::any_of(s.stations.begin(), s.stations.end(), near)) return;
    std::vector<size_t> close;
    for (size_t i = 0; i < spots.size(); ++i) {
      if (near(spots[i].at)) close.push_back(i);
    }
    if (!close.empty()) wanted.push_back(NearestTo(doorway.centre.head<2>(), spots, close));
  }
};

}  // namespace

std::vector<std::vector<size_t>> RoomsOf(const std::vector<Spot>& spots, double cell_size,
                                         const std::vector<planning::Opening>& doorways) {
  std::multimap<std::pair<int, int>, size_t> free;
  for (size_t i = 0; i < spots.size(); ++i) {
    const Vector3d floor = FloorOf(spots[i]);
    if (std::none_of(doorways.begin(), doorways.end(),
                     [&](const planning::Opening& doorway) { return LiesIn(doorway, floor); })) {
      free.emplace(std::pair(spots[i].column.x(), spots[i].column.y()), i);
    }
  }
  std::vector<bool> seen(spots.size(), false);
  std::vector<std::vector<size_t>> rooms;
  for (const auto& [column, first] : free) {
    if (seen[first]) continue;
    seen[first] = true;
    std::vector<size_t> room = {first};
    for (size_t head = 0; head < room.size(); ++head) {
      const Spot& spot = spots[room[head]];
      for (int k = 0; k < 9; ++k) {
        const auto [begin, end] =
            free.equal_range({spot.column.x() + k % 3 - 1, spot.column.y() + k / 3 - 1});
        for (auto next = begin; next != end; ++next) {
          if (seen[next->second] || std::abs(spots[next->second].floor - spot.floor) > kStep) {
            continue;
          }
          seen[next->second] = true;
          room.push_back(next->second);
        }
      }
    }
    const double area = static_cast<double>(room.size()) * cell_size * cell_size;
    if (area >= kLeastRoom) rooms.push_back(std::move(room));
  }
  return rooms;
}

std::unique_ptr<Rival> SurveyorRival() { return std::make_unique<AsSurveyorsDo>(); }

}  // namespace vantage::study
