#include "core/tour/describe_tour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/cover/element_set.h"
#include "core/tour/worth_curve.h"

namespace vantage::tour {
namespace {

constexpr size_t kOpenPlaces = 10;
// Cubes that what stays open is summed up in, m: a person who looks for it finds it by that.
constexpr double kCube = 2;
constexpr double kLeastOpen = 0.1;  // m^2, of a cube that is told

std::string Hours(double minutes) {
  const auto whole = static_cast<int>(std::lround(minutes));
  if (whole < 60) return absl::StrFormat("%d min", whole);
  return absl::StrFormat("%d h %02d min", whole / 60, whole % 60);
}

class Describer {
 public:
  Describer(const TourSources& from, const ChosenTour& chosen, const std::stop_token& cancelled,
            parallel::Parallel& parallel)
      : from_(from), chosen_(chosen), made_(chosen.arrangement), parallel_(parallel) {
    unlimited_.cancelled = cancelled;
  }

  Tour Describe(uint64_t& rays) {
    Measure(rays);
    Tour tour;
    tour.area_before = from_.choice.AreaBefore();
    tour.scanner_minutes = made_.done;
    tour.minutes = made_.minutes;
    tour.area = areas_.empty() ? 0 : areas_.back();
    const GainElements& elements = from_.table.elements();
    const double to_checked = elements.total > 0 ? from_.checked.total / elements.total : 1;
    tour.attainable = std::max(from_.table.attainable() * to_checked, tour.area);
    tour.out_of_reach = std::max(0.0, from_.checked.total - tour.attainable);
    const double all = tour.area_before + tour.attainable;
    const auto share = [&](double brought) {
      return all > 0 ? (tour.area_before + brought) / all : 1;
    };
    tour.coverage_before = share(0);
    tour.coverage = share(tour.area);
    const std::vector<std::vector<uint32_t>> links = from_.arranger.Links().links;
    for (size_t k = 0; k < made_.stops.size(); ++k) {
      TourStop stop = StopOf(k, links);
      stop.area = areas_[k] - (k > 0 ? areas_[k - 1] : 0);
      stop.coverage = share(areas_[k]);
      tour.kept += stop.kept ? 1 : 0;
      tour.walked += stop.way_length;
      tour.stops.push_back(std::move(stop));
    }
    tour.candidates = from_.table.candidates().size();
    // Candidates that came since may do with fewer, and raise the goal.
    tour.fewest = from_.choice.Fewest();
    tour.reaches_goal =
        chosen_.reaches_goal &&
        (!from_.request.goal.has_value() || made_.area >= from_.choice.GoalWeight() * (1 - 1e-9));
    tour.not_registering = made_.not_registering.size();
    tour.not_worth_it = chosen_.not_worth_it;
    for (const WorthStep& step : Worth()) {
      tour.worth.push_back({step.scans, step.minutes, step.area, share(step.area)});
    }
    tour.open = Open();
    tour.message = Message(tour);
    return tour;
  }

 private:
  // What each stop brings, by the cells that the tour was not chosen by, and the way to it.
  void Measure(uint64_t& rays) {
    const size_t count = made_.stops.size();
    const cover::ElementSet none = cover::EmptySet(from_.checked.weights.size());
    brought_.resize(count);
    ways_.resize(count);
    std::vector<uint64_t> cast(count, 0);
    parallel_.For(count, [&](size_t k) {
      const ArrangedStop& stop = made_.stops[k];
      const Candidate& candidate = from_.table.candidates()[stop.candidate];
      brought_[k] =
          Brought(from_.problem, candidate, from_.checked, unlimited_, cast[k]).value_or(none);
      if (unlimited_.Expired()) return;
      std::optional<Eigen::Vector3d> before;
      if (stop.after.has_value()) {
        before = from_.table.candidates()[*stop.after].position;
      } else if (stop.day == 0) {
        before = from_.arranger.StartOf(stop.scanner);
      }
      if (before.has_value()) ways_[k] = from_.ways.Way(*before, candidate.position);
    });
    all_ = none;
    for (size_t k = 0; k < count; ++k) {
      rays += cast[k];
      cover::Unite(all_, brought_[k]);
      // Summed by element, so that the last is what the whole tour brings, to the bit.
      double area = 0;
      cover::ForEach(all_, [&](size_t i) { area += from_.checked.weights[i]; });
      areas_.push_back(area);
    }
  }

