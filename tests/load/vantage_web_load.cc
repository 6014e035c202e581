// vantage_web_load: what the web listener costs a call, beside gRPC, and what many open pages cost
// the calls of others.
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/library/client.h"
#include "tests/bench/figures.h"
#include "tests/integration/process.h"
#include "tests/load/server_metrics.h"
#include "tests/server/fixture/web_client.h"

namespace vantage::load {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kSession[] = "sessions/site";
// Between two events that every page is told.
constexpr std::chrono::milliseconds kEventEvery(200);
// Between two calls while pages are open: people don't tap faster.
constexpr std::chrono::milliseconds kCallEvery(5);

double Milliseconds(const std::function<void()>& call) {
  const Clock::time_point began = Clock::now();
  call();
  return std::chrono::duration<double, std::milli>(Clock::now() - began).count();
}

// As many files as the system lets this process have, and the server that it starts.
void TakeFiles() {
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
}

// The port that the server wrote to a file.
int PortOf(const std::string& path) {
  int port = 0;
  std::ifstream(path) >> port;
  return port;
}

std::string Enveloped(const std::string& message) {
  std::string head(5, '\0');
  head[4] = static_cast<char>(message.size());  // below 256 bytes
  return head + message;
}

// Pages that follow a session: a stream each, of which all that comes is read.
class OpenPages {
 public:
  OpenPages(int port, int count) {
    v1::WatchSessionRequest watch;
    watch.set_name(kSession);
    const std::string request =
        fixture::WebRequest("POST", "/vantage.v1.SessionService/WatchSession",
                            {{"content-type", "application/connect+json"}},
                            Enveloped(absl::StrCat(R"({"name":")", kSession, R"("})")));
    for (int i = 0; i < count; ++i) {
      auto page = std::make_unique<fixture::WebClient>(port);
      page->Send(request);
      if (page->ReadHead().status == 200 && page->ReadMessage().flags == 0) {
        pages_.push_back(std::move(page));
      }
    }
    reader_ = std::thread([this] { ReadAll(); });
  }
  ~OpenPages() {
    stop_ = true;
    reader_.join();
  }
  OpenPages(const OpenPages&) = delete;
  OpenPages& operator=(const OpenPages&) = delete;

  size_t open() const { return pages_.size() - ended_; }
  int64_t bytes() const { return bytes_; }

 private:
  void ReadAll() {
    std::vector<pollfd> files;
    files.reserve(pages_.size());
    for (const auto& page : pages_) files.push_back({page->file(), POLLIN, 0});
    std::array<char, 64 << 10> part{};
    while (!stop_) {
      if (poll(files.data(), files.size(), 100) <= 0) continue;
      for (pollfd& file : files) {
        if (file.revents == 0) continue;
        const ssize_t n = recv(file.fd, part.data(), part.size(), MSG_DONTWAIT);
        if (n > 0) {
          bytes_ += n;
        } else if (n == 0) {
          ++ended_;
          file.fd = -1;
        }
      }
    }
  }

