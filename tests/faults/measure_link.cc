#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "tests/faults/fault_figures.h"
#include "tests/faults/packet_link.h"
#include "tests/integration/process.h"

namespace vantage::faults {
namespace {

using Clock = std::chrono::steady_clock;

constexpr uint32_t kSeed = 5;
constexpr int kScans = 20;  // under each of the conditions
constexpr int kClearScans = 5;
constexpr int kBreaks = 3;
constexpr int64_t kBytesBetweenBreaks = 600'000;
constexpr double kPatienceSeconds = 30;
constexpr auto kLook = std::chrono::milliseconds(20);

enum class Breaks { kNone, kCut, kHalfOpen };

struct Trial {
  const char* name;
  const char* what;
  LinkConditions link;
  double degrees;
  Breaks breaks;
};

// What a link job said, and the link itself.
struct Outcome {
  int arrived = 0;
  long long once_bytes = 0;
  long long sent_bytes = 0;
  int reconnects = 0;
  int64_t delivered_bytes = 0;
  double seconds = 0;
};

struct NoticedSeconds {
  std::vector<double> client;
  std::vector<double> server;
};

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Breaks the link and waits until both ends have given up what went over it.
void Break(PacketLink& link, const Trial& trial, NoticedSeconds& noticed) {
  LinkConditions broken = trial.link;
  broken.cut = trial.breaks == Breaks::kCut;
  broken.server_unheard = trial.breaks == Breaks::kHalfOpen;
  link.Set(broken);
  const auto start = Clock::now();
  double client = -1;
  double server = -1;
  while ((client < 0 || server < 0) && SecondsSince(start) < kPatienceSeconds) {
    if (client < 0 && link.Established(LinkEnd::kClient) == 0) client = SecondsSince(start);
    if (server < 0 && link.Established(LinkEnd::kServer) == 0) server = SecondsSince(start);
    std::this_thread::sleep_for(kLook);
  }
  noticed.client.push_back(client < 0 ? kPatienceSeconds : client);
  noticed.server.push_back(server < 0 ? kPatienceSeconds : server);
  link.Set(trial.link);
}

Outcome RunTrial(PacketLink& link, const std::string& server, const Trial& trial, int scans,
                 NoticedSeconds& noticed) {
  link.Set(trial.link);
  const int64_t delivered_before = link.DeliveredBytes();
  const auto start = Clock::now();
  integration::Finished job;
  std::atomic<bool> done{false};
  std::thread pushing([&] {
    link.RunAt(LinkEnd::kClient, [&] {
      job = integration::RunProgram({LINK_CLIENT, server,
                                     absl::StrReplaceAll(trial.name, {{"_", "-"}}),
                                     absl::StrCat(scans), absl::StrCat(trial.degrees)});
    });
    done = true;
  });
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<int64_t> apart(kBytesBetweenBreaks / 2, kBytesBetweenBreaks);
  for (int i = 0; i < kBreaks && trial.breaks != Breaks::kNone; ++i) {
    const int64_t at = link.DeliveredBytes() + apart(random);
    while (!done && link.DeliveredBytes() < at) std::this_thread::sleep_for(kLook);
    if (!done) Break(link, trial, noticed);
  }
  pushing.join();
  Outcome outcome;
  outcome.seconds = SecondsSince(start);
  outcome.delivered_bytes = link.DeliveredBytes() - delivered_before;
  std::sscanf(job.out.c_str(), "%d %lld %lld %d", &outcome.arrived, &outcome.once_bytes,
              &outcome.sent_bytes, &outcome.reconnects);
  if (outcome.arrived != scans) std::cerr << "link, " << trial.name << ": " << job.out << job.error;
  return outcome;
}

}  // namespace

bool MeasureLink(bench::Figures& figures) {
  const auto link = PacketLink::Make(kSeed);
  if (!link.ok()) {
    std::cerr << "link: skipped, it needs root and /dev/net/tun: " << link.status().message()
              << "\n";
    return true;
  }
  std::unique_ptr<integration::ServerProcess> server;
  (*link)->RunAt(LinkEnd::kServer, [&] {
    server = std::make_unique<integration::ServerProcess>(
        "", PacketLink::AddressOf(LinkEnd::kServer),
        std::vector<std::string>{"--allow-insecure-remote"});
  });
  LinkConditions good;  // a tablet's, with nobody else in the hall
  good.delay = std::chrono::milliseconds(5);
  good.bytes_per_second = 250'000;
  LinkConditions lossy = good;
  lossy.loss = 0.15;
  LinkConditions late = good;
  late.delay = std::chrono::milliseconds(100);
  LinkConditions slow = good;
  slow.bytes_per_second = 32'000;
  const Trial clear = {"clear", "2 Mbit/s, 5 ms", good, 2.0, Breaks::kNone};
  const std::vector<Trial> trials = {
      {"cut", "2 Mbit/s, 5 ms; cut 3 times, until both ends notice", good, 0.7, Breaks::kCut},
      {"half_open", "2 Mbit/s, 5 ms; 3 times the client hears nothing more, until both notice",
       good, 0.7, Breaks::kHalfOpen},
      {"loss", "2 Mbit/s, 5 ms; 15 % of the packets lost, each way", lossy, 2.0, Breaks::kNone},
      {"delay", "2 Mbit/s, 100 ms each way", late, 1.0, Breaks::kNone},
      {"slow", "256 kbit/s, 5 ms", slow, 1.0, Breaks::kNone}};

  // What a scan's calls take besides its pieces.
  NoticedSeconds noticed;
  const Outcome undisturbed = RunTrial(**link, server->address(), clear, kClearScans, noticed);
  const double calls =
      static_cast<double>(undisturbed.delivered_bytes - undisturbed.once_bytes) / kClearScans;
  int arrived = 0;
  for (const Trial& trial : trials) {
    std::cerr << "link: " << kScans << " scans, " << trial.what << "\n";
    const Outcome outcome = RunTrial(**link, server->address(), trial, kScans, noticed);
    arrived += outcome.arrived;
    const auto once = static_cast<double>(std::max(1LL, outcome.once_bytes));
    const std::string name = absl::StrCat("link.", trial.name, ".");
    figures.Add({name + "seconds", outcome.seconds, "s", "",
                 absl::StrCat(kScans, " scans, ", outcome.once_bytes >> 10, " KiB; ", trial.what,
                              "; ", outcome.reconnects, " resumed")});
    figures.Add({name + "sent_twice", static_cast<double>(outcome.sent_bytes) / once - 1, "", "",
                 "share of the bytes that the client sent again, in flight or not"});
    // A break takes with it the piece that it cuts off: that was in flight.
    const bool breaks = trial.breaks != Breaks::kNone;
    figures.Add({name + "delivered_twice",
                 (static_cast<double>(outcome.delivered_bytes) - calls * kScans) / once - 1, "",
                 breaks ? "" : "< 0.02",
                 breaks
                     ? "share that reached the server again: parts of pieces that a break cut off"
                     : "share that reached the server again"});
    if (breaks && outcome.reconnects > 0) {
      figures.Add({name + "per_break.kib",
                   (static_cast<double>(outcome.sent_bytes) - once) / outcome.reconnects / 1024,
                   "KiB", "< 256",
                   "sent again for each break: a piece, before compression, is 256"});
    }
  }
  const int wanted = kScans * static_cast<int>(trials.size());
  figures.Add(
      {"link.arrived", static_cast<double>(arrived), "scans", absl::StrCat(wanted),
       absl::StrCat("of ", wanted, ", exactly once and with their own bytes; seed ", kSeed)});
  if (!noticed.client.empty()) {
    const std::string broken = absl::StrCat("the slowest of ", noticed.client.size());
    figures.Add({"link.noticed.client.seconds",
                 *std::max_element(noticed.client.begin(), noticed.client.end()), "s", "< 10",
                 broken});
    figures.Add({"link.noticed.server.seconds",
                 *std::max_element(noticed.server.begin(), noticed.server.end()), "s", "< 10",
                 broken});
  }
  return arrived == wanted;
}

}  // namespace vantage::faults
