#include "core/planning/ranking/target_advice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "core/registration/align/targets.h"

namespace vantage::planning {
namespace {

// A sphere of this width, m, or a board that is turned to the scanner, of which so many samples
// tell the centre to a millimetre or two: a spacing of 2 cm, as the makers of scanning software ask
// for.
constexpr double kTargetWidth = 0.15;
constexpr double kFewestOnTarget = 50;
// Over the floor, m: within reach, and not behind what stands about.
constexpr double kLowestTarget = 0.5;
constexpr double kHighestTarget = 2.0;
constexpr double kMostTilt = 0.3;  // of a normal, out of the horizontal: a wall
// Between two targets, m: nearer ones tell hardly more than one, and are mistaken for each other.
constexpr double kTargetsApart = 1.0;
// m: from a line through two of them the third and others are at least this far, so that they hold
// the turn about that line as well, whatever is left of the surfaces: to half a degree by sightings
// of 2 mm.
constexpr double kOffLine = 0.3;
constexpr size_t kFewestTargets = 2;  // a single one that was moved or mistaken would go unnoticed
constexpr size_t kMostTargets = 4;
// One sigma of a sighting, m per axis: TargetTie's.
const double kSightingSigma = registration::TargetTie().sigma;
constexpr double kSigmasOfBound = 1.96;  // the bound of a pose holds at 95 % (TiesOf())
// Places that are compared, of all, and stations that targets may be measured from, the nearest
// first: what they cost is a hundredth of a plan.
constexpr size_t kMostPlaces = 40;
constexpr size_t kMostSources = 6;
constexpr size_t kMostAdvised = 3;  // views, the best first: each takes some 50 ms
// And views of other passages: so many of the next best that stand so far, m, from those before.
constexpr size_t kMostElsewhere = 3;
constexpr double kElsewhere = 3.0;
constexpr double kPlaceCube = 0.5;  // m, of which one place is compared

struct Candidate {
  TargetPlace place;
  double sigma = kSightingSigma;  // m
  double samples = 0;             // on the target, from where fewer are
};

registration::TargetTie TieOf(const Candidate& candidate, const Eigen::Vector3d& view) {
  return {candidate.place.target, candidate.place.position - view, candidate.place.position,
          candidate.sigma};
}

// Whether a target lies on a line with two of those that were chosen.
bool IsInLine(const std::vector<const Candidate*>& chosen, const Eigen::Vector3d& at) {
  for (size_t i = 0; i < chosen.size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      const Eigen::Vector3d from = chosen[i]->place.position;
      const Eigen::Vector3d along = (chosen[k]->place.position - from).normalized();
      if (along.cross(at - from).norm() < kOffLine) return true;
    }
  }
  return false;
}

class TargetSearch {
 public:
  TargetSearch(const PlanningProblem& problem, const RankedView& view,
               const parallel::Budget& budget, uint64_t& rays)
      : problem_(problem), overlap_(problem.overlap()), view_(view), budget_(budget), rays_(rays) {}

  std::optional<TargetAdvice> Find(const RankedView* next) {
    sight_ = overlap_.SightFrom(view_.position, problem_.scene(), budget_, view_.heading);
    if (!sight_.has_value()) return std::nullopt;
    rays_ += sight_->rays;
    const registration::RegistrationConfig& config = problem_.config().registration;
    prediction_.emplace(overlap_.Targeted(*sight_, view_.position, config));
    const std::vector<Candidate> known = KnownTargets();
    if (std::optional<TargetAdvice> advice = Choose(known)) return advice;
    if (next != nullptr) {
      std::optional<TargetAdvice> advice =
          Choose(Seen(next->position, next->heading, next->verdict.error_bound, known));
      if (advice.has_value()) {
        advice->first_view = 0;
        return advice;
      }
    }
    return FromStations(known);
  }

 private:
  // The samples that a scan from a place has on a target.
  double OnTarget(const Eigen::Vector3d& from, const Eigen::Vector3d& target) const {
    const Eigen::Vector3d ray = target - from;
    const double range = ray.norm();
    const sensor::ScannerModel& scanner = problem_.scanner();
    const double elevation = std::asin(ray.z() / range);
    if (range < scanner.range_min || range > scanner.range_max ||
        elevation < scanner.elevation_min || elevation > scanner.elevation_max) {
      return 0;
    }
    constexpr double kArea = std::numbers::pi / 4 * kTargetWidth * kTargetWidth;
    return scanner.SamplingDensity(elevation, 1, range) * kArea;
  }
  // Whether a scan has samples of a piece of surface at an incidence that counts.
  bool Faces(const Eigen::Vector3d& from, const Eigen::Vector3d& at,
             const Eigen::Vector3d& normal) const {
    const Eigen::Vector3d ray = at - from;
    return -normal.dot(ray) >= std::cos(problem_.scanner().max_incidence) * ray.norm();
  }
  Eigen::Vector3d PositionOf(size_t i) const {
    const CellArrays& cells = overlap_.cells();
    return Eigen::Vector3f(cells.x[i], cells.y[i], cells.z[i]).cast<double>();
  }
  Eigen::Vector3d NormalOf(size_t i) const {
    const CellArrays& cells = overlap_.cells();
    return Eigen::Vector3f(cells.nx[i], cells.ny[i], cells.nz[i]).cast<double>();
  }

