#include "server/session/model_memory.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/model/carve/carve_room.h"
#include "core/model/snapshot/snapshot_header.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/conversion/to_proto.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
namespace {

// Bytes of a model that is not loaded, for each voxel with surface in each scan's report and each
// cell of its image, as measured (core/model/carve/carve_room.h) with a fifth for boundaries; scans
// that see the same surface share a part.
constexpr double kBytesPerSurfaceVoxel = 1.2 * model::kBytesOfSurfaceKept;
constexpr int64_t kBytesPerScan = 64 << 10;
// Of an encoded cell; of a decoded one beside it, and of what alignment makes of both.
constexpr int64_t kEncodedCell = 4;
constexpr int64_t kBytesPerAlignedCell = 30;
constexpr int64_t kAnyAlignment = 1 << 20;
// The name of the work of loading a model, which is no scan's.
constexpr char kLoadingWork[] = "model";
constexpr absl::Duration kShortRetry = absl::Seconds(5);
constexpr absl::Duration kModelRetryAfter = absl::Seconds(1);

// A snapshot is due when an eighth of the scans have changed since the last one. All snapshots of a
// session together then are a few times its final size, and a restart replays an eighth of its
// scans at most.
constexpr size_t kShareThatChanged = 8;

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

absl::Status Draining() {
  return contract::Retryable(absl::StatusCode::kUnavailable, "DRAINING",
                             "the server shuts down before the model is loaded; try again",
                             kShortRetry);
}

bool SameConfig(const model::ModelConfig& a, const model::ModelConfig& b) {
  return a.voxel_size == b.voxel_size && a.discontinuity_angle == b.discontinuity_angle &&
         a.max_half_extent == b.max_half_extent;
}

// The name of a scan in the model and its snapshots: its own, and which samples, once they are
// others than it came with.
std::string KeyOf(const v1::Scan& scan) {
  if (!scan.has_replace_time()) return scan.name();
  return absl::StrCat(scan.name(), "@", absl::BytesToHexString(scan.sha256()));
}

// The name of the scan that a key is of.
std::string NameOf(absl::string_view key) { return std::string(key.substr(0, key.find('@'))); }

// True when `key` is that of a scan's samples before they were replaced by those that it has.
bool IsPreviewOf(absl::string_view key, const v1::Scan& scan) {
  if (key == KeyOf(scan)) return false;
  return key == scan.name() || absl::StartsWith(key, absl::StrCat(scan.name(), "@"));
}

}  // namespace

ModelMemory::ModelMemory(SessionContext& context, StoredSnapshots& snapshots,
                         std::unique_ptr<model::PartialModel> empty, Begin begin,
                         Reconcile reconcile, AdjustPoses adjust_poses)
    : context_(context),
      snapshots_(snapshots),
      config_(empty->config()),
      reconcile_(std::move(reconcile)),
      adjust_poses_(std::move(adjust_poses)),
      memory_(context.dependencies().memory, context.tenant()),
      loaded_(begin == Begin::kNew),
      model_(std::move(empty)),
      work_(context),
      site_prior_(memory_, [this] { return Estimate(); }) {
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
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (!set_aside_.ok()) return set_aside_;
    }
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
  if (const int64_t counted = counted_; counted > 0) return counted;
  double bytes = 0;
  context_.journal().Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      if (!record.in_model) continue;
      const int64_t encoded = record.scan.encoded_size_bytes() / kEncodedCell;
      const auto cells = static_cast<double>(encoded);
      const auto surface = static_cast<double>(record.scan.merge().surface_voxel_count());
      bytes += kBytesPerScan + cells * model::kBytesOfCellKept + surface * kBytesPerSurfaceVoxel;
    }
  });
  return static_cast<int64_t>(bytes);
}

int64_t ModelMemory::EstimateAlignment(const v1::Scan& scan) {
  return kAnyAlignment + scan.encoded_size_bytes() / kEncodedCell * kBytesPerAlignedCell;
}

