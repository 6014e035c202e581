// A session's model in memory: loaded when it is needed, evicted when nobody does, and never
// more of it than the server's account allows.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/planning/problem/planning_estimate.h"
#include "server/contract/error.h"
#include "server/session/plan_inputs.h"
#include "server/session/session.h"

namespace vantage::session {
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
      bytes += kBytesPerScan +
               kBytesPerVoxel * (merge.empty_voxel_count() + merge.surface_voxel_count());
    }
  });
  return bytes;
}

int64_t Session::EstimateMerge(const v1::Scan& scan) {
  // Encoded cells take 3 bytes or more.
  return kUnknownScan + kBytesPerCell * (scan.encoded_size_bytes() / 3);
}

absl::StatusOr<MemoryAccount::Reservation> Session::ReserveMemory(int64_t bytes) const {
  if (dependencies_.memory == nullptr) return MemoryAccount::Reservation();
  std::optional<MemoryAccount::Reservation> reservation = dependencies_.memory->Take(bytes);
  if (reservation.has_value()) return *std::move(reservation);
  return contract::Retryable(absl::StatusCode::kResourceExhausted, "MEMORY_SHORT",
                             absl::StrCat("this needs some ", bytes >> 20,
                                          " MiB, and the server's memory is taken; try again"),
                             kShortRetry);
}

absl::Status Session::CheckSize(const PlanInputs& inputs) {
  planning::PlanningConfig config = inputs.config;
  config.memory_limit /= inputs.scanner_models;
  const absl::Status fits = planning::CheckPlanningSize(*inputs.model.view, config);
  if (fits.ok()) return fits;
  return contract::ErrorWithReason(fits.code(), "PLAN_TOO_LARGE", fits.message());
}

absl::Status Session::ReservePlan(PlanInputs& inputs) const {
  absl::StatusOr<MemoryAccount::Reservation> reservation = ReserveMemory(static_cast<int64_t>(
      inputs.scanner_models * EstimatePlanningMemory(*inputs.model.view, inputs.config)));
  if (!reservation.ok()) return reservation.status();
  inputs.memory = std::make_shared<MemoryAccount::Reservation>(*std::move(reservation));
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
  return work || LastUsed() >= journal_.Now() - dependencies_.limits.evict_after;
}

void Session::ReconcileLater(const absl::Status& why) {
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
void Session::ReserveModel() {
  if (dependencies_.memory == nullptr) return;
  if (model_reservation_.bytes() == 0) model_reservation_ = dependencies_.memory->Empty();
  model_reservation_.Set(EstimateModel());
}

absl::Status Session::Load(parallel::Parallel& parallel) {
  if (loaded_) return absl::OkStatus();
  absl::StatusOr<MemoryAccount::Reservation> reservation = ReserveMemory(EstimateModel());
  if (!reservation.ok()) return reservation.status();
  model_reservation_ = *std::move(reservation);
  Touch();
  Rebuild(parallel);
  return absl::OkStatus();
}

absl::Status Session::BeginLoad() {
  Touch();
  if (loaded_ || loading_.exchange(true)) return absl::OkStatus();
  // Whoever asks hears at once when there is no room.
  absl::Status room = ReserveMemory(EstimateModel()).status();
  const bool posted =
      room.ok() && strand_->TryPost([self = shared_from_this()](parallel::Parallel& parallel) {
        const absl::Status taken = self->Load(parallel);
        if (!taken.ok()) {
          self->dependencies_.log.Warning("a model cannot be loaded",
                                          {{"session", self->id_}, {"error", taken.ToString()}});
        }
        self->loading_ = false;
      });
  if (!posted) loading_ = false;
  return room;
}

void Session::PostEvict() {
  if (!loaded_ || dependencies_.limits.snapshots_per_session == 0) return;
  const bool posted = strand_->TryPost(
      [self = shared_from_this()](parallel::Parallel& parallel) { self->Evict(parallel); });
  if (!posted && !closed_)
    dependencies_.log.Info("the session has too much to do to evict its model now",
                           {{"session", id_}});
}

// Nothing is lost whenever this happens: whoever has the old view keeps it.
void Session::Evict(parallel::Parallel& parallel) {
  if (closed_ || !loaded_ || model_->scans().empty() || strand_->Size() > 1) return;
  if (RunningPlans() > 0 || exports_ > 0 || evaluations_ > 0) return;
  if (unsaved_changes_ > 0) WriteSnapshot(parallel);
  if (unsaved_changes_ > 0) return;  // it could not be written
  absl::StatusOr<std::unique_ptr<model::PartialModel>> empty =
      model::PartialModel::Create(model_->config());
  if (!empty.ok()) return;
  loaded_ = false;
  ModelSnapshot nothing;
  nothing.version = Model().version;
  Show(nothing);
  model_ = *std::move(empty);
  model_reservation_.Release();
  dependencies_.log.Info("model evicted", {{"session", id_}});
}

}  // namespace vantage::session
