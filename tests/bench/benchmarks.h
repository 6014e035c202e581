// The groups of figures, each of which measures itself against a reference in the same run.
#ifndef VANTAGE_TESTS_BENCH_BENCHMARKS_H_
#define VANTAGE_TESTS_BENCH_BENCHMARKS_H_

#include <string>

#include "core/parallel/parallel.h"
#include "core/simulation/scenes/scene_use.h"
#include "tests/bench/figures.h"

namespace vantage::bench {

struct BenchOptions {
  bool full = false;     // also figures that take many minutes
  std::string pictures;  // folder for curves and tours; empty: none are drawn
  simulation::SceneUse use = simulation::SceneUse::kReporting;  // of the scenes measured on
};

using Benchmark = void(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures);

Benchmark BenchPrepare;  // prepare.*
Benchmark BenchVerdict;  // verdict.*
Benchmark BenchChange;   // change.*
// loop.*: chains of scans that close, adjusted together; `full`: five sites of each kind.
Benchmark BenchLoop;
Benchmark BenchPrediction;  // predict.kept.*, predict.missed.*
Benchmark BenchAdvice;      // advice.*
Benchmark BenchOverlap;     // predict.overlap.*
Benchmark BenchCycle;       // cycle.*
Benchmark BenchCarve;       // carve.*
Benchmark BenchSnapshot;    // snapshot.*
// plan.embree.*, plan.brute.*, plan.budget.*, plan.cancel.*, plan.2000m2.*: packets, budgets,
// memory.
Benchmark BenchPlanning;
// merge.*, model.*: what many scans cost; `full` adds a whole storey.
Benchmark BenchModel;
// loop.remerge.*: all scans of a building merged anew at adjusted poses.
Benchmark BenchRemerge;
// model.hall100.*, plan.hall100.*: a hall that is nearly all empty space.
Benchmark BenchHall;
// memory.account.*: what scans and plans are estimated to take, beside what they take.
Benchmark BenchMemory;
// plan.exact.*: the hierarchy against brute force; `full` adds what takes minutes.
Benchmark BenchEvaluator;
// fleet.*: several scanners on one job; `full`: on 1,000 m^2, with 1 to 8 scanners.
Benchmark BenchFleet;
// tour.stations.*: how many stations are chosen where the mesh is known. Not without the service,
// whose client has the integer programme.
Benchmark BenchCover;
// align.*, predict.ms: registration, beside PCL's ICP, which `full` gives all of the pairs.
Benchmark BenchRegistration;
// site.*: views in the air, and places without a view; `full`: in 1,000 scenes. Coverage at the end
// of jobs; `full`: of flats, too.
Benchmark BenchSite;
// heading.*: plans for a scanner that sees a sector, beside those for one that turns all around.
Benchmark BenchHeading;
// preview.*: what plans from thinned scans lose, and how large those are; `full`: in more scenes.
Benchmark BenchPreview;
// import.*: how fast scan files are read, and in how much memory; `full`: of 44 million cells.
Benchmark BenchImport;
// scan.*, scans200.*: what dense scans leave in memory; `full`: two hundred scans.
Benchmark BenchLargeScans;
// phantom.*: what is left of rooms that are only in mirrors, and openings lost for mirrors.
Benchmark BenchPhantom;
// plan.answered.*, plan.first_view.*: whether short budgets give a view, and how soon the first is
// shown.
Benchmark BenchAnswers;
// plan.anytime.*, plan.threads2.*: what is answered at a budget.
Benchmark BenchAnytime;
Benchmark BenchTour;  // tour.*

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_BENCHMARKS_H_
