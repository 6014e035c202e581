// A session's model over restarts: snapshots of it, and what of the log came after them.
#include <algorithm>
#include <chrono>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/model/snapshot/snapshot_header.h"
#include "core/model/view/algorithm_version.h"
#include "server/conversion/to_proto.h"
#include "server/session/session.h"

namespace vantage::session {
namespace {

// A snapshot is due when an eighth of the scans have changed since: writing them costs a session no
// more than a few times its final size, and a restart replays an eighth of it at most.
constexpr size_t kShareThatChanged = 8;

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool SameConfig(const model::ModelConfig& a, const model::ModelConfig& b) {
  return a.voxel_size == b.voxel_size && a.discontinuity_angle == b.discontinuity_angle &&
         a.max_half_extent == b.max_half_extent;
}

}  // namespace

// The strand's operations that wait come first; the last of them that changes the model posts this
// again.
void Session::PostSnapshot(size_t changes) {
  unsaved_changes_ += changes;
  if (dependencies_.limits.snapshots_per_session == 0 || unsaved_changes_ == 0) return;
  const size_t due = std::max<size_t>(1, model_->scans().size() / kShareThatChanged);
  if (unsaved_changes_ < due) return;
  const bool posted = strand_->TryPost([self = shared_from_this()](parallel::Parallel& parallel) {
    if (self->unsaved_changes_ > 0) self->WriteSnapshot(parallel);
  });
  if (!posted && !closed_) dependencies_.log.Info("no room for a snapshot now", {{"session", id_}});
}

void Session::WriteSnapshot(parallel::Parallel& parallel) {
  const auto start = std::chrono::steady_clock::now();
  const std::string bytes = model_->Save(parallel);
  store::SnapshotRecord record;
  record.algorithm_version = model_algorithm_version_;
  journal_.Read([&](const SessionState& state) { record.sequence = state.last_sequence; });
  const absl::StatusOr<std::string> blob = PutOwnBlob(bytes);
  absl::Status written = blob.status();
  std::vector<std::string> unused;
  if (blob.ok()) {
    record.blob = *blob;
    std::lock_guard<std::mutex> lock(snapshots_mutex_);
    // A session that is closed has given its blobs back.
    written = closed_ ? absl::CancelledError("the session was deleted")
                      : dependencies_.store.PutSnapshot(id_, record);
    if (written.ok()) {
      std::erase_if(snapshots_, [&](const store::SnapshotRecord& known) {
        if (known.sequence == record.sequence) unused.push_back(known.blob);
        return known.sequence == record.sequence;
      });
      snapshots_.insert(snapshots_.begin(), record);
      while (snapshots_.size() > dependencies_.limits.snapshots_per_session) {
        const store::SnapshotRecord oldest = snapshots_.back();
        if (!dependencies_.store.DropSnapshot(id_, oldest.sequence).ok()) break;
        unused.push_back(oldest.blob);
        snapshots_.pop_back();
      }
    } else {
      unused.push_back(*blob);
    }
  }
  for (const std::string& released : unused) ReleaseOwnBlob(released);
  if (!written.ok()) {
    // Nothing is lost by that: a restart takes longer. The next change tries again.
    if (!closed_) {
      dependencies_.log.Warning("no snapshot was written",
                                {{"session", id_}, {"error", written.ToString()}});
    }
    return;
  }
  unsaved_changes_ = 0;
  telemetry::ObserveStage(dependencies_.metrics, "write snapshot", SecondsSince(start));
  dependencies_.log.Info("snapshot written",
                         {{"session", id_},
                          {"sequence", static_cast<int64_t>(record.sequence)},
                          {"scans", static_cast<int64_t>(model_->scans().size())},
                          {"bytes", static_cast<int64_t>(bytes.size())},
                          {"seconds", SecondsSince(start)}});
}

// Newest first; one that is damaged is let go, so that the next is written anew.
void Session::LoadSnapshot(parallel::Parallel& parallel) {
  std::vector<store::SnapshotRecord> known;
  {
    std::lock_guard<std::mutex> lock(snapshots_mutex_);
    known = snapshots_;
  }
  for (const store::SnapshotRecord& record : known) {
    const auto start = std::chrono::steady_clock::now();
    const absl::StatusOr<std::string> bytes = dependencies_.store.GetBlob(record.blob);
    absl::Status usable = bytes.status();
    if (bytes.ok()) {
      absl::StatusOr<std::unique_ptr<model::PartialModel>> loaded =
          model::PartialModel::Load(*bytes, dependencies_.limits.snapshot_bytes, parallel);
      usable = loaded.status();
      if (loaded.ok() && !SameConfig((*loaded)->config(), model_->config())) {
        usable = absl::DataLossError("it is of a model with another configuration");
      }
      if (usable.ok()) {
        model_ = *std::move(loaded);
        const absl::StatusOr<model::SnapshotHeader> header = model::ReadSnapshotHeader(*bytes);
        if (header.ok()) model_algorithm_version_ = header->algorithm_version;
      }
    }
    if (usable.ok()) {
      telemetry::ObserveStage(dependencies_.metrics, "load snapshot", SecondsSince(start));
      dependencies_.log.Info("snapshot loaded",
                             {{"session", id_},
                              {"sequence", static_cast<int64_t>(record.sequence)},
                              {"seconds", SecondsSince(start)}});
      if (model_algorithm_version_ != model::kModelAlgorithmVersion) {
        dependencies_.log.Warning(
            "older algorithms made this model; it is kept as it is rather than made anew",
            {{"session", id_},
             {"version", static_cast<int64_t>(model_algorithm_version_)},
             {"current", static_cast<int64_t>(model::kModelAlgorithmVersion)}});
      }
      return;
    }
    dependencies_.log.Warning("a snapshot cannot be used; an older one or the scans will do",
                              {{"session", id_},
                               {"sequence", static_cast<int64_t>(record.sequence)},
                               {"error", usable.ToString()}});
    if (absl::IsUnavailable(usable)) continue;  // the medium may come back
    std::lock_guard<std::mutex> lock(snapshots_mutex_);
    if (closed_ || !dependencies_.store.DropSnapshot(id_, record.sequence).ok()) continue;
    std::erase_if(snapshots_,
                  [&](const store::SnapshotRecord& it) { return it.sequence == record.sequence; });
    ReleaseOwnBlob(record.blob);
  }
}

// The newest snapshot that can be used, and what the log says beyond it. The model is a function of
// the set of scans and poses, so the difference of the two sets is all there is to replay.
void Session::Rebuild(parallel::Parallel& parallel) {
  std::map<std::string, v1::Scan> wanted;
  std::vector<v1::Scan> in_order;
  std::vector<std::string> undecided;
  ModelSnapshot rebuilt;
  journal_.Read([&](const SessionState& state) {
    rebuilt.version = state.model_version;
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (record.in_model) in_order.push_back(record.scan);
      if (record.in_model != (record.scan.state() == v1::SCAN_STATE_MERGED) ||
          record.scan.state() == v1::SCAN_STATE_RECEIVED ||
          record.scan.state() == v1::SCAN_STATE_MERGING) {
        undecided.push_back(name);
      }
    }
  });
  // As they were merged: the last station is where the scanner is.
  std::stable_sort(in_order.begin(), in_order.end(), [](const v1::Scan& a, const v1::Scan& b) {
    return a.merge().model_version() < b.merge().model_version();
  });
  for (const v1::Scan& scan : in_order) wanted[scan.name()] = scan;