  // Known targets that the view sees.
  std::vector<Candidate> KnownTargets() const {
    std::vector<Candidate> known;
    for (const registration::KnownTarget& target : problem_.config().targets) {
      const double samples = OnTarget(view_.position, target.in_world);
      if (samples < kFewestOnTarget ||
          !overlap_.Sees(view_.position, target.in_world, problem_.scene(), view_.heading)) {
        continue;
      }
      known.push_back(
          {{target.in_world, std::nullopt, target.name, (target.in_world - view_.position).norm()},
           target.sigma,
           samples});
    }
    return known;
  }

  // m, over the floor, or, where none is known (treads are too narrow for a scanner to stand on),
  // over the measured surface below; NaN where there is none within reach.
  double HeightOverGround(const Eigen::Vector3d& at) const {
    const double over_floor = problem_.feasible().HeightOverFloor(at);
    if (!std::isnan(over_floor)) return over_floor;
    const model::PlanningView& model = problem_.model();
    const double h = model.voxel_size();
    for (double down = 0; down <= kHighestTarget + h; down += h) {
      const model::VoxelIndex below = model.At(at - Eigen::Vector3d(0, 0, down));
      if (model.Empty(below)) continue;
      if (model.State(below) != model::VoxelState::kTrueSurface) break;
      return at.z() - static_cast<double>(model.Surface(below)->centroid.z());
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  // Places on walls that are seen from the view and from `from`, where they would be measured with
  // a pose that is known to `error_bound`, and what is known besides.
  std::vector<Candidate> Seen(const Eigen::Vector3d& from, std::optional<double> heading,
                              double error_bound, const std::vector<Candidate>& known) const {
    const auto there = overlap_.SightFrom(from, problem_.scene(), budget_, heading);
    if (!there.has_value()) return {};
    rays_ += there->rays;
    const double sigma = std::hypot(kSightingSigma, error_bound / kSigmasOfBound);
    // The best of each cube, in order of first appearance, so that the choice stays the same.
    absl::flat_hash_map<std::array<int, 3>, size_t> of_cube;
    std::vector<Candidate> places;
    for (size_t i = 0; i < overlap_.cells().size(); ++i) {
      if (!(sight_->samples[i] > 0 && there->samples[i] > 0)) continue;
      const Eigen::Vector3d at = PositionOf(i);
      if (std::abs(NormalOf(i).z()) > kMostTilt) continue;
      const double height = HeightOverGround(at + kPlaceCube * NormalOf(i));
      if (!(height >= kLowestTarget && height <= kHighestTarget)) continue;
      const double samples = std::min(OnTarget(view_.position, at), OnTarget(from, at));
      if (samples < kFewestOnTarget || !Faces(view_.position, at, NormalOf(i)) ||
          !Faces(from, at, NormalOf(i))) {
        continue;
      }
      const Eigen::Array3i cube = (at.array() / kPlaceCube).floor().cast<int>();
      const auto [it, fresh] = of_cube.try_emplace({cube.x(), cube.y(), cube.z()}, places.size());
      Candidate candidate{{at, NormalOf(i), "", (at - view_.position).norm()}, sigma, samples};
      if (fresh) {
        places.push_back(std::move(candidate));
      } else if (samples > places[it->second].samples) {
        places[it->second] = std::move(candidate);
      }
    }
    places = FarthestApart(std::move(places));
    if (places.empty()) return {};
    places.insert(places.end(), known.begin(), known.end());
    return places;
  }

  // So many of them that lie far from each other, from the one farthest from the view on.
  static std::vector<Candidate> FarthestApart(std::vector<Candidate> places) {
    if (places.size() <= kMostPlaces) return places;
    std::vector<Candidate> kept;
    std::vector<double> away(places.size());
    for (size_t i = 0; i < places.size(); ++i) away[i] = places[i].place.distance;
    while (kept.size() < kMostPlaces) {
      const size_t next =
          static_cast<size_t>(std::max_element(away.begin(), away.end()) - away.begin());
      kept.push_back(places[next]);
      for (size_t i = 0; i < places.size(); ++i) {
        const double apart = (places[i].place.position - places[next].place.position).norm();
        away[i] = kept.size() == 1 ? apart : std::min(away[i], apart);
      }
    }
    return kept;
  }

  // Greedily, each the one that leaves the smallest bound, until the view registers.
  std::optional<TargetAdvice> Choose(const std::vector<Candidate>& candidates) const {
    std::vector<const Candidate*> chosen;
    std::vector<registration::TargetTie> ties;
    while (chosen.size() < kMostTargets) {
      const Candidate* best = nullptr;
      double least = std::numeric_limits<double>::max();
      for (const Candidate& candidate : candidates) {
        if (budget_.Expired()) return std::nullopt;
        const bool near = std::any_of(chosen.begin(), chosen.end(), [&](const Candidate* other) {
          return (other->place.position - candidate.place.position).norm() < kTargetsApart;
        });
        if (near || IsInLine(chosen, candidate.place.position)) continue;
        ties.push_back(TieOf(candidate, view_.position));
        const double bound = prediction_->Bound(ties);
        ties.pop_back();
        if (bound >= least) continue;
        least = bound;
        best = &candidate;
      }
      if (best == nullptr) return std::nullopt;
      chosen.push_back(best);
      ties.push_back(TieOf(*best, view_.position));
      if (chosen.size() < kFewestTargets) continue;
      const registration::RegistrationVerdict verdict =
          overlap_.JudgeSight(*sight_, view_.position, problem_.config().registration, ties);
      if (!verdict.registered()) continue;
      TargetAdvice advice;
      for (const Candidate* candidate : chosen) advice.places.push_back(candidate->place);
      advice.error_bound = verdict.error_bound;
      return advice;
    }
    return std::nullopt;
  }

  std::vector<ScannedFrom> Stations() const {
    std::vector<ScannedFrom> stations = problem_.config().scanned_from;
    if (stations.empty()) {
      for (const model::Station& station : problem_.model().stations()) {
        stations.push_back({absl::StrCat("scan ", stations.size() + 1), station.position, 0});
      }
    }
    std::stable_sort(stations.begin(), stations.end(),
                     [&](const ScannedFrom& a, const ScannedFrom& b) {
                       return (a.position - view_.position).squaredNorm() <
                              (b.position - view_.position).squaredNorm();
                     });
    if (stations.size() > kMostSources) stations.resize(kMostSources);
    return stations;
  }

  // Of what stations see the smallest set, of equally small ones that of the nearest station.
  std::optional<TargetAdvice> FromStations(const std::vector<Candidate>& known) const {
    std::optional<TargetAdvice> best;
    const std::vector<ScannedFrom> stations = Stations();
    for (const ScannedFrom& station : stations) {
      std::optional<TargetAdvice> advice =
          Choose(Seen(station.position, std::nullopt, station.error_bound, known));
      if (!advice.has_value()) continue;
      if (best.has_value() && best->places.size() <= advice->places.size()) continue;
      best = std::move(advice);
      best->seen_from = {station.name};
      if (best->places.size() <= kFewestTargets) break;
    }
    if (!best.has_value()) return best;
    for (const ScannedFrom& station : stations) {
      if (station.name != best->seen_from.front() && SeesAll(station, best->places)) {
        best->seen_from.push_back(station.name);
      }
    }
    return best;
  }
  bool SeesAll(const ScannedFrom& station, const std::vector<TargetPlace>& places) const {
    return std::all_of(places.begin(), places.end(), [&](const TargetPlace& place) {
      return !place.normal.has_value() ||
             (Faces(station.position, place.position, *place.normal) &&
              OnTarget(station.position, place.position) >= kFewestOnTarget &&
              overlap_.Sees(station.position, place.position, problem_.scene(), std::nullopt));
    });
  }

  const PlanningProblem& problem_;
  const OverlapSurface& overlap_;
  const RankedView& view_;
  const parallel::Budget& budget_;
  uint64_t& rays_;
  std::optional<OverlapSurface::Sight> sight_;
  std::optional<registration::TargetedPrediction> prediction_;
};

}  // namespace

uint64_t AdviseTargets(const PlanningProblem& problem, const parallel::Budget& budget, Plan& plan) {
  uint64_t rays = 0;
  const RankedView* next = plan.views.empty() ? nullptr : &plan.views.front();
  // Where nothing registers, the advice is what the plan is good for.
  parallel::Budget untimed = budget;
  untimed.deadline = parallel::Budget::Clock::time_point::max();
  std::vector<Eigen::Vector3d> advised;
  for (size_t i = 0; i < plan.refused.size(); ++i) {
    RankedView& view = plan.refused[i];
    const bool elsewhere = std::none_of(
        advised.begin(), advised.end(),
        [&](const Eigen::Vector3d& other) { return (other - view.position).norm() < kElsewhere; });
    if (i >= kMostAdvised && !elsewhere) continue;
    const bool anyway = i == 0 && next == nullptr;
    if (budget.cancelled.stop_requested() || (!anyway && budget.Expired())) break;
    view.targets = FindTargets(problem, view, next, anyway ? untimed : budget, rays);
    advised.push_back(view.position);
    if (advised.size() == kMostAdvised + kMostElsewhere) break;
  }
  return rays;
}

std::optional<TargetAdvice> FindTargets(const PlanningProblem& problem, const RankedView& view,
                                        const RankedView* next, const parallel::Budget& budget,
                                        uint64_t& rays) {
  if (view.verdict.registered() ||
      view.verdict.overlap_share < problem.config().registration.minimum_overlap) {
    return std::nullopt;
  }
  return TargetSearch(problem, view, budget, rays).Find(next);
}

}  // namespace vantage::planning
