#include "core/cover/bonds.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace vantage::cover {
namespace {

// The stations without which others fall apart, by their place in `stations` (Tarjan 1972). The
// anchors are a node of their own, the last, which all anchored stations are linked with.
std::vector<uint8_t> Needed(const Instance& instance, const std::vector<Index>& stations) {
  const size_t count = stations.size();
  const size_t nodes = count + (instance.rooted ? 1 : 0);
  std::vector<std::vector<uint32_t>> near(nodes);
  for (uint32_t a = 0; a < count; ++a) {
    for (uint32_t b = a + 1; b < count; ++b) {
      if (!instance.Linked(stations[a], stations[b])) continue;
      near[a].push_back(b);
      near[b].push_back(a);
    }
    if (instance.rooted && instance.anchored[stations[a]] != 0) {
      near[a].push_back(static_cast<uint32_t>(count));
      near[count].push_back(a);
    }
  }
  std::vector<uint8_t> needed(nodes, 0);
  std::vector<uint32_t> met(nodes, 0);  // when; 0: not yet
  std::vector<uint32_t> low(nodes, 0);
  struct Visit {
    uint32_t node, from;
    size_t next = 0;
  };
  if (nodes == 0) return needed;
  const auto root = static_cast<uint32_t>(nodes - 1);
  std::vector<Visit> stack = {{root, root}};
  uint32_t clock = 1;
  met[root] = low[root] = clock;
  size_t children_of_root = 0;
  while (!stack.empty()) {
    Visit& at = stack.back();
    if (at.next < near[at.node].size()) {
      const uint32_t to = near[at.node][at.next++];
      if (met[to] == 0) {
        met[to] = low[to] = ++clock;
        stack.push_back({to, at.node});
      } else if (to != at.from) {
        low[at.node] = std::min(low[at.node], met[to]);
      }
      continue;
    }
    const Visit done = at;
    stack.pop_back();
    if (stack.empty()) break;
    low[done.from] = std::min(low[done.from], low[done.node]);
    if (done.from == root) {
      ++children_of_root;
    } else if (low[done.node] >= met[done.from]) {
      needed[done.from] = 1;
    }
  }
  needed[root] = children_of_root > 1 ? 1 : 0;
  needed.resize(count);
  return needed;
}

// Whether all stations are reached over links from those that are anchored, or from one of them
// where none has to be.
template <typename Station, typename Anchored, typename Linked>
bool AllReached(std::vector<Station> left, bool rooted, Anchored anchored, Linked linked) {
  if (left.empty()) return true;
  std::vector<Station> reached;
  if (rooted) {
    std::copy_if(left.begin(), left.end(), std::back_inserter(reached), anchored);
    std::erase_if(left, anchored);
  } else {
    reached.push_back(left.back());
    left.pop_back();
  }
  for (size_t head = 0; head < reached.size(); ++head) {
    for (size_t k = 0; k < left.size();) {
      if (linked(reached[head], left[k])) {
        reached.push_back(left[k]);
        left[k] = left.back();
        left.pop_back();
      } else {
        ++k;
      }
    }
  }
  return left.empty();
}

}  // namespace

Bonds::Bonds(const Choice& choice) : choice_(choice), parts_(choice.slots()) {
  const std::vector<Index> stations = choice.Stations();
  const std::vector<uint8_t> needed = Needed(choice.instance(), stations);
  for (size_t k = 0; k < stations.size(); ++k) {
    const size_t slot = choice.SlotOf(stations[k]);
    if (needed[k] != 0) parts_[slot] = PartsWithout(slot);
  }
}

std::vector<Bonds::Part> Bonds::PartsWithout(size_t slot) const {
  const Instance& instance = choice_.instance();
  std::vector<Index> left = choice_.Stations();
  std::erase(left, choice_.At(slot));
  std::vector<Part> parts;
  const auto grow = [&](Part part) {
    for (size_t head = 0; head < part.size(); ++head) {
      const auto apart = std::stable_partition(
          left.begin(), left.end(), [&](Index i) { return !instance.Linked(part[head], i); });
      part.insert(part.end(), apart, left.end());
      left.erase(apart, left.end());
    }
    parts.push_back(std::move(part));
  };
  if (instance.rooted) {
    Part rooted;
    for (const Index i : left) {
      if (instance.anchored[i] != 0) rooted.push_back(i);
    }
    std::erase_if(left, [&](Index i) { return instance.anchored[i] != 0; });
    grow(std::move(rooted));  // may be empty
  }
  while (!left.empty()) {
    Part seed = {left.back()};
    left.pop_back();
    grow(std::move(seed));
  }
  return parts;
}

bool Bonds::MayReplace(size_t slot, Index candidate) const {
  const Instance& instance = choice_.instance();
  const bool anchored = instance.rooted && instance.anchored[candidate] != 0;
  const std::vector<Part>& parts = parts_[slot];
  if (parts.empty()) {
    if (anchored || (!instance.rooted && choice_.size() == 1)) return true;
    const uint32_t with_it = instance.Linked(candidate, choice_.At(slot)) ? 1 : 0;
    return choice_.Linked(candidate) > with_it;
  }
  for (size_t k = 0; k < parts.size(); ++k) {
    if (k == 0 && anchored) continue;
    if (std::none_of(parts[k].begin(), parts[k].end(),
                     [&](Index i) { return instance.Linked(candidate, i); })) {
      return false;
    }
  }
  return true;
}

bool HangTogether(const Instance& instance, const std::vector<Index>& stations) {
  return AllReached(
      stations, instance.rooted, [&](Index i) { return instance.anchored[i] != 0; },
      [&](Index a, Index b) { return instance.Linked(a, b); });
}

bool HangTogether(const CoverProblem& problem, const std::vector<uint32_t>& stations) {
  return AllReached(
      stations, !problem.anchored.empty(),
      [&](uint32_t i) {
        return std::find(problem.anchored.begin(), problem.anchored.end(), i) !=
               problem.anchored.end();
      },
      [&](uint32_t a, uint32_t b) {
        return std::binary_search(problem.links[a].begin(), problem.links[a].end(), b);
      });
}

std::vector<Index> InOrder(const Instance& instance, const std::vector<Index>& stations) {
  std::vector<Index> left = stations;
  std::sort(left.begin(), left.end());
  std::vector<Index> order;
  ElementSet covered = EmptySet(instance.elements());
  std::vector<uint8_t> reached(instance.candidates(), 0);
  while (!left.empty()) {
    size_t best = left.size();
    int64_t most = -1;
    for (size_t k = 0; k < left.size(); ++k) {
      const Index i = left[k];
      const bool free_first = !instance.rooted && order.empty();
      if (!free_first && instance.anchored[i] == 0 && reached[i] == 0) continue;
      int64_t gain = 0;
      ForEachBeyond(instance.covers[i], covered, [&](size_t e) { gain += instance.weights[e]; });
      if (gain > most) {
        most = gain;
        best = k;
      }
    }
    if (best == left.size()) break;  // they do not hang together
    const Index next = left[best];
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
    order.push_back(next);
    Unite(covered, instance.covers[next]);
    for (const Index i : instance.links[next]) reached[i] = 1;
  }
  return order;
}

}  // namespace vantage::cover
