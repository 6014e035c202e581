#include "server/main/monitor.h"

#include <sys/resource.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "server/auth/tls_files.h"

namespace vantage::server {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

double ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  double total = 0;
  double resident = kUnknown;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double OpenFiles() {
  std::error_code failed;
  double count = 0;
  for (std::filesystem::directory_iterator it("/proc/self/fd", failed), end; it != end && !failed;
       it.increment(failed)) {
    ++count;
  }
  return failed ? kUnknown : count;
}

double ProcessorSeconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double FreeBytes(const std::string& folder) {
  struct statvfs status {};
  if (statvfs(folder.c_str(), &status) != 0) return kUnknown;
  return static_cast<double>(status.f_bavail) * static_cast<double>(status.f_frsize);
}

// One pass over the sessions serves everything that one request reads.
class Totals {
 public:
  explicit Totals(session::SessionRegistry& sessions) : sessions_(sessions) {}
  session::SessionTotals Get() {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (now >= stale_) {
      totals_ = sessions_.Totals();
      stale_ = now + std::chrono::milliseconds(200);
    }
    return totals_;
  }

 private:
  session::SessionRegistry& sessions_;
  std::mutex mutex_;
  session::SessionTotals totals_ ABSL_GUARDED_BY(mutex_);
  std::chrono::steady_clock::time_point stale_ ABSL_GUARDED_BY(mutex_);
};

std::string StatusPage(const Monitored& m, absl::Time started) {
  const session::SessionTotals totals = m.sessions.Totals();
  const execution::PlanningPool::Load load = m.pool.load();
  std::string out = absl::StrFormat(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>vantaged</title>"
      "<style>body{font:1em sans-serif;margin:2em}td{padding:.2em 1em .2em 0}"
      "td+td{text-align:right}</style></head><body><h1>vantaged: %s</h1><table>",
      m.state());
  const auto row = [&out](absl::string_view what, const std::string& value) {
    absl::StrAppend(&out, "<tr><td>", what, "</td><td>", value, "</td></tr>\n");
  };
  row("up for", absl::FormatDuration(absl::Trunc(absl::Now() - started, absl::Seconds(1))));
  row("sessions", absl::StrCat(totals.sessions));
  row("models in memory", absl::StrCat(totals.loaded));
  row("uploads under way", absl::StrCat(totals.uploads));
  row("scans not decided", absl::StrCat(totals.pending_scans));
  row("plans under way", absl::StrCat(totals.plans));
  row("jobs that compute", absl::StrCat(load.running));
  row("jobs that wait", absl::StrCat(load.queued));
  row("requests that wait", absl::StrCat(m.tasks.waiting()));
  row("memory", absl::StrFormat("%.0f MB", ResidentBytes() / 1e6));
  if (!m.data_folder.empty()) {
    row("free on disk", absl::StrFormat("%.1f GB", FreeBytes(m.data_folder) / 1e9));
  }
  absl::StrAppend(&out,
                  "</table><p><a href=\"/metrics\">metrics</a> <a href=\"/readyz\">ready?</a></p>"
                  "</body></html>\n");
  return out;
}

}  // namespace

