#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/store/disk_store.h"
#include "tests/faults/fault_figures.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"
#include "vantage/v1/plan_service.grpc.pb.h"

namespace vantage::faults {
namespace {

constexpr int kScans = 10;
constexpr double kDegrees = 1.5;
constexpr int kSayEvery = 10;

// What takes its time says how far it is.
void Say(const std::string& words, std::chrono::steady_clock::time_point start) {
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::cerr << "restart: " << words << ", " << static_cast<int>(seconds) << " s\n";
}

// Aligned where their priors are: it is the restart that is measured.
absl::Status MakeSessions(const std::string& folder, int sessions) {
  const auto start = std::chrono::steady_clock::now();
  const auto store = store::DiskStore::Open(folder);
  if (!store.ok()) return store.status();
  fixture::Script script;
  fixture::SessionHost host(**store, script.Make(), {}, absl::Now,
                            static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<std::string> scans;
  std::vector<v1::PosePrior> priors;
  scans.reserve(kScans);
  priors.reserve(kScans);
  for (int scan = 0; scan < kScans; ++scan) {
    const Eigen::Vector3d at(1.0 + 0.3 * scan, 1.2 + 0.17 * scan, 1.4);
    scans.push_back(fixture::EncodedRoom(at, kDegrees));
    priors.push_back(fixture::PriorAt(at.x(), at.y(), at.z()));
  }
  for (int i = 0; i < sessions; ++i) {
    const auto session = fixture::OpenSession(host.registry, absl::StrCat("job-", i));
    for (size_t scan = 0; scan < scans.size(); ++scan) {
      const auto sent = fixture::SendScan(*session, scans[scan], &priors[scan]);
      if (!sent.ok()) return sent.status();
    }
    session->WaitUntilIdle();
    if ((i + 1) % kSayEvery == 0)
      Say(absl::StrCat(i + 1, " of ", sessions, " sessions made"), start);
  }
  return absl::OkStatus();
}

}  // namespace

bool MeasureRestart(int sessions, bench::Figures& figures) {
  const integration::ScratchFolder scratch;
  const std::string data = scratch.File("data");
  const absl::Status made = MakeSessions(data, sessions);
  if (!made.ok()) {
    std::cerr << "restart: " << made << "\n";
    return false;
  }
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  integration::ServerProcess server(data);
  const double serving = since();
  Say("serving", start);
  const auto channel = grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials());
  const auto plans = v1::PlanService::NewStub(channel);
  std::vector<double> first_plan;
  std::vector<std::string> running(static_cast<size_t>(sessions));
  std::vector<bool> done(running.size());
  const auto limit = std::chrono::minutes(10);
  while (first_plan.size() < running.size() && Clock::now() - start < limit) {
    for (size_t i = 0; i < running.size(); ++i) {
      if (done[i]) continue;
      grpc::ClientContext context;
      if (running[i].empty()) {
        v1::CreatePlanRequest create;
        create.set_parent(absl::StrCat("sessions/job-", i));
        create.mutable_plan()->set_work_limit_rays(100'000);
        v1::CreatePlanResponse response;
        if (plans->CreatePlan(&context, create, &response).ok())
          running[i] = response.plan().name();
        continue;
      }
      v1::GetPlanRequest get;
      get.set_name(running[i]);
      v1::GetPlanResponse response;
      if (!plans->GetPlan(&context, get, &response).ok()) continue;
      done[i] = response.plan().state() != v1::PLAN_STATE_QUEUED &&
                response.plan().state() != v1::PLAN_STATE_RUNNING;
      if (!done[i]) continue;
      first_plan.push_back(since());
      if (first_plan.size() % kSayEvery == 0) {
        Say(absl::StrCat(first_plan.size(), " first plans"), start);
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (first_plan.size() < running.size()) {
    std::cerr << "restart: only " << first_plan.size() << " sessions plan after ten minutes\n";
    return false;
  }
  const std::string what = absl::StrCat(sessions, " sessions of ", kScans, " scans of ",
                                        fixture::ScanRoom({2, 2, 1.4}, kDegrees).cells(), " cells");
  figures.Add({"restart.serving.seconds", serving, "s", "", what + ", from exec to SERVING"});
  figures.Add({"restart.first_plan.median.seconds", bench::Percentile(first_plan, 0.5), "s", "",
               "from exec to the end of a session's first plan, all of them asked at once"});
  figures.Add(
      {"restart.first_plan.last.seconds", first_plan.back(), "s", "", "the last session's"});
  return true;
}

}  // namespace vantage::faults