  TourStop StopOf(size_t k, const std::vector<std::vector<uint32_t>>& all_links) const {
    const ArrangedStop& from = made_.stops[k];
    const Candidate& candidate = from_.table.candidates()[from.candidate];
    TourStop stop;
    stop.position = candidate.position;
    stop.heading = candidate.heading;
    stop.scanner = from.scanner;
    stop.storey = candidate.storey;
    stop.expected = from_.problem.BasisOf(candidate.position) == planning::StationBasis::kExpected;
    stop.kept = from_.choice.IsPrevious(from.candidate);
    stop.way = ways_[k];
    for (size_t i = 1; i < stop.way.size(); ++i) {
      stop.way_length += (stop.way[i] - stop.way[i - 1]).head<2>().norm();
    }
    stop.wait = from.wait;
    stop.start = from.start;
    stop.end = from.end;
    stop.day = from.day;
    stop.verdict = from.verdict;
    const std::vector<uint32_t>& links = all_links[from.candidate];
    for (size_t j = 0; j < k; ++j) {
      if (made_.stops[j].end <= from.start + 1e-9 &&
          std::binary_search(links.begin(), links.end(), made_.stops[j].candidate)) {
        stop.registers_with.push_back(j);
      }
    }
    return stop;
  }

  std::vector<WorthStep> Worth() const {
    std::vector<cover::ElementSet> covers(made_.stations.size());
    for (size_t i = 0; i < covers.size(); ++i) {
      for (size_t k = 0; k < made_.stops.size(); ++k) {
        if (made_.stops[k].candidate == made_.stations[i]) covers[i] = brought_[k];
      }
    }
    return WorthCurve(made_.order, made_.routes, covers, from_.checked.weights, unlimited_);
  }

  // Where most of what some candidate brings stays open.
  std::vector<OpenPlace> Open() const {
    const planning::CellArrays& cells = from_.checked.cells;
    struct Sum {
      std::array<int, 3> cube{};
      uint32_t element = 0;
    };
    std::vector<Sum> sums;
    for (uint32_t i = 0; i < from_.checked.weights.size(); ++i) {
      if (cover::Contains(all_, i)) continue;
      const auto at = [&](float v) { return static_cast<int>(std::floor(v / kCube)); };
      sums.push_back({{at(cells.x[i]), at(cells.y[i]), at(cells.z[i])}, i});
    }
    std::stable_sort(sums.begin(), sums.end(),
                     [](const Sum& a, const Sum& b) { return a.cube < b.cube; });
    std::vector<OpenPlace> places;
    for (size_t begin = 0; begin < sums.size();) {
      size_t end = begin;
      OpenPlace place;
      for (; end < sums.size() && sums[end].cube == sums[begin].cube; ++end) {
        const uint32_t i = sums[end].element;
        const double weight = from_.checked.weights[i];
        place.area += weight;
        place.position += weight * Eigen::Vector3d(cells.x[i], cells.y[i], cells.z[i]);
      }
      place.position /= place.area;
      if (place.area >= kLeastOpen) places.push_back(place);
      begin = end;
    }
    std::stable_sort(places.begin(), places.end(),
                     [](const OpenPlace& a, const OpenPlace& b) { return a.area > b.area; });
    if (places.size() > kOpenPlaces) places.resize(kOpenPlaces);
    return places;
  }

  std::string Message(const Tour& tour) const {
    const double point = 1 / std::sqrt(from_.problem.config().required_density);
    const size_t scans = tour.stops.size();
    if (scans == 0) {
      return absl::StrFormat(
          "%s: %.0f %% at %.3g cm",
          from_.table.overlap().AnyKnown() && from_.arranger.Links().anchored.empty()
              ? "no place is known at which a scan would register to those that were made"
              : "nothing to go for",
          100 * tour.coverage, 100 * point);
    }
    std::string said =
        absl::StrFormat("%d station%s, %s, %.0f %% at %.3g cm", scans, scans == 1 ? "" : "s",
                        Hours(tour.minutes), 100 * tour.coverage, 100 * point);
    const size_t points = tour.worth.size();
    if (points > 2) {
      absl::StrAppendFormat(
          &said, "; the last two scans bring %.1f %%",
          100 * (tour.worth[points - 1].coverage - tour.worth[points - 3].coverage));
    }
    if (tour.not_worth_it > 0) {
      absl::StrAppendFormat(
          &said, "; left out: %d that would bring less than %.3g m\u00b2 each beyond the others",
          tour.not_worth_it, from_.choice.WorthAScan());
    }
    if (const size_t closed = made_.closed.size(); closed > 0) {
      absl::StrAppendFormat(
          &said, "; %d station%s left out: the room is closed when anybody could be there", closed,
          closed == 1 ? " is" : "s are");
    }
    return said;
  }

  const TourSources& from_;
  const ChosenTour& chosen_;
  const Arrangement& made_;
  parallel::Parallel& parallel_;
  parallel::Budget unlimited_ = parallel::Budget::Unlimited();
  std::vector<cover::ElementSet> brought_;          // by stop
  std::vector<std::vector<Eigen::Vector3d>> ways_;  // by stop
  cover::ElementSet all_;                           // by all stops together
  std::vector<double> areas_;                       // m^2, by all stops up to this one
};

}  // namespace

Tour DescribeTour(const TourSources& from, const ChosenTour& chosen,
                  const std::stop_token& cancelled, parallel::Parallel& parallel, uint64_t& rays) {
  return Describer(from, chosen, cancelled, parallel).Describe(rays);
}

}  // namespace vantage::tour
