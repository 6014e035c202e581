#include "tests/core/planning/scanned_office.h"

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scene.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage {

std::shared_ptr<const PlanningView> ScannedOffice() {
  const Scene scene = OfficeFloor(3, 90);
  const SimulatedScanner tracer(scene.mesh);
  Scan scan;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = Radians(0.6);
  ModelConfig config;
  config.voxel_size = 0.1;
  auto model = PartialModel::Create(config).value();
  ThreadPool pool(2);
  for (size_t i = 0; i < 2; ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = scene.starts[i * (scene.starts.size() - 1)];
    scan.image = tracer.Scan(scan.scanner, pose, ScanFaults{}, i, pool);
    model->Insert(i == 0 ? "a" : "b", scan, pose, pool).value();
  }
  return model->Publish();
}

}  // namespace vantage
