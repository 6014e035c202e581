// How well stations hang together, in numbers: of the scans of a job by its pose graph, and of a
// job that is planned by the links that are expected (algorithm.md section 9, 'Connectivity').
#ifndef VANTAGE_CORE_CONNECTIVITY_CONNECTIVITY_H_
#define VANTAGE_CORE_CONNECTIVITY_CONNECTIVITY_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"

namespace vantage::connectivity {

// Between two stations, by number. Several between the same two are valid.
struct StationLink {
  uint32_t a = 0;
  uint32_t b = 0;
  double sigma = 0;  // m, > 0: how well one is known as the other sees it, one standard deviation
};

// A station whose loss would cut the job: others hang together through it alone.
struct CutStation {
  uint32_t station = 0;
  size_t cut_off = 0;  // stations that would be apart from the largest part of its piece
};

// A link that nothing else backs.
struct Bridge {
  size_t link = 0;     // of the list that was given
  size_t cut_off = 0;  // stations beyond it, the fewer of both sides
};

struct Connectivity {
  size_t pieces = 0;  // that the stations are in
  // Pairs of stations in the same piece, and the mean over them of the path's sigma, m: along the
  // links between the two whose squared sigmas sum up to least, the root of that sum. 0 where there
  // are none.
  uint64_t tied_pairs = 0;
  double mean_path_sigma = 0;
  double longest_path_sigma = 0;  // m, the largest of them
  std::vector<CutStation> cuts;   // the most cut off first, then by number
  std::vector<Bridge> bridges;    // likewise
};

// INVALID_ARGUMENT: a link of a station that is not there or with itself, or a sigma that is not
// positive and finite.
absl::StatusOr<Connectivity> MeasureConnectivity(size_t stations,
                                                 std::span<const StationLink> links);

}  // namespace vantage::connectivity

#endif  // VANTAGE_CORE_CONNECTIVITY_CONNECTIVITY_H_
