#include "server/session/scan_reconciler.h"

#include <chrono>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "core/model/carve/carve_room.h"
#include "core/model/insert_estimate.h"
#include "core/registration/first_pose.h"
#include "core/sensor/likeness.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/gain_promise.h"
#include "server/session/scan_alignment.h"
#include "server/session/scan_links.h"
#include "server/session/sightings.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
namespace {

constexpr std::chrono::seconds kReconcileAgainAfter(5);

// The state that a verdict gives a scan that is not registered.
v1::ScanState StateOf(const registration::RegistrationVerdict& verdict) {
  return verdict.outcome == registration::RegistrationOutcome::kDoubtful ? v1::SCAN_STATE_DOUBTFUL
                                                                         : v1::SCAN_STATE_FAILED;
}

}  // namespace

ScanReconciler::ScanReconciler(SessionContext& context, ModelMemory& model, Claims& claims,
                               Stations& stations, Preparation& preparation, PoseAdjuster& adjuster,
                               DoubtProposals& proposals)
    : context_(context),
      journal_(context.journal()),
      dependencies_(context.dependencies()),
      model_(model),
      claims_(claims),
      stations_(stations),
      preparation_(preparation),
      adjuster_(adjuster),
      proposals_(proposals),
      work_(context) {}

void ScanReconciler::Post(const std::string& scan) {
  const bool posted =
      context_.TryPost([this, scan](parallel::Parallel& parallel) { Reconcile(scan, parallel); });
  if (!posted && !context_.closed()) {
    RetryLater(scan, absl::ResourceExhaustedError("the session's queue is full"));
  }
}

void ScanReconciler::PostUndecidedLater(const absl::Status& why) {
  std::vector<std::string> scans;
  journal_.Read([&](const SessionState& state) { scans = state.UndecidedScans(); });
  for (const std::string& scan : scans) RetryLater(scan, why);
}

void ScanReconciler::AddProgress(v1::Scan& scan) const {
  const bool received = scan.state() == v1::SCAN_STATE_RECEIVED;
  if (!received && scan.state() != v1::SCAN_STATE_MERGING) return;
  std::lock_guard<std::mutex> lock(mutex_);
  if (received && reconciling_ == scan.name()) scan.set_state(v1::SCAN_STATE_REGISTERING);
  if (const auto it = waits_.find(scan.name()); it != waits_.end()) {
    scan.set_state_message(it->second);
  }
}

void ScanReconciler::RetryLater(const std::string& scan, const absl::Status& why,
                                const std::string& waited) {
  const std::string waits = absl::StrCat("waits, and is tried again: ", why.message());
  if (waits != waited) {
    dependencies_.log.Warning("scan waits", {{"scan", scan}, {"error", why.ToString()}});
  }
  {
    std::lock_guard<std::mutex> lock(mutex_);
    waits_[scan] = waits;
  }
  context_.After(kReconcileAgainAfter, [this, scan] { Post(scan); });
}

// Changes a scan unless it has changed since it was read, since a person may have decided otherwise
// meanwhile.
absl::Status ScanReconciler::Change(
    const v1::Scan& as_read, absl::FunctionRef<void(const SessionState&, v1::Scan&, Draft&)> change,
    absl::FunctionRef<void()> applied) {
  return journal_
      .Execute(
          {},
          [&](const SessionState& state) -> absl::StatusOr<Draft> {
            const auto it = state.scans.find(as_read.name());
            if (it == state.scans.end())
              return contract::ResourceNotFound("vantage/Scan", as_read.name());
            if (it->second.scan.SerializeAsString() != as_read.SerializeAsString()) {
              return absl::AbortedError("the scan changed meanwhile");
            }
            v1::Scan next = it->second.scan;
            *next.mutable_update_time() = conversion::WriteTime(journal_.Now());
            Draft draft;
            change(state, next, draft);
            return draft;
          },
          applied)
      .status();
}

void ScanReconciler::Reconcile(const std::string& name, parallel::Parallel& parallel) {
  if (context_.closed() || context_.halted()) return;
  ReconcileScan(name, parallel);
  if (!model_.loaded()) return;
  adjuster_.AdjustWhenDue(parallel);
  proposals_.PostWhenDue();
}

