// Converts a score into square metres (glossary: model gain).
#ifndef VANTAGE_CORE_PLANNING_PLAN_MODEL_GAIN_H_
#define VANTAGE_CORE_PLANNING_PLAN_MODEL_GAIN_H_

namespace vantage::planning {

// Surface that a view would bring to the required density in the model, m2. `score` is in weighted
// samples, `required_density` (D > 0) in samples per m2.
inline double ModelGain(double score, double required_density) { return score / required_density; }

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_MODEL_GAIN_H_
