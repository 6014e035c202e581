// The partial model of a site: a function of the set of (scan, pose) merged into it, independent of
// their order to the bit (algorithm.md section 4).
#ifndef VANTAGE_CORE_MODEL_PARTIAL_MODEL_H_
#define VANTAGE_CORE_MODEL_PARTIAL_MODEL_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/model/merge/site_changes.h"
#include "core/model/view/model_config.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"

namespace vantage::model {

// What merging a scan did.
struct MergeReport {
  uint64_t version = 0;             // of the model afterwards
  size_t samples = 0;               // that took part
  size_t beyond_range = 0;          // returns that were cut: farther than the scanner's range,
  size_t beyond_site = 0;           // or outside the site's limit; 0 after Withdraw()
  size_t sky_rays = 0;              // rays that went into the open sky; 0 after Withdraw()
  size_t empty_voxels = 0;          // of this scan
  size_t surface_voxels = 0;        // of this scan
  size_t recomputed_bricks = 0;     // of the model: all that the scan can have an influence on
  size_t changed_bricks = 0;        // those that are not what they were, to the bit
  size_t copied_pages = 0;          // pages of the planning view with any of them
  double carve_seconds = 0;         // range image to per-scan voxels
  double merge_seconds = 0;         // into the model, frontier and attributes included
  std::vector<SiteChange> changes;  // since the scans before; none after Withdraw() and Move()
};

// A scan of the model and where it belongs.
struct ScanMove {
  std::string id;
  Eigen::Isometry3d T_model_scan = Eigen::Isometry3d::Identity();
};

class PartialModel {
 public:
  // INVALID_ARGUMENT when the configuration is impossible.
  static absl::StatusOr<std::unique_ptr<PartialModel>> Create(const ModelConfig& config);
  ~PartialModel();

  // Merges a scan at a pose (rigid, scanner to model frame). `id` is unique within the model.
  // ALREADY_EXISTS: the id is in the model. INVALID_ARGUMENT: the image is not valid.
  // OUT_OF_RANGE: the scanner stands outside the site's limit; the figures are in the message.
  // RESOURCE_EXHAUSTED: it would take more than `memory_limit` bytes of memory, which is noticed
  // before they are taken (insert_estimate.h). On error the model is as it was. When memory cannot
  // be had at all (std::bad_alloc), the model may only be destroyed.
  absl::StatusOr<MergeReport> Insert(absl::string_view id, const sensor::Scan& scan,
                                     const Eigen::Isometry3d& T_model_scan,
                                     parallel::Parallel& parallel,
                                     int64_t memory_limit = std::numeric_limits<int64_t>::max());

  // Takes a scan out: the model is then, bit for bit, as if it had never come. NOT_FOUND.
  absl::StatusOr<MergeReport> Withdraw(absl::string_view id, parallel::Parallel& parallel);

  // Merges a scan in place of the scan `old`, which is taken out: the station keeps its place in
  // the order in which scans came. Errors as of both; on error the model is as it was.
  absl::StatusOr<MergeReport> Replace(absl::string_view old, absl::string_view id,
                                      const sensor::Scan& scan,
                                      const Eigen::Isometry3d& T_model_scan,
                                      parallel::Parallel& parallel,
                                      int64_t memory_limit = std::numeric_limits<int64_t>::max());

  // Moves scans to other poses: the model is then, bit for bit, as if they had been merged there in
  // the first place, in the order in which they came. `load` gives a scan's samples again; where
  // many are moved, `at_once` scans at the same time (at most parallel.width()), each with its own
  // `memory_limit`, since what one thread does of a scan others would wait for. Errors as of
  // Insert(), and those of `load`; NOT_FOUND: a scan is not in the model, which is then as it was.
  // After any other error the model may only be destroyed.
  absl::StatusOr<MergeReport> Move(
      std::span<const ScanMove> moves,
      absl::FunctionRef<absl::StatusOr<sensor::Scan>(absl::string_view id)> load,
      parallel::Parallel& parallel, int64_t memory_limit = std::numeric_limits<int64_t>::max(),
      size_t at_once = 1);

  // Says in which order its scans came, which is the order of the stations and nothing else.
  // INVALID_ARGUMENT: these are not its scans.
  absl::Status Reorder(std::vector<std::string> ids);

  // The model as bytes (snapshot.h), and back: what is loaded goes on as if it had never been away.
  // DATA_LOSS: damaged. FAILED_PRECONDITION: of a newer release. RESOURCE_EXHAUSTED: more than
  // `max_bytes` decompressed.
  std::string Save(parallel::Parallel& parallel) const;
  static absl::StatusOr<std::unique_ptr<PartialModel>> Load(absl::string_view snapshot,
                                                            size_t max_bytes,
                                                            parallel::Parallel& parallel);

  // The model as it stands. Costs nothing: each merge makes a view, which shares with the view
  // before it all pages of bricks in which nothing changed. A view may be kept while the model
  // changes.
  std::shared_ptr<const PlanningView> Publish() const;

  // The memory that it takes, in bytes, within a tenth. Looks at every brick once.
  int64_t Bytes() const;

  // A 64-bit digest (FNV-1a) of everything that planners see of the model, version and history
  // excepted.
  uint64_t Digest() const;

  const ModelConfig& config() const;
  uint64_t version() const;
  // The oldest of the algorithms that the scans in the model were carved with: those of this
  // release (algorithm_version.h) unless an older one saved the model. Of this release when there
  // is no scan.
  uint32_t algorithm_version() const;
  std::vector<std::string> scans() const;  // sorted
  // Scanner to model frame, as it was merged; nothing if the scan is not in the model.
  std::optional<Eigen::Isometry3d> PoseOf(absl::string_view id) const;

 private:
  struct State;
  explicit PartialModel(std::unique_ptr<State> state);
  // Move() of a few scans, one after the other, and of many at once.
  absl::StatusOr<MergeReport> MoveEach(
      std::span<const ScanMove> moves,
      absl::FunctionRef<absl::StatusOr<sensor::Scan>(absl::string_view id)> load,
      parallel::Parallel& parallel, int64_t memory_limit);
  absl::StatusOr<MergeReport> MoveTogether(
      std::span<const ScanMove> moves,
      absl::FunctionRef<absl::StatusOr<sensor::Scan>(absl::string_view id)> load,
      parallel::Parallel& parallel, int64_t memory_limit, size_t at_once);
  std::unique_ptr<State> state_;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_PARTIAL_MODEL_H_