void ScanReconciler::ReconcileScan(const std::string& name, parallel::Parallel& parallel) {
  std::string waited;  // for what
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (auto waits = waits_.extract(name); !waits.empty()) waited = std::move(waits.mapped());
  }
  preparation_.Stop();
  if (absl::Status taken = model_.Load(parallel); !taken.ok()) return RetryLater(name, taken);
  model_.Touch();
  v1::Scan scan;
  bool in_model = false;
  journal_.Read([&](const SessionState& state) {
    const auto it = state.scans.find(name);
    if (it == state.scans.end()) return;
    scan = it->second.scan;
    in_model = it->second.in_model;
  });
  const bool wanted = scan.state() == v1::SCAN_STATE_MERGED;
  // Its preview stays until it is merged itself.
  const bool swaps =
      in_model && scan.state() == v1::SCAN_STATE_MERGING && model_.HoldsPreviewOf(scan);
  if (in_model && !wanted && !swaps) {
    const absl::Status removed =
        contract::UnlessOutOfMemory([&] { return RemoveFromModel(scan, parallel); });
    if (contract::ReasonOf(removed) == "MEMORY_SHORT") model_.Forget();
    if (!removed.ok()) return RetryLater(name, removed);
    journal_.Read([&](const SessionState& state) { scan = state.scans.at(name).scan; });
  }
  if (scan.state() != v1::SCAN_STATE_RECEIVED && scan.state() != v1::SCAN_STATE_MERGING) return;
  // It would be aligned to less than the log says that the model is.
  if (absl::Status whole = model_.CheckWhole(); !whole.ok()) return RetryLater(name, whole, waited);
  // Held until the scan is merged; then the model's own reservation includes it.
  absl::StatusOr<MemoryAccount::Reservation> reservation =
      model_.Reserve(ModelMemory::EstimateAlignment(scan));
  if (!reservation.ok()) return RetryLater(name, reservation.status());
  const absl::Status begun = work_.Begin(name);
  if (!begun.ok() && context_.closed()) return;
  if (absl::IsFailedPrecondition(begun)) {
    Refuse(scan, v1::SCAN_STATE_FAILED,
           absl::StrCat(std::string(begun.message()),
                        "; withdraw it, or set its pose to have it tried again"),
           nullptr);
    return work_.End(name);  // what a person decides counts anew
  }
  if (!begun.ok()) return RetryLater(name, begun);
  {
    std::lock_guard<std::mutex> lock(mutex_);
    reconciling_ = name;
  }
  const absl::Status done = contract::UnlessOutOfMemory([&] {
    Work(scan, *reservation, parallel);
    return absl::OkStatus();
  });
  if (!done.ok()) {
    model_.Forget();
    journal_.Read([&](const SessionState& state) { scan = state.scans.at(name).scan; });
    if (scan.state() == v1::SCAN_STATE_RECEIVED || scan.state() == v1::SCAN_STATE_MERGING) {
      Refuse(scan, v1::SCAN_STATE_FAILED,
             "the server had no memory left for this scan: use a larger voxel_size, or a smaller "
             "max_range_m, in a new session, or set its pose to have it tried again",
             nullptr);
    }
  }
  work_.End(name);
  std::lock_guard<std::mutex> lock(mutex_);
  reconciling_.clear();
}

void ScanReconciler::Work(const v1::Scan& scan, MemoryAccount::Reservation& reservation,
                          parallel::Parallel& parallel) {
  absl::StatusOr<sensor::Scan> data = LoadScan(context_, scan);
  // The medium may come back, and then the scan can be read.
  if (absl::IsUnavailable(data.status())) return RetryLater(scan.name(), data.status());
  if (!data.ok()) {
    return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(data.status().message()), nullptr);
  }
  const model::InsertSize size(*data, model_.config());
  const absl::Status room =
      model_.Enlarge(reservation, ModelMemory::DecodedBytes(*data) + size.PeakBytes());
  if (contract::ReasonOf(room) == "SCAN_TOO_LARGE") {
    return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(room.message()), nullptr);
  }
  if (!room.ok()) return RetryLater(scan.name(), room);
  if (scan.state() == v1::SCAN_STATE_RECEIVED) {
    Align(scan, *data, reservation, parallel);
  } else {
    Merge(scan, *data, reservation, parallel);
  }
}

