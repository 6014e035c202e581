// Where to put the scanner next, after one scan, without a server: plan_ptx SCAN.ptx
#include <vantage/core/model/partial_model.h>
#include <vantage/core/parallel/thread_pool.h>
#include <vantage/core/planning/planner.h>
#include <vantage/core/registration/levelling.h>
#include <vantage/core/sensor/scan_file.h>

#include "or_exit.h"
using namespace vantage;

int main(int argc, char** argv) {
  const auto file = OrExit(sensor::ReadScanFile(argc == 2 ? argv[1] : "", {}));
  const sensor::Scan scan{file.image, file.scanner, std::nullopt};
  parallel::ThreadPool threads(4);
  const auto model = OrExit(model::PartialModel::Create({}));
  // The first scan says where the world is: z up, the origin where the scanner stood.
  const auto levelled = OrExit(registration::LevelFirstScan(scan));
  OrExit(model->Insert("first", scan, levelled.T_world_scan, threads));
  planning::PlanningConfig config;
  config.required_density = 100;  // samples / m^2
  const auto plan =
      OrExit(planning::MakePlan(*model->Publish(), scan.scanner, config,
                                parallel::Budget::Seconds(60), threads, [](const auto&) {}));
  std::printf("%zu views. %s\n", plan.views.size(), plan.message.c_str());
  for (const planning::RankedView& view : plan.views) {
    std::printf("(%.2f, %.2f, %.2f) m: %.1f m^2, %s\n", view.position.x(), view.position.y(),
                view.position.z(), view.model_gain.value_or(0), view.location.description.c_str());
  }
}
