#include "tests/support/standing_oracle.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "core/model/partial_model.h"
#include "core/simulation/simulated_scanner.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::test_support {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kStep = 0.20;   // m that people step up and down
constexpr double kSlope = 0.7;   // of stairs
constexpr double kWayIn = 1.3;   // m around a station: what it did not see there was free
constexpr double kHeight = 1.5;  // m over the floor, of the places asked
constexpr size_t kExamples = 3;

class Oracle {
 public:
  Oracle(const simulation::Scene& scene, const model::PlanningView& model,
         const sensor::ScannerModel& scanner, const planning::PlanningConfig& config)
      : model_(model),
        grid_(model),
        scanner_(scanner),
        config_(config),
        tracer_(scene.mesh),
        bounds_(scene.mesh.Bounds()) {}

  // Distance to what is straight below, m; infinite when there is nothing.
  double Drop(const Vector3d& p) const {
    const simulation::TraceHit hit =
        tracer_.Trace(p.cast<float>(), -Eigen::Vector3f::UnitZ(), 0.0f);
    return hit.hit ? static_cast<double>(hit.distance) : std::numeric_limits<double>::infinity();
  }

  // Places that can be walked to through what was seen, at the height of a viewpoint.
  std::vector<Vector3d> Places(const planning::FeasibleViews& views) {
    const double cell = views.cell_size();
    using Node = std::tuple<int, int, int>;  // column, and height in mm
    std::set<Node> reached;
    std::deque<Node> queue;
    const auto push = [&](int x, int y, double height) {
      const Node node(x, y, static_cast<int>(std::lround(height * 1000)));
      if (reached.insert(node).second) queue.push_back(node);
    };
    for (const model::Station& station : model_.stations()) {
      const double height = station.position.z() - Drop(station.position);
      push(static_cast<int>(std::floor(station.position.x() / cell)),
           static_cast<int>(std::floor(station.position.y() / cell)), height);
    }
    std::vector<Vector3d> places;
    while (!queue.empty()) {
      const auto [x, y, millimetres] = queue.front();
      queue.pop_front();
      const double height = millimetres / 1000.0;
      const Vector2d at((x + 0.5) * cell, (y + 0.5) * cell);
      const Vector3d place(at.x(), at.y(), (std::floor((height + kHeight) / cell) + 0.5) * cell);
      // All of the viewcell has it, not its middle alone.
      const double clearance = scanner_.clearance + 0.5 * std::sqrt(3.0) * cell;
      if (Seen(at, height) && planning::ClearanceAt(grid_, model_.voxel_size(), place,
                                                    clearance + 0.05) > clearance + 1e-3) {
        places.push_back(place);
      }
      for (int j = y - 1; j <= y + 1; ++j) {
        for (int i = x - 1; i <= x + 1; ++i) {
          const Vector2d to((i + 0.5) * cell, (j + 0.5) * cell);
          for (const double next : MeshFloors(to)) {
            if (std::abs(next - height) > kStep - 0.01) continue;
            if (reached.count(Node(i, j, static_cast<int>(std::lround(next * 1000)))) > 0) continue;
            if (!Fits(to, next)) continue;
            if (BesideStation(to, next) || Seen(to, next)) push(i, j, next);
          }
        }
      }
    }
    return places;
  }

 private:
  // Heights of all that faces up or down at a place, m.
  const std::vector<double>& MeshFloors(const Vector2d& at) {
    const auto [it, fresh] = floors_.try_emplace(Key(static_cast<int>(std::lround(at.x() * 1000)),
                                                     static_cast<int>(std::lround(at.y() * 1000))));
    if (!fresh) return it->second;
    double z = bounds_.max().z() + 1;
    for (int k = 0; k < 32; ++k) {
      const simulation::TraceHit hit =
          tracer_.Trace(Vector3d(at.x(), at.y(), z).cast<float>(), -Eigen::Vector3f::UnitZ(), 0.0f);
      if (!hit.hit) break;
      z -= static_cast<double>(hit.distance);
      if (std::abs(hit.normal.z()) > 0.87f) it->second.push_back(z);
      z -= 0.005;
    }
    return it->second;
  }
  // The mesh alone: a scanner can stand here and be carried through.
  bool Fits(const Vector2d& at, double height) {
    const std::tuple<int, int, int> key(static_cast<int>(std::lround(at.x() * 1000)),
                                        static_cast<int>(std::lround(at.y() * 1000)),
                                        static_cast<int>(std::lround(height * 1000)));
    const auto [it, fresh] = fits_.try_emplace(key, false);
    if (!fresh) return it->second;
    const double radius = config_.scanner_width / 2 + 0.05;
    // Stairs rise within the scanner's width.
    const double foot = height + kStep + kSlope * radius;
    it->second = tracer_.CylinderFree(at, radius, foot, height + config_.scanner_height);
    for (int k = 0; it->second && k < 16; ++k) {
      const double angle = k * 0.3926990817;
      const double away = k % 2 == 0 ? radius : 0.5 * radius;
      const Vector2d beside = at + away * Vector2d(std::cos(angle), std::sin(angle));
      const std::vector<double>& floors = MeshFloors(beside);
      it->second = std::any_of(floors.begin(), floors.end(), [&](double floor) {
        return std::abs(floor - height) <= kStep + kSlope * away - 0.02;
      });
    }
    return it->second;
  }
  bool BesideStation(const Vector2d& at, double height) const {
    return std::any_of(
        model_.stations().begin(), model_.stations().end(), [&](const model::Station& station) {
          return (station.position.head<2>() - at).norm() < kWayIn &&
                 std::abs(station.position.z() - Drop(station.position) - height) < 0.05;
        });
  }
  // Everything of the floor under a scanner was measured, and all of the air over it was seen.
  bool Seen(const Vector2d& at, double height) {
    const double voxel = model_.voxel_size();
    const double radius = config_.scanner_width / 2 + 0.05;
    for (int y = static_cast<int>(std::floor((at.y() - radius) / voxel));
         y * voxel < at.y() + radius; ++y) {
      for (int x = static_cast<int>(std::floor((at.x() - radius) / voxel));
           x * voxel < at.x() + radius; ++x) {
        const double away = (Vector2d((x + 0.5) * voxel, (y + 0.5) * voxel) - at).norm();
        if (away > radius) continue;
        const std::vector<double>& floors = SeenFloors(x, y);
        if (std::none_of(floors.begin(), floors.end(), [&](double floor) {
              return std::abs(floor - height) <= kStep + kSlope * away;
            })) {
          return false;
        }
      }
    }
    return true;
  }
  // Heights of the mesh in a column of voxels that were measured, under air that was seen, m.
  const std::vector<double>& SeenFloors(int x, int y) {
    const auto [it, fresh] = seen_.try_emplace(Key(x, y));
    if (!fresh) return it->second;
    const double voxel = model_.voxel_size();
    for (const double floor : MeshFloors({(x + 0.5) * voxel, (y + 0.5) * voxel})) {
      const int layer = static_cast<int>(std::floor(floor / voxel));
      bool measured = false;
      for (int z = layer - 1; z <= layer + 1; ++z) {
        measured |= model_.State({x, y, z}) == model::VoxelState::kTrueSurface;
      }
      bool free = true;
      for (int z = static_cast<int>(std::floor(floor / voxel + 0.5)) + 2;
           z * voxel < floor + config_.scanner_height + kStep; ++z) {
        free &= model_.Empty({x, y, z});
      }
      if (measured && free) it->second.push_back(floor);
    }
    return it->second;
  }
  static uint64_t Key(int a, int b) {
    return uint64_t{static_cast<uint32_t>(a)} << 32 | static_cast<uint32_t>(b);
  }