void ScanReconciler::Align(const v1::Scan& scan, sensor::Scan& data,
                           MemoryAccount::Reservation& reservation, parallel::Parallel& parallel) {
  const ModelSnapshot model = model_.Current();
  v1::Scan placed = scan;
  placed.set_state(v1::SCAN_STATE_MERGING);
  if (model.view == nullptr) {
    std::vector<registration::TargetTie> targets;
    journal_.Read(
        [&](const SessionState& state) { targets = TiesOf(state, scan, context_.origin()); });
    const absl::Status first = PlaceFirst(data, targets, placed);
    if (!first.ok()) {
      return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(first.message()), nullptr);
    }
  } else {
    const absl::Time started = absl::Now();
    const absl::StatusOr<registration::RegistrationResult> result =
        AlignToModel(context_, *model.view, scan, data, parallel);
    if (!result.ok()) {
      return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(result.status().message()), nullptr);
    }
    telemetry::ObserveStage(dependencies_.metrics, "registration",
                            absl::ToDoubleSeconds(absl::Now() - started));
    const v1::Registration registration =
        conversion::WriteRegistration(*result, model.version, context_.origin());
    const registration::RegistrationVerdict& verdict = result->verdict;
    if (const std::string twin = TwinOf(scan, data, result->T_world_scan); !twin.empty()) {
      return Refuse(scan, v1::SCAN_STATE_FAILED,
                    absl::StrCat("the same samples as ", twin,
                                 ", which is in the model already; withdraw this one (to give that "
                                 "one another pose, set it there)"),
                    &registration);
    }
    const v1::PoseReference reference = NearestInModel(context_, scan, result->T_world_scan);
    if (!verdict.registered()) {
      return Refuse(scan, StateOf(verdict), DoubtWords(registration), &registration, &reference);
    }
    *placed.mutable_pose_reference() = reference;
    *placed.mutable_registration() = registration;
    *placed.mutable_pose() = registration.pose();
    const bool trusted = data.prior.has_value() && data.prior->trusted;
    placed.set_pose_source(trusted ? v1::POSE_SOURCE_TRUSTED_PRIOR : v1::POSE_SOURCE_REGISTRATION);
  }
  absl::Status logged = Change(scan, [&](const SessionState&, v1::Scan& next, Draft& draft) {
    *placed.mutable_update_time() = next.update_time();
    *draft.event.mutable_scan_registered()->mutable_scan() = placed;
  });
  if (absl::IsAborted(logged)) return;  // its next operation is queued
  if (!logged.ok()) return RetryLater(scan.name(), logged);
  Merge(placed, data, reservation, parallel);
}

absl::Status ScanReconciler::PlaceFirst(sensor::Scan& data,
                                        std::span<const registration::TargetTie> targets,
                                        v1::Scan& placed) const {
  absl::StatusOr<std::optional<sensor::PosePrior>> prior =
      registration::FirstPrior(data.prior, targets);
  if (!prior.ok()) return prior.status();
  data.prior = *std::move(prior);
  absl::StatusOr<registration::Levelling> levelling = dependencies_.algorithms.level(data);
  if (!levelling.ok()) return levelling.status();
  levelling->T_world_scan = registration::FirstPose(*levelling, data.prior);
  *placed.mutable_levelling() = conversion::WriteLevelling(*levelling, context_.origin());
  *placed.mutable_pose() = placed.levelling().pose();
  placed.set_pose_source(v1::POSE_SOURCE_FIRST_SCAN);
  return absl::OkStatus();
}

