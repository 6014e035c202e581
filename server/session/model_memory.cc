#include "server/session/model_memory.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/model/snapshot/snapshot_header.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
namespace {

// Bytes of octree, planning view and layers of scans for each voxel that a scan knows: about 14 as
// measured on sites of 1000 m^2 (model.1000m2.mb), and room for growth at the edges.
constexpr int64_t kBytesPerVoxel = 24;
constexpr int64_t kBytesPerScan = 1 << 20;
// The same for a scan that was not merged yet.
constexpr int64_t kUnknownScan = 24 << 20;
// Memory of aligning and carving for each cell of the range image, bytes.
constexpr int64_t kBytesPerCell = 150;
constexpr absl::Duration kShortRetry = absl::Seconds(5);
constexpr absl::Duration kModelRetryAfter = absl::Seconds(1);

// A snapshot is due when an eighth of the scans have changed since the last one. All snapshots of a
// session together then are a few times its final size, and a restart replays an eighth of its
// scans at most.
constexpr size_t kShareThatChanged = 8;

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool SameConfig(const model::ModelConfig& a, const model::ModelConfig& b) {
  return a.voxel_size == b.voxel_size && a.discontinuity_angle == b.discontinuity_angle &&
         a.max_half_extent == b.max_half_extent;
}

}  // namespace

ModelMemory::ModelMemory(SessionContext& context, StoredSnapshots& snapshots,
                         std::unique_ptr<model::PartialModel> empty, Begin begin,
                         Reconcile reconcile)
    : context_(context),
      snapshots_(snapshots),
      reconcile_(std::move(reconcile)),
      loaded_(begin == Begin::kNew),
      model_(std::move(empty)) {
  Touch();
}

ModelSnapshot ModelMemory::Current() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return current_;
}

absl::Status ModelMemory::CheckWhole() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return lacks_.empty() ? absl::OkStatus() : ModelLacks(context_.name(), lacks_);
}

absl::Status ModelMemory::WhyNone() {
  if (absl::Status whole = CheckWhole(); !whole.ok()) return whole;
  bool expected = false;
  context_.journal().Read([&](const SessionState& state) { expected = state.AnyInModel(); });
  if (expected) {
    if (absl::Status room = BeginLoad(); !room.ok()) return room;
    return contract::Retryable(absl::StatusCode::kUnavailable, "MODEL_LOADING",
                               absl::StrCat("the model of ", context_.name(), " is being loaded"),
                               kModelRetryAfter);
  }
  return contract::ErrorWithReason(absl::StatusCode::kFailedPrecondition, "MODEL_EMPTY",
                                   absl::StrCat(context_.name(),
                                                " has no scan in its model yet; send one, and wait "
                                                "for its merge (WatchSession)"));
}

void ModelMemory::Touch() { touched_ = absl::ToInt64Milliseconds(context_.journal().Seen()); }

absl::Duration ModelMemory::LastTouched() const { return absl::Milliseconds(touched_.load()); }

int64_t ModelMemory::Estimate() const {
  int64_t bytes = 0;
  context_.journal().Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      if (!record.in_model) continue;
      const v1::MergeReport& merge = record.scan.merge();
      bytes += kBytesPerScan +
               kBytesPerVoxel * (merge.empty_voxel_count() + merge.surface_voxel_count());
    }
  });
  return bytes;
}

int64_t ModelMemory::EstimateMerge(const v1::Scan& scan) {
  // Encoded cells take 3 bytes or more.
  return kUnknownScan + kBytesPerCell * (scan.encoded_size_bytes() / 3);
}

absl::StatusOr<MemoryAccount::Reservation> ModelMemory::Reserve(int64_t bytes) const {
  MemoryAccount* const memory = context_.dependencies().memory;
  if (memory == nullptr) return MemoryAccount::Reservation();
  std::optional<MemoryAccount::Reservation> reservation = memory->Take(bytes);
  if (reservation.has_value()) return *std::move(reservation);
  return contract::Retryable(absl::StatusCode::kResourceExhausted, "MEMORY_SHORT",
                             absl::StrCat("this needs some ", bytes >> 20,
                                          " MiB, and the server's memory is taken; try again"),
                             kShortRetry);
}

bool ModelMemory::BeginEvaluation() {
  if (evaluations_.fetch_add(1) < static_cast<int>(context_.dependencies().limits.evaluations)) {
    return true;
  }
  --evaluations_;
  return false;
}

bool ModelMemory::BeginExport() {
  if (++exports_ <= static_cast<int>(context_.dependencies().limits.exports_per_session)) {
    return true;
  }
  --exports_;
  return false;
}

