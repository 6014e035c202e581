#include "core/registration/graph/max_clique.h"

#include <algorithm>
#include <numeric>

namespace vantage::registration {
namespace {

// A vertex and the number of colours that it and those before it need: a clique among them has at
// most so many.
struct Coloured {
  size_t vertex = 0;
  size_t colours = 0;
};

class CliqueSearch {
 public:
  CliqueSearch(const std::vector<std::vector<bool>>& neighbours, size_t most_lookups)
      : neighbours_(neighbours), most_(most_lookups) {}

  Clique Run() {
    // By degree, the highest first: colours are then few, and the first way down is greedy.
    const size_t count = neighbours_.size();
    std::vector<size_t> degree(count);
    for (size_t i = 0; i < count; ++i) {
      for (size_t j = 0; j < count; ++j) degree[i] += i != j && neighbours_[i][j] ? 1 : 0;
    }
    std::vector<size_t> all(count);
    std::iota(all.begin(), all.end(), size_t{0});
    std::stable_sort(all.begin(), all.end(),
                     [&](size_t l, size_t r) { return degree[l] > degree[r]; });
    const std::vector<Coloured> coloured = Colour(all);
    const size_t bound = coloured.empty() ? 0 : coloured.back().colours;
    Expand(coloured);
    Clique clique;
    clique.vertices = best_;
    std::sort(clique.vertices.begin(), clique.vertices.end());
    clique.exact = !ended_early_;
    clique.bound = clique.exact ? best_.size() : bound;
    return clique;
  }

 private:
  // In the order of colours; each colour is of vertices of which no two are neighbours.
  std::vector<Coloured> Colour(const std::vector<size_t>& vertices) {
    std::vector<std::vector<size_t>> classes;
    for (const size_t v : vertices) {
      const auto free = std::find_if(classes.begin(), classes.end(), [&](const auto& members) {
        lookups_ += members.size();
        return std::none_of(members.begin(), members.end(),
                            [&](size_t m) { return neighbours_[v][m]; });
      });
      if (free == classes.end()) {
        classes.push_back({v});
      } else {
        free->push_back(v);
      }
    }
    std::vector<Coloured> coloured;
    for (size_t c = 0; c < classes.size(); ++c) {
      for (const size_t v : classes[c]) coloured.push_back({v, c + 1});
    }
    return coloured;
  }

  // Depth is that of the clique, at most the number of vertices; a stack frame is small.
  void Expand(const std::vector<Coloured>& candidates) {
    for (size_t k = candidates.size(); k > 0; --k) {
      const Coloured& last = candidates[k - 1];
      if (current_.size() + last.colours <= best_.size()) return;
      if (lookups_ > most_ && went_down_) {
        ended_early_ = true;
        return;
      }
      current_.push_back(last.vertex);
      std::vector<size_t> rest;
      for (size_t j = 0; j + 1 < k; ++j) {
        if (neighbours_[last.vertex][candidates[j].vertex]) rest.push_back(candidates[j].vertex);
      }
      if (current_.size() > best_.size()) best_ = current_;
      if (!rest.empty()) Expand(Colour(rest));
      went_down_ = true;
      current_.pop_back();
    }
  }

  const std::vector<std::vector<bool>>& neighbours_;
  size_t most_;
  size_t lookups_ = 0;
  bool went_down_ = false;  // once to the end
  bool ended_early_ = false;
  std::vector<size_t> current_;
  std::vector<size_t> best_;
};

}  // namespace

Clique LargestClique(const std::vector<std::vector<bool>>& neighbours, size_t most_lookups) {
  return CliqueSearch(neighbours, most_lookups).Run();
}

}  // namespace vantage::registration
