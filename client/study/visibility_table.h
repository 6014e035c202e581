// Which candidate sees which sample of a scene's surface: what a choice of stations is made from,
// in this program and in others.
#ifndef VANTAGE_CLIENT_STUDY_VISIBILITY_TABLE_H_
#define VANTAGE_CLIENT_STUDY_VISIBILITY_TABLE_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/study/study_scene.h"
#include "core/simulation/ground_truth.h"

namespace vantage::study {

struct VisibilityTable {
  std::vector<Eigen::Vector3d> candidates;  // m, scene frame
  // By candidate: the samples that it measures at density, bit k % 64 of word k / 64.
  std::vector<simulation::SampleSet> sees;
  size_t samples = 0;
  std::optional<size_t> start;  // the candidate that is chosen in any case
};

// Of a scene: its allowed positions on a lattice of `lattice` (m, a multiple of 0.3), and the
// samples that any allowed position measures at density. With a start that one is a candidate,
// wherever it lies, and chosen.
VisibilityTable MakeVisibilityTable(const StudyScene& scene, double lattice,
                                    std::optional<size_t> start_position);

// As files in a folder: candidates.csv (place_file.h) and visibility.npy, NumPy's format 1.0, of
// type '|b1' in C order: candidates x samples, 1 where the candidate sees the sample. The start is
// not written. PERMISSION_DENIED: it cannot be.
absl::Status WriteVisibilityTable(const VisibilityTable& table, const std::string& folder);

// NOT_FOUND, INVALID_ARGUMENT: naming the file and what is wrong with it. At most 65,535
// candidates, 200,000 samples, and 4e9 of both.
absl::StatusOr<VisibilityTable> ReadVisibilityTable(const std::string& folder);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_VISIBILITY_TABLE_H_
