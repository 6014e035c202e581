// Step D under a budget: race, decide, complete (algorithm.md section 8, 'Anytime, and honest about
// it').
#ifndef VANTAGE_CORE_PLANNING_ANYTIME_H_
#define VANTAGE_CORE_PLANNING_ANYTIME_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/brute_force.h"
#include "core/planning/opaque_grid.h"

namespace vantage {

// A round of the race: so large a sample of the cells on so many of the views.
struct RaceRound {
  double sample = 0.01;  // of the cells
  double views = 1.0;    // of all, the best so far
};

struct AnytimeOptions {
  std::vector<RaceRound> rounds = {{0.01, 1.0}, {0.03, 0.05}, {0.15, 0.005}};
  size_t least_sample = 512;  // draws; a round that would draw a third of the cells is skipped
  double confidence = 0.95;   // of all bounds together
  uint64_t seed = 1;
  double separation = 0.6;  // m, of the leaders scored exactly
  int leaders = 10;
  // Of views and cells left to complete, from which on the hierarchy is worth building.
  uint64_t hierarchy_pairs = 50'000'000;
  // Of the box around the model, up to which it is; its table of counts takes 4 bytes a voxel.
  uint64_t hierarchy_voxels = uint64_t{1} << 28;
};

// What the hierarchical scorer needs besides; kept by reference.
struct HierarchyInput {
  const OpaqueGrid& grid;                      // axes {0, 1, 2}
  std::span<const Eigen::Vector3i> viewcells;  // view i is the centre of viewcell i
  double viewcell_size;                        // m
};

struct ViewEstimate {
  double score = 0;  // the best estimate so far, samples
  double lower = 0;  // bounds: together they hold with the confidence asked for
  double upper = 0;
  bool scored = false;  // false: nothing but the bounds is known
  bool exact = false;   // lower == score == upper, for certain
};

struct Evaluation {
  std::vector<ViewEstimate> views;
  uint64_t rays = 0;
  size_t exact = 0;       // views
  bool complete = false;  // all of them
  bool decided = false;   // the leaders are exact
  // By needy cell: some scored view gains something there. Final only when complete.
  std::vector<uint8_t> seen;
  bool any() const {
    for (const ViewEstimate& view : views) {
      if (view.scored) return true;
    }
    return false;
  }
};

// Scores `views` (m) on `cells`. Draws lie along a line on which each cell is as long as the most
// it can gain, one at random in each of n equal parts: strata are places (neighbours lie side by
// side), the probability is proportional to area x deficit x weight, and the draws are independent
// with a known range, so the bounds of MeanBounds hold for any scene. The error is split over all
// views, rounds and sides. `first_order` lists the views for the first round, coarse lattice first.
// What is left is completed by the hierarchy where `hierarchy` is given, enough is left, there is
// time to build it and the model is not too large for it, otherwise view by view; both give the
// same scores up to rounding. `cells` are then in the order of PatchOrder(). `progress` sees the
// evaluation when it has improved. Heeds deadline, cancellation and work limit (rays); with a work
// limit alone the result does not depend on the number of threads.
Evaluation EvaluateViews(const BruteForceScorer& scorer, std::span<const Eigen::Vector3d> views,
                         std::span<const uint32_t> first_order, const CellArrays& cells,
                         const AnytimeOptions& options, const Budget& budget, Parallel& parallel,
                         absl::FunctionRef<void(const Evaluation&)> progress,
                         const HierarchyInput* hierarchy = nullptr);

// Indices 0..n-1 of viewcells, those on the coarsest lattice first.
std::vector<uint32_t> CoarseFirst(std::span<const Eigen::Vector3i> cells);

// Scored views from the best on, equal ones by index.
std::vector<uint32_t> ByScore(const Evaluation& evaluation);

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_ANYTIME_H_
