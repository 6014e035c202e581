#include "tests/bench/planning_job.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/model/partial_model.h"
#include "core/simulation/mesh_ply.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/scan_job.h"

namespace vantage::bench {
namespace {

constexpr size_t kMeshScans = 5;

std::shared_ptr<const model::PlanningView> ScannedFrom(const simulation::TriangleMesh& mesh,
                                                       const std::vector<Eigen::Vector3d>& places,
                                                       const sensor::ScannerModel& scanner,
                                                       parallel::Parallel& parallel) {
  const simulation::SimulatedScanner tracer(mesh);
  auto model = model::PartialModel::Create({}).value();
  for (size_t i = 0; i < places.size(); ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = places[i];
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, i, parallel);
    model->Insert(absl::StrCat("scan", i), scan, pose, parallel).value();
  }
  return model->Publish();
}

std::unique_ptr<PlanningJob> JobAfter(const ScanJob& job, parallel::Parallel& parallel) {
  return std::make_unique<PlanningJob>(ModelOf(job, job.scans.size(), parallel)->Publish(),
                                       job.scans[0].scanner, parallel);
}

}  // namespace

PlanningJob::PlanningJob(std::shared_ptr<const model::PlanningView> view,
                         const sensor::ScannerModel& of, parallel::Parallel& parallel)
    : model(std::move(view)),
      scanner(of),
      problem(planning::PlanningProblem::Prepare({*model, scanner, config}, parallel).value()) {
  for (size_t i = 0; i < feasible.cells().size(); ++i) views.push_back(feasible.Centre(i));
}

std::string PlanningJob::Size() const {
  return absl::StrCat(views.size(), " views x ", scoring->cells().size(), " cells");
}

std::unique_ptr<PlanningJob> FlatPlanningJob(uint64_t seed, size_t scans,
                                             parallel::Parallel& parallel) {
  return JobAfter(MakeFlatJob(seed, scans, parallel), parallel);
}

std::unique_ptr<PlanningJob> RoomsPlanningJob(uint64_t seed, size_t scans,
                                              parallel::Parallel& parallel) {
  return JobAfter(MakeScanJob(simulation::TwoRooms(seed), seed, scans, parallel), parallel);
}

std::unique_ptr<PlanningJob> HallPlanningJob(uint64_t seed, size_t scans,
                                             parallel::Parallel& parallel) {
  return JobAfter(MakeScanJob(simulation::PillarHall(seed), seed, scans, parallel), parallel);
}

std::shared_ptr<const model::PlanningView> ScannedOffice(uint64_t seed, double area_m2,
                                                         sensor::ScannerModel& scanner,
                                                         parallel::Parallel& parallel) {
  const simulation::Scene scene = simulation::OfficeStorey(seed, area_m2);
  scanner.range_max = 30;
  const size_t scans = std::max<size_t>(1, static_cast<size_t>(area_m2 / 50));
  std::vector<Eigen::Vector3d> places;
  for (size_t i = 0; i < scans; ++i)
    places.push_back(scene.starts[i * scene.starts.size() / scans]);
  return ScannedFrom(scene.mesh, places, scanner, parallel);
}

std::unique_ptr<PlanningJob> OfficePlanningJob(uint64_t seed, double area_m2,
                                               parallel::Parallel& parallel) {
  sensor::ScannerModel scanner;
  auto model = ScannedOffice(seed, area_m2, scanner, parallel);
  return std::make_unique<PlanningJob>(std::move(model), scanner, parallel);
}

std::unique_ptr<PlanningJob> MeshPlanningJob(const std::string& folder,
                                             parallel::Parallel& parallel) {
  const char* data = std::getenv("VANTAGE_SHARED_DATA");
  if (data == nullptr) return nullptr;
  const std::string path = absl::StrCat(data, "/", folder);
  const auto mesh = simulation::ReadMeshPly(path + "/scene.ply");
  std::ifstream points(path + "/free_points.txt");
  std::vector<Eigen::Vector3d> places;
  for (std::string line; places.size() < kMeshScans && std::getline(points, line);) {
    double x = 0;
    double y = 0;
    double z = 0;
    if (std::sscanf(line.c_str(), "%lf %lf %lf", &x, &y, &z) == 3) places.emplace_back(x, y, z);
  }
  if (!mesh.ok() || places.size() < kMeshScans) return nullptr;
  const sensor::ScannerModel scanner;
  return std::make_unique<PlanningJob>(ScannedFrom(*mesh, places, scanner, parallel), scanner,
                                       parallel);
}

}  // namespace vantage::bench
