#include "server/session/session.h"

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "google/protobuf/util/field_mask_util.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/asked_evaluation.h"
#include "server/session/coverage.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
Session::Session(const std::string& id, std::unique_ptr<Journal> log,
                 std::unique_ptr<model::PartialModel> empty, ModelMemory::Begin begin,
                 std::vector<store::SnapshotRecord> snapshots, TenantAccounts& accounts,
                 const SessionDependencies& dependencies)
    : SessionContext(id, std::move(log), accounts, dependencies),
      snapshots_(*this, std::move(snapshots)),
      model_(
          *this, snapshots_, std::move(empty), begin,
          [this](const std::string& scan, parallel::Parallel& parallel) {
            reconciler_.Reconcile(scan, parallel);
          },
          [this](parallel::Parallel& parallel) {
            adjuster_.AdjustWhenDue(parallel);
            proposals_.PostWhenDue();
          }),
      claims_(*this, model_),
      stations_(*this, model_),
      preparation_(*this, model_),
      adjuster_(*this, model_, preparation_),
      proposals_(*this, model_),
      reconciler_(*this, model_, claims_, stations_, preparation_, adjuster_, proposals_),
      scans_(*this, reconciler_),
      pose_comparisons_(*this, model_),
      uploads_(*this, reconciler_),
      plans_(*this, model_, claims_, preparation_),
      tours_(*this, model_, preparation_),
      scanners_(*this),
      rejections_(*this),
      site_priors_(*this, model_, preparation_) {}