int64_t ModelMemory::DecodedBytes(const sensor::Scan& scan) {
  return static_cast<int64_t>(scan.image.cells() * sizeof(float));
}

absl::Status ModelMemory::Enlarge(MemoryAccount::Reservation& reservation, int64_t bytes) const {
  const std::optional<int64_t> most = memory_.Most();
  if (!most.has_value()) return absl::OkStatus();
  if (bytes > *most) {
    return contract::ErrorWithReason(
        absl::StatusCode::kResourceExhausted, "SCAN_TOO_LARGE",
        absl::StrCat(
            "merging this scan takes some ", bytes >> 20, " MiB, and the server has ", *most >> 20,
            " MiB for all models and plans: use a larger voxel_size, or a smaller max_range_m "
            "or max_half_extent, in a new session, or have its operator give it more "
            "(--memory-mib)"));
  }
  if (reservation.Grow(bytes)) return absl::OkStatus();
  return MemoryShort(bytes);
}

std::shared_ptr<Evaluation> ModelMemory::BeginEvaluation() {
  return evaluations_.Begin(context_.dependencies().limits.evaluations);
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
  if (context_.draining()) return Draining();
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!set_aside_.ok()) return set_aside_;
  }
  absl::StatusOr<MemoryAccount::Reservation> reservation = Reserve(Estimate());
  if (!reservation.ok()) return reservation.status();
  reservation_ = *std::move(reservation);
  Touch();
  bool any = false;
  std::vector<std::string> undecided;
  context_.journal().Read([&](const SessionState& state) {
    any = state.AnyInModel();
    undecided = state.UndecidedScans();
  });
  absl::Status rebuilt = contract::UnlessOutOfMemory([&]() -> absl::Status {
    if (!any) return Rebuild(parallel);
    if (absl::Status begun = work_.Begin(kLoadingWork); !begun.ok()) {
      std::lock_guard<std::mutex> lock(mutex_);
      if (absl::IsFailedPrecondition(begun)) set_aside_ = begun;
      return begun;
    }
    absl::Status done = Rebuild(parallel);
    work_.End(kLoadingWork);
    return done;
  });
  if (!rebuilt.ok()) {
    if (contract::ReasonOf(rebuilt) == "MEMORY_SHORT") work_.End(kLoadingWork);
    Forget();
    return rebuilt;
  }
  // Work of their own, with notes of their own. What is left at a drain is in the log. Scans that
  // wait are aligned to the model with its poses adjusted, as they would have been.
  if (!context_.halted()) adjust_poses_(parallel);
  if (!loaded_) {  // that failed half way
    return absl::UnavailableError("the model could not be merged anew; it is tried again");
  }
  for (const std::string& scan : undecided) {
    if (context_.halted()) break;
    reconcile_(scan, parallel);
  }
  return absl::OkStatus();
}

void ModelMemory::Evict(parallel::Parallel& parallel) {
  if (context_.closed() || !loaded_ || model_->scans().empty() || !CheckWhole().ok()) return;
  if (unsaved_changes_ > 0) WriteSnapshot(parallel);
  if (unsaved_changes_ > 0) return;  // the snapshot could not be written
  Forget();
  context_.dependencies().log.Info("model evicted", {{"session", context_.id()}});
}

void ModelMemory::Forget() {
  absl::StatusOr<std::unique_ptr<model::PartialModel>> empty =
      model::PartialModel::Create(model_->config());
  if (!empty.ok()) return;  // it was created with this configuration before
  loaded_ = false;
  ModelSnapshot nothing;
  nothing.version = Current().version;
  Show(nothing);
  model_ = *std::move(empty);
  link_surfaces_.Clear();
  site_prior_.Forget();
  unsaved_changes_ = 0;
  reservation_.Release();
}

