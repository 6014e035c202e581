// vantage_load [--minutes N] [--sessions N] [--jobs N] [--out FILE]
//
// Many jobs on a server of its own, on 127.0.0.1: each pushes a scan of 864,000 cells of a
// furnished flat that nobody has pushed before, and plans, every 20 s. Prints figures, and writes
// them as JSON. The exit status is 1 when the server ended, or something failed in a way that is no
// documented limit.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iostream>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/library/client.h"
#include "tests/bench/figures.h"
#include "tests/integration/process.h"
#include "tests/load/load_job.h"
#include "tests/load/load_scans.h"
#include "tests/load/server_metrics.h"

namespace vantage::load {
namespace {

using Clock = std::chrono::steady_clock;
constexpr size_t kScans = 8;  // of a job, before its next session
constexpr int kAloneSeconds = 30;

int PortIn(const std::string& file) {
  std::ifstream in(file);
  int port = 0;
  in >> port;
  return port;
}

// Appends a caller of that name and tenant to the callers file, and writes its token.
bool AddCaller(const std::string& name, const std::string& callers, const std::string& token) {
  const integration::Finished made = integration::RunProgram(
      {VANTAGED_BINARY, "token", name, name, "submit,plan,read", "--days", "1"});
  const std::vector<std::string> lines = absl::StrSplit(made.out, '\n');
  if (made.exit_code != 0 || lines.size() < 2) {
    std::cerr << "no token: " << made.error;
    return false;
  }
  std::ofstream(token) << lines[0] << "\n";
  std::ofstream(callers, std::ios::app) << lines[1] << "\n";
  return true;
}

double Largest(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

// How far the job that is furthest from the mean of all is from it: all ask for the same.
double SpreadOf(const std::map<int, double>& rays) {
  double sum = 0;
  for (const auto& [job, count] : rays) sum += count;
  const double mean = sum / static_cast<double>(rays.size());
  double most = 0;
  for (const auto& [job, count] : rays) most = std::max(most, std::abs(count / mean - 1));
  return most;
}

int Run(double minutes, int sessions, int jobs, const std::string& out) {
  const integration::ScratchFolder scratch;
  // All jobs are of one tenant, and one who asks for little is another.
  const std::string callers = scratch.File("callers");
  const std::string busy = scratch.File("busy-token");
  const std::string quiet = scratch.File("quiet-token");
  if (!AddCaller("busy", callers, busy) || !AddCaller("quiet", callers, quiet)) return 1;
  integration::ServerProcess server(
      scratch.File("data"), "127.0.0.1",
      {"--http", "127.0.0.1:0", "--http-port-file", scratch.File("http"), "--evict-minutes", "1",
       "--calls-per-second", "0", "--callers", callers, "--log-level", "warning"});
  if (server.address().empty()) return 1;
  const int http = PortIn(scratch.File("http"));
  LoadPlan plan;
  plan.server = server.address();
  plan.token_file = busy;
  LoadPlan quiet_plan = plan;
  quiet_plan.token_file = quiet;

  std::cout << "making scans\n";
  const std::vector<sensor::Scan> scans = MakeLoadScans(kScans);
  client::ClientOptions options;
  options.server = plan.server;
  options.token_file = plan.token_file;
  client::Client client(options);
  std::vector<std::string> names;
  for (int i = 0; i < sessions; ++i) {
    v1::CreateSessionRequest request;
    request.set_session_id(absl::StrCat("idle-", i));
    const auto made = client.Call(request);
    if (!made.ok()) {
      std::cerr << "cannot open sessions: " << made.status() << "\n";
      return 1;
    }
    names.push_back(made->session().name());
  }

  std::cout << sessions << " sessions open, " << jobs << " jobs for " << minutes << " minutes\n";
  LoadLog log;
  std::atomic<bool> stop{false};
  // Before the others begin: what the quiet tenant's plans are where nobody else asks for anything.
  LoadLog alone;
  {
    std::thread thread([&] { RunQuietTenant("alone", quiet_plan, scans.front(), stop, alone); });
    std::this_thread::sleep_for(std::chrono::seconds(kAloneSeconds));
    stop = true;
    thread.join();
    stop = false;
  }
  if (alone.quiet_to_end().empty()) {
    std::cerr << "a tenant alone on the server got no plan\n";
    return 1;
  }
  std::vector<std::thread> threads;
  threads.reserve(static_cast<size_t>(jobs) + 2);
  for (int job = 0; job < jobs; ++job) {
    threads.emplace_back([&, job] { RunLoadJob(job, plan, scans, stop, log); });
  }
  threads.emplace_back([&] { RunProber(plan, names, stop, log); });
  threads.emplace_back([&] { RunQuietTenant("quiet", quiet_plan, scans.front(), stop, log); });
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(60 * minutes));
  std::vector<double> memory;  // MB, every 10 s
  while (Clock::now() < end) {
    std::this_thread::sleep_for(
        std::min<Clock::duration>(end - Clock::now(), std::chrono::seconds(10)));
    const std::map<std::string, double> seen = ReadMetrics(http);
    if (seen.empty()) break;
    const auto value = [&](const char* name) {
      const auto it = seen.find(name);
      return it == seen.end() ? 0.0 : it->second;
    };
    memory.push_back(value("process_resident_memory_bytes") / 1e6);
    std::cout << log.to_plan().size() << " plans, " << memory.back() << " MB, "
              << value("vantage_scans_pending") << " scans pending, "
              << value("vantage_plans_running") << " plans under way\n"
              << std::flush;
  }
  stop = true;
  for (std::thread& thread : threads) thread.join();
  const bool lives = !ReadMetrics(http).empty();
  const int code = server.Stop(SIGTERM);

  bench::Figures figures("");
  const auto add = [&](const char* name, double value, const char* unit, const char* aim) {
    figures.Add({name, value, unit, aim, absl::StrCat(jobs, " jobs, ", sessions, " sessions")});
  };
  add("load.cycles", static_cast<double>(log.to_plan().size()), "plans", "");
  add("load.scans.merged", log.merged(), "scans", "");
  add("load.scans.not_merged", log.not_merged(), "scans", "");
  if (!log.unary().empty()) {
    add("load.unary.p50", 1e3 * bench::Percentile(log.unary(), 0.5), "ms", "");
    add("load.unary.p99", 1e3 * bench::Percentile(log.unary(), 0.99), "ms", "50");
  }
  if (!log.to_plan().empty()) {
    add("load.to_plan.p50", bench::Percentile(log.to_plan(), 0.5), "s", "");
    add("load.to_plan.p99", bench::Percentile(log.to_plan(), 0.99), "s", "5");
    add("load.over_budget.p99", 1e3 * bench::Percentile(log.over_budget(), 0.99), "ms", "");
    add("load.over_budget.max", 1e3 * Largest(log.over_budget()), "ms", "");
  }
  if (!log.rays().empty()) {
    add("load.shares.spread", SpreadOf(log.rays()), "of the mean job's rays", "0.15");
  }
  if (!log.quiet_to_end().empty()) {
    add("load.quiet.start.p50", bench::Percentile(log.quiet_to_start(), 0.5), "s", "");
    add("load.quiet.start.p99", bench::Percentile(log.quiet_to_start(), 0.99), "s", "0.5");
    add("load.quiet.end.p99", bench::Percentile(log.quiet_to_end(), 0.99), "s", "");
    add("load.quiet.end.p99.alone", bench::Percentile(alone.quiet_to_end(), 0.99), "s", "");
    add("load.quiet.share",
        bench::Percentile(log.quiet_rays(), 0.5) / bench::Percentile(alone.quiet_rays(), 0.5),
        "of the rays of its plans when alone", "0.5");
  }
  if (memory.size() >= 2) {
    add("load.memory.half_time", memory[memory.size() / 2], "MB", "");
    add("load.memory.end", memory.back(), "MB", "as at half time");
  }
  int undocumented = 0;
  for (const auto& [error, count] : log.errors()) {
    const bool limit = absl::StartsWith(error, "RESOURCE_EXHAUSTED") ||
                       absl::StartsWith(error, "UNAVAILABLE MODEL_LOADING");
    if (!limit) undocumented += count;
    std::cout << count << " x " << error << (limit ? "" : "   NO DOCUMENTED LIMIT") << "\n";
  }
  add("load.errors.undocumented", undocumented, "errors", "0");
  if (!out.empty() && !figures.WriteJson(out)) std::cerr << "cannot write " << out << "\n";
  std::cout << (lives && code == 0 ? "the server lived, and drained\n" : "THE SERVER ENDED\n");
  return lives && code == 0 && undocumented == 0 ? 0 : 1;
}

}  // namespace
}  // namespace vantage::load

int main(int argc, char** argv) {
  CLI::App app("Many jobs on one server, on this machine");
  double minutes = 10;
  int sessions = 200;
  int jobs = 16;
  std::string out;
  app.add_option("--minutes", minutes, "how long")
      ->check(CLI::Range(0.1, 120.0))
      ->capture_default_str();
  app.add_option("--sessions", sessions, "open beside the jobs")
      ->check(CLI::Range(1, 900))
      ->capture_default_str();
  app.add_option("--jobs", jobs, "at a time")->check(CLI::Range(1, 64))->capture_default_str();
  app.add_option("--out", out, "where to write the figures as JSON");
  CLI11_PARSE(app, argc, argv);
  return vantage::load::Run(minutes, sessions, jobs, out);
}