absl::StatusOr<std::shared_ptr<Session>> Session::Make(const std::string& id,
                                                       std::unique_ptr<Journal> log,
                                                       ModelMemory::Begin begin,
                                                       std::vector<store::SnapshotRecord> snapshots,
                                                       TenantAccounts& accounts,
                                                       const SessionDependencies& dependencies) {
  v1::ModelConfig config;
  log->Read([&](const SessionState& state) { config = state.session.model_config(); });
  contract::Violations violations;
  const model::ModelConfig read =
      conversion::ReadModelConfig(config, "session.model_config", violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  absl::StatusOr<std::unique_ptr<model::PartialModel>> empty = model::PartialModel::Create(read);
  if (!empty.ok()) return empty.status();
  std::shared_ptr<Session> session(new Session(id, std::move(log), *std::move(empty), begin,
                                               std::move(snapshots), accounts, dependencies));
  session->journal().Watch([weak = session->weak_from_this()] {
    if (const std::shared_ptr<SessionContext> keep = weak.lock()) keep->CompactLogWhenDue();
  });
  return session;
}

absl::StatusOr<std::shared_ptr<Session>> Session::Create(
    const std::string& id, const v1::Session& session, const RequestKey& key,
    const std::string& tenant, TenantAccounts& accounts, const SessionDependencies& dependencies) {
  auto log = std::make_unique<Journal>(id, dependencies.store, dependencies.clock,
                                       dependencies.SeenClock());
  absl::StatusOr<std::string> logged =
      log->Execute(key, [&](const SessionState&) -> absl::StatusOr<Draft> {
        Draft draft;
        draft.tenant = tenant;
        v1::Session& stored = *draft.event.mutable_session_created()->mutable_session();
        stored = session;
        stored.set_name(contract::NameOfSession(id));
        *stored.mutable_create_time() = conversion::WriteTime(dependencies.clock());
        return draft;
      });
  // Nothing of this call was written: what is there under this id is another's.
  if (!logged.ok()) return logged.status();
  absl::StatusOr<std::shared_ptr<Session>> made =
      Make(id, std::move(log), ModelMemory::Begin::kNew, {}, accounts, dependencies);
  if (!made.ok()) dependencies.store.Drop(id).IgnoreError();
  return made;
}

absl::StatusOr<std::shared_ptr<Session>> Session::Load(const std::string& id,
                                                       TenantAccounts& accounts,
                                                       const SessionDependencies& dependencies) {
  absl::StatusOr<std::unique_ptr<Journal>> log =
      Journal::Open(id, dependencies.store, dependencies.clock, dependencies.SeenClock());
  if (!log.ok()) return log.status();
  absl::StatusOr<std::vector<store::SnapshotRecord>> snapshots = dependencies.store.Snapshots(id);
  if (!snapshots.ok()) return snapshots.status();
  absl::StatusOr<std::shared_ptr<Session>> made =
      Make(id, *std::move(log), ModelMemory::Begin::kToBeLoaded, *std::move(snapshots), accounts,
           dependencies);
  if (!made.ok()) return made;
  (*made)->plans_.EndInterrupted();
  (*made)->uploads_.Resume();
  (*made)->claims_.Resume();
  (*made)->stations_.Resume();
  return made;
}

absl::Status Session::Resume() {
  // True when there is work for the model or the session was used lately: by the clock, since
  // memory is not for what was used before a long pause.
  bool needed = uploads_.OpenCount() > 0;
  const absl::Time lately = journal().Now() - dependencies().limits.evict_after;
  journal().Read([&](const SessionState& state) {
    needed = needed || !state.UndecidedScans().empty() ||
             conversion::ReadTime(state.session.update_time()) >= lately;
  });
  uploads_.ResumeReading();
  const bool posted = TryPost([this, needed](parallel::Parallel& parallel) {
    FindLostScans(*this);
    const absl::Status taken = needed ? model_.Load(parallel) : absl::OkStatus();
    if (!taken.ok()) reconciler_.PostUndecidedLater(taken);
    uploads_.CommitComplete();
  });
  return posted ? absl::OkStatus() : absl::InternalError("a new strand is full");
}

void Session::AddReferences(std::map<std::string, int>& blobs,
                            std::set<std::string>& spools) const {
  journal().Read([&](const SessionState& state) {
    for (const auto& [scan, record] : state.scans) {
      if (!record.blob.empty()) ++blobs[record.blob];
      if (!record.preview_blob.empty()) ++blobs[record.preview_blob];
    }
  });
  for (const std::string& blob : site_priors_.Blobs()) ++blobs[blob];
  for (const store::SnapshotRecord& snapshot : snapshots_.List()) ++blobs[snapshot.blob];
  for (const std::string& blob : plans_.Blobs()) ++blobs[blob];
  for (const std::string& upload : uploads_.Names()) spools.insert(upload);
}

absl::Time Session::created() const {
  absl::Time time;
  journal().Read(
      [&](const SessionState& state) { time = conversion::ReadTime(state.session.create_time()); });
  return time;
}

bool Session::Matches(const v1::ListSessionsRequest& filter) const {
  bool matches = true;
  journal().Read([&](const SessionState& state) {
    const std::string text = absl::AsciiStrToLower(filter.text());
    matches = absl::StrContains(id(), text) ||
              absl::StrContains(absl::AsciiStrToLower(state.session.display_name()), text);
    if (filter.has_updated_after()) {
      matches = matches && conversion::ReadTime(state.session.update_time()) >
                               conversion::ReadTime(filter.updated_after());
    }
  });
  return matches;
}

v1::Session Session::Describe() const {
  v1::Session out;
  journal().Read([&](const SessionState& state) { out = state.Describe(); });
  lost_scans().Describe(out);
  return out;
}

v1::Session Session::DescribeWithRejections() const {
  v1::Session out;
  const google::protobuf::Timestamp now = conversion::WriteTime(journal().Now());
  journal().Read([&](const SessionState& state) {
    out = state.Describe();
    state.AddRejections(now, out);
  });
  lost_scans().Describe(out);
  return out;
}

absl::StatusOr<v1::Session> Session::Update(const v1::UpdateSessionRequest& request) {
  const google::protobuf::FieldMask& mask = request.update_mask();
  absl::StatusOr<std::string> updated =
      journal().Execute(RequestKey::Of(request.request_id(), "UpdateSession", request),
                        [&](const SessionState& state) -> absl::StatusOr<Draft> {
                          if (absl::Status room = CheckLog(); !room.ok()) return room;
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

absl::StatusOr<v1::GetCoverageResponse> Session::MeasureCoverage() {
  return session::MeasureCoverage(*this, model_, plans_);
}

void Session::DescribePoseGraph(
    std::function<void(absl::StatusOr<v1::GetPoseGraphResponse>)> done) {
  std::shared_ptr<Evaluation> evaluation = model_.BeginEvaluation();
  if (evaluation == nullptr) {
    return done(contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                                    "as much of this session is being evaluated as may be",
                                    absl::Seconds(1)));
  }
  RunAsked<v1::GetPoseGraphResponse>(
      *this, std::move(evaluation), std::move(done),
      [this](parallel::Parallel&) -> absl::StatusOr<v1::GetPoseGraphResponse> {
        absl::StatusOr<v1::PoseGraph> graph = adjuster_.Describe();
        if (!graph.ok()) return graph.status();
        v1::GetPoseGraphResponse response;
        *response.mutable_graph() = *std::move(graph);
        return response;
      });
}

void Session::PostEvict() {
  if (!model_.loaded() || dependencies().limits.snapshots_per_session == 0) return;
  preparation_.Stop();
  const bool posted = TryPost([this](parallel::Parallel& parallel) {
    const bool others_wait = Operations() > 1;
    if (!others_wait && plans_.Running() == 0 && !model_.InUse()) model_.Evict(parallel);
  });
  if (!posted && !closed()) {
    dependencies().log.Info("the session has too much to do to evict its model now",
                            {{"session", id()}});
  }
}

absl::Duration Session::LastUsed() const {
  absl::Duration last;
  journal().Read([&](const SessionState& state) { last = state.last_seen; });
  return std::max(last, uploads_.LastPiece());
}

bool Session::Rests() const {
  return Operations() == 0 && !model_.InUse() && plans_.Rest() && preparation_.Rests();
}

void Session::GiveUp() {
  Halt();
  reconciler_.GiveUp();
  adjuster_.GiveUp();
  proposals_.GiveUp();
  model_.GiveUp();
  uploads_.GiveUp();
}

void Session::Close() {
  CloseLog();
  plans_.Stop(PlanRun::StopReason::kSessionDeleted);
  tours_.Stop();
  claims_.Stop();
  site_priors_.Stop();
  strand().Close();
  std::vector<std::string> blobs = plans_.TakeBlobs();
  journal().Read([&](const SessionState& state) {
    for (const auto& [scan, record] : state.scans) {
      if (!record.blob.empty()) blobs.push_back(record.blob);
      if (!record.preview_blob.empty()) blobs.push_back(record.preview_blob);
    }
  });
  for (const std::string& blob : site_priors_.Blobs()) blobs.push_back(blob);
  for (std::string& blob : snapshots_.TakeBlobs()) blobs.push_back(std::move(blob));
  // Blobs that cannot be released now are removed by the store's own collection.
  for (const std::string& blob : blobs) dependencies().store.ReleaseBlob(blob).IgnoreError();
  uploads_.Close();
  account()->Close();
  journal().Wake();
}

}  // namespace vantage::session