void ScanReconciler::Merge(const v1::Scan& scan, const sensor::Scan& data,
                           MemoryAccount::Reservation& reservation, parallel::Parallel& parallel) {
  if (PutBackPreview(scan, data)) return;
  const bool swaps = model_.HoldsPreviewOf(scan);
  const std::pair<std::string, int64_t> preview = PreviewOf(scan.name());
  // The pose is read back from the log, so that a replay gives the same bits.
  const Eigen::Isometry3d T_model_scan = conversion::ReadOwnPose(scan.pose(), context_.origin());
  absl::StatusOr<model::MergeReport> report = absl::ResourceExhaustedError("");
  while (true) {
    const int64_t limit = model_.memory().Limited()
                              ? reservation.bytes() - ModelMemory::DecodedBytes(data)
                              : model::CarveRoom::kUnlimited;
    report = model_.Insert(scan, data, T_model_scan, parallel, limit);
    if (!absl::IsResourceExhausted(report.status())) break;
    // It takes more than was estimated: once more, with twice the room.
    const absl::Status room = model_.Enlarge(reservation, 2 * reservation.bytes());
    if (contract::ReasonOf(room) == "SCAN_TOO_LARGE") break;
    if (!room.ok()) return RetryLater(scan.name(), room);
  }
  if (!report.ok()) {
    return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(report.status().message()), nullptr);
  }
  // A reader who sees the scan merged gets the model with that scan.
  const std::shared_ptr<const model::PlanningView> before = model_.Current().view;
  ModelSnapshot next_model{model_.Publish(), 0};
  const double obtained = ObtainedGain(context_, before.get(), *next_model.view, parallel);
  const std::vector<v1::ScanLink> links = LinksOf(context_, model_, scan, data, parallel);
  std::string claim;    // that it fulfils
  std::string station;  // that it comes from
  absl::Status logged = Change(
      scan,
      [&](const SessionState& state, v1::Scan& next, Draft& draft) {
        next_model.version = state.model_version + 1;
        next.set_state(v1::SCAN_STATE_MERGED);
        *next.mutable_merge() = conversion::WriteMergeReport(*report, context_.origin());
        next.mutable_merge()->set_model_version(next_model.version);
        if (dependencies_.algorithms.link_scans) {
          next.mutable_merge()->set_link_count(static_cast<int32_t>(links.size()));
        }
        if (swaps && scan.has_merge()) {
          // What it was made for was obtained, and promised, before its preview came, which also
          // showed what was moved.
          const v1::MergeReport& first = scan.merge();
          *next.mutable_merge()->mutable_changes() = first.changes();
          if (first.has_obtained_gain_m2()) {
            next.mutable_merge()->set_obtained_gain_m2(first.obtained_gain_m2());
          }
          if (first.has_promise()) *next.mutable_merge()->mutable_promise() = first.promise();
        } else {
          next.mutable_merge()->set_obtained_gain_m2(obtained);
          if (const auto promise = PromiseOf(state, next)) {
            *next.mutable_merge()->mutable_promise() = *promise;
          }
          claim = claims_.FulfilledBy(state, next);
          if (!claim.empty()) next.set_scanner(state.claims.at(claim).claim.scanner());
          station = stations_.OfScan(state, next);
        }
        *draft.event.mutable_scan_merged()->mutable_scan() = next;
        *draft.event.mutable_scan_merged()->mutable_links() = {links.begin(), links.end()};
      },
      [&] { model_.Show(next_model); });
  if (!logged.ok()) {
    // The log decides; the model follows it.
    if (swaps) {
      model_.Forget();
    } else {
      model_.Withdraw(scan, parallel).IgnoreError();
    }
    if (!absl::IsAborted(logged)) RetryLater(scan.name(), logged);
    return;
  }
  Release(preview);
  telemetry::ObserveStage(dependencies_.metrics, "carve", report->carve_seconds);
  telemetry::ObserveStage(dependencies_.metrics, "merge", report->merge_seconds);
  dependencies_.log.Info(
      "scan merged",
      {{"session", context_.id()},
       {"scan", scan.name()},
       {"carve_seconds", report->carve_seconds},
       {"merge_seconds", report->merge_seconds},
       {"registration_seconds", conversion::ReadDuration(scan.registration().duration())}});
  // If the server stops here, the log asks for it again after the restart.
  if (!claim.empty()) claims_.Fulfil(claim, scan.name()).IgnoreError();
  if (!station.empty()) stations_.Arrived(station, scan.name()).IgnoreError();
  model_.Changed(1);
  preparation_.Begin();
}

absl::Status ScanReconciler::RemoveFromModel(const v1::Scan& scan, parallel::Parallel& parallel) {
  const std::pair<std::string, int64_t> preview = PreviewOf(scan.name());
  absl::StatusOr<model::MergeReport> removed = model_.Withdraw(scan, parallel);
  if (!removed.ok() && !absl::IsNotFound(removed.status())) return removed.status();
  const std::shared_ptr<const model::PlanningView> without = model_.Publish();
  ModelSnapshot next_model;
  absl::Status logged = journal_
                            .Execute(
                                {},
                                [&](const SessionState& state) -> absl::StatusOr<Draft> {
                                  next_model.version = state.model_version + 1;
                                  for (const auto& [name, record] : state.scans) {
                                    if (record.in_model && name != scan.name())
                                      next_model.view = without;
                                  }
                                  Draft draft;
                                  v1::ScanRemovedEvent& event = *draft.event.mutable_scan_removed();
                                  *event.mutable_scan() = state.scans.at(scan.name()).scan;
                                  event.mutable_scan()->clear_merge();
                                  event.set_model_version(next_model.version);
                                  return draft;
                                },
                                [&] { model_.Show(next_model); })
                            .status();
  if (logged.ok()) {
    Release(preview);
    model_.Changed(1);
    preparation_.Begin();
  }
  return logged;
}

