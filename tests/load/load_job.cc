#include "tests/load/load_job.h"

#include <chrono>
#include <thread>

#include "absl/strings/str_cat.h"
#include "client/library/client.h"
#include "client/library/error.h"
#include "client/library/geometry.h"
#include "tests/load/load_scans.h"

namespace vantage::load {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double SecondsBetween(const google::protobuf::Timestamp& from,
                      const google::protobuf::Timestamp& to) {
  return static_cast<double>(to.seconds() - from.seconds()) + 1e-9 * (to.nanos() - from.nanos());
}

// Until then, or until the end.
void SleepUntil(Clock::time_point when, const std::atomic<bool>& stop) {
  while (!stop && Clock::now() < when) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

absl::StatusOr<std::string> OpenSession(client::Client& client, const std::string& id) {
  v1::CreateSessionRequest request;
  request.set_session_id(id);
  const auto opened = client.Call(request);
  if (!opened.ok()) return opened.status();
  return opened->session().name();
}

// The scan's name, once all of it is stored.
absl::StatusOr<std::string> SendScan(client::Client& client, const std::string& session,
                                     const sensor::RangeImage& image,
                                     const sensor::PosePrior& prior) {
  v1::Upload upload;
  *upload.mutable_prior() = client::ToProto(prior);
  return client.Upload(session, upload, image, [](const client::UploadProgress&) {});
}

// Until the plan ended.
absl::StatusOr<v1::Plan> PlanNow(client::Client& client, const std::string& session,
                                 double budget) {
  v1::CreatePlanRequest create;
  create.set_parent(session);
  const auto whole = static_cast<int64_t>(budget);
  create.mutable_plan()->mutable_time_budget()->set_seconds(whole);
  create.mutable_plan()->mutable_time_budget()->set_nanos(
      static_cast<int32_t>((budget - static_cast<double>(whole)) * 1e9));
  const auto created = client.Call(create);
  if (!created.ok()) return created.status();
  return client.WatchPlan(created->plan().name(), [](const v1::Plan&) {});
}

// One scan and the plan after it.
absl::Status RunCycle(client::Client& client, int job, const LoadPlan& load,
                      const std::string& session, const sensor::RangeImage& image,
                      const sensor::PosePrior& prior, LoadLog& log) {
  const auto scan = SendScan(client, session, image, prior);
  if (!scan.ok()) return scan.status();
  const auto stored = Clock::now();
  const auto decided = client.WaitForScan(*scan, [](const v1::Scan&) {});
  if (!decided.ok()) return decided.status();
  log.Decided(decided->state() == v1::SCAN_STATE_MERGED);
  const auto plan = PlanNow(client, session, load.budget);
  if (!plan.ok()) return plan.status();
  log.Cycle(job, SecondsSince(stored),
            SecondsBetween(plan->start_time(), plan->end_time()) - load.budget,
            static_cast<double>(plan->result().ray_count()));
  return absl::OkStatus();
}

}  // namespace

void LoadLog::Cycle(int job, double seconds_to_plan, double over_budget, double rays) {
  std::lock_guard<std::mutex> lock(mutex_);
  to_plan_.push_back(seconds_to_plan);
  over_budget_.push_back(over_budget);
  rays_[job] += rays;
}
void LoadLog::Quiet(double seconds_to_start, double seconds_to_end, double rays) {
  std::lock_guard<std::mutex> lock(mutex_);
  quiet_to_start_.push_back(seconds_to_start);
  quiet_to_end_.push_back(seconds_to_end);
  quiet_rays_.push_back(rays);
}
void LoadLog::Decided(bool merged) {
  std::lock_guard<std::mutex> lock(mutex_);
  ++(merged ? merged_ : not_merged_);
}
void LoadLog::Unary(double seconds) {
  std::lock_guard<std::mutex> lock(mutex_);
  unary_.push_back(seconds);
}
void LoadLog::Error(const absl::Status& status) {
  const client::Explanation e = client::Explain(status);
  std::lock_guard<std::mutex> lock(mutex_);
  ++errors_[absl::StrCat(absl::StatusCodeToString(status.code()), " ",
                         e.reason.empty() ? e.cause : e.reason)];
}
int LoadLog::merged() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return merged_;
}
int LoadLog::not_merged() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return not_merged_;
}
std::vector<double> LoadLog::to_plan() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return to_plan_;
}
std::vector<double> LoadLog::over_budget() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return over_budget_;
}
std::vector<double> LoadLog::unary() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return unary_;
}
std::map<int, double> LoadLog::rays() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return rays_;
}
std::vector<double> LoadLog::quiet_to_start() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return quiet_to_start_;
}
std::vector<double> LoadLog::quiet_to_end() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return quiet_to_end_;
}
std::vector<double> LoadLog::quiet_rays() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return quiet_rays_;
}
std::map<std::string, int> LoadLog::errors() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return errors_;
}