absl::StatusOr<model::MergeReport> ModelMemory::Insert(const v1::Scan& scan,
                                                       const sensor::Scan& data,
                                                       const Eigen::Isometry3d& T_model_scan,
                                                       parallel::Parallel& parallel,
                                                       int64_t memory_limit) {
  const std::string preview = PreviewKeyOf(scan);
  absl::StatusOr<model::MergeReport> report =
      preview.empty()
          ? model_->Insert(KeyOf(scan), data, T_model_scan, parallel, memory_limit)
          : model_->Replace(preview, KeyOf(scan), data, T_model_scan, parallel, memory_limit);
  if (!report.ok()) return report;
  for (model::SiteChange& change : report->changes) change.since = NameOf(change.since);
  // Its preview shows the same site.
  std::erase_if(report->changes,
                [&](const model::SiteChange& change) { return change.since == scan.name(); });
  return report;
}

absl::StatusOr<model::MergeReport> ModelMemory::Withdraw(const v1::Scan& scan,
                                                         parallel::Parallel& parallel) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    std::erase(lacks_, scan.name());
  }
  const std::string preview = PreviewKeyOf(scan);
  return model_->Withdraw(preview.empty() ? KeyOf(scan) : preview, parallel);
}

absl::StatusOr<model::MergeReport> ModelMemory::Move(const std::vector<PosedScan>& scans,
                                                     parallel::Parallel& parallel, size_t at_once) {
  std::vector<model::ScanMove> moves;
  std::map<std::string, const v1::Scan*> by_key;
  for (const PosedScan& posed : scans) {
    const std::string key = KeyOf(posed.scan);
    by_key[key] = &posed.scan;
    moves.push_back({key, posed.T_model_scan});
  }
  const auto load = [&](absl::string_view key) {
    return LoadScan(context_, *by_key.at(std::string(key)));
  };
  return model_->Move(moves, load, parallel, std::numeric_limits<int64_t>::max(), at_once);
}

std::string ModelMemory::PreviewKeyOf(const v1::Scan& scan) const {
  for (std::string& key : model_->scans()) {
    if (IsPreviewOf(key, scan)) return std::move(key);
  }
  return "";
}

void ModelMemory::Show(ModelSnapshot snapshot) {
  prepared_.Forget();
  std::lock_guard<std::mutex> lock(mutex_);
  current_ = std::move(snapshot);
  if (!lacks_.empty()) current_.view = nullptr;
}

void ModelMemory::Changed(size_t scans) {
  TakeRoom();
  PostSnapshot(scans);
}

void ModelMemory::TakeRoom() {
  counted_ = model_->Bytes();
  MemoryAccount* const memory = context_.dependencies().memory;
  if (memory == nullptr) return;
  if (reservation_.bytes() == 0) reservation_ = memory->Empty(context_.tenant());
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

bool ModelMemory::ReleaseSnapshotsBefore(uint64_t sequence) {
  const auto any_before = [&] {
    const std::vector<store::SnapshotRecord> listed = snapshots_.List();
    return !listed.empty() && listed.back().sequence < sequence;  // the oldest is the last
  };
  if (!any_before()) return true;
  const store::SnapshotRecord newest = snapshots_.List().front();
  if (newest.sequence < sequence) {
    const bool may_go =
        newest.algorithm_version == model::kModelAlgorithmVersion && FollowsFromScans();
    RenewSnapshot(sequence);
    if (!may_go) return false;
  }
  snapshots_.DropBefore(sequence);
  return !any_before();
}

// As far as is known: damage shows when a scan is read.
bool ModelMemory::FollowsFromScans() const {
  bool all = true;
  context_.journal().Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      if (record.in_model && context_.lost_scans().Has(name)) all = false;
    }
  });
  return all;
}

