#include "core/cover/instance.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include "absl/strings/str_format.h"

namespace vantage::cover {
namespace {

// All weight together, in quanta: sums of sums stay far below 2^63, and a quantum far below what
// anybody asks for.
constexpr double kWhole = 1ULL << 46;

absl::Status Wrong(const std::string& what) { return absl::InvalidArgumentError(what); }

absl::Status CheckLinks(const CoverProblem& problem) {
  for (uint32_t i = 0; i < problem.candidates(); ++i) {
    const std::vector<uint32_t>& links = problem.links[i];
    for (size_t k = 0; k < links.size(); ++k) {
      if (links[k] >= problem.candidates()) {
        return Wrong(absl::StrFormat("links: candidate %d is linked with %d, of %d candidates", i,
                                     links[k], problem.candidates()));
      }
      if (links[k] == i) return Wrong(absl::StrFormat("links: %d is linked with itself", i));
      if (k > 0 && links[k - 1] >= links[k]) {
        return Wrong(absl::StrFormat("links: those of candidate %d do not ascend", i));
      }
      const std::vector<uint32_t>& back = problem.links[links[k]];
      if (!std::binary_search(back.begin(), back.end(), i)) {
        return Wrong(absl::StrFormat("links: %d is linked with %d, but not %d with %d", i, links[k],
                                     links[k], i));
      }
    }
  }
  return absl::OkStatus();
}

// Groups of candidates that hang together; with anchors the one group of those that hang together
// with any of them.
std::vector<std::vector<uint32_t>> Groups(const CoverProblem& problem) {
  std::vector<uint8_t> met(problem.candidates(), 0);
  std::vector<std::vector<uint32_t>> groups;
  const auto grow = [&](std::vector<uint32_t> group) {
    for (const uint32_t i : group) met[i] = 1;
    for (size_t head = 0; head < group.size(); ++head) {
      for (const uint32_t j : problem.links[group[head]]) {
        if (met[j] == 0) group.push_back(j);
        met[j] = 1;
      }
    }
    std::sort(group.begin(), group.end());
    groups.push_back(std::move(group));
  };
  if (!problem.anchored.empty()) {
    std::vector<uint32_t> seeds = problem.anchored;
    std::sort(seeds.begin(), seeds.end());
    seeds.erase(std::unique(seeds.begin(), seeds.end()), seeds.end());
    grow(std::move(seeds));
    return groups;
  }
  for (uint32_t i = 0; i < problem.candidates(); ++i) {
    if (met[i] == 0) grow({i});
  }
  return groups;
}

// For each element the candidates of `covers` that cover it.
void Transpose(const std::vector<ElementSet>& covers, size_t elements, std::vector<size_t>& first,
               std::vector<Index>& covered_by) {
  first.assign(elements + 1, 0);
  for (const ElementSet& set : covers) ForEach(set, [&](size_t e) { ++first[e + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  covered_by.resize(first.back());
  std::vector<size_t> next(first.begin(), first.end() - 1);
  for (size_t i = 0; i < covers.size(); ++i) {
    ForEach(covers[i], [&](size_t e) { covered_by[next[e]++] = static_cast<Index>(i); });
  }
}

// For each element of the problem its number among the instance's, those alike having the same
// one; kNone: no candidate covers it.
constexpr uint32_t kNone = UINT32_MAX;
std::vector<uint32_t> MergeAlike(const Instance& instance, size_t elements, size_t& merged) {
  // Elements alike have the same signature, and those that share one are compared.
  std::mt19937_64 random(1);
  std::vector<uint64_t> signatures(elements, 0);
  for (const ElementSet& set : instance.covers) {
    const uint64_t bits = random();
    ForEach(set, [&](size_t e) { signatures[e] ^= bits; });
  }
  std::vector<uint32_t> order(elements);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return std::pair(signatures[a], a) < std::pair(signatures[b], b);
  });
  std::vector<uint32_t> like(elements);  // the first element that is like this one
  std::iota(like.begin(), like.end(), 0);
  for (size_t k = 1; k < elements; ++k) {
    const uint32_t a = like[order[k - 1]];
    const uint32_t b = order[k];
    if (signatures[a] != signatures[b]) continue;
    const auto of_a = instance.CoveredBy(a);
    const auto of_b = instance.CoveredBy(b);
    if (std::equal(of_a.begin(), of_a.end(), of_b.begin(), of_b.end())) like[b] = a;
  }
  std::vector<uint32_t> names(elements, kNone);
  merged = 0;
  for (uint32_t e = 0; e < elements; ++e) {
    if (instance.CoveredBy(e).empty()) continue;
    names[e] = like[e] == e ? static_cast<uint32_t>(merged++) : names[like[e]];
  }
  return names;
}

Instance MakeInstance(const CoverProblem& problem, std::vector<uint32_t> group, double quantum) {
  Instance instance;
  instance.quantum = quantum;
  instance.rooted = !problem.anchored.empty();
  instance.number = std::move(group);
  std::vector<uint32_t> index(problem.candidates(), kNone);
  for (uint32_t i = 0; i < instance.candidates(); ++i) index[instance.number[i]] = i;
  instance.anchored.assign(instance.candidates(), 0);
  for (const uint32_t a : problem.anchored) instance.anchored[index[a]] = 1;
  instance.links.resize(instance.candidates());
  instance.linked.assign(instance.candidates(), ElementSet((instance.candidates() + 63) / 64, 0));
  for (uint32_t i = 0; i < instance.candidates(); ++i) {
    instance.covers.push_back(problem.covers[instance.number[i]]);
    for (const uint32_t j : problem.links[instance.number[i]]) {
      instance.links[i].push_back(static_cast<Index>(index[j]));
      instance.linked[i][index[j] / 64] |= uint64_t{1} << (index[j] % 64);
    }
  }
  const size_t elements = problem.weights.size();
  Transpose(instance.covers, elements, instance.first, instance.covered_by);
  size_t merged = 0;
  const std::vector<uint32_t> names = MergeAlike(instance, elements, merged);
  instance.weights.assign(merged, 0);
  for (size_t e = 0; e < elements; ++e) {
    if (names[e] == kNone) continue;
    instance.weights[names[e]] += std::llround(problem.weights[e] / quantum);
  }
  for (ElementSet& set : instance.covers) {
    ElementSet of_merged((merged + 63) / 64, 0);
    ForEach(set, [&](size_t e) { of_merged[names[e] / 64] |= uint64_t{1} << (names[e] % 64); });
    set = std::move(of_merged);
  }
  Transpose(instance.covers, merged, instance.first, instance.covered_by);
  instance.whole = std::accumulate(instance.weights.begin(), instance.weights.end(), int64_t{0});
  return instance;
}

}  // namespace

absl::Status CheckProblem(const CoverProblem& problem) {
  const size_t elements = problem.weights.size();
  if (problem.candidates() > kMostCandidates) {
    return Wrong(absl::StrFormat("covers: %d candidates; %d are the most: take a coarser lattice",
                                 problem.candidates(), kMostCandidates));
  }
  if (problem.links.size() != problem.candidates()) {
    return Wrong(absl::StrFormat("links: of %d candidates, where there are %d",
                                 problem.links.size(), problem.candidates()));
  }
  for (size_t e = 0; e < elements; ++e) {
    if (!(problem.weights[e] > 0) || !std::isfinite(problem.weights[e])) {
      return Wrong(
          absl::StrFormat("weights: element %d has %g m2; each is above 0", e, problem.weights[e]));
    }
  }
  for (size_t i = 0; i < problem.candidates(); ++i) {
    const ElementSet& set = problem.covers[i];
    if (set.size() != (elements + 63) / 64) {
      return Wrong(absl::StrFormat("covers: candidate %d has %d words for %d elements", i,
                                   set.size(), elements));
    }
    if (elements % 64 != 0 && set.back() >> (elements % 64) != 0) {
      return Wrong(
          absl::StrFormat("covers: candidate %d has elements beyond the %d that have "
                          "weights",
                          i, elements));
    }
  }
  for (const uint32_t a : problem.anchored) {
    if (a >= problem.candidates()) {
      return Wrong(absl::StrFormat("anchored: %d, of %d candidates", a, problem.candidates()));
    }
  }
  return CheckLinks(problem);
}

std::vector<Instance> MakeInstances(const CoverProblem& problem) {
  const double whole = std::accumulate(problem.weights.begin(), problem.weights.end(), 0.0);
  std::vector<Instance> instances;
  for (std::vector<uint32_t>& group : Groups(problem)) {
    Instance instance = MakeInstance(problem, std::move(group), whole / kWhole);
    if (instance.elements() > 0) instances.push_back(std::move(instance));
  }
  return instances;
}

}  // namespace vantage::cover