  const model::PlanningView& model_;
  const visibility::OpaqueGrid grid_;
  const sensor::ScannerModel& scanner_;
  const planning::PlanningConfig& config_;
  const simulation::Tracer tracer_;
  const Eigen::AlignedBox3d bounds_;
  std::unordered_map<uint64_t, std::vector<double>> floors_;  // by place, mm
  std::unordered_map<uint64_t, std::vector<double>> seen_;    // by column of voxels
  std::map<std::tuple<int, int, int>, bool> fits_;
};

}  // namespace

std::optional<double> MeshFloor::Below(const Vector3d& place) const {
  const simulation::TraceHit hit =
      tracer_.Trace(place.cast<float>(), -Eigen::Vector3f::UnitZ(), 0.0f);
  if (!hit.hit) return std::nullopt;
  return place.z() - static_cast<double>(hit.distance);
}

bool MeshFloor::Carries(const Vector3d& view, double height_over_floor) const {
  const std::optional<double> floor = Below(view);
  return floor.has_value() && std::abs(view.z() - *floor - height_over_floor) <= kStep;
}

bool MeshFloor::CarriesTripod(const Vector3d& view, double away) const {
  constexpr int kTurns = 8;  // within the third of a turn after which the feet are the same
  constexpr double kThird = 2 * sensor::kPi / 3;
  const std::optional<double> middle = Below(view);
  if (!middle.has_value()) return false;
  for (int turn = 0; turn < kTurns; ++turn) {
    bool carried = true;
    for (int foot = 0; carried && foot < 3; ++foot) {
      const double angle = kThird * (foot + static_cast<double>(turn) / kTurns);
      // From a step over the floor: what is over that is beside the leg, not below the foot.
      const std::optional<double> floor = Below(
          {view.x() + away * std::cos(angle), view.y() + away * std::sin(angle), *middle + kStep});
      carried = floor.has_value() && std::abs(*floor - *middle) <= kStep;
    }
    if (carried) return true;
  }
  return false;
}

std::shared_ptr<const model::PlanningView> ScanFromStarts(const simulation::Scene& scene,
                                                          const sensor::ScannerModel& scanner,
                                                          parallel::Parallel& parallel) {
  auto model = model::PartialModel::Create({}).value();
  const simulation::SimulatedScanner simulated(scene.mesh);
  for (size_t i = 0; i < scene.starts.size(); ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = scene.starts[i];
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = simulated.Scan(scanner, pose, simulation::ScanFaults{}, 7 + i, parallel);
    (void)model->Insert(absl::StrCat("scan", i), scan, pose, parallel).value();
  }
  return model->Publish();
}

StandingFigures JudgeStanding(const simulation::Scene& scene, const model::PlanningView& model,
                              const planning::FeasibleViews& views,
                              const sensor::ScannerModel& scanner,
                              const planning::PlanningConfig& config) {
  Oracle oracle(scene, model, scanner, config);
  const MeshFloor mesh_floor(scene);
  StandingFigures figures;
  figures.feasible = views.cells().size();
  for (size_t i = 0; i < views.cells().size(); ++i) {
    const Vector3d view = views.Centre(i);
    if (mesh_floor.Carries(view, views.HeightOverFloor(view))) continue;
    if (figures.in_air++ < kExamples) figures.air.push_back(view);
  }
  for (const Vector3d& place : oracle.Places(views)) {
    ++figures.allowed;
    if (views.IndexOf(views.CellOf(place)) >= 0) {
      ++figures.found;
    } else if (figures.missed.size() < kExamples) {
      figures.missed.push_back(place);
    }
  }
  return figures;
}

}  // namespace vantage::test_support
