#include "server/session/session.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "google/protobuf/util/field_mask_util.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

// Which fields an update may change; each with everything below it.
constexpr const char* kUpdatable[] = {"display_name", "scanner_models", "planning_config",
                                      "site_rules"};

constexpr absl::Duration kModelRetryAfter = absl::Seconds(1);

bool Updatable(const std::string& path) {
  for (const char* field : kUpdatable) {
    if (path == field || absl::StartsWith(path, absl::StrCat(field, "."))) return true;
  }
  return false;
}

}  // namespace

Session::Session(std::string id, const SessionDependencies& dependencies)
    : id_(std::move(id)),
      name_(contract::NameOfSession(id_)),
      dependencies_(dependencies),
      journal_(id_, dependencies.store, dependencies.clock),
      share_(dependencies.pool.NewShare()),
      // Every scan may have one operation waiting from its arrival and one from a person.
      strand_(std::make_shared<execution::Strand>(dependencies.pool, share_,
                                                  2 * dependencies.limits.scans_per_session + 16)) {
  Touch();
}

absl::StatusOr<std::shared_ptr<Session>> Session::Create(
    const std::string& id, const v1::Session& session, const RequestKey& key,
    const std::string& tenant, TenantAccounts& accounts, const SessionDependencies& dependencies) {
  std::shared_ptr<Session> made(new Session(id, dependencies));
  absl::StatusOr<std::string> logged =
      made->journal_.Execute(key, [&](const SessionState&) -> absl::StatusOr<Draft> {
        Draft draft;
        draft.tenant = tenant;
        v1::Session& stored = *draft.event.mutable_session_created()->mutable_session();
        stored = session;
        stored.set_name(made->name_);
        *stored.mutable_create_time() = conversion::WriteTime(dependencies.clock());
        return draft;
      });
  if (!logged.ok()) return logged.status();
  absl::Status begun = made->Begin(accounts);
  if (!begun.ok()) return begun;
  return made;
}

absl::StatusOr<std::shared_ptr<Session>> Session::Load(const std::string& id,
                                                       TenantAccounts& accounts,
                                                       const SessionDependencies& dependencies) {
  std::shared_ptr<Session> made(new Session(id, dependencies));
  absl::Status loaded = made->journal_.Load();
  if (!loaded.ok()) return loaded;
  absl::Status begun = made->Begin(accounts);
  if (!begun.ok()) return begun;

  // Plans that ran when the server stopped ended with it.
  std::vector<v1::Plan> interrupted;
  std::vector<std::string> full_results;
  made->journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.plan_order) {
      const PlanRecord& record = state.plans.at(name);
      if (record.plan.state() == v1::PLAN_STATE_QUEUED) interrupted.push_back(record.plan);
      if (!record.blob.empty()) full_results.push_back(record.blob);
    }
  });
  const auto own = [&](const std::string& blob) {
    made->account_->Add(dependencies.store.BlobSize(blob).value_or(0));
  };
  const size_t kept = std::min(full_results.size(), dependencies.limits.full_plans_per_session);
  full_results.erase(full_results.begin(), full_results.end() - static_cast<std::ptrdiff_t>(kept));
  for (const std::string& blob : full_results) own(blob);
  {
    std::lock_guard<std::mutex> lock(made->mutex_);
    made->full_results_ = std::move(full_results);
  }
  for (v1::Plan& plan : interrupted) {
    const auto run = std::make_shared<PlanRun>(plan);
    plan.set_state(v1::PLAN_STATE_FAILED);
    plan.set_state_message("the server stopped while it ran; create it again");
    made->EndPlan(run, plan, nullptr);
  }
  absl::StatusOr<std::vector<store::SnapshotRecord>> snapshots = dependencies.store.Snapshots(id);
  if (!snapshots.ok()) return snapshots.status();
  for (const store::SnapshotRecord& snapshot : *snapshots) own(snapshot.blob);
  {
    std::lock_guard<std::mutex> lock(made->snapshots_mutex_);
    made->snapshots_ = *std::move(snapshots);
  }
  made->ResumeUploads();
  made->ResumeClaims();
  return made;
}