void RunLoadJob(int job, const LoadPlan& plan, const std::vector<sensor::Scan>& scans,
                const std::atomic<bool>& stop, LoadLog& log) {
  client::ClientOptions options;
  options.server = plan.server;
  options.token_file = plan.token_file;
  client::Client client(options);
  std::string session;
  int session_count = 0;
  uint64_t pushed = 0;
  size_t which = 0;
  // Spread over the period, as people are.
  auto next = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(plan.period * (job % 16) / 16));
  while (!stop) {
    SleepUntil(next, stop);
    if (stop) return;
    next += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(plan.period));
    if (which == 0) {
      const auto opened = OpenSession(client, absl::StrCat("load-", job, "-", session_count++));
      if (!opened.ok()) {
        log.Error(opened.status());
        continue;
      }
      session = *opened;
    }
    const sensor::Scan& scan = scans[which];
    which = (which + 1) % scans.size();
    const uint64_t number = static_cast<uint64_t>(job) << 32 | pushed++;
    const absl::Status done =
        RunCycle(client, job, plan, session, Unseen(scan.image, number), *scan.prior, log);
    if (!done.ok()) log.Error(done);
    // A job that is late does not catch up.
    if (next < Clock::now()) next = Clock::now();
  }
}

void RunQuietTenant(const std::string& id, const LoadPlan& plan, const sensor::Scan& first,
                    const std::atomic<bool>& stop, LoadLog& log) {
  client::ClientOptions options;
  options.server = plan.server;
  options.token_file = plan.token_file;
  client::Client client(options);
  const auto session = OpenSession(client, id);
  const auto scan = session.ok() ? SendScan(client, *session, first.image, *first.prior) : session;
  const absl::Status merged =
      scan.ok() ? client.WaitForScan(*scan, [](const v1::Scan&) {}).status() : scan.status();
  if (!merged.ok()) {
    log.Error(merged);
    return;
  }
  while (!stop) {
    const auto begun = Clock::now();
    const auto ended = PlanNow(client, *session, plan.budget);
    if (ended.ok()) {
      log.Quiet(SecondsBetween(ended->create_time(), ended->start_time()), SecondsSince(begun),
                static_cast<double>(ended->result().ray_count()));
    } else {
      log.Error(ended.status());
    }
    SleepUntil(begun + std::chrono::seconds(5), stop);
  }
}

void RunProber(const LoadPlan& plan, const std::vector<std::string>& sessions,
               const std::atomic<bool>& stop, LoadLog& log) {
  client::ClientOptions options;
  options.server = plan.server;
  options.token_file = plan.token_file;
  options.attempts = 1;
  client::Client client(options);
  for (size_t i = 0; !stop; ++i) {
    const auto begun = Clock::now();
    absl::Status done;
    if (i % 2 == 0) {
      v1::GetSessionRequest request;
      request.set_name(sessions[i % sessions.size()]);
      done = client.Call(request).status();
    } else {
      v1::ListPlansRequest request;
      request.set_parent(sessions[i % sessions.size()]);
      done = client.Call(request).status();
    }
    log.Unary(SecondsSince(begun));
    if (!done.ok()) log.Error(done);
    SleepUntil(begun + std::chrono::milliseconds(100), stop);
  }
}

}  // namespace vantage::load