  LoadSnapshot(parallel);
  size_t changes = 0;
  for (const std::string& name : model_->scans()) {
    const auto it = wanted.find(name);
    const bool stays =
        it != wanted.end() && model_->PoseOf(name)->matrix() ==
                                  conversion::ReadOwnPose(it->second.pose(), origin_).matrix();
    if (stays) continue;
    model_->Withdraw(name, parallel).IgnoreError();  // it is there
    ++changes;
  }
  for (const v1::Scan& scan : in_order) {
    if (model_->PoseOf(scan.name()).has_value()) continue;
    absl::StatusOr<sensor::Scan> data = LoadScan(scan);
    absl::Status inserted = data.status();
    if (data.ok()) {
      inserted =
          model_
              ->Insert(scan.name(), *data, conversion::ReadOwnPose(scan.pose(), origin_), parallel)
              .status();
    }
    if (!inserted.ok()) {
      dependencies_.log.Error("a merged scan could not be merged again",
                              {{"scan", scan.name()}, {"error", inserted.ToString()}});
      continue;
    }
    ++changes;
  }
  if (!in_order.empty()) rebuilt.view = model_->Publish();
  loaded_ = true;
  ReserveModel();
  Show(rebuilt);
  for (const std::string& scan : undecided) Reconcile(scan, parallel);
  PostSnapshot(changes);
}

}  // namespace vantage::session
