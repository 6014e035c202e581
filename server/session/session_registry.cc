#include "server/session/session_registry.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/check_request.h"

namespace vantage::session {
namespace {

constexpr char kSessionType[] = "vantage/Session";
constexpr char kImport[] = "ImportSession";
constexpr absl::Duration kRetryAfterRestart = absl::Seconds(5);
// Idle time before a model may be evicted for another one.
constexpr absl::Duration kUnusedForAWhile = absl::Seconds(20);

SessionDependencies WithOwn(SessionDependencies dependencies) {
  if (dependencies.seen == nullptr) dependencies.seen = std::make_shared<execution::SeenTime>();
  if (dependencies.files == nullptr) {
    dependencies.files = std::make_shared<FileReadings>(dependencies.limits.files_read_at_once);
  }
  return dependencies;
}

}  // namespace

SessionRegistry::SessionRegistry(const SessionDependencies& dependencies)
    : dependencies_(WithOwn(dependencies)),
      accounts_(dependencies.limits.tenant_bytes),
      imports_(dependencies_),
      random_(std::random_device{}()) {}

// Before any session goes: who reads a file holds its session.
SessionRegistry::~SessionRegistry() { dependencies_.files->End(); }

absl::Status SessionRegistry::LoadAll() {
  const absl::StatusOr<absl::Duration> seen = dependencies_.store.SeenTime();
  if (!seen.ok()) return seen.status();
  dependencies_.seen->Resume(*seen);
  absl::StatusOr<std::vector<std::string>> ids = dependencies_.store.Sessions();
  if (!ids.ok()) return ids.status();
  std::vector<std::pair<absl::Time, std::shared_ptr<Session>>> loaded;
  std::map<std::string, LeftOut> left_out;
  for (const std::string& id : *ids) {
    absl::StatusOr<std::shared_ptr<Session>> session = Session::Load(id, accounts_, dependencies_);
    // A damaged session must not prevent the others from loading; a log newer than this server
    // must.
    if (absl::IsFailedPrecondition(session.status())) return session.status();
    if (!session.ok()) {
      dependencies_.log.Error("a session cannot be loaded",
                              {{"session", id}, {"error", session.status().ToString()}});
      left_out[id] = LeftOut{TenantOf(id), std::string(session.status().message())};
      continue;
    }
    const absl::Time created = (*session)->created();
    loaded.emplace_back(created, *std::move(session));
  }
  // What was seen since that was last put down, as far as the logs tell.
  for (const auto& [time, session] : loaded) dependencies_.seen->Resume(session->LastUsed());
  std::stable_sort(loaded.begin(), loaded.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::map<std::string, int> blobs;
  std::set<std::string> spools;
  for (const auto& [time, session] : loaded) session->AddReferences(blobs, spools);
  // Nothing is collected while a session that may need it is damaged.
  absl::Status swept =
      left_out.empty() ? Sweep(blobs, spools) : dependencies_.store.KeepAllBlobs(blobs);
  if (!swept.ok()) return swept;
  for (const auto& [time, session] : loaded) {
    if (absl::Status resumed = session->Resume(); !resumed.ok()) return resumed;
  }
  const absl::StatusOr<std::vector<store::DeletionRecord>> deletions =
      dependencies_.store.Deletions();
  if (!deletions.ok()) return deletions.status();
  std::lock_guard<std::mutex> lock(mutex_);
  deletions_.assign(deletions->begin(), deletions->end());
  left_out_ = std::move(left_out);
  for (auto& [time, session] : loaded) {
    (*session).journal().Read([&, id = session->id()](const SessionState& state) {
      for (const auto& [request, record] : state.requests) {
        if (record.method == "CreateSession" || record.method == kImport) {
          creations_[{state.tenant, request}] = id;
        }
      }
    });
    if (draining_) session->BeginDrain();
    order_.push_back(session->id());
    sessions_[session->id()] = std::move(session);
  }
  return absl::OkStatus();
}

// The tenant of a session that cannot be loaded, where the beginning of its log can be read.
std::optional<std::string> SessionRegistry::TenantOf(const std::string& id) const {
  const absl::StatusOr<std::vector<storage::v1::LogEntry>> first =
      dependencies_.store.Read(id, 0, 1);
  if (!first.ok() || first->empty()) return std::nullopt;
  return first->front().tenant();
}

// Removes what a crash left behind and no log names.
absl::Status SessionRegistry::Sweep(const std::map<std::string, int>& blobs,
                                    const std::set<std::string>& spools) {
  if (absl::Status kept = dependencies_.store.KeepBlobs(blobs); !kept.ok()) return kept;
  const absl::StatusOr<std::vector<std::string>> there = dependencies_.store.Spools();
  if (!there.ok()) return there.status();
  for (const std::string& spool : *there) {
    if (spools.count(spool) != 0) continue;
    if (absl::Status dropped = dependencies_.store.DropSpool(spool); !dropped.ok()) return dropped;
  }
  return absl::OkStatus();
}

std::string SessionRegistry::FreshId() {
  constexpr char kAlphabet[] = "abcdefghijkmnpqrstuvwxyz23456789";
  while (true) {
    std::string id = "s-";
    for (int i = 0; i < 10; ++i) id += kAlphabet[random_() % (sizeof(kAlphabet) - 1)];
    if (sessions_.count(id) == 0 && left_out_.count(id) == 0) return id;
  }
}

absl::Status SessionRegistry::CheckPlace(const std::string& tenant) const {
  if (sessions_.size() >= dependencies_.limits.sessions) {
    return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "TOO_MANY_SESSIONS",
                                     absl::StrCat("the server has ", sessions_.size(),
                                                  " sessions, the most it may; delete some"));
  }
  const auto own =
      static_cast<size_t>(std::count_if(sessions_.begin(), sessions_.end(), [&](const auto& entry) {
        return entry.second->tenant() == tenant;
      }));
  // Nobody has more than what is left for all others.
  if (tenant.empty() || own < dependencies_.limits.sessions - sessions_.size()) {
    return absl::OkStatus();
  }
  return contract::ErrorWithReason(
      absl::StatusCode::kResourceExhausted, "TOO_MANY_SESSIONS",
      absl::StrCat("the tenant has ", own, " sessions of the ", dependencies_.limits.sessions,
                   " that the server may have, and the rest is for others; delete some"));
}

absl::Status SessionRegistry::CheckFree(const std::string& id, const std::string& tenant) const {
  if (sessions_.count(id) == 0 && left_out_.count(id) == 0) return absl::OkStatus();
  return contract::ErrorWithReason(
      absl::StatusCode::kAlreadyExists, "SESSION_EXISTS",
      absl::StrCat(contract::NameOfSession(id), " exists",
                   SaysDamaged(id, tenant)
                       ? ", but it is damaged, and was left out when the server started"
                       : "",
                   "; choose another id"));
}

std::shared_ptr<Session> SessionRegistry::MadeBy(const std::string& request,
                                                 const std::string& tenant) const {
  const auto made = creations_.find({tenant, request});
  if (request.empty() || made == creations_.end()) return nullptr;
  const auto session = sessions_.find(made->second);
  return session == sessions_.end() ? nullptr : session->second;
}

absl::StatusOr<v1::ImportSessionResponse> SessionRegistry::Import(
    const v1::ImportSessionRequest& request, const std::string& tenant) {
  v1::ImportSessionResponse response;
  std::shared_ptr<Session> before;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    before = MadeBy(request.request_id(), tenant);
  }
  if (before != nullptr) {
    RequestKey key{request.request_id(), kImport, ""};  // its pieces are known no more
    if (absl::Status same = before->journal().CheckRequest(key); !same.ok()) return same;
    response.set_next_offset(request.offset() + static_cast<int64_t>(request.data().size()));
    *response.mutable_session() = before->Describe();
    return response;
  }
  const absl::StatusOr<Imports::Taken> taken = imports_.Take(request, tenant, accounts_.Of(tenant));
  if (!taken.ok()) return taken.status();
  response.set_next_offset(taken->next_offset);
  if (taken->whole == nullptr) return response;
  const absl::StatusOr<std::shared_ptr<Session>> made = Adopt(*taken->whole, tenant);
  if (!made.ok()) return made.status();
  *response.mutable_session() = (*made)->Describe();
  return response;
}

