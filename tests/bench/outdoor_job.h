// A job under the open sky: scan, plan, move, until the planner says that nothing is left; and what
// its promises were worth by the mesh.
#ifndef VANTAGE_TESTS_BENCH_OUTDOOR_JOB_H_
#define VANTAGE_TESTS_BENCH_OUTDOOR_JOB_H_

#include <cstddef>

#include "core/parallel/parallel.h"
#include "core/simulation/scenes/scene.h"

namespace vantage::bench {

struct OutdoorJobResult {
  size_t scans = 0;
  size_t with_targets = 0;  // scans that registered by targets which the plan advised
  bool stopped = false;     // the planner suggested to stop, or found nothing to gain
  // Of the views that were chosen, m^2 of model gain. Of that, in the sky: where the ray from the
  // view through the cell that gains meets nothing of the mesh, however far it goes.
  double promised = 0;
  double promised_sky = 0;
  double attained = 0;   // share of what the mesh says is attainable at density, at the end
  double estimated = 0;  // coverage as the planner says it, at the end

  double sky_share() const { return promised > 0 ? promised_sky / promised : 0; }
};

// The first scan is made from the scene's first start, the others where the plans say, at the exact
// pose and with all faults of a scanner; with the targets that a plan advises, where the view that
// needs them brings more than twice as much. Plans have a limit on their work: the job is
// repeatable.
OutdoorJobResult RunOutdoorJob(const simulation::Scene& scene, size_t most_scans,
                               parallel::Parallel& parallel);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_OUTDOOR_JOB_H_
