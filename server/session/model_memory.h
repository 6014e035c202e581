// A session's model in memory: loaded when it is needed, evicted when nobody does, and never more
// of it than the server's account allows.
#ifndef VANTAGE_SERVER_SESSION_MODEL_MEMORY_H_
#define VANTAGE_SERVER_SESSION_MODEL_MEMORY_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/model/partial_model.h"
#include "core/model/view/algorithm_version.h"
#include "core/model/view/planning_view.h"
#include "server/session/memory_account.h"
#include "server/session/session_context.h"
#include "server/session/stored_snapshots.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// The model at one moment.
struct ModelSnapshot {
  std::shared_ptr<const model::PlanningView> view;  // null while no scan is in the model
  uint64_t version = 0;
};

// Thread safe, but for what is to be called on the session's strand.
class ModelMemory {
 public:
  // Does, on the strand, what the log wants of a scan.
  using Reconcile = std::function<void(const std::string& scan, parallel::Parallel&)>;
  // Whether the log has scans for the model: then it has to be loaded before it is used.
  enum class Begin { kNew, kToBeLoaded };

  // `empty` is of the session's configuration.
  ModelMemory(SessionContext& context, StoredSnapshots& snapshots,
              std::unique_ptr<model::PartialModel> empty, Begin begin, Reconcile reconcile);

  ModelSnapshot Current() const;
  // Why Current() has no view. FAILED_PRECONDITION (MODEL_EMPTY): no scan has been merged.
  // UNAVAILABLE (MODEL_LOADING): after a restart, or after it was evicted, soon.
  // RESOURCE_EXHAUSTED (MEMORY_SHORT): there is no room for it now.
  absl::Status WhyNone();
  bool loaded() const { return loaded_; }
  // Somebody uses the model: it stays for a while.
  void Touch();
  absl::Time LastTouched() const;

  // What the model takes, by what is known of its scans, and what aligning and merging a scan
  // takes meanwhile, bytes.
  int64_t Estimate() const;
  static int64_t EstimateMerge(const v1::Scan& scan);
  // RESOURCE_EXHAUSTED (MEMORY_SHORT).
  absl::StatusOr<MemoryAccount::Reservation> Reserve(int64_t bytes) const;

  // Positions that are evaluated and exports under way, which keep the model. False when the
  // session has as many as it may; else it is ended by whoever began it.
  bool BeginEvaluation();
  void EndEvaluation() { --evaluations_; }
  bool BeginExport();
  void EndExport() { --exports_; }
  bool InUse() const { return evaluations_ > 0 || exports_ > 0; }

  // The rest on the strand.

  // Makes it what the log says, from its newest snapshot that can be used and the scans beyond it;
  // scans that wait for it are reconciled. RESOURCE_EXHAUSTED (MEMORY_SHORT).
  absl::Status Load(parallel::Parallel& parallel);
  // Lets go of it, to its snapshot, if that can be written. Nothing is lost whenever this happens:
  // whoever has the old view keeps it.
  void Evict(parallel::Parallel& parallel);
  // As PartialModel has them. They show when Show() is called.
  absl::StatusOr<model::MergeReport> Insert(absl::string_view scan, const sensor::Scan& data,
                                            const Eigen::Isometry3d& T_model_scan,
                                            parallel::Parallel& parallel);
  absl::StatusOr<model::MergeReport> Withdraw(absl::string_view scan, parallel::Parallel& parallel);
  std::shared_ptr<const model::PlanningView> Publish() const { return model_->Publish(); }
  // Is also called while the log's lock is held, so that whoever sees a scan merged sees the model
  // with it.
  void Show(ModelSnapshot snapshot);
  // Scans came or went, and the log has it: what the model takes is reserved, and a snapshot
  // written when one is due.
  void Changed(size_t scans);

 private:
  absl::Status BeginLoad();
  void TakeRoom();
  void Rebuild(parallel::Parallel& parallel);
  void LoadSnapshot(parallel::Parallel& parallel);
  void WriteSnapshot(parallel::Parallel& parallel);
  void PostSnapshot(size_t changes);

  SessionContext& context_;
  StoredSnapshots& snapshots_;
  const Reconcile reconcile_;
  std::atomic<int> evaluations_{0};
  std::atomic<int> exports_{0};
  std::atomic<bool> loaded_;  // changes on the strand only
  std::atomic<bool> loading_{false};
  std::atomic<int64_t> touched_{0};  // ms since 1970

  // Touched on the strand only.
  std::unique_ptr<model::PartialModel> model_;
  MemoryAccount::Reservation reservation_;
  uint32_t algorithm_version_ = model::kModelAlgorithmVersion;
  size_t unsaved_changes_ = 0;  // scans that came or went since the last snapshot

  mutable std::mutex mutex_;
  ModelSnapshot current_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_MODEL_MEMORY_H_