// The session of an archive that has come.
absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Adopt(SessionImport& import,
                                                                const std::string& tenant) {
  const std::string& id = import.id();
  std::lock_guard<std::mutex> only_one(create_mutex_);
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (absl::Status place = CheckPlace(tenant); !place.ok()) return place;
    if (absl::Status free = CheckFree(id, tenant); !free.ok()) return free;
  }
  if (absl::Status put = import.PutLog(); !put.ok()) return put;
  absl::StatusOr<std::shared_ptr<Session>> session = Session::Load(id, accounts_, dependencies_);
  absl::Status resumed = session.status();
  if (resumed.ok()) {
    import.Keep();
    resumed = (*session)->Resume();
  }
  if (!resumed.ok()) {
    // Nothing of it stays: what was stored goes with the import.
    dependencies_.store.Drop(id).IgnoreError();
    return ArchiveDamaged(resumed.message());
  }
  dependencies_.log.Info("a session was imported", {{"session", id}});
  std::lock_guard<std::mutex> lock(mutex_);
  if (draining_) (*session)->BeginDrain();
  sessions_[id] = *session;
  order_.push_back(id);
  creations_[{tenant, import.request_id()}] = id;
  return session;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Create(
    const v1::CreateSessionRequest& request, const std::string& tenant) {
  const v1::Session session = conversion::Completed(request.session());
  const RequestKey key = RequestKey::Of(request.request_id(), "CreateSession", request);
  std::lock_guard<std::mutex> only_one(create_mutex_);
  std::string id = request.session_id();
  std::shared_ptr<Session> before;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    before = MadeBy(key.id, tenant);
    if (before == nullptr) {
      if (absl::Status place = CheckPlace(tenant); !place.ok()) return place;
      if (id.empty()) id = FreshId();
      if (absl::Status free = CheckFree(id, tenant); !free.ok()) return free;
    }
  }
  if (before != nullptr) {
    // The journal checks that it was the same request.
    absl::StatusOr<std::string> same =
        before->journal().Execute(key, [](const SessionState&) -> absl::StatusOr<Draft> {
          return absl::InternalError("the session's log does not have its creation");
        });
    if (!same.ok()) return same.status();
    return before;
  }
  if (absl::Status room = accounts_.Of(tenant)->Reserve(0); !room.ok()) return room;
  absl::StatusOr<std::shared_ptr<Session>> made =
      Session::Create(id, session, key, tenant, accounts_, dependencies_);
  if (!made.ok()) return made.status();
  std::lock_guard<std::mutex> lock(mutex_);
  sessions_[id] = *made;
  order_.push_back(id);
  if (!key.id.empty()) creations_[{tenant, key.id}] = id;
  return made;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Find(
    const std::string& id, const std::optional<std::string>& tenant) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto it = sessions_.find(id);
  if (it != sessions_.end() && it->second->BelongsTo(tenant)) return it->second;
  if (const LeftOut* damaged = FindLeftOut(id, tenant); damaged != nullptr) {
    return contract::ErrorWithReason(
        absl::StatusCode::kDataLoss, "SESSION_DAMAGED",
        absl::StrCat(contract::NameOfSession(id),
                     " is damaged, and was left out when the server started (", damaged->why,
                     "); its operator can restore it from a backup, or save what can be read of "
                     "it ('vantaged salvage ",
                     id, "'); DeleteSession gives it up"));
  }
  return contract::ResourceNotFound(kSessionType, contract::NameOfSession(id));
}

