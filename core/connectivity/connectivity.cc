#include "core/connectivity/connectivity.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "absl/strings/str_format.h"

namespace vantage::connectivity {
namespace {

struct Way {
  uint32_t to = 0;
  size_t link = 0;
};
using Ways = std::vector<std::vector<Way>>;  // by station

// One walk through all stations (Tarjan 1972), with a stack of its own: chains of scans are long.
class Walk {
 public:
  Walk(const Ways& ways, std::span<const StationLink> links)
      : ways_(ways),
        met_(ways.size(), 0),
        low_(ways.size(), 0),
        below_(ways.size(), 1),
        parts_(ways.size()),
        roots_(ways.size(), 0),
        beyond_(links.size(), 0),
        piece_(ways.size(), 0) {
    for (uint32_t i = 0; i < ways.size(); ++i) {
      if (met_[i] != 0) continue;
      From(i);
      sizes_.push_back(below_[i]);
    }
  }

  void Describe(std::span<const StationLink> links, Connectivity& connectivity) const {
    connectivity.pieces = sizes_.size();
    for (const size_t size : sizes_) connectivity.tied_pairs += uint64_t{size} * (size - 1) / 2;
    for (uint32_t i = 0; i < ways_.size(); ++i) {
      const size_t piece = sizes_[piece_[i]];
      // What falls apart without the station: the parts below it that reach no further up, and,
      // but for the walk's root, all the rest.
      std::vector<size_t> parts = parts_[i];
      size_t rest = piece - 1;
      for (const size_t part : parts) rest -= part;
      if (roots_[i] == 0 && rest > 0) parts.push_back(rest);
      if (parts.size() < 2) continue;
      const size_t largest = *std::max_element(parts.begin(), parts.end());
      connectivity.cuts.push_back({i, piece - 1 - largest});
    }
    for (size_t l = 0; l < beyond_.size(); ++l) {
      if (beyond_[l] == 0) continue;
      const size_t piece = sizes_[piece_[links[l].a]];
      connectivity.bridges.push_back({l, std::min(beyond_[l], piece - beyond_[l])});
    }
  }

 private:
  struct Place {
    uint32_t station = 0;
    size_t by = 0;  // link
    size_t next = 0;
    bool root = false;
  };
  void From(uint32_t root) {
    std::vector<Place> stack = {{root, 0, 0, true}};
    roots_[root] = 1;
    Meet(root);
    while (!stack.empty()) {
      Place& at = stack.back();
      if (at.next < ways_[at.station].size()) {
        const Way way = ways_[at.station][at.next++];
        if (!at.root && way.link == at.by) continue;
        if (met_[way.to] == 0) {
          Meet(way.to);
          stack.push_back({way.to, way.link, 0, false});
        } else {
          low_[at.station] = std::min(low_[at.station], met_[way.to]);
        }
        continue;
      }
      const Place done = at;
      stack.pop_back();
      if (done.root) break;
      const uint32_t parent = stack.back().station;
      low_[parent] = std::min(low_[parent], low_[done.station]);
      below_[parent] += below_[done.station];
      if (low_[done.station] > met_[parent]) beyond_[done.by] = below_[done.station];
      if (low_[done.station] >= met_[parent]) parts_[parent].push_back(below_[done.station]);
    }
  }
  void Meet(uint32_t station) {
    met_[station] = low_[station] = ++clock_;
    piece_[station] = sizes_.size();
  }

  const Ways& ways_;
  std::vector<uint32_t> met_;  // when; 0: not yet
  std::vector<uint32_t> low_;
  std::vector<size_t> below_;               // stations that were met through it, itself counted
  std::vector<std::vector<size_t>> parts_;  // below it, that hang on it alone
  std::vector<uint8_t> roots_;
  std::vector<size_t> beyond_;  // by link, of bridges
  std::vector<size_t> piece_;
  std::vector<size_t> sizes_;  // by piece
  uint32_t clock_ = 0;
};

// Squared sigmas from one station to all others (Dijkstra 1959).
std::vector<double> VariancesFrom(uint32_t from, const Ways& ways,
                                  std::span<const StationLink> links) {
  std::vector<double> variances(ways.size(), std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  variances[from] = 0;
  open.push({0, from});
  while (!open.empty()) {
    const auto [variance, at] = open.top();
    open.pop();
    if (variance > variances[at]) continue;
    for (const Way& way : ways[at]) {
      const double there = variance + links[way.link].sigma * links[way.link].sigma;
      if (there >= variances[way.to]) continue;
      variances[way.to] = there;
      open.push({there, way.to});
    }
  }
  return variances;
}

}  // namespace

absl::StatusOr<Connectivity> MeasureConnectivity(size_t stations,
                                                 std::span<const StationLink> links) {
  Ways ways(stations);
  for (size_t l = 0; l < links.size(); ++l) {
    const StationLink& link = links[l];
    if (link.a >= stations || link.b >= stations || link.a == link.b) {
      return absl::InvalidArgumentError(
          absl::StrFormat("link %d ties stations %d and %d, of %d", l, link.a, link.b, stations));
    }
    if (!(link.sigma > 0) || !std::isfinite(link.sigma)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "link %d has a sigma of %g m; it has to be positive and finite", l, link.sigma));
    }
    ways[link.a].push_back({link.b, l});
    ways[link.b].push_back({link.a, l});
  }
  Connectivity connectivity;
  Walk(ways, links).Describe(links, connectivity);
  double sum = 0;
  for (uint32_t i = 0; i < stations; ++i) {
    const std::vector<double> variances = VariancesFrom(i, ways, links);
    for (uint32_t j = i + 1; j < stations; ++j) {
      if (!std::isfinite(variances[j])) continue;
      const double sigma = std::sqrt(variances[j]);
      sum += sigma;
      connectivity.longest_path_sigma = std::max(connectivity.longest_path_sigma, sigma);
    }
  }
  if (connectivity.tied_pairs > 0) {
    connectivity.mean_path_sigma = sum / static_cast<double>(connectivity.tied_pairs);
  }
  const auto most_first = [](const auto& l, const auto& r) { return l.cut_off > r.cut_off; };
  std::stable_sort(connectivity.cuts.begin(), connectivity.cuts.end(), most_first);
  std::stable_sort(connectivity.bridges.begin(), connectivity.bridges.end(), most_first);
  return connectivity;
}

}  // namespace vantage::connectivity
