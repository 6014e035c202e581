// The race: samples of the cells, larger and larger, on fewer and fewer of the views (algorithm.md
// section 8, 'Anytime, and honest about it').
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
  size_t first_draws = 256;  // of cells, for a view that enters
  size_t growth = 4;         // of the sample from rung to rung
  size_t promotion = 16;     // one in so many views goes up, at first
  size_t widest = 4;         // the same, once every view has entered and there is time
};

// Successive halving without rounds: every rung is the size of a sample, the last one all cells. A
// view goes up when it is among the best sixteenth of those that reached its rung, so that each
// rung gets a quarter of the effort of the one below. The more work is done, the more go up, until
// it is every second from the first rung and every fourth from the others, which then get the same
// effort each: small samples suit a quick look, and mislead a long one.
//
// All views on a rung share its sample. So where that happens to hold too much of what a room
// shows, all views there look too good, and would fill the next rung. What those that went up were
// found to be worse is therefore taken off their neighbours, before the best are chosen.
//
// Half of those that enter are the next of a lattice of views, the coarsest first; the others are
// neighbours of views that rank best, two times of three at each distance on the lattice in turn,
// else of the best of all: so its surroundings are looked at closely, but not before all else. An
// answer is there early, and nothing is decided by the budget.
class ViewRace {
 public:
  // The bounds of all views on all rungs hold together with `confidence`. References are kept.
  ViewRace(EvaluationRun& run, const CellSampler& sampler, const RaceOptions& options,
           double confidence, uint64_t seed);

  // Until every view has entered and nobody is to go up, or the budget is spent.
  void Run(const parallel::Budget& part);

  // Lets twice as many go up from now on: who was unlucky on a small sample gets another chance.
  // False when that is as wide as the race gets.
  bool Widen();

  // Rungs between that on which views enter and that of all cells are 1 to rungs() - 2.
  size_t rungs() const { return rungs_.size(); }
  // The rung's sample for whoever may still be better than the best view is for certain: so the gap
  // closes long before everything is exact.
  void Tighten(size_t rung, const parallel::Budget& part);

 private:
  static constexpr uint8_t kOutside = 0xff;
  static constexpr uint8_t kAllProposed = 0xff;

  // Of the views of a region that went up: by how much larger samples changed their scores.
  struct Revision {
    float sum = 0;  // samples
    float views = 0;
  };
  struct Rung {
    size_t draws = 0;  // of this rung alone
    size_t total = 0;  // and those below
    CellSample sample;
    std::vector<MeanBounds> bounds;   // one, made with the sample
    size_t reached = 0;               // views, those that went on included
    std::vector<uint32_t> waiting;    // to go up
    std::vector<Revision> revisions;  // by region
  };
  // A view whose neighbours may enter, by what it was ranked when it was listed.
  struct Proposer {
    double rank;
    uint32_t view;
    bool operator<(const Proposer& other) const {
      return rank != other.rank ? rank < other.rank : view > other.view;
    }
  };

  bool Step(const parallel::Budget& part);
  // One in so many views goes up to the rung.
  size_t Promotion(size_t rung) const;
  uint32_t RegionOf(uint32_t view) const;
  // The score of a view that waits on the rung, revised as its neighbours' were.
  double RevisedScore(uint32_t view, size_t rung) const;
  bool GoUp(size_t rung, size_t count, const parallel::Budget& part);
  bool Enter(const parallel::Budget& part);
  // Whose neighbours are next, by the index of the queue; nothing when all were proposed.
  std::optional<size_t> NextToPropose();
  bool ScoreOn(size_t rung, std::span<const uint32_t> which, const parallel::Budget& part);
  void Arrive(uint32_t view, size_t rung);
  // Takes those out that were decided on in the meantime, and returns them: they arrive without a
  // sample.
  std::vector<uint32_t> ArriveExact(std::vector<uint32_t>& views, size_t rung);
  void Note(uint32_t view, size_t rung, double score);
  // Lists a view as one whose neighbours 2^level viewcells away may enter.
  void Propose(uint32_t view, size_t level);
  // The same for one that enters: half as far away as those on its level of the lattice.
  void ProposeFirst(uint32_t view);
  void ListNeighbours(uint32_t of, int step, std::vector<uint32_t>& entering);
  // Views that are scored together: the more work is done, the more.
  size_t BatchOn(size_t rung) const;
  const CellSample* SampleOf(size_t rung);  // null: all cells
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
  // By the distance of the neighbours that are next, 2^k viewcells. Whoever went up since is listed
  // again: once it has proposed, proposes_ says that the other entry is void.
  std::array<std::priority_queue<Proposer>, ViewLattice::kCoarsest> proposers_;
  size_t turns_ = 0;
  size_t level_ = 0;    // of proposers_, whose turn it was last
  uint64_t pairs_ = 0;  // of view and cell, scored
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_VIEW_RACE_H_