// Others learn no more than that the id is taken.
bool SessionRegistry::SaysDamaged(const std::string& id, const std::string& tenant) const {
  const auto it = left_out_.find(id);
  return it != left_out_.end() && it->second.tenant.value_or("") == tenant;
}

// Where it is not known whose it is, it shows only where callers are not told apart.
const SessionRegistry::LeftOut* SessionRegistry::FindLeftOut(
    const std::string& id, const std::optional<std::string>& tenant) const {
  const auto it = left_out_.find(id);
  if (it == left_out_.end()) return nullptr;
  return !tenant.has_value() || it->second.tenant == tenant ? &it->second : nullptr;
}

std::vector<std::shared_ptr<Session>> SessionRegistry::List(
    const SessionPlace& after, size_t limit, bool& more, const std::optional<std::string>& tenant,
    const v1::ListSessionsRequest& filter) const {
  std::lock_guard<std::mutex> lock(mutex_);
  // When that session has been deleted (another one may have its id since), the sessions created
  // later follow.
  const auto last = sessions_.find(after.id);
  bool there = last != sessions_.end() && last->second->created() == after.created;
  const bool gone = !there;
  std::vector<std::shared_ptr<Session>> out;
  more = false;
  for (const std::string& id : order_) {
    const std::shared_ptr<Session>& session = sessions_.at(id);
    if (there) {
      there = id != after.id;
      continue;
    }
    const bool before = gone && std::pair(session->created(), absl::string_view(id)) <=
                                    std::pair(after.created, absl::string_view(after.id));
    if (before || !session->BelongsTo(tenant) || !session->Matches(filter)) continue;
    if (out.size() < limit) {
      out.push_back(session);
    } else {
      more = true;
      break;
    }
  }
  return out;
}