absl::Status ModelMemory::BeginLoad() {
  Touch();
  if (loaded_ || loading_.exchange(true)) return absl::OkStatus();
  // A caller is told at once when there is no room.
  absl::Status room = Reserve(Estimate()).status();
  const bool posted = room.ok() && context_.TryPost([this](parallel::Parallel& parallel) {
    const absl::Status taken = Load(parallel);
    if (!taken.ok()) {
      context_.dependencies().log.Warning(
          "a model cannot be loaded", {{"session", context_.id()}, {"error", taken.ToString()}});
    }
    loading_ = false;
  });
  if (!posted) loading_ = false;
  return room;
}

absl::Status ModelMemory::Load(parallel::Parallel& parallel) {
  if (loaded_) return absl::OkStatus();
  absl::StatusOr<MemoryAccount::Reservation> reservation = Reserve(Estimate());
  if (!reservation.ok()) return reservation.status();
  reservation_ = *std::move(reservation);
  Touch();
  absl::Status rebuilt = Rebuild(parallel);
  if (!rebuilt.ok()) reservation_.Release();
  return rebuilt;
}

void ModelMemory::Evict(parallel::Parallel& parallel) {
  if (context_.closed() || !loaded_ || model_->scans().empty() || !CheckWhole().ok()) return;
  if (unsaved_changes_ > 0) WriteSnapshot(parallel);
  if (unsaved_changes_ > 0) return;  // the snapshot could not be written
  absl::StatusOr<std::unique_ptr<model::PartialModel>> empty =
      model::PartialModel::Create(model_->config());
  if (!empty.ok()) return;
  loaded_ = false;
  ModelSnapshot nothing;
  nothing.version = Current().version;
  Show(nothing);
  model_ = *std::move(empty);
  reservation_.Release();
  context_.dependencies().log.Info("model evicted", {{"session", context_.id()}});
}

absl::StatusOr<model::MergeReport> ModelMemory::Insert(absl::string_view scan,
                                                       const sensor::Scan& data,
                                                       const Eigen::Isometry3d& T_model_scan,
                                                       parallel::Parallel& parallel) {
  return model_->Insert(scan, data, T_model_scan, parallel);
}

absl::StatusOr<model::MergeReport> ModelMemory::Withdraw(absl::string_view scan,
                                                         parallel::Parallel& parallel) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    std::erase(lacks_, scan);
  }
  return model_->Withdraw(scan, parallel);
}

void ModelMemory::Show(ModelSnapshot snapshot) {
  std::lock_guard<std::mutex> lock(mutex_);
  current_ = std::move(snapshot);
  if (!lacks_.empty()) current_.view = nullptr;
}

void ModelMemory::Changed(size_t scans) {
  TakeRoom();
  PostSnapshot(scans);
}

void ModelMemory::TakeRoom() {
  MemoryAccount* const memory = context_.dependencies().memory;
  if (memory == nullptr) return;
  if (reservation_.bytes() == 0) reservation_ = memory->Empty();
  reservation_.Set(Estimate());
}

// Waiting operations of the strand come first; the last of them that changes the model posts this
// again.
void ModelMemory::PostSnapshot(size_t changes) {
  unsaved_changes_ += changes;
  if (context_.dependencies().limits.snapshots_per_session == 0 || unsaved_changes_ == 0) return;
  if (!CheckWhole().ok()) return;
  const size_t due = std::max<size_t>(1, model_->scans().size() / kShareThatChanged);
  if (unsaved_changes_ < due) return;
  const bool posted = context_.TryPost([this](parallel::Parallel& parallel) {
    if (unsaved_changes_ > 0) WriteSnapshot(parallel);
  });
  if (!posted && !context_.closed()) {
    context_.dependencies().log.Info("no room for a snapshot now", {{"session", context_.id()}});
  }
}

void ModelMemory::WriteSnapshot(parallel::Parallel& parallel) {
  const auto start = std::chrono::steady_clock::now();
  const std::string bytes = model_->Save(parallel);
  store::SnapshotRecord record;
  record.algorithm_version = algorithm_version_;
  context_.journal().Read(
      [&](const SessionState& state) { record.sequence = state.last_sequence; });
  telemetry::Log& log = context_.dependencies().log;
  const absl::Status written = snapshots_.Add(bytes, record);
  if (!written.ok()) {
    // Nothing is lost by that, but a restart takes longer. The next change tries again.
    if (!context_.closed()) {
      log.Warning("no snapshot was written",
                  {{"session", context_.id()}, {"error", written.ToString()}});
    }
    return;
  }
  unsaved_changes_ = 0;
  telemetry::ObserveStage(context_.dependencies().metrics, "write snapshot", SecondsSince(start));
  log.Info("snapshot written", {{"session", context_.id()},
                                {"sequence", static_cast<int64_t>(record.sequence)},
                                {"scans", static_cast<int64_t>(model_->scans().size())},
                                {"bytes", static_cast<int64_t>(bytes.size())},
                                {"seconds", SecondsSince(start)}});
}

