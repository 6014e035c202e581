// The race scores fewer and fewer views on larger and larger samples of the cells (algorithm.md
// section 8, 'Race').
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_VIEW_RACE_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_VIEW_RACE_H_

#include <array>
#include <cstdint>
#include <optional>
#include <queue>
#include <span>
#include <vector>

#include "core/planning/evaluation/cell_sample.h"
#include "core/planning/evaluation/confidence_bounds.h"
#include "core/planning/evaluation/evaluation_run.h"
#include "core/planning/evaluation/view_lattice.h"

namespace vantage::planning {

struct RaceOptions {
  size_t first_draws = 256;  // cells, for a view that enters
  size_t growth = 4;         // of the sample from rung to rung
  size_t promotion = 16;     // one in this many views goes up, at first
  size_t widest = 4;         // the same, at the widest (see Widen())
};

// Successive halving without rounds. Each rung is a size of sample, the last one all cells; the
// best views of a rung go up to the next. Neither the order of the work nor the estimates depend on
// when the budget ends.
class ViewRace {
 public:
  // The bounds of all views with all headings on all rungs hold together with `confidence`.
  // References are kept.
  ViewRace(EvaluationRun& run, const CellSampler& sampler, const RaceOptions& options,
           double confidence, uint64_t seed);

  // Runs until every view has entered and none is due to go up, or until the budget is spent.
  void Run(const parallel::Budget& part);
  // The same, and no longer than a first look takes. Run() goes on where this ends.
  void Look(const parallel::Budget& part);

  // Lets twice as many views go up from now on, so that views underestimated by a small sample get
  // another chance. False when the race is at its widest already.
  bool Widen();

  // The number of rungs. Views enter on rung 0; the last rung is all cells.
  size_t rungs() const { return rungs_.size(); }
  // Scores on the rung's sample every view whose upper bound exceeds the best lower bound. This
  // narrows the optimality gap long before everything is exact.
  void Tighten(size_t rung, const parallel::Budget& part);

 private:
  static constexpr uint8_t kOutside = 0xff;
  static constexpr uint8_t kAllProposed = 0xff;

  // By how much larger samples changed the scores of the views of a region that went up.
  struct Revision {
    float sum = 0;  // samples
    float views = 0;
  };
  struct Rung {
    size_t draws = 0;  // of this rung only
    size_t total = 0;  // of this rung and those below
    CellSample sample;
    std::vector<MeanBounds> bounds;   // one element, made with the sample
    size_t reached = 0;               // views, including those that went up since
    std::vector<uint32_t> waiting;    // to go up
    std::vector<Revision> revisions;  // by region
  };
  // A view whose neighbours may enter, with its rank at the time of listing.
  struct Proposer {
    double rank;
    uint32_t view;
    bool operator<(const Proposer& other) const {
      return rank != other.rank ? rank < other.rank : view > other.view;
    }
  };

  bool Step(const parallel::Budget& part);
  // One in this many views goes up to the rung.
  size_t Promotion(size_t rung) const;
  uint32_t RegionOf(uint32_t view) const;
  // The score of a view that waits on the rung, corrected by the mean change of its region.
  double RevisedScore(uint32_t view, size_t rung) const;
  bool GoUp(size_t rung, size_t count, const parallel::Budget& part);
  bool Enter(const parallel::Budget& part);
  // The index in proposers_ of the queue whose first view's neighbours enter next; nothing when all
  // are empty.
  std::optional<size_t> NextToPropose();
  bool ScoreOn(size_t rung, std::span<const uint32_t> which, const parallel::Budget& part);
  void Arrive(uint32_t view, size_t rung);
  // Removes from `views` those that have become exact in the meantime and returns them. They arrive
  // on the rung without a sample.
  std::vector<uint32_t> ArriveExact(std::vector<uint32_t>& views, size_t rung);
  void Note(uint32_t view, size_t rung, std::span<const double> by_heading);
  // Lists a view as a proposer of its neighbours 2^level viewcells away.
  void Propose(uint32_t view, size_t level);
  // The same for a view that enters; its neighbours are half as far away as those on its level of
  // the lattice.
  void ProposeFirst(uint32_t view);
  void ListNeighbours(uint32_t of, int step, std::vector<uint32_t>& entering);
  // Number of views that are scored together; it grows with the work done.
  size_t BatchOn(size_t rung) const;
  const CellSample* SampleOf(size_t rung);  // null: all cells
  // The draws that the estimate of a view on the rung rests on.
  size_t DrawsOf(const Rung& rung) const;
  bool IsLast(size_t rung) const { return rung + 1 == rungs_.size(); }

  EvaluationRun& run_;
  const CellSampler& sampler_;
  RaceOptions options_;
  uint64_t seed_;
  // Regions are cubes of a few viewcells.
  Eigen::Vector3i first_region_ = Eigen::Vector3i::Zero();
  Eigen::Vector3i regions_ = Eigen::Vector3i::Zero();  // along the axes
  double log_inverse_error_ = 0;
  std::vector<Rung> rungs_;
  std::vector<uint8_t> rung_of_;    // by view
  std::vector<float> drawn_score_;  // by view: over all its draws
  std::vector<uint8_t> proposes_;   // by view: in which of proposers_ it waits
  ViewLattice lattice_;             // of views that enter
  // Queue k has the views whose neighbours 2^k viewcells away are next. A view that goes up is
  // listed again; proposes_ tells which of its entries are void.
  std::array<std::priority_queue<Proposer>, ViewLattice::kCoarsest> proposers_;
  size_t turns_ = 0;
  size_t level_ = 0;    // the queue of proposers_ that had the last turn
  uint64_t pairs_ = 0;  // pairs of view and cell scored so far
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_VIEW_RACE_H_
