#include "core/tour/spread_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "absl/container/flat_hash_map.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/target.h"

namespace vantage::tour {
namespace {

constexpr double kShareOfRange = 1.0 / 6;
constexpr double kMostSpacing = 1.0;  // m
// Of the spacing: places of a lattice stay, and what lies between them goes.
constexpr double kApart = 0.75;
constexpr double kWider = 1.25;       // the spacing, where there are too many
constexpr double kFloorsApart = 0.5;  // m, of floors one over the other
constexpr int kMostHeadings = 6;

// The places of a problem, one for each column of viewcells and floor.
std::vector<Candidate> Columns(const planning::PlanningProblem& problem) {
  const planning::FeasibleViews& feasible = problem.feasible();
  const planning::PlanningConfig& config = problem.config();
  const double middle = (config.min_viewpoint_height + config.max_viewpoint_height) / 2;
  struct Best {
    uint32_t cell = 0;
    double off = std::numeric_limits<double>::infinity();  // m, from the middle height
  };
  absl::flat_hash_map<std::tuple<int, int, int>, Best> columns;
  for (uint32_t i = 0; i < feasible.cells().size(); ++i) {
    const Eigen::Vector3d at = feasible.Centre(i);
    const double height = feasible.HeightOverFloor(at);
    if (std::isnan(height)) continue;
    const auto floor = static_cast<int>(std::lround((at.z() - height) / kFloorsApart));
    Best& best = columns[{feasible.cells()[i].x(), feasible.cells()[i].y(), floor}];
    const double off = std::abs(height - middle);
    if (off < best.off) best = {i, off};
  }
  std::vector<uint32_t> cells;
  cells.reserve(columns.size());
  for (const auto& [column, best] : columns) cells.push_back(best.cell);
  std::sort(cells.begin(), cells.end());
  std::vector<Candidate> places;
  places.reserve(cells.size());
  for (const uint32_t i : cells) {
    const Eigen::Vector3d at = feasible.Centre(i);
    places.push_back({at, std::nullopt, feasible.Storey(at).value_or(0)});
  }
  return places;
}

bool SeeEachOther(const planning::PlanningProblem& problem, const Eigen::Vector3d& a,
                  const Eigen::Vector3d& b) {
  const double voxel = problem.model().voxel_size();
  const Eigen::Vector3f to = problem.scene().ToScene(b / voxel);
  visibility::TargetPacket packet{};
  packet.x[0] = to.x();
  packet.y[0] = to.y();
  packet.z[0] = to.z();
  return problem.scene().Occluded(problem.scene().ToScene(a / voxel), packet, 1) == 0;
}

// Places in cubes as large as they are apart, so that only neighbours are looked at.
class Sparse {
 public:
  Sparse(const planning::PlanningProblem& problem, double apart)
      : problem_(problem), apart_(apart) {}

  // Keeps the place, unless one that it sees is too near.
  void Offer(const Candidate& place) {
    const Eigen::Vector3i cube = (place.position / apart_).array().floor().cast<int>();
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
          const auto it = cubes_.find({cube.x() + x, cube.y() + y, cube.z() + z});
          if (it == cubes_.end()) continue;
          for (const size_t other : it->second) {
            if ((kept_[other].position - place.position).norm() < apart_ &&
                SeeEachOther(problem_, kept_[other].position, place.position)) {
              return;
            }
          }
        }
      }
    }
    cubes_[{cube.x(), cube.y(), cube.z()}].push_back(kept_.size());
    kept_.push_back(place);
  }
  std::vector<Candidate>& kept() { return kept_; }

 private:
  const planning::PlanningProblem& problem_;
  const double apart_;
  absl::flat_hash_map<std::tuple<int, int, int>, std::vector<size_t>> cubes_;
  std::vector<Candidate> kept_;
};

// How far a place is from the nearest of a lattice, in plan, m.
double OffLattice(const Eigen::Vector3d& at, double spacing) {
  const Eigen::Array2d in = at.head<2>().array() / spacing;
  return spacing * (in - in.round()).matrix().norm();
}

std::vector<Candidate> Spread(const planning::PlanningProblem& problem,
                              std::vector<Candidate> places, double spacing) {
  // The lattice first, then what walls divide from it.
  const double cell = problem.feasible().cell_size();
  std::stable_sort(places.begin(), places.end(), [&](const Candidate& a, const Candidate& b) {
    return std::floor(OffLattice(a.position, spacing) / cell) <
           std::floor(OffLattice(b.position, spacing) / cell);
  });
  Sparse sparse(problem, kApart * spacing);
  for (const Candidate& place : places) sparse.Offer(place);
  return std::move(sparse.kept());
}

// Of a scanner that sees a sector: each place with headings that see everything twice.
std::vector<Candidate> WithHeadings(const planning::PlanningProblem& problem,
                                    const std::vector<Candidate>& places) {
  const sensor::ScannerModel& scanner = problem.scanner();
  if (scanner.TurnsAllAround()) return places;
  const int headings = std::clamp(
      static_cast<int>(std::ceil(2 * 2 * sensor::kPi / scanner.azimuth_span)), 2, kMostHeadings);
  std::vector<Candidate> facing;
  for (const Candidate& place : places) {
    for (int k = 0; k < headings; ++k) {
      facing.push_back(place);
      facing.back().heading = 2 * sensor::kPi * k / headings;
    }
  }
  return facing;
}

}  // namespace

double SpacingFor(const planning::PlanningProblem& problem) {
  const sensor::ScannerModel& scanner = problem.scanner();
  const double density = problem.config().required_density;
  const double range = std::min(
      scanner.range_max, std::sqrt(1 / (scanner.azimuth_step * scanner.elevation_step * density)));
  return std::max(problem.feasible().cell_size(), std::min(kShareOfRange * range, kMostSpacing));
}

std::vector<Candidate> SpreadViews(const planning::PlanningProblem& problem, double spacing,
                                   size_t most, std::span<const Candidate> beside) {
  std::vector<Candidate> places = Columns(problem);
  if (!beside.empty()) {
    constexpr double kBeside = 2.1;  // spacings: a ring of neighbours, and those across corners
    std::erase_if(places, [&](const Candidate& place) {
      return std::none_of(beside.begin(), beside.end(), [&](const Candidate& chosen) {
        return chosen.storey == place.storey &&
               (chosen.position - place.position).norm() <= kBeside * spacing;
      });
    });
  }
  for (;; spacing *= kWider) {
    std::vector<Candidate> spread = WithHeadings(problem, Spread(problem, places, spacing));
    if (spread.size() <= most) return spread;
  }
}

std::optional<Candidate> NearestView(const planning::PlanningProblem& problem,
                                     const Eigen::Vector3d& place, double within) {
  const planning::FeasibleViews& feasible = problem.feasible();
  std::optional<Candidate> nearest;
  double least = within;
  for (size_t i = 0; i < feasible.cells().size(); ++i) {
    const Eigen::Vector3d at = feasible.Centre(i);
    const double apart = (at - place).norm();
    if (apart >= least) continue;
    least = apart;
    nearest = Candidate{at, std::nullopt, feasible.Storey(at).value_or(0)};
  }
  return nearest;
}

}  // namespace vantage::tour
