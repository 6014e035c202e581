// A largest set of vertices of an undirected graph of which each two are neighbours.
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_MAX_CLIQUE_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_MAX_CLIQUE_H_

#include <cstddef>
#include <vector>

namespace vantage::registration {

struct Clique {
  std::vector<size_t> vertices;  // rising
  size_t bound = 0;              // no clique is larger
  bool exact = true;             // none is larger than this one
};

// Branch and bound over colourings (Tomita and Seki 2003) until about `most_lookups` pairs were
// looked up; the greedy choice is always made. Depends on the graph alone. `neighbours` is square
// and symmetric; the diagonal does not matter.
Clique LargestClique(const std::vector<std::vector<bool>>& neighbours, size_t most_lookups);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_MAX_CLIQUE_H_
