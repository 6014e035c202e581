#include "tests/support/scanned_office.h"

#include "core/model/partial_model.h"
#include "core/model/view/model_config.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::test_support {

std::shared_ptr<const model::PlanningView> ScannedOffice() {
  const simulation::Scene scene = simulation::OfficeStorey(3, 90);
  const simulation::SimulatedScanner tracer(scene.mesh);
  sensor::Scan scan;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(0.6);
  model::ModelConfig config;
  config.voxel_size = 0.1;
  auto model = model::PartialModel::Create(config).value();
  parallel::ThreadPool pool(2);
  for (size_t i = 0; i < 2; ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = scene.starts[i * (scene.starts.size() - 1)];
    scan.image = tracer.Scan(scan.scanner, pose, simulation::ScanFaults{}, i, pool);
    model->Insert(i == 0 ? "a" : "b", scan, pose, pool).value();
  }
  return model->Publish();
}

}  // namespace vantage::test_support
