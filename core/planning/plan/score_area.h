// A score in square metres.
#ifndef VANTAGE_CORE_PLANNING_PLAN_SCORE_AREA_H_
#define VANTAGE_CORE_PLANNING_PLAN_SCORE_AREA_H_

namespace vantage::planning {

// The surface that a score would bring from nothing to the required density, m2: what fields of the
// contract give that came before the model gain. With weights, with space behind openings and with
// what samples on surface short of D are worth, so it may exceed what is there. `score` is in
// weighted samples, `required_density` (D > 0) in samples per m2.
inline double ScoreArea(double score, double required_density) { return score / required_density; }

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_SCORE_AREA_H_