absl::StatusOr<absl::Time> SessionRegistry::Delete(const std::string& id,
                                                   const std::string& request_id,
                                                   const std::optional<std::string>& tenant) {
  std::lock_guard<std::mutex> only_one(create_mutex_);
  std::shared_ptr<Session> session;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const store::DeletionRecord& deletion : deletions_) {
      if (tenant.has_value() && deletion.tenant != *tenant) continue;
      if (!request_id.empty() && deletion.request == request_id) {
        if (deletion.session == id) return deletion.time;
        return contract::ErrorWithReason(absl::StatusCode::kAlreadyExists, "REQUEST_ID_REUSED",
                                         "request_id was used for another DeleteSession");
      }
    }
    const auto it = sessions_.find(id);
    if (it != sessions_.end() && it->second->BelongsTo(tenant)) {
      session = it->second;
    } else if (FindLeftOut(id, tenant) == nullptr) {
      return contract::ResourceNotFound(kSessionType, contract::NameOfSession(id));
    }
  }
  // The scans of one that was left out go at the next start, when it is known who needs them.
  const absl::Time time = dependencies_.clock();
  const store::DeletionRecord deletion{session != nullptr ? session->tenant() : tenant.value_or(""),
                                       request_id, id, time};
  const bool remembered = !request_id.empty();
  absl::Status erased = session != nullptr ? Erase(session, remembered ? &deletion : nullptr)
                                           : Drop(id, remembered ? &deletion : nullptr);
  if (!erased.ok()) return erased;
  std::lock_guard<std::mutex> lock(mutex_);
  left_out_.erase(id);
  if (remembered) {
    deletions_.push_back(deletion);
    if (deletions_.size() > store::Store::kRememberedDeletions) deletions_.pop_front();
  }
  return time;
}

absl::Status SessionRegistry::Drop(const std::string& id, const store::DeletionRecord* deletion) {
  return deletion == nullptr ? dependencies_.store.Drop(id)
                             : dependencies_.store.DropByRequest(*deletion);
}

// The log is deleted first. If a crash leaves the rest behind, no log names it, and it is
// collected.
absl::Status SessionRegistry::Erase(const std::shared_ptr<Session>& session,
                                    const store::DeletionRecord* deletion) {
  const std::string& id = session->id();
  if (absl::Status dropped = Drop(id, deletion); !dropped.ok()) return dropped;
  session->Close();
  std::lock_guard<std::mutex> lock(mutex_);
  sessions_.erase(id);
  order_.erase(std::find(order_.begin(), order_.end(), id));
  std::erase_if(creations_, [&](const auto& entry) { return entry.second == id; });
  return absl::OkStatus();
}

Collected SessionRegistry::Collect() {
  std::lock_guard<std::mutex> one(collect_mutex_);
  std::vector<std::shared_ptr<Session>> sessions;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [id, session] : sessions_) sessions.push_back(session);
  }
  Collected collected;
  const contract::Limits& limits = dependencies_.limits;
  const absl::Duration now = dependencies_.seen->Now();
  if (absl::Status put = dependencies_.store.PutSeenTime(now); !put.ok()) {
    dependencies_.log.Warning("the time that was seen could not be put down",
                              {{"error", put.ToString()}});
  }
  imports_.Expire();
  std::map<std::string, absl::Duration> past;
  const auto sure = [&](const std::string& name) {
    const auto before = past_.find(name);
    const absl::Duration first = before == past_.end() ? now : before->second;
    past[name] = first;
    if (before == past_.end()) {
      dependencies_.log.Info(
          "past its time; it goes when a second look agrees",
          {{"name", name}, {"second_look_seconds", absl::ToDoubleSeconds(limits.second_look)}});
    }
    return now - first >= limits.second_look;
  };
  const absl::Duration unused_since = now - limits.keep_sessions;
  for (const std::shared_ptr<Session>& session : sessions) {
    if (draining()) break;
    session->uploads().Expire();
    session->claims().Expire();
    if (session->model().LastTouched() < now - limits.evict_after) session->PostEvict();
    if (session->LastUsed() < unused_since) {
      if (!sure(session->name())) continue;
      std::lock_guard<std::mutex> only_one(create_mutex_);
      const absl::StatusOr<std::shared_ptr<Session>> still = Find(session->id());
      if (!still.ok() || *still != session || session->LastUsed() >= unused_since) continue;
      const absl::Status erased = Erase(session, nullptr);
      if (erased.ok()) {
        ++collected.sessions;
        dependencies_.log.Info("a session past its time was deleted", {{"session", session->id()}});
      } else {
        dependencies_.log.Error("a session past its time could not be deleted",
                                {{"session", session->id()}, {"error", erased.ToString()}});
      }
      continue;
    }
    const absl::StatusOr<int> erased = session->scans().EraseWithdrawn(
        now - limits.keep_withdrawn_scans, sure, [&session](uint64_t sequence) {
          return session->model().ReleaseSnapshotsBefore(sequence);
        });
    if (erased.ok()) {
      collected.scans += *erased;
    } else {
      dependencies_.log.Error("withdrawn scans could not be erased",
                              {{"session", session->id()}, {"error", erased.status().ToString()}});
    }
  }
  past_ = std::move(past);
  return collected;
}

