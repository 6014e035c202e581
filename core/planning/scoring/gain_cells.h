// Patch cells as the model gain counts them: square metres that come to the required density, and
// nothing else (glossary: model gain).
#ifndef VANTAGE_CORE_PLANNING_SCORING_GAIN_CELLS_H_
#define VANTAGE_CORE_PLANNING_SCORING_GAIN_CELLS_H_

#include <cstdint>

#include "core/parallel/parallel.h"
#include "core/planning/patches/patches.h"
#include "core/planning/scoring/constraints.h"

namespace vantage::planning {

// The same cells, in the same order, so that a scorer's sum over them is the model gain of a view,
// m2, and not its score: a cell counts its area times its probability of success when the view
// brings it to the density D that is required there (samples / m2), from 0.99 D on in proportion,
// and nothing below. Neither weights nor unknown space behind it count, and a cell that has D
// already (after claimed scans) gains nothing. Of cells that are expected and not known, the sum is
// what they are expected to gain, and no model gain.
CellArrays GainCells(const CellArrays& cells, const PatchSet& patches);
// The same, on several threads.
CellArrays GainCells(const CellArrays& cells, const PatchSet& patches,
                     parallel::Parallel& parallel);

// The most model gain that a sample of any cell's score can stand for, m2 per weighted sample. So
// a view's model gain is at most this times its score. `gains` are the GainCells() of `cells`.
double MostGainPerSample(const CellArrays& cells, const CellArrays& gains);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_GAIN_CELLS_H_
