#include "tests/core/cover/random_cover.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/simulation/random_sequence.h"

namespace vantage::cover {
namespace {

void Put(ElementSet& set, size_t element) { set[element / 64] |= uint64_t{1} << (element % 64); }
bool Holds(const ElementSet& set, size_t element) {
  return (set[element / 64] >> (element % 64) & 1) != 0;
}

void Link(CoverProblem& problem, uint32_t a, uint32_t b) {
  problem.links[a].push_back(b);
  problem.links[b].push_back(a);
}

void SortLinks(CoverProblem& problem) {
  for (std::vector<uint32_t>& links : problem.links) std::sort(links.begin(), links.end());
}

}  // namespace

CoverProblem MakeRandomCover(const RandomCover& of) {
  simulation::RandomSequence random(of.seed);
  CoverProblem problem;
  for (size_t e = 0; e < of.elements; ++e) problem.weights.push_back(0.1 + random.Uniform());
  problem.covers.assign(of.candidates, ElementSet((of.elements + 63) / 64, 0));
  for (ElementSet& set : problem.covers) {
    for (size_t e = 0; e < of.elements; ++e) {
      if (random.Chance(of.covers)) Put(set, e);
    }
  }
  problem.links.resize(of.candidates);
  for (uint32_t i = 0; i < of.candidates; ++i) {
    for (uint32_t j = 0; j < i; ++j) {
      if (random.Chance(of.links)) Link(problem, i, j);
    }
    if (random.Chance(of.anchored)) problem.anchored.push_back(i);
  }
  SortLinks(problem);
  return problem;
}

CoverProblem MakeRooms(uint64_t seed, size_t rooms, size_t candidates, size_t elements) {
  simulation::RandomSequence random(seed);
  const auto side = static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(rooms))));
  struct Place {
    double x, y;
    size_t room;
  };
  const auto place = [&] {
    Place at{random.Uniform() * static_cast<double>(side),
             random.Uniform() * static_cast<double>(side), 0};
    at.room = static_cast<size_t>(at.y) * side + static_cast<size_t>(at.x);
    return at;
  };
  std::vector<Place> stands, things;
  for (size_t i = 0; i < candidates; ++i) stands.push_back(place());
  for (size_t e = 0; e < elements; ++e) things.push_back(place());
  const auto apart = [](const Place& a, const Place& b) {
    return std::hypot(a.x - b.x, a.y - b.y);
  };
  CoverProblem problem;
  problem.weights.assign(elements, 0.05);
  problem.covers.assign(candidates, ElementSet((elements + 63) / 64, 0));
  problem.links.resize(candidates);
  for (uint32_t i = 0; i < candidates; ++i) {
    for (size_t e = 0; e < elements; ++e) {
      // Half of a room is hidden from any place in it, and little of the next is seen.
      const double reach = stands[i].room == things[e].room ? 0.6 : 0.15;
      if (apart(stands[i], things[e]) < reach * (0.6 + 0.8 * random.Uniform())) {
        Put(problem.covers[i], e);
      }
    }
    for (uint32_t j = 0; j < i; ++j) {
      const double reach = stands[i].room == stands[j].room ? 0.7 : 0.45;
      if (apart(stands[i], stands[j]) < reach) Link(problem, i, j);
    }
  }
  SortLinks(problem);
  return problem;
}

double WeightOf(const CoverProblem& problem, const std::vector<uint32_t>& stations) {
  double weight = 0;
  for (size_t e = 0; e < problem.weights.size(); ++e) {
    const bool covered = std::any_of(stations.begin(), stations.end(),
                                     [&](uint32_t i) { return Holds(problem.covers[i], e); });
    if (covered) weight += problem.weights[e];
  }
  return weight;
}

bool EachRegisters(const CoverProblem& problem, const std::vector<uint32_t>& stations) {
  for (size_t k = 0; k < stations.size(); ++k) {
    bool registers = problem.anchored.empty() && k == 0;
    for (const uint32_t a : problem.anchored) registers |= a == stations[k];
    for (size_t before = 0; before < k; ++before) {
      if (stations[before] == stations[k]) return false;
      for (const uint32_t j : problem.links[stations[k]]) registers |= j == stations[before];
    }
    if (!registers) return false;
  }
  return true;
}

ByTrying TryAll(const CoverProblem& problem, double goal) {
  ByTrying found;
  const size_t count = problem.candidates();
  found.best.assign(count + 1, 0);
  uint32_t anchored = 0;
  for (const uint32_t a : problem.anchored) anchored |= uint32_t{1} << a;
  std::vector<uint32_t> links(count, 0);
  for (size_t i = 0; i < count; ++i) {
    for (const uint32_t j : problem.links[i]) links[i] |= uint32_t{1} << j;
  }
  for (uint32_t chosen = 1; chosen < uint32_t{1} << count; ++chosen) {
    std::vector<uint32_t> stations;
    for (uint32_t i = 0; i < count; ++i) {
      if ((chosen >> i & 1) != 0) stations.push_back(i);
    }
    const double weight = WeightOf(problem, stations);
    const bool enough = weight >= goal - 1e-9;
    if (enough && (found.fewest_apart == 0 || stations.size() < found.fewest_apart)) {
      found.fewest_apart = stations.size();
    }
    uint32_t met = problem.anchored.empty() ? chosen & (~chosen + 1) : chosen & anchored;
    for (uint32_t before = 0; before != met;) {
      before = met;
      for (size_t i = 0; i < count; ++i) {
        if ((met >> i & 1) != 0) met |= links[i] & chosen;
      }
    }
    if (met != chosen) continue;
    found.best[stations.size()] = std::max(found.best[stations.size()], weight);
    if (enough && (!found.fewest || stations.size() < *found.fewest)) {
      found.fewest = stations.size();
    }
  }
  for (size_t k = 1; k <= count; ++k) found.best[k] = std::max(found.best[k], found.best[k - 1]);
  return found;
}

}  // namespace vantage::cover