void ModelMemory::RenewSnapshot(uint64_t sequence) {
  if (context_.dependencies().limits.snapshots_per_session == 0) return;
  const bool posted = context_.TryPost([this, sequence](parallel::Parallel& parallel) {
    const absl::Status loaded = Load(parallel);
    if (!loaded.ok()) {
      context_.dependencies().log.Info(
          "the model is not there to write a snapshot of; one is written when it is",
          {{"session", context_.id()}, {"error", loaded.ToString()}});
      return;
    }
    const std::vector<store::SnapshotRecord> listed = snapshots_.List();
    if (!listed.empty() && listed.front().sequence >= sequence) return;
    if (CheckWhole().ok()) WriteSnapshot(parallel);
  });
  if (!posted && !context_.closed()) {
    context_.dependencies().log.Info("no room for a snapshot now", {{"session", context_.id()}});
  }
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
  std::vector<std::pair<uint64_t, v1::Scan>> entered;
  std::vector<v1::Scan> in_order;
  ModelSnapshot rebuilt;
  context_.journal().Read([&](const SessionState& state) {
    rebuilt.version = state.model_version;
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (!record.in_model) continue;
      entered.emplace_back(record.entered,
                           record.preview_blob.empty() ? record.scan : record.preview);
    }
  });
  // In the order in which they were merged, since the last station is where the scanner is.
  std::stable_sort(entered.begin(), entered.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  in_order.reserve(entered.size());
  for (auto& [version, scan] : entered) in_order.push_back(std::move(scan));
  for (const v1::Scan& scan : in_order) wanted[KeyOf(scan)] = scan;
  const auto pose_of = [this](const v1::Scan& scan) {
    return conversion::ReadOwnPose(scan.pose(), context_.origin());
  };

  LoadSnapshot(parallel);
  size_t changes = 0;
  std::vector<std::string> lacks;
  std::vector<PosedScan> moved;  // since the snapshot
  for (const std::string& key : model_->scans()) {
    const auto it = wanted.find(key);
    if (it == wanted.end()) continue;
    const Eigen::Isometry3d pose = pose_of(it->second);
    if (model_->PoseOf(key)->matrix() != pose.matrix()) moved.push_back({it->second, pose});
  }
  if (!moved.empty()) {
    if (context_.draining()) return Draining();
    absl::Status done = Move(moved, parallel, 1).status();
    if (absl::IsUnavailable(done)) return done;
    if (!done.ok()) {
      // What can be had of the scans is merged again, and what cannot is told.
      absl::StatusOr<std::unique_ptr<model::PartialModel>> empty =
          model::PartialModel::Create(config_);
      if (!empty.ok()) return empty.status();
      model_ = *std::move(empty);
    }
    changes += moved.size();
  }
  for (const std::string& key : model_->scans()) {
    const auto it = wanted.find(key);
    const bool stays = it != wanted.end();
    const bool is_replaced =
        std::any_of(in_order.begin(), in_order.end(),
                    [&](const v1::Scan& scan) { return IsPreviewOf(key, scan); });
    if (stays || is_replaced) continue;
    model_->Withdraw(key, parallel).IgnoreError();  // it is there
    ++changes;
  }
  for (const v1::Scan& scan : in_order) {
    if (model_->PoseOf(KeyOf(scan)).has_value()) continue;
    if (context_.draining()) return Draining();
    absl::StatusOr<sensor::Scan> data = LoadScan(context_, scan);
    absl::Status inserted = data.status();
    if (data.ok()) {
      inserted =
          Insert(scan, *data, pose_of(scan), parallel, model::CarveRoom::kUnlimited).status();
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
  std::vector<std::string> order;
  for (const v1::Scan& scan : in_order) {
    if (model_->PoseOf(KeyOf(scan)).has_value()) order.push_back(KeyOf(scan));
  }
  model_->Reorder(std::move(order)).IgnoreError();  // a preview may be there under its own name
  {
    std::lock_guard<std::mutex> lock(mutex_);
    lacks_ = std::move(lacks);
  }
  if (!in_order.empty()) rebuilt.view = model_->Publish();
  loaded_ = true;
  TakeRoom();
  Show(rebuilt);
  PostSnapshot(changes);
  return absl::OkStatus();
}

}  // namespace vantage::session