SessionTotals SessionRegistry::Totals() const {
  std::vector<std::shared_ptr<Session>> sessions;
  SessionTotals totals;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [id, session] : sessions_) sessions.push_back(session);
    totals.left_out = left_out_.size();
  }
  totals.sessions = sessions.size();
  for (const auto& session : sessions) {
    totals.loaded +=
        session->model().loaded() && session->model().Current().view != nullptr ? 1 : 0;
    totals.uploads += session->uploads().OpenCount();
    totals.plans += session->plans().Running();
    totals.pending_scans += session->scans().Pending();
  }
  return totals;
}

void SessionRegistry::FreeMemory(const MemoryAccount::Shortage& shortage) {
  int64_t bytes = shortage.lacks;
  std::vector<std::shared_ptr<Session>> sessions;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [id, session] : sessions_) {
      if (session->model().loaded()) sessions.push_back(session);
    }
  }
  std::sort(sessions.begin(), sessions.end(), [](const auto& a, const auto& b) {
    return a->model().LastTouched() < b->model().LastTouched();
  });
  // What was prepared is made again soonest.
  for (const auto& session : sessions) {
    if (bytes <= 0) return;
    bytes -= session->model().prepared().Forget();
  }
  for (const auto& session : sessions) {
    if (bytes <= 0) return;
    bytes -= session->model().site_prior().Forget();
  }
  const absl::Duration unused_since = dependencies_.seen->Now() - kUnusedForAWhile;
  for (const auto& session : sessions) {
    if (bytes <= 0) return;
    // Who has more than its share gives it up to one who lacks a share, also what was used of late.
    const bool owed = shortage.within_share && session->tenant() != shortage.tenant &&
                      dependencies_.memory->BeyondShare(session->tenant());
    if (session->model().LastTouched() > unused_since && !owed) continue;
    bytes -= session->model().Estimate();
    session->PostEvict();
  }
}

void SessionRegistry::BeginDrain() {
  std::vector<std::shared_ptr<Session>> sessions;
  std::vector<std::shared_ptr<std::function<void()>>> watchers;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    draining_ = true;
    for (const auto& [id, session] : sessions_) sessions.push_back(session);
    for (const auto& [id, call] : watchers_) watchers.push_back(call);
  }
  // What is not put down now, the logs tell in part.
  dependencies_.store.PutSeenTime(dependencies_.seen->Now()).IgnoreError();
  for (const auto& session : sessions) {
    session->BeginDrain();
    session->plans().Stop(PlanRun::StopReason::kDrain);
    session->tours().Stop();
    session->claims().Stop();
    session->site_priors().Stop();
  }
  // The next start goes on with them.
  dependencies_.files->Stop();
  for (const auto& call : watchers) (*call)();
}

bool SessionRegistry::draining() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return draining_;
}

absl::Status SessionRegistry::CheckTakesWork() const {
  if (!draining()) return absl::OkStatus();
  return contract::Retryable(absl::StatusCode::kUnavailable, "DRAINING",
                             "the server shuts down and takes no new work; try again",
                             kRetryAfterRestart);
}

bool SessionRegistry::WaitUntilIdle(std::chrono::milliseconds patience) const {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (true) {
    bool idle = dependencies_.files->Rests();
    {
      std::lock_guard<std::mutex> lock(mutex_);
      for (const auto& [id, session] : sessions_) idle = idle && session->Rests();
    }
    if (idle) return true;
    if (std::chrono::steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void SessionRegistry::GiveUp() {
  std::vector<std::shared_ptr<Session>> sessions;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [id, session] : sessions_) sessions.push_back(session);
  }
  for (const auto& session : sessions) session->GiveUp();
}

uint64_t SessionRegistry::WatchDrain(std::function<void()> call) {
  std::lock_guard<std::mutex> lock(mutex_);
  const uint64_t id = next_watch_++;
  watchers_[id] = std::make_shared<std::function<void()>>(std::move(call));
  return id;
}

void SessionRegistry::UnwatchDrain(uint64_t id) {
  std::lock_guard<std::mutex> lock(mutex_);
  watchers_.erase(id);
}

}  // namespace vantage::session