  std::vector<std::unique_ptr<fixture::WebClient>> pages_;
  std::thread reader_;
  std::atomic<bool> stop_{false};
  std::atomic<size_t> ended_{0};
  std::atomic<int64_t> bytes_{0};
};

int Run(int pages, int calls, const std::string& out) {
  TakeFiles();
  const integration::ScratchFolder scratch;
  integration::ServerProcess server(
      scratch.File("data"), "127.0.0.1",
      {"--http", "127.0.0.1:0", "--http-port-file", scratch.File("http"), "--web", "127.0.0.1:0",
       "--web-port-file", scratch.File("web"), "--calls-per-second", "0", "--log-level",
       "warning"});
  if (server.address().empty()) return 1;
  const int port = PortOf(scratch.File("web"));
  client::ClientOptions options;
  options.server = server.address();
  client::Client client(options);
  v1::CreateSessionRequest create;
  create.set_session_id("site");
  if (!client.Call(create).ok()) return 1;
  v1::GetSessionRequest get;
  get.set_name(kSession);
  const std::string asked = get.SerializeAsString();

  std::atomic<int> failed{0};
  fixture::WebClient web(port);
  const auto by_web = [&] {
    const auto answer = web.Ask("POST", "/vantage.v1.SessionService/GetSession",
                                {{"content-type", "application/proto"}}, asked);
    if (answer.status != 200) ++failed;
  };
  const auto by_grpc = [&] {
    if (!client.Call(get).ok()) ++failed;
  };
  // In turns, so that both have the same machine.
  std::vector<double> grpc_ms;
  std::vector<double> web_ms;
  for (int i = 0; i < calls; ++i) {
    grpc_ms.push_back(Milliseconds(by_grpc));
    web_ms.push_back(Milliseconds(by_web));
  }

  const double before = ReadMetrics(PortOf(scratch.File("http")))["process_resident_memory_bytes"];
  std::vector<double> crowded_ms;
  std::vector<double> crowded_grpc_ms;
  size_t open = 0;
  double after = 0;
  {
    OpenPages crowd(port, pages);
    std::atomic<bool> stop{false};
    // Somebody works on the site, and all pages are told.
    std::thread events([&] {
      client::Client other(options);
      while (!stop) {
        v1::UpdateSessionRequest update;
        update.mutable_session()->set_name(kSession);
        update.mutable_session()->set_display_name(absl::StrCat("site ", crowd.bytes()));
        update.mutable_update_mask()->add_paths("display_name");
        if (!other.Call(update).ok()) ++failed;
        std::this_thread::sleep_for(kEventEvery);
      }
    });
    for (int i = 0; i < calls; ++i) {
      crowded_ms.push_back(Milliseconds(by_web));
      crowded_grpc_ms.push_back(Milliseconds(by_grpc));
      std::this_thread::sleep_for(kCallEvery);
    }
    stop = true;
    events.join();
    open = crowd.open();
    after = ReadMetrics(PortOf(scratch.File("http")))["process_resident_memory_bytes"];
  }
  const int code = server.Stop(SIGTERM);

  bench::Figures figures("");
  const std::string conditions = absl::StrCat(calls, " calls each, in turns");
  const std::string crowd = absl::StrCat(pages, " pages, five events a second");
  figures.Add({"web.unary.grpc.p50", bench::Percentile(grpc_ms, 0.5), "ms", "", conditions});
  figures.Add({"web.unary.p50", bench::Percentile(web_ms, 0.5), "ms", "", conditions});
  figures.Add({"web.unary.grpc.p99", bench::Percentile(grpc_ms, 0.99), "ms", "", conditions});
  figures.Add({"web.unary.p99", bench::Percentile(web_ms, 0.99), "ms", "", conditions});
  figures.Add({"web.unary.p99_over_grpc",
               bench::Percentile(web_ms, 0.99) - bench::Percentile(grpc_ms, 0.99), "ms", "2",
               conditions});
  figures.Add({"web.pages.open", static_cast<double>(open), "streams", absl::StrCat(pages), crowd});
  figures.Add({"web.pages.unary.p50", bench::Percentile(crowded_ms, 0.5), "ms", "", crowd});
  figures.Add({"web.pages.unary.p99", bench::Percentile(crowded_ms, 0.99), "ms", "50", crowd});
  figures.Add(
      {"web.pages.unary.grpc.p99", bench::Percentile(crowded_grpc_ms, 0.99), "ms", "", crowd});
  figures.Add(
      {"web.pages.memory", (after - before) / 1024 / std::max(1, pages), "KiB a page", "", crowd});
  figures.Add({"web.errors", static_cast<double>(failed.load()), "calls", "0", crowd});
  if (!out.empty() && !figures.WriteJson(out)) std::cerr << "cannot write " << out << "\n";
  return code == 0 && failed == 0 && open == static_cast<size_t>(pages) ? 0 : 1;
}

}  // namespace
}  // namespace vantage::load

int main(int argc, char** argv) {
  CLI::App app("Many open pages on one server, on this machine");
  int pages = 1000;
  int calls = 2000;
  std::string out;
  app.add_option("--pages", pages, "open at a time")
      ->check(CLI::Range(1, 3000))
      ->capture_default_str();
  app.add_option("--calls", calls, "of each kind")
      ->check(CLI::Range(100, 1000000))
      ->capture_default_str();
  app.add_option("--out", out, "where to write the figures as JSON");
  CLI11_PARSE(app, argc, argv);
  return vantage::load::Run(pages, calls, out);
}
