#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "proto/wire/checksum.h"
#include "server/session/session_registry.h"
#include "server/store/disk_store.h"
#include "tests/faults/fault_figures.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/scripted.h"

namespace vantage {
namespace {

constexpr int kScans = 10;
constexpr double kDegrees = 1.5;

absl::Status SendScan(Session& session, int number) {
  const Eigen::Vector3d position(1.0 + 0.3 * number, 1.2 + 0.17 * number, 1.4);
  const std::string bytes = EncodedRoom(position, kDegrees);
  v1::CreateUploadRequest request;
  *request.mutable_upload()->mutable_prior() = PriorAt(position.x(), position.y(), position.z());
  const auto upload = session.CreateUpload(request);
  if (!upload.ok()) return upload.status();
  v1::UploadTotal total;
  total.set_encoded_size(static_cast<int64_t>(bytes.size()));
  total.set_sha256(Sha256::Of(bytes));
  v1::Piece piece;
  piece.set_data(bytes);
  piece.set_crc32c(Crc32c(bytes));
  return session.AddToUpload(upload->name(), &piece, &total).status();
}

// Aligned where their priors are: it is the restart that is measured.
absl::Status MakeSessions(const std::string& folder, int sessions) {
  const auto store = DiskStore::Open(folder);
  if (!store.ok()) return store.status();
  Log log(LogLevel::kOff, Log::Stderr());
  Timer timer;
  PlanningPool pool(static_cast<int>(std::thread::hardware_concurrency()), 8);
  Script script;
  SessionRegistry registry(SessionSurroundings{
      **store, pool, timer, log, {}, script.Make(), [] { return absl::Now(); }});
  for (int i = 0; i < sessions; ++i) {
    v1::CreateSessionRequest create;
    create.set_session_id(absl::StrCat("job-", i));
    create.mutable_session()->mutable_model_config()->set_voxel_size(0.1);
    const auto session = registry.Create(create);
    if (!session.ok()) return session.status();
    for (int scan = 0; scan < kScans; ++scan) {
      absl::Status sent = SendScan(**session, scan);
      if (!sent.ok()) return sent;
      (*session)->WaitUntilIdle();
    }
  }
  return absl::OkStatus();
}

}  // namespace

bool MeasureRestart(int sessions, Figures& figures) {
  const ScratchFolder scratch;
  const std::string data = scratch.File("data");
  const absl::Status made = MakeSessions(data, sessions);
  if (!made.ok()) {
    std::cerr << "restart: " << made << "\n";
    return false;
  }
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  ServerProcess server(data);
  const double serving = since();
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
        create.mutable_plan()->set_work_limit(100'000);
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
      if (done[i]) first_plan.push_back(since());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (first_plan.size() < running.size()) {
    std::cerr << "restart: only " << first_plan.size() << " sessions plan after ten minutes\n";
    return false;
  }
  const std::string what = absl::StrCat(sessions, " sessions of ", kScans, " scans of ",
                                        ScanRoom({2, 2, 1.4}, kDegrees).cells(), " cells");
  figures.Add({"restart.serving.seconds", serving, "s", "", what + ", from exec to SERVING"});
  figures.Add({"restart.first_plan.median.seconds", Percentile(first_plan, 0.5), "s", "",
               "from exec to the end of a session's first plan, all of them asked at once"});
  figures.Add(
      {"restart.first_plan.last.seconds", first_plan.back(), "s", "", "the last session's"});
  return true;
}

}  // namespace vantage
