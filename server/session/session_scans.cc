// A session's scans: aligned, judged, merged and taken out again, on the session's strand.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/sensor/encoding.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/session.h"
#include "server/session/sightings.h"

namespace vantage::session {
namespace {

constexpr char kScanType[] = "vantage/Scan";
constexpr std::chrono::seconds kMergeAgainAfter(5);

absl::Status WrongState(const v1::Scan& scan, absl::string_view needed) {
  return contract::ErrorWithReason(
      absl::StatusCode::kFailedPrecondition, "SCAN_STATE",
      absl::StrCat(scan.name(), " is ", v1::ScanState_Name(scan.state()), "; ", needed),
      {{"state", v1::ScanState_Name(scan.state())}});
}

// Scans in the model whose alignment saw `scan` in it.
std::vector<std::string> Dependents(const SessionState& state, const ScanRecord& scan) {
  std::vector<std::string> names;
  if (!scan.in_model) return names;
  for (const std::string& name : state.scan_order) {
    const ScanRecord& other = state.scans.at(name);
    const bool aligned = other.scan.pose_source() == v1::POSE_SOURCE_REGISTRATION ||
                         other.scan.pose_source() == v1::POSE_SOURCE_ACCEPTED;
    if (other.in_model && name != scan.scan.name() && aligned &&
        other.scan.registration().model_version() >= scan.scan.merge().model_version()) {
      names.push_back(name);
    }
  }
  return names;
}

}  // namespace

absl::StatusOr<v1::Scan> Session::GetScan(const std::string& name) const {
  absl::StatusOr<v1::Scan> found = contract::ResourceNotFound(kScanType, name);
  journal_.Read([&](const SessionState& state) {
    const auto it = state.scans.find(name);
    if (it != state.scans.end()) found = it->second.scan;
  });
  if (found.ok()) AddProgress(*found);
  return found;
}

// What the log doesn't say: what is being done now, or why it isn't.
void Session::AddProgress(v1::Scan& scan) const {
  const bool received = scan.state() == v1::SCAN_STATE_RECEIVED;
  if (!received && scan.state() != v1::SCAN_STATE_MERGING) return;
  std::lock_guard<std::mutex> lock(mutex_);
  if (received && reconciling_ == scan.name()) scan.set_state(v1::SCAN_STATE_REGISTERING);
  if (const auto it = waits_.find(scan.name()); it != waits_.end()) {
    scan.set_state_message(it->second);
  }
}

absl::StatusOr<std::vector<v1::Scan>> Session::ListScans(absl::string_view after, size_t limit,
                                                         bool& more) const {
  std::vector<v1::Scan> scans;
  absl::StatusOr<size_t> begin = 0;
  journal_.Read([&](const SessionState& state) {
    begin = PlaceAfter(state.scan_order, after);
    if (!begin.ok()) return;
    for (size_t i = *begin; i < state.scan_order.size() && scans.size() < limit; ++i) {
      scans.push_back(state.scans.at(state.scan_order[i]).scan);
    }
    more = *begin + scans.size() < state.scan_order.size();
  });
  if (!begin.ok()) return begin.status();
  for (v1::Scan& scan : scans) AddProgress(scan);
  return scans;
}

absl::StatusOr<v1::Scan> Session::AcceptScan(const v1::AcceptScanRequest& request) {
  contract::Violations violations;
  conversion::CheckRequestId(request.request_id(), violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  absl::StatusOr<std::string> name = journal_.Execute(
      RequestKey::Of(request.request_id(), "AcceptScan", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        const auto it = state.scans.find(request.name());
        if (it == state.scans.end()) return contract::ResourceNotFound(kScanType, request.name());
        const v1::Scan& scan = it->second.scan;
        const bool waits =
            scan.state() == v1::SCAN_STATE_DOUBTFUL || scan.state() == v1::SCAN_STATE_FAILED;
        if (!waits || !scan.has_registration()) {
          return WrongState(scan,
                            "only a doubtful or failed scan with an alignment can be "
                            "accepted; give it a pose with SetScanPose");
        }
        Draft draft;
        v1::Scan& next = *draft.event.mutable_scan_accepted()->mutable_scan();
        next = scan;
        next.set_state(v1::SCAN_STATE_MERGING);
        next.clear_state_message();
        *next.mutable_pose() = scan.registration().pose();
        next.set_pose_source(v1::POSE_SOURCE_ACCEPTED);
        *next.mutable_update_time() = conversion::WriteTime(journal_.Now());
        return draft;
      });
  if (!name.ok()) return name.status();
  PostReconcile(*name);
  return GetScan(*name);
}

absl::StatusOr<v1::Scan> Session::SetScanPose(const v1::SetScanPoseRequest& request) {
  contract::Violations violations;
  conversion::CheckRequestId(request.request_id(), violations);
  if (!request.has_prior()) violations.Add("prior", "is required");
  if (request.has_prior()) conversion::ReadPosePrior(request.prior(), origin_, "prior", violations);
  if (!v1::PoseUse_IsValid(request.use())) violations.Add("use", "must be ALIGN or AS_IS");
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  absl::StatusOr<std::string> name =
      journal_.Execute(RequestKey::Of(request.request_id(), "SetScanPose", request),
                       [&](const SessionState& state) -> absl::StatusOr<Draft> {
                         const auto it = state.scans.find(request.name());
                         if (it == state.scans.end())
                           return contract::ResourceNotFound(kScanType, request.name());
                         const v1::Scan& scan = it->second.scan;
                         if (scan.state() == v1::SCAN_STATE_WITHDRAWN) {
                           return WrongState(scan, "send it again instead");
                         }
                         Draft draft;
                         v1::Scan& next = *draft.event.mutable_scan_pose_set()->mutable_scan();
                         next = scan;
                         *next.mutable_prior() = request.prior();
                         next.clear_state_message();
                         if (request.use() == v1::POSE_USE_AS_IS) {
                           next.set_state(v1::SCAN_STATE_MERGING);
                           *next.mutable_pose() = request.prior().pose();
                           next.set_pose_source(v1::POSE_SOURCE_SET);
                         } else {
                           next.set_state(v1::SCAN_STATE_RECEIVED);
                           next.clear_pose();
                           next.clear_pose_source();
                           next.clear_registration();
                           next.clear_levelling();
                         }
                         *next.mutable_update_time() = conversion::WriteTime(journal_.Now());
                         return draft;
                       });
  if (!name.ok()) return name.status();
  PostReconcile(*name);
  return GetScan(*name);
}

absl::StatusOr<v1::WithdrawScanResponse> Session::WithdrawScan(
    const v1::WithdrawScanRequest& request) {
  contract::Violations violations;
  conversion::CheckRequestId(request.request_id(), violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  absl::StatusOr<std::string> name = journal_.Execute(
      RequestKey::Of(request.request_id(), "WithdrawScan", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        const auto it = state.scans.find(request.name());
        if (it == state.scans.end()) return contract::ResourceNotFound(kScanType, request.name());
        const v1::Scan& scan = it->second.scan;
        if (scan.state() == v1::SCAN_STATE_WITHDRAWN) {
          return WrongState(scan, "it has been withdrawn already");
        }
        Draft draft;
        v1::ScanWithdrawnEvent& event = *draft.event.mutable_scan_withdrawn();
        *event.mutable_scan() = scan;
        event.mutable_scan()->set_state(v1::SCAN_STATE_WITHDRAWN);
        event.mutable_scan()->clear_state_message();
        *event.mutable_scan()->mutable_update_time() = conversion::WriteTime(journal_.Now());
        for (const std::string& dependent : Dependents(state, it->second)) {
          event.add_dependent_scans(dependent);
        }
        return draft;
      });
  if (!name.ok()) return name.status();
  PostReconcile(*name);
  absl::StatusOr<v1::Scan> scan = GetScan(*name);
  if (!scan.ok()) return scan.status();
  v1::WithdrawScanResponse response;
  *response.mutable_scan() = *std::move(scan);
  // From the log, so that a repeated request hears the same.
  uint64_t after = 0;
  constexpr size_t kBatch = 256;
  while (true) {
    absl::StatusOr<std::vector<v1::SessionEvent>> events = journal_.Events(after, kBatch);
    if (!events.ok()) return events.status();
    if (events->empty()) return response;
    for (const v1::SessionEvent& event : *events) {
      if (event.scan_withdrawn().scan().name() != *name) continue;
      *response.mutable_dependent_scans() = event.scan_withdrawn().dependent_scans();
    }
    after = events->back().sequence();
  }
}

absl::StatusOr<sensor::RangeImage> Session::LoadImage(const std::string& scan) const {
  std::string blob;
  bool known = false;
  journal_.Read([&](const SessionState& state) {
    const auto it = state.scans.find(scan);
    known = it != state.scans.end();
    if (known) blob = it->second.blob;
  });
  if (!known) return contract::ResourceNotFound(kScanType, scan);
  if (blob.empty()) {
    return contract::ErrorWithReason(
        absl::StatusCode::kFailedPrecondition, "SCAN_ERASED",
        absl::StrCat(scan,
                     " was withdrawn, and its data have been erased since; "
                     "send it again"));
  }
  absl::StatusOr<std::string> bytes = dependencies_.store.GetBlob(blob);
  if (absl::IsNotFound(bytes.status())) {
    return contract::ErrorWithReason(
        absl::StatusCode::kDataLoss, "SCAN_LOST",
        absl::StrCat(scan, ": the server has lost its data; have its operator restore a backup"));
  }
  if (!bytes.ok()) return bytes.status();
  return sensor::DecodeRangeImage(*bytes, dependencies_.limits.scan_cells);
}

absl::StatusOr<sensor::Scan> Session::LoadScan(const v1::Scan& scan) const {
  absl::StatusOr<sensor::RangeImage> image = LoadImage(scan.name());
  if (!image.ok()) return image.status();
  sensor::Scan data;
  data.image = *std::move(image);
  contract::Violations violations;
  data.scanner = conversion::ReadScannerModel(scan.scanner_model(), "scanner_model", violations);
  if (scan.has_prior())
    data.prior = conversion::ReadPosePrior(scan.prior(), origin_, "prior", violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  return data;
}

void Session::PostReconcile(const std::string& scan) {
  const bool posted =
      strand_->TryPost([self = shared_from_this(), scan](parallel::Parallel& parallel) {
        self->Reconcile(scan, parallel);
      });
  if (!posted && !closed_) {
    RetryLater(scan, absl::ResourceExhaustedError("the session's queue is full"));
  }
}

void Session::RetryLater(const std::string& scan, const absl::Status& why) {
  dependencies_.log.Warning("scan waits", {{"scan", scan}, {"error", why.ToString()}});
  {
    std::lock_guard<std::mutex> lock(mutex_);
    waits_[scan] = absl::StrCat("waits, and is tried again: ", std::string(why.message()));
  }
  dependencies_.timer.After(kMergeAgainAfter, [self = weak_from_this(), scan] {
    if (const std::shared_ptr<Session> session = self.lock()) session->PostReconcile(scan);
  });
}

// Changes a scan if it still is as it was read; a person may have decided otherwise meanwhile.
absl::Status Session::Change(const v1::Scan& as_read,
                             absl::FunctionRef<void(const SessionState&, v1::Scan&, Draft&)> change,
                             absl::FunctionRef<void()> applied) {
  return journal_
      .Execute(
          {},
          [&](const SessionState& state) -> absl::StatusOr<Draft> {
            const auto it = state.scans.find(as_read.name());
            if (it == state.scans.end())
              return contract::ResourceNotFound(kScanType, as_read.name());
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

// Does what the scan's state in the log asks for, and nothing when that is done.
void Session::Reconcile(const std::string& name, parallel::Parallel& parallel) {
  if (closed_) return;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    waits_.erase(name);
  }
  if (absl::Status taken = Load(parallel); !taken.ok()) return RetryLater(name, taken);
  Touch();
  v1::Scan scan;
  bool in_model = false;
  journal_.Read([&](const SessionState& state) {
    const auto it = state.scans.find(name);
    if (it == state.scans.end()) return;
    scan = it->second.scan;
    in_model = it->second.in_model;
  });
  const bool wanted = scan.state() == v1::SCAN_STATE_MERGED;
  if (in_model && !wanted) {
    absl::Status removed = RemoveFromModel(scan, parallel);
    if (!removed.ok()) return RetryLater(name, removed);
    journal_.Read([&](const SessionState& state) { scan = state.scans.at(name).scan; });
  }
  if (scan.state() != v1::SCAN_STATE_RECEIVED && scan.state() != v1::SCAN_STATE_MERGING) return;
  // Until it is merged; then the model's own reservation has it.
  const absl::StatusOr<MemoryAccount::Reservation> reservation = ReserveMemory(EstimateMerge(scan));
  if (!reservation.ok()) return RetryLater(name, reservation.status());
  {
    std::lock_guard<std::mutex> lock(mutex_);
    reconciling_ = name;
  }
  absl::StatusOr<sensor::Scan> data = LoadScan(scan);
  if (!data.ok()) {
    Refuse(scan, v1::SCAN_STATE_FAILED, std::string(data.status().message()), nullptr);
  } else if (scan.state() == v1::SCAN_STATE_RECEIVED) {
    Align(scan, *data, parallel);
  } else {
    Merge(scan, *data, parallel);
  }
  std::lock_guard<std::mutex> lock(mutex_);
  reconciling_.clear();
}

void Session::Align(const v1::Scan& scan, sensor::Scan& data, parallel::Parallel& parallel) {
  const ModelSnapshot model = Model();
  v1::Scan placed = scan;
  placed.set_state(v1::SCAN_STATE_MERGING);
  std::vector<registration::TargetTie> targets;
  journal_.Read([&](const SessionState& state) { targets = TiesOf(state, scan, origin_); });
  if (model.view == nullptr) {
    const bool trusted = data.prior.has_value() && data.prior->trusted;
    const auto from_targets = FirstPoseFromTargets(targets);
    if (!from_targets.ok()) {
      return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(from_targets.status().message()),
                    nullptr);
    }
    if (from_targets->has_value() && !trusted) data.prior = *from_targets;
    absl::StatusOr<registration::Levelling> levelling = dependencies_.algorithms.level(data);
    if (!levelling.ok()) {
      return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(levelling.status().message()),
                    nullptr);
    }
    if (data.prior.has_value()) {
      if (data.prior->trusted) {
        levelling->T_world_scan = data.prior->T_world_scan;
      } else {
        // The prior's world it is: its heading and place, with the tilt found.
        const Eigen::Vector3d ahead = data.prior->T_world_scan.linear() * Eigen::Vector3d::UnitX();
        const double heading = std::atan2(ahead.y(), ahead.x());
        const Eigen::Vector3d now = levelling->T_world_scan.linear() * Eigen::Vector3d::UnitX();
        const double turn = heading - std::atan2(now.y(), now.x());
        levelling->T_world_scan.linear() =
            Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
            levelling->T_world_scan.linear();
        levelling->T_world_scan.translation() = data.prior->T_world_scan.translation();
      }
    }
    *placed.mutable_levelling() = conversion::WriteLevelling(*levelling, origin_);
    *placed.mutable_pose() = placed.levelling().pose();
    placed.set_pose_source(v1::POSE_SOURCE_FIRST_SCAN);
  } else {
    sensor::PosePrior prior;
    v1::PlanningConfig config;
    journal_.Read([&](const SessionState& state) {
      config = state.session.planning_config();
      // Without a prior: where the scanner stood last, to begin with.
      for (const std::string& name : state.scan_order) {
        const ScanRecord& record = state.scans.at(name);
        if (record.in_model)
          prior.T_world_scan = conversion::ReadOwnPose(record.scan.pose(), origin_);
      }
    });
    if (data.prior.has_value()) prior = *data.prior;
    contract::Violations violations;
    const planning::PlanningConfig planning = conversion::ReadPlanningConfig(
        config, {}, origin_, model.view->voxel_size(), "planning_config", "", violations);
    const absl::Time started = absl::Now();
    absl::StatusOr<registration::RegistrationResult> result =
        dependencies_.algorithms.register_scan(*model.view, data, prior, targets,
                                               planning.registration, parallel);
    if (!result.ok()) {
      return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(result.status().message()), nullptr);
    }
    telemetry::ObserveStage(dependencies_.metrics, "registration",
                            absl::ToDoubleSeconds(absl::Now() - started));
    const v1::Registration registration =
        conversion::WriteRegistration(*result, model.version, origin_);
    if (!result->verdict.registered()) {
      const bool doubtful = result->verdict.outcome == registration::RegistrationOutcome::kDoubtful;
      return Refuse(
          scan, doubtful ? v1::SCAN_STATE_DOUBTFUL : v1::SCAN_STATE_FAILED,
          absl::StrCat(result->verdict.reason,
                       result->verdict.remedy.empty() ? "" : "; remedy: ", result->verdict.remedy),
          &registration);
    }
    *placed.mutable_registration() = registration;
    *placed.mutable_pose() = registration.pose();
    placed.set_pose_source(prior.trusted ? v1::POSE_SOURCE_TRUSTED_PRIOR
                                         : v1::POSE_SOURCE_REGISTRATION);
  }
  absl::Status logged = Change(scan, [&](const SessionState&, v1::Scan& next, Draft& draft) {
    *placed.mutable_update_time() = next.update_time();
    *draft.event.mutable_scan_registered()->mutable_scan() = placed;
  });
  if (absl::IsAborted(logged)) return;  // its next operation is queued
  if (!logged.ok()) return RetryLater(scan.name(), logged);
  Merge(placed, data, parallel);
}

void Session::Merge(const v1::Scan& scan, const sensor::Scan& data, parallel::Parallel& parallel) {
  // As the log has it, so that a replay gives the same bits.
  const Eigen::Isometry3d T_model_scan = conversion::ReadOwnPose(scan.pose(), origin_);
  absl::StatusOr<model::MergeReport> report =
      model_->Insert(scan.name(), data, T_model_scan, parallel);
  if (!report.ok()) {
    return Refuse(scan, v1::SCAN_STATE_FAILED, std::string(report.status().message()), nullptr);
  }
  // Whoever sees the scan merged sees the model with it.
  ModelSnapshot next_model{model_->Publish(), 0};
  std::string claim;  // that it fulfils
  absl::Status logged = Change(
      scan,
      [&](const SessionState& state, v1::Scan& next, Draft& draft) {
        next_model.version = state.model_version + 1;
        next.set_state(v1::SCAN_STATE_MERGED);
        *next.mutable_merge() = conversion::WriteMergeReport(*report);
        next.mutable_merge()->set_model_version(next_model.version);
        claim = FulfilledClaim(state, next);
        if (!claim.empty()) next.set_scanner(state.claims.at(claim).claim.scanner());
        *draft.event.mutable_scan_merged()->mutable_scan() = next;
      },
      [&] { Show(next_model); });
  if (!logged.ok()) {
    // The log is what counts: the model follows it.
    model_->Withdraw(scan.name(), parallel).IgnoreError();
    if (!absl::IsAborted(logged)) RetryLater(scan.name(), logged);
    return;
  }
  ReserveModel();
  telemetry::ObserveStage(dependencies_.metrics, "carve", report->carve_seconds);
  telemetry::ObserveStage(dependencies_.metrics, "merge", report->merge_seconds);
  dependencies_.log.Info(
      "scan merged",
      {{"session", id_},
       {"scan", scan.name()},
       {"carve_seconds", report->carve_seconds},
       {"merge_seconds", report->merge_seconds},
       {"registration_seconds", conversion::ReadDuration(scan.registration().duration())}});
  // The log says so again when the server comes back, should it stop here.
  if (!claim.empty()) EndClaim(claim, fleet::ClaimEnd::kScanArrived, scan.name(), {}).IgnoreError();
  PostSnapshot(1);
}

absl::Status Session::RemoveFromModel(const v1::Scan& scan, parallel::Parallel& parallel) {
  absl::StatusOr<model::MergeReport> removed = model_->Withdraw(scan.name(), parallel);
  if (!removed.ok() && !absl::IsNotFound(removed.status())) return removed.status();
  const std::shared_ptr<const model::PlanningView> without = model_->Publish();
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
                                [&] { Show(next_model); })
                            .status();
  if (logged.ok()) {
    ReserveModel();
    PostSnapshot(1);
  }
  return logged;
}

void Session::Refuse(const v1::Scan& scan, v1::ScanState state, const std::string& message,
                     const v1::Registration* registration) {
  absl::Status logged = Change(scan, [&](const SessionState&, v1::Scan& next, Draft& draft) {
    next.set_state(state);
    next.set_state_message(message);
    next.clear_pose();
    next.clear_pose_source();
    if (registration != nullptr) {
      *next.mutable_registration() = *registration;
    }
    *draft.event.mutable_scan_refused()->mutable_scan() = next;
  });
  if (!logged.ok() && !absl::IsAborted(logged)) RetryLater(scan.name(), logged);
  dependencies_.log.Info("scan refused", {{"session", id_},
                                          {"scan", scan.name()},
                                          {"state", v1::ScanState_Name(state)},
                                          {"why", message}});
}

void Session::Show(ModelSnapshot snapshot) {
  std::lock_guard<std::mutex> lock(mutex_);
  snapshot_ = std::move(snapshot);
}

}  // namespace vantage::session