// Newest first.
void ModelMemory::LoadSnapshot(parallel::Parallel& parallel) {
  const SessionDependencies& dependencies = context_.dependencies();
  for (const store::SnapshotRecord& record : snapshots_.List()) {
    const auto start = std::chrono::steady_clock::now();
    const absl::StatusOr<std::string> bytes = dependencies.store.GetBlob(record.blob);
    absl::Status usable = bytes.status();
    if (bytes.ok()) {
      absl::StatusOr<std::unique_ptr<model::PartialModel>> loaded =
          model::PartialModel::Load(*bytes, dependencies.limits.snapshot_bytes, parallel);
      usable = loaded.status();
      if (loaded.ok() && !SameConfig((*loaded)->config(), model_->config())) {
        usable = absl::DataLossError("it is of a model with another configuration");
      }
      if (usable.ok()) {
        model_ = *std::move(loaded);
        const absl::StatusOr<model::SnapshotHeader> header = model::ReadSnapshotHeader(*bytes);
        if (header.ok()) algorithm_version_ = header->algorithm_version;
      }
    }
    if (usable.ok()) {
      telemetry::ObserveStage(dependencies.metrics, "load snapshot", SecondsSince(start));
      dependencies.log.Info("snapshot loaded", {{"session", context_.id()},
                                                {"sequence", static_cast<int64_t>(record.sequence)},
                                                {"seconds", SecondsSince(start)}});
      if (algorithm_version_ != model::kModelAlgorithmVersion) {
        dependencies.log.Warning(
            "older algorithms made this model; it is kept as it is rather than made anew",
            {{"session", context_.id()},
             {"version", static_cast<int64_t>(algorithm_version_)},
             {"current", static_cast<int64_t>(model::kModelAlgorithmVersion)}});
      }
      return;
    }
    dependencies.log.Warning("a snapshot cannot be used; an older one or the scans will do",
                             {{"session", context_.id()},
                              {"sequence", static_cast<int64_t>(record.sequence)},
                              {"error", usable.ToString()}});
    if (absl::IsUnavailable(usable)) continue;  // the medium may come back
    snapshots_.Drop(record);
  }
}

// The newest usable snapshot and the log's later entries. The model is a function of the set of
// scans and poses, so only the difference of the two sets is replayed.
absl::Status ModelMemory::Rebuild(parallel::Parallel& parallel) {
  std::map<std::string, v1::Scan> wanted;
  std::vector<v1::Scan> in_order;
  std::vector<std::string> undecided;
  ModelSnapshot rebuilt;
  context_.journal().Read([&](const SessionState& state) {
    rebuilt.version = state.model_version;
    undecided = state.UndecidedScans();
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (record.in_model) in_order.push_back(record.scan);
    }
  });
  // In the order in which they were merged, since the last station is where the scanner is.
  std::stable_sort(in_order.begin(), in_order.end(), [](const v1::Scan& a, const v1::Scan& b) {
    return a.merge().model_version() < b.merge().model_version();
  });
  for (const v1::Scan& scan : in_order) wanted[scan.name()] = scan;
  const auto pose_of = [this](const v1::Scan& scan) {
    return conversion::ReadOwnPose(scan.pose(), context_.origin());
  };

  LoadSnapshot(parallel);
  size_t changes = 0;
  std::vector<std::string> lacks;
  for (const std::string& name : model_->scans()) {
    const auto it = wanted.find(name);
    const bool stays =
        it != wanted.end() && model_->PoseOf(name)->matrix() == pose_of(it->second).matrix();
    if (stays) continue;
    model_->Withdraw(name, parallel).IgnoreError();  // it is there
    ++changes;
  }
  for (const v1::Scan& scan : in_order) {
    if (model_->PoseOf(scan.name()).has_value()) continue;
    absl::StatusOr<sensor::Scan> data = LoadScan(context_, scan);
    absl::Status inserted = data.status();
    if (data.ok()) {
      inserted = model_->Insert(scan.name(), *data, pose_of(scan), parallel).status();
    }
    // The medium may come back, and then the rest is put in.
    if (absl::IsUnavailable(inserted)) return inserted;
    if (!inserted.ok()) {
      context_.dependencies().log.Error("a merged scan could not be merged again",
                                        {{"scan", scan.name()}, {"error", inserted.ToString()}});
      lacks.push_back(scan.name());
      continue;
    }
    ++changes;
  }
  {
    std::lock_guard<std::mutex> lock(mutex_);
    lacks_ = std::move(lacks);
  }
  if (!in_order.empty()) rebuilt.view = model_->Publish();
  loaded_ = true;
  TakeRoom();
  Show(rebuilt);
  for (const std::string& scan : undecided) reconcile_(scan, parallel);
  PostSnapshot(changes);
  return absl::OkStatus();
}

}  // namespace vantage::session