absl::Status Session::Resume() {
  loaded_ = false;
  const bool needed = NeededAtStart();
  const bool posted =
      strand_->TryPost([self = shared_from_this(), needed](parallel::Parallel& parallel) {
        const absl::Status taken = needed ? self->Load(parallel) : absl::OkStatus();
        if (!taken.ok()) self->ReconcileLater(taken);
        std::vector<std::shared_ptr<Upload>> complete;
        {
          std::lock_guard<std::mutex> lock(self->mutex_);
          for (const auto& [name, upload] : self->uploads_) {
            if (upload->Complete()) complete.push_back(upload);
          }
        }
        for (const auto& upload : complete) {
          // What cannot be committed now is when its sender asks again.
          self->CommitScan(upload).IgnoreError();
        }
      });
  return posted ? absl::OkStatus() : absl::InternalError("a new strand is full");
}

void Session::AddReferences(std::map<std::string, int>& blobs,
                            std::set<std::string>& spools) const {
  journal_.Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      if (!record.blob.empty()) ++blobs[record.blob];
    }
  });
  {
    std::lock_guard<std::mutex> lock(snapshots_mutex_);
    for (const store::SnapshotRecord& snapshot : snapshots_) ++blobs[snapshot.blob];
  }
  std::lock_guard<std::mutex> lock(mutex_);
  for (const std::string& blob : full_results_) ++blobs[blob];
  for (const auto& [name, upload] : uploads_) spools.insert(name);
}

absl::Status Session::Begin(TenantAccounts& accounts) {
  v1::ModelConfig config;
  journal_.Read([&](const SessionState& state) {
    tenant_ = state.tenant;
    account_ = std::make_shared<AccountShare>(accounts.Of(state.tenant));
    for (const auto& [name, record] : state.scans) account_->Add(record.scan.encoded_size_bytes());
    config = state.session.model_config();
    const v1::Vector3& origin = state.session.origin();
    origin_ = {origin.x(), origin.y(), origin.z()};
  });
  contract::Violations violations;
  const model::ModelConfig model =
      conversion::ReadModelConfig(config, "session.model_config", violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  absl::StatusOr<std::unique_ptr<model::PartialModel>> made = model::PartialModel::Create(model);
  if (!made.ok()) return made.status();
  model_ = *std::move(made);
  return absl::OkStatus();
}

absl::Time Session::created() const {
  absl::Time time;
  journal_.Read(
      [&](const SessionState& state) { time = conversion::ReadTime(state.session.create_time()); });
  return time;
}

v1::Session Session::Describe() const {
  v1::Session out;
  journal_.Read([&](const SessionState& state) { out = state.Describe(); });
  return out;
}

v1::Session Session::DescribeWithRejections() const {
  v1::Session out;
  const google::protobuf::Timestamp now = conversion::WriteTime(journal_.Now());
  journal_.Read([&](const SessionState& state) {
    out = state.Describe();
    state.AddRejections(now, out);
  });
  return out;
}

absl::StatusOr<v1::Session> Session::Update(const v1::UpdateSessionRequest& request) {
  contract::Violations violations;
  conversion::CheckRequestId(request.request_id(), violations);
  const google::protobuf::FieldMask& mask = request.update_mask();
  if (mask.paths().empty()) violations.Add("update_mask", "must name at least one field");
  for (const std::string& path : mask.paths()) {
    if (!Updatable(path) ||
        !google::protobuf::util::FieldMaskUtil::IsValidPath<v1::Session>(path)) {
      violations.Add("update_mask",
                     absl::StrCat("'", path,
                                  "' is no field that can be updated; those are "
                                  "display_name, scanner_models, planning_config, site_rules"));
    }
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;

  absl::StatusOr<std::string> updated =
      journal_.Execute(RequestKey::Of(request.request_id(), "UpdateSession", request),
                       [&](const SessionState& state) -> absl::StatusOr<Draft> {
                         const std::string& etag = request.session().etag();
                         if (!etag.empty() && etag != EtagOf(state.session)) {
                           return contract::ErrorWithReason(
                               absl::StatusCode::kAborted, "ETAG_STALE",
                               "the session was changed by somebody else; read it again");
                         }
                         v1::Session next = state.session;
                         google::protobuf::util::FieldMaskUtil::MergeOptions options;
                         options.set_replace_message_fields(true);
                         options.set_replace_repeated_fields(true);
                         google::protobuf::util::FieldMaskUtil::MergeMessageTo(
                             request.session(), mask, options, &next);
                         if (next.scanner_models().empty()) next.add_scanner_models();
                         for (v1::ScannerModel& scanner : *next.mutable_scanner_models())
                           conversion::FillDefaults(scanner);
                         conversion::FillDefaults(*next.mutable_planning_config());
                         contract::Violations whole;
                         conversion::CheckSession(next, "session.", whole);
                         absl::Status possible = whole.ToStatus();
                         if (!possible.ok()) return possible;
                         Draft draft;
                         *draft.event.mutable_session_updated()->mutable_session() = next;
                         *draft.event.mutable_session_updated()->mutable_update_mask() = mask;
                         return draft;
                       });
  if (!updated.ok()) return updated.status();
  return Describe();
}

ModelSnapshot Session::Model() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return snapshot_;
}

absl::Status Session::WhyNoModel() {
  bool expected = false;
  journal_.Read([&](const SessionState& state) { expected = state.AnyInModel(); });
  if (expected) {
    if (absl::Status room = BeginLoad(); !room.ok()) return room;
    return contract::Retryable(absl::StatusCode::kUnavailable, "MODEL_LOADING",
                               absl::StrCat("the model of ", name_, " is being loaded"),
                               kModelRetryAfter);
  }
  return contract::ErrorWithReason(absl::StatusCode::kFailedPrecondition, "MODEL_EMPTY",
                                   absl::StrCat(name_,
                                                " has no scan in its model yet; send one, and wait "
                                                "for its merge (WatchSession)"));
}

bool Session::BeginExport() {
  if (++exports_ <= static_cast<int>(dependencies_.limits.exports_per_session)) return true;
  --exports_;
  return false;
}

void Session::RunInteractive(execution::PlanningPool::Job job) {
  dependencies_.pool.Submit(share_, execution::JobPriority::kInteractive, std::move(job));
}

absl::StatusOr<std::string> Session::PutOwnBlob(absl::string_view bytes) {
  absl::StatusOr<std::string> blob = dependencies_.store.PutBlob(bytes);
  if (blob.ok()) account_->Add(static_cast<int64_t>(bytes.size()));
  return blob;
}

void Session::ReleaseOwnBlob(const std::string& sha256) {
  account_->GiveBack(dependencies_.store.BlobSize(sha256).value_or(0));
  // What cannot be released now is found by the store's own collection.
  dependencies_.store.ReleaseBlob(sha256).IgnoreError();
}

absl::Time Session::LastUsed() const {
  absl::Time last = absl::InfinitePast();
  journal_.Read(
      [&](const SessionState& state) { last = conversion::ReadTime(state.session.update_time()); });
  std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [name, upload] : uploads_) last = std::max(last, upload->LastPiece());
  return last;
}

