// A session's model in memory: taken up when it is needed, put away when nobody does, and never
// more of it than the server's account allows.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/planning/planning_estimate.h"
#include "server/session/error.h"
#include "server/session/plan_inputs.h"
#include "server/session/session.h"

namespace vantage {
namespace {

// Octree, planning view and layers of scans, by voxel that a scan knows: some 14 bytes as measured
// on sites of 1000 m^2 (model.1000m2.mb), and room for what grows at the edges.
constexpr int64_t kBytesPerVoxel = 24;
constexpr int64_t kBytesPerScan = 1 << 20;
// Of a scan that no merge has measured yet.
constexpr int64_t kUnknownScan = 24 << 20;
// What aligning and carving hold for each cell of the range image meanwhile.
constexpr int64_t kBytesPerCell = 150;
constexpr absl::Duration kShortRetry = absl::Seconds(5);

}  // namespace

int64_t Session::EstimateModel() const {
  int64_t bytes = 0;
  journal_.Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      if (!record.in_model) continue;
      const v1::MergeReport& merge = record.scan.merge();
      bytes += kBytesPerScan + kBytesPerVoxel * (merge.empty_voxels() + merge.surface_voxels());
    }
  });
  return bytes;
}

int64_t Session::EstimateMerge(const v1::Scan& scan) {
  // Encoded cells take 3 bytes or more.
  return kUnknownScan + kBytesPerCell * (scan.encoded_size() / 3);
}

absl::StatusOr<MemoryAccount::Hold> Session::ReserveMemory(int64_t bytes) const {
  if (around_.memory == nullptr) return MemoryAccount::Hold();
  std::optional<MemoryAccount::Hold> hold = around_.memory->Take(bytes);
  if (hold.has_value()) return *std::move(hold);
  return Retryable(absl::StatusCode::kResourceExhausted, "MEMORY_SHORT",
                   absl::StrCat("this needs some ", bytes >> 20,
                                " MiB, and the server's memory is taken; try again"),
                   kShortRetry);
}

absl::Status Session::CheckSize(const PlanInputs& inputs) {
  PlanningConfig config = inputs.config;
  config.memory_limit /= inputs.scanner_models;
  const absl::Status fits = CheckPlanningSize(*inputs.model.view, config);
  if (fits.ok()) return fits;
  return ErrorWithReason(fits.code(), "PLAN_TOO_LARGE", fits.message());
}

absl::Status Session::ReservePlan(PlanInputs& inputs) const {
  absl::StatusOr<MemoryAccount::Hold> hold = ReserveMemory(static_cast<int64_t>(
      inputs.scanner_models * EstimatePlanningMemory(*inputs.model.view, inputs.config)));
  if (!hold.ok()) return hold.status();
  inputs.memory = std::make_shared<MemoryAccount::Hold>(*std::move(hold));
  return absl::OkStatus();
}

void Session::Touch() { touched_ = absl::ToUnixMillis(journal_.Now()); }

absl::Time Session::LastTouched() const { return absl::FromUnixMillis(touched_); }

bool Session::NeededAtStart() const {
  bool work = false;
  journal_.Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      const v1::ScanState scan = record.scan.state();
      work = work || scan == v1::SCAN_STATE_RECEIVED || scan == v1::SCAN_STATE_MERGING ||
             record.in_model != (scan == v1::SCAN_STATE_MERGED);
    }
  });
  return work || LastUsed() >= journal_.Now() - around_.limits.put_away_after;
}

void Session::SettleLater(const absl::Status& why) {
  std::vector<std::string> scans;
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      const v1::ScanState scan = record.scan.state();
      if (scan == v1::SCAN_STATE_RECEIVED || scan == v1::SCAN_STATE_MERGING ||
          record.in_model != (scan == v1::SCAN_STATE_MERGED)) {
        scans.push_back(name);
      }
    }
  });
  for (const std::string& scan : scans) RetryLater(scan, why);
}

// On the strand.
void Session::HoldModel() {
  if (around_.memory == nullptr) return;
  if (model_hold_.bytes() == 0) model_hold_ = around_.memory->Empty();
  model_hold_.Set(EstimateModel());
}

absl::Status Session::TakeUp(Parallel& parallel) {
  if (loaded_) return absl::OkStatus();
  absl::StatusOr<MemoryAccount::Hold> hold = ReserveMemory(EstimateModel());
  if (!hold.ok()) return hold.status();
  model_hold_ = *std::move(hold);
  Touch();
  Rebuild(parallel);
  return absl::OkStatus();
}

absl::Status Session::BeginToTakeUp() {
  Touch();
  if (loaded_ || taking_up_.exchange(true)) return absl::OkStatus();
  // Whoever asks hears at once when there is no room.
  absl::Status room = ReserveMemory(EstimateModel()).status();
  const bool posted =
      room.ok() && strand_->TryPost([self = shared_from_this()](Parallel& parallel) {
        const absl::Status taken = self->TakeUp(parallel);
        if (!taken.ok()) {
          self->around_.log.Warning("a model cannot be taken up",
                                    {{"session", self->id_}, {"error", taken.ToString()}});
        }
        self->taking_up_ = false;
      });
  if (!posted) taking_up_ = false;
  return room;
}

void Session::PostPutAway() {
  if (!loaded_ || around_.limits.snapshots_per_session == 0) return;
  const bool posted = strand_->TryPost(
      [self = shared_from_this()](Parallel& parallel) { self->PutAway(parallel); });
  if (!posted && !closed_) around_.log.Info("no room to put a model away", {{"session", id_}});
}

// Nothing is lost whenever this happens: whoever has the old view keeps it.
void Session::PutAway(Parallel& parallel) {
  if (closed_ || !loaded_ || model_->scans().empty() || strand_->Size() > 1) return;
  if (RunningPlans() > 0 || exports_ > 0 || evaluations_ > 0) return;
  if (unsaved_changes_ > 0) WriteSnapshot(parallel);
  if (unsaved_changes_ > 0) return;  // it could not be written
  absl::StatusOr<std::unique_ptr<PartialModel>> empty = PartialModel::Create(model_->config());
  if (!empty.ok()) return;
  loaded_ = false;
  ModelSnapshot nothing;
  nothing.version = Model().version;
  Show(nothing);
  model_ = *std::move(empty);
  model_hold_.Release();
  around_.log.Info("model put away", {{"session", id_}});
}

}  // namespace vantage
