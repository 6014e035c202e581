#include "server/session/session_context.h"

#include <exception>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/contract/resource_names.h"

namespace vantage::session {
namespace {

constexpr absl::Duration kRetryDroppedAfter = absl::Seconds(2);

std::string TenantOf(const Journal& journal) {
  std::string tenant;
  journal.Read([&](const SessionState& state) { tenant = state.tenant; });
  return tenant;
}

Eigen::Vector3d OriginOf(const Journal& journal) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  journal.Read([&](const SessionState& state) {
    const v1::Vector3& stated = state.session.origin();
    origin = {stated.x(), stated.y(), stated.z()};
  });
  return origin;
}

}  // namespace

SessionContext::SessionContext(std::string id, std::unique_ptr<Journal> journal,
                               TenantAccounts& accounts, const SessionDependencies& dependencies)
    : id_(std::move(id)),
      name_(contract::NameOfSession(id_)),
      dependencies_(dependencies),
      journal_(std::move(journal)),
      tenant_(TenantOf(*journal_)),
      origin_(OriginOf(*journal_)),
      account_(std::make_shared<AccountShare>(accounts.Of(tenant_))),
      share_(dependencies.pool.NewShare(1.0, tenant_)),
      // Each scan may have two operations waiting: one from its arrival and one from a person.
      strand_(std::make_shared<execution::Strand>(dependencies.pool, share_,
                                                  2 * dependencies.limits.scans_per_session + 16)) {
  journal_->Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      account_->Add(record.scan.encoded_size_bytes() + record.preview.encoded_size_bytes());
    }
  });
  journal_->OnWritten([share = account_](int64_t bytes) { share->AddLog(bytes); });
}

Eigen::Vector3d SessionContext::origin() const {
  std::lock_guard<std::mutex> lock(origin_mutex_);
  return origin_;
}

void SessionContext::ReadOrigin() {
  const Eigen::Vector3d origin = OriginOf(*journal_);
  std::lock_guard<std::mutex> lock(origin_mutex_);
  origin_ = origin;
}

absl::Status SessionContext::CheckLog() const {
  return journal_->CheckRoom(dependencies_.limits.log_bytes_per_session);
}

void SessionContext::CompactLogWhenDue() {
  if (!journal_->DueForCompaction()) return;
  Submit(execution::JobPriority::kModel, [this](parallel::Parallel&) {
    if (closed() || halted()) return;
    const absl::StatusOr<int64_t> saved = journal_->Compact();
    if (saved.ok()) {
      if (*saved > 0) {
        dependencies_.log.Info("the log was compacted",
                               {{"session", id_}, {"bytes", journal_->bytes()}, {"saved", *saved}});
      }
      CompactLogWhenDue();
    } else if (!closed()) {
      dependencies_.log.Warning("the log could not be compacted",
                                {{"session", id_}, {"error", saved.status().ToString()}});
    }
  });
}

absl::Status SessionContext::Dropped() const {
  if (std::uncaught_exceptions() > 0) return contract::OutOfMemory();
  if (closed()) return absl::AbortedError(absl::StrCat(name_, " was deleted"));
  return contract::Retryable(absl::StatusCode::kUnavailable, "DRAINING",
                             "the server shuts down; ask again after its next start",
                             kRetryDroppedAfter);
}

bool SessionContext::TryPost(execution::Strand::Operation operation) {
  return strand_->TryPost([keep = shared_from_this(), operation = std::move(operation)](
                              parallel::Parallel& parallel) { operation(parallel); });
}

uint64_t SessionContext::Submit(execution::JobPriority priority, execution::PlanningPool::Job job,
                                double seconds) {
  // What the job holds may need the session until it goes, also where the job is dropped.
  struct Kept {
    std::shared_ptr<SessionContext> session;
    execution::PlanningPool::Job job;
    void operator()(parallel::Parallel& parallel) const { job(parallel); }
  };
  return dependencies_.pool.Submit(share_, priority, Kept{shared_from_this(), std::move(job)},
                                   seconds);
}

void SessionContext::After(std::chrono::nanoseconds delay, std::function<void()> call) {
  dependencies_.timer.After(delay, [weak = weak_from_this(), call = std::move(call)] {
    if (const std::shared_ptr<SessionContext> keep = weak.lock()) call();
  });
}

absl::StatusOr<std::string> SessionContext::PutOwnBlob(absl::string_view bytes) {
  absl::StatusOr<std::string> blob = dependencies_.store.PutBlob(bytes);
  if (blob.ok()) account_->Add(static_cast<int64_t>(bytes.size()));
  return blob;
}

absl::StatusOr<std::string> SessionContext::PutGivenBlob(absl::string_view bytes) {
  const auto size = static_cast<int64_t>(bytes.size());
  if (absl::Status room = account_->Reserve(size); !room.ok()) return room;
  absl::StatusOr<std::string> blob = dependencies_.store.PutBlob(bytes);
  if (!blob.ok()) account_->GiveBack(size);
  return blob;
}

void SessionContext::ReleaseOwnBlob(const std::string& sha256) {
  account_->GiveBack(dependencies_.store.BlobSize(sha256).value_or(0));
  // What cannot be released now is found by the store's own collection.
  dependencies_.store.ReleaseBlob(sha256).IgnoreError();
}

void SessionContext::CloseLog() {
  closed_ = true;
  journal_->Close();
}

}  // namespace vantage::session
