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
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/flat_job.h"

namespace vantage::bench {
namespace {

constexpr size_t kHouseScans = 5;

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

std::unique_ptr<PlanningJob> FlatPlanningJob(size_t scans, parallel::Parallel& parallel) {
  const FlatJob flat = MakeFlatJob(1, scans, parallel);
  return std::make_unique<PlanningJob>(ModelOf(flat, scans, parallel)->Publish(),
                                       flat.scans[0].scanner, parallel);
}

std::shared_ptr<const model::PlanningView> ScannedOffice(double area_m2,
                                                         sensor::ScannerModel& scanner,
                                                         parallel::Parallel& parallel) {
  const simulation::Scene scene = simulation::OfficeStorey(1, area_m2);
  scanner.range_max = 30;
  const size_t scans = std::max<size_t>(1, static_cast<size_t>(area_m2 / 50));
  std::vector<Eigen::Vector3d> places;
  for (size_t i = 0; i < scans; ++i)
    places.push_back(scene.starts[i * scene.starts.size() / scans]);
  return ScannedFrom(scene.mesh, places, scanner, parallel);
}

std::unique_ptr<PlanningJob> OfficePlanningJob(double area_m2, parallel::Parallel& parallel) {
  sensor::ScannerModel scanner;
  auto model = ScannedOffice(area_m2, scanner, parallel);
  return std::make_unique<PlanningJob>(std::move(model), scanner, parallel);
}

std::unique_ptr<PlanningJob> SmallHousePlanningJob(parallel::Parallel& parallel) {
  const char* data = std::getenv("VANTAGE_SHARED_DATA");
  if (data == nullptr) return nullptr;
  const std::string folder = absl::StrCat(data, "/small_house/");
  const auto mesh = simulation::ReadMeshPly(folder + "scene.ply");
  std::ifstream points(folder + "free_points.txt");
  std::vector<Eigen::Vector3d> places;
  for (std::string line; places.size() < kHouseScans && std::getline(points, line);) {
    double x = 0;
    double y = 0;
    double z = 0;
    if (std::sscanf(line.c_str(), "%lf %lf %lf", &x, &y, &z) == 3) places.emplace_back(x, y, z);
  }
  if (!mesh.ok() || places.size() < kHouseScans) return nullptr;
  const sensor::ScannerModel scanner;
  return std::make_unique<PlanningJob>(ScannedFrom(*mesh, places, scanner, parallel), scanner,
                                       parallel);
}

}  // namespace vantage::bench