void ScanReconciler::ForEachInModel(
    const std::string& but, const Eigen::Isometry3d& T_model_scan,
    absl::FunctionRef<void(const ScanRecord&, double apart)> visit) const {
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (!record.in_model || name == but) continue;
      const Eigen::Isometry3d pose = conversion::ReadOwnPose(record.scan.pose(), context_.origin());
      visit(record, (pose.translation() - T_model_scan.translation()).norm());
    }
  });
}

std::string ScanReconciler::TwinOf(const v1::Scan& scan, const sensor::Scan& data,
                                   const Eigen::Isometry3d& T_model_scan) const {
  constexpr double kSamePlace = 0.3;  // m: where a copy aligns, and few second scans stand
  std::vector<v1::Scan> candidates;
  ForEachInModel(scan.name(), T_model_scan, [&](const ScanRecord& record, double apart) {
    if (apart <= kSamePlace || record.blob == scan.sha256()) candidates.push_back(record.scan);
  });
  for (const v1::Scan& other : candidates) {
    if (other.sha256() == scan.sha256()) return other.name();
    const absl::StatusOr<sensor::RangeImage> image = LoadImage(context_, other.name());
    if (image.ok() && sensor::SameSamples(data.image, *image)) return other.name();
  }
  return "";
}

std::pair<std::string, int64_t> ScanReconciler::PreviewOf(const std::string& scan) const {
  std::pair<std::string, int64_t> preview;
  journal_.Read([&](const SessionState& state) {
    const ScanRecord& record = state.scans.at(scan);
    preview = {record.preview_blob, record.preview.encoded_size_bytes()};
  });
  return preview;
}

void ScanReconciler::Release(const std::pair<std::string, int64_t>& preview) {
  if (preview.first.empty()) return;
  context_.account()->GiveBack(preview.second);
  // What cannot be removed now is removed at the next start.
  dependencies_.store.ReleaseBlob(preview.first).IgnoreError();
}

bool ScanReconciler::PutBackPreview(const v1::Scan& scan, const sensor::Scan& data) {
  constexpr double kSameScan = 0.7;  // of directions: another place agrees in a tenth
  const std::string blob = PreviewOf(scan.name()).first;
  if (blob.empty()) return false;
  const absl::StatusOr<sensor::RangeImage> preview = LoadImage(context_, scan.name(), blob);
  // The medium may come back, and then they are compared.
  if (absl::IsUnavailable(preview.status())) {
    RetryLater(scan.name(), preview.status());
    return true;
  }
  if (!preview.ok()) return false;  // it is lost, and there is the whole scan
  const double share = sensor::ShareThatAgrees(data.image, *preview);
  if (share >= kSameScan) return false;
  const absl::Status logged =
      Change(scan, [&](const SessionState& state, v1::Scan& next, Draft& draft) {
        v1::Scan before = state.scans.at(scan.name()).preview;
        before.set_state_message(
            absl::StrFormat("what was sent in place of this preview was another scan (%.0f %% of "
                            "the directions agree), "
                            "and was dropped; send it as a scan of its own",
                            100 * share));
        *before.mutable_update_time() = next.update_time();
        before.set_upload(next.upload());
        draft.blob = blob;
        *draft.event.mutable_scan_replaced()->mutable_scan() = std::move(before);
      });
  if (absl::IsAborted(logged)) return true;  // its next operation is queued
  if (!logged.ok()) {
    RetryLater(scan.name(), logged);
    return true;
  }
  Release({std::string(scan.sha256()), scan.encoded_size_bytes()});
  return true;
}

void ScanReconciler::Refuse(const v1::Scan& scan, v1::ScanState state, const std::string& message,
                            const v1::Registration* registration,
                            const v1::PoseReference* reference) {
  absl::Status logged = Change(scan, [&](const SessionState&, v1::Scan& next, Draft& draft) {
    next.set_state(state);
    next.set_state_message(message);
    next.clear_pose();
    next.clear_pose_source();
    next.clear_adjustment();
    next.clear_pose_proposal();
    if (reference != nullptr) *next.mutable_pose_reference() = *reference;
    if (registration != nullptr) {
      *next.mutable_registration() = *registration;
    }
    next.set_etag(EtagOfDoubt(next));
    *draft.event.mutable_scan_refused()->mutable_scan() = next;
  });
  if (!logged.ok() && !absl::IsAborted(logged)) RetryLater(scan.name(), logged);
  if (logged.ok() && model_.HoldsPreviewOf(scan)) Post(scan.name());  // its preview leaves as well
  dependencies_.log.Info("scan refused", {{"session", context_.id()},
                                          {"scan", scan.name()},
                                          {"state", v1::ScanState_Name(state)},
                                          {"why", message}});
}

}  // namespace vantage::session