size_t Session::RunningPlans() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return runs_.size();
}

size_t Session::OpenUploads() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return uploads_.size();
}

int Session::PendingScans() const {
  int pending = 0;
  journal_.Read([&](const SessionState& state) { pending = state.PendingScans(); });
  return pending;
}

void Session::Close() {
  closed_ = true;
  journal_.Close();
  StopPlans(PlanRun::StopReason::kSessionDeleted);
  strand_->Close();
  std::vector<std::string> blobs;
  std::map<std::string, std::shared_ptr<Upload>> uploads;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    blobs = full_results_;
    full_results_.clear();
    uploads.swap(uploads_);
  }
  journal_.Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      if (!record.blob.empty()) blobs.push_back(record.blob);
    }
  });
  {
    std::lock_guard<std::mutex> lock(snapshots_mutex_);
    for (const store::SnapshotRecord& snapshot : snapshots_) blobs.push_back(snapshot.blob);
    snapshots_.clear();
  }
  // What cannot be released now is found by the store's own collection.
  for (const std::string& blob : blobs) dependencies_.store.ReleaseBlob(blob).IgnoreError();
  // A piece that is being taken comes before the end, or is refused: no spool comes back.
  for (const auto& [name, upload] : uploads) {
    upload->End(v1::UPLOAD_STATE_FAILED, "the session was deleted", "");
  }
  account_->Close();
  journal_.Wake();
}

}  // namespace vantage::session