void AddGauges(const Monitored& m) {
  telemetry::Metrics& metrics = m.metrics;
  const auto totals = std::make_shared<Totals>(m.sessions);
  const auto gauge = [&metrics](const char* name, const char* help, std::function<double()> read) {
    metrics.AddGauge(name, help, {}, std::move(read));
  };
  gauge("vantage_ready", "1 while the server serves.",
        [state = m.state] { return state() == "serving" ? 1.0 : 0.0; });
  gauge("vantage_sessions", "Sessions that there are.",
        [totals] { return static_cast<double>(totals->Get().sessions); });
  gauge("vantage_sessions_left_out", "Sessions that are damaged and were left out at the start.",
        [totals] { return static_cast<double>(totals->Get().left_out); });
  gauge("vantage_sessions_max", "Sessions that there may be.",
        [&s = m.sessions] { return static_cast<double>(s.dependencies().limits.sessions); });
  gauge("vantage_models_loaded", "Sessions whose model is in memory.",
        [totals] { return static_cast<double>(totals->Get().loaded); });
  gauge("vantage_uploads_open", "Uploads under way.",
        [totals] { return static_cast<double>(totals->Get().uploads); });
  gauge("vantage_scans_pending", "Scans received and not yet merged or refused.",
        [totals] { return static_cast<double>(totals->Get().pending_scans); });
  gauge("vantage_plans_running", "Plans queued or running.",
        [totals] { return static_cast<double>(totals->Get().plans); });
  metrics.AddGauge("vantage_queue_length", "What waits.", {{"queue", "requests"}},
                   [&t = m.tasks] { return static_cast<double>(t.waiting()); });
  metrics.AddGauge("vantage_queue_length", "What waits.", {{"queue", "planning"}},
                   [&p = m.pool] { return static_cast<double>(p.load().queued); });
  metrics.AddGauge("vantage_queue_capacity", "What may wait.", {{"queue", "requests"}},
                   [&t = m.tasks] { return static_cast<double>(t.capacity()); });
  gauge("vantage_planning_jobs", "Jobs of the planning pool that have begun.",
        [&p = m.pool] { return static_cast<double>(p.load().running); });
  gauge("vantage_planning_slots", "Threads that compute at a time.",
        [&p = m.pool] { return static_cast<double>(p.slots()); });
  gauge("vantage_log_lines_lost_total", "Lines of the log that nobody took in time.",
        [&l = m.log] { return static_cast<double>(l.lost()); });
  gauge("process_resident_memory_bytes", "Resident memory.", ResidentBytes);
  gauge("process_cpu_seconds_total", "Processor time used.", ProcessorSeconds);
  gauge("process_open_fds", "Open files and connections.", OpenFiles);
  gauge("process_start_time_seconds", "When the server started, since 1970.",
        [started = absl::ToDoubleSeconds(absl::Now() - absl::UnixEpoch())] { return started; });
  if (!m.data_folder.empty()) {
    gauge("vantage_store_free_bytes", "Free space where the data are kept.",
          [folder = m.data_folder] { return FreeBytes(folder); });
  }
  if (m.tls_files != nullptr) {
    gauge(
        "vantage_tls_certificate_expires_seconds",
        "When the server's certificate expires, since 1970; 0 when what is on disk cannot be used, "
        "and what was loaded before stays.",
        [files = m.tls_files] {
          return files->fault().empty()
                     ? absl::ToDoubleSeconds(files->expires() - absl::UnixEpoch())
                     : 0.0;
        });
  }
}

std::map<std::string, telemetry::HttpListener::Page> MonitorPages(const Monitored& m) {
  const absl::Time started = absl::Now();
  return {
      {"/metrics",
       [m] {
         return telemetry::HttpAnswer{200, "text/plain; version=0.0.4; charset=utf-8",
                                      m.metrics.Text()};
       }},
      {"/healthz",
       [] {
         return telemetry::HttpAnswer{200, "text/plain", "alive\n"};
       }},
      {"/readyz",
       [m] {
         const std::string state = m.state();
         std::string text = state + "\n";
         // Those who have the port still get through it, so that it stays in use.
         if (m.tls_files != nullptr && !m.tls_files->fault().empty()) {
           absl::StrAppend(&text, "certificates on disk are not used: ", m.tls_files->fault(),
                           "\n");
         }
         return telemetry::HttpAnswer{state == "serving" ? 200 : 503, "text/plain", text};
       }},
      {"/",
       [m, started] {
         return telemetry::HttpAnswer{200, "text/html; charset=utf-8", StatusPage(m, started)};
       }},
  };
}

}  // namespace vantage::server
