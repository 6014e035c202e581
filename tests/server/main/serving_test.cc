// The server as a whole: health, reflection, draining, addresses, errors as they travel.
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <thread>

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/contract/error.h"
#include "server/main/credentials.h"
#include "server/main/healthcheck.h"
#include "server/rpc/services.h"
#include "tests/load/server_metrics.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::server {
namespace {

using grpc::health::v1::HealthCheckResponse;

HealthCheckResponse::ServingStatus Health(fixture::InProcess& server, const std::string& service) {
  grpc::ClientContext context;
  grpc::health::v1::HealthCheckRequest request;
  request.set_service(service);
  HealthCheckResponse response;
  const grpc::Status status =
      grpc::health::v1::Health::NewStub(server.channel())->Check(&context, request, &response);
  return status.ok() ? response.status() : HealthCheckResponse::UNKNOWN;
}

TEST(Serving, EveryServiceIsHealthyAndDescribed) {
  fixture::Script script;
  fixture::InProcess server(script.Make());
  EXPECT_EQ(Health(server, ""), HealthCheckResponse::SERVING);
  ASSERT_EQ(rpc::Services::Names().size(), 5U);
  for (const std::string& name : rpc::Services::Names()) {
    EXPECT_EQ(Health(server, name), HealthCheckResponse::SERVING) << name;
    EXPECT_NE(google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name), nullptr);
  }
  EXPECT_NE(google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
                "grpc.health.v1.Health"),
            nullptr);
  EXPECT_TRUE(CheckHealth(server.address()).ok());
}

// A plan, a watcher of its session and an upload, all under way when the server drains.
class Draining : public testing::Test {
 protected:
  // Drains while `read` reads its stream to the end.
  template <typename Read>
  void DrainWhile(Read read) {
    std::thread drain([&] { server_.Drain(); });
    read();
    drain.join();
  }

  fixture::Script script_;
  fixture::InProcess server_{script_.Make()};
  const std::string session_ = server_.OpenRoom("job");
};

TEST_F(Draining, APlanEndsWithItsBest) {
  grpc::ClientContext create_context;
  v1::CreatePlanRequest create;
  create.set_parent(session_);
  create.mutable_plan()->mutable_time_budget()->set_seconds(3000);
  v1::CreatePlanResponse created;
  ASSERT_TRUE(server_.plans->CreatePlan(&create_context, create, &created).ok());
  script_.WaitForPlans(1);
  grpc::ClientContext context;
  v1::WatchPlanRequest watch;
  watch.set_name(created.plan().name());
  const auto plan = server_.plans->WatchPlan(&context, watch);
  v1::WatchPlanResponse step;
  ASSERT_TRUE(plan->Read(&step));
  EXPECT_FALSE(step.last());
  DrainWhile([&] {
    while (plan->Read(&step)) {
    }
  });
  EXPECT_TRUE(plan->Finish().ok());
  EXPECT_TRUE(step.last());
  EXPECT_EQ(step.plan().state(), v1::PLAN_STATE_SUCCEEDED);
  EXPECT_EQ(step.plan().result().views_size(), 1);
}

TEST_F(Draining, AWatcherIsToldWhereToResume) {
  grpc::ClientContext context;
  v1::WatchSessionRequest watch;
  watch.set_name(session_);
  const auto events = server_.sessions->WatchSession(&context, watch);
  v1::WatchSessionResponse event;
  ASSERT_TRUE(events->Read(&event));
  uint64_t last = event.event().sequence();
  DrainWhile([&] {
    while (events->Read(&event)) {
      if (event.has_event()) last = event.event().sequence();
    }
  });
  ASSERT_GT(last, 0U);
  ASSERT_TRUE(event.has_resume());
  EXPECT_EQ(event.resume().after_sequence(), last);
  const grpc::Status status = events->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(fixture::InfoOf(status).reason(), "DRAINING");
}

TEST_F(Draining, AnUploadIsToldToComeAgain) {
  v1::CreateUploadRequest announce;
  announce.set_parent(session_);
  v1::CreateUploadResponse announced;
  grpc::ClientContext announce_context;
  ASSERT_TRUE(server_.scans->CreateUpload(&announce_context, announce, &announced).ok());
  grpc::ClientContext context;
  const auto upload = server_.scans->UploadScan(&context);
  v1::UploadScanRequest silent;
  silent.set_upload(announced.upload().name());
  ASSERT_TRUE(upload->Write(silent));
  v1::UploadScanResponse ack;
  ASSERT_TRUE(upload->Read(&ack));
  DrainWhile([&] {
    while (upload->Read(&ack)) {
    }
  });
  EXPECT_EQ(fixture::InfoOf(upload->Finish()).reason(), "DRAINING");
}

TEST_F(Draining, TheServerIsNoLongerHealthy) {
  ASSERT_TRUE(CheckHealth(server_.address()).ok());
  server_.Drain();
  EXPECT_FALSE(CheckHealth(server_.address()).ok());
}

TEST(Serving, NewWorkIsRefusedWhileDraining) {
  fixture::Script script;
  fixture::InProcess server(script.Make());
  const std::string session = server.OpenRoom("job");
  server.server().sessions().BeginDrain();
  grpc::ClientContext context;
  v1::CreatePlanRequest request;
  request.set_parent(session);
  v1::CreatePlanResponse response;
  const grpc::Status status = server.plans->CreatePlan(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(fixture::InfoOf(status).reason(), "DRAINING");
  // Reads still work.
  grpc::ClientContext get;
  v1::GetSessionRequest read;
  read.set_name(session);
  v1::GetSessionResponse got;
  EXPECT_TRUE(server.sessions->GetSession(&get, read, &got).ok());
}

TEST(Serving, SessionsPastTheirTimeAreCollected) {
  ServerOptions options;
  options.collect_every = std::chrono::milliseconds(5);
  options.limits.keep_sessions = absl::ZeroDuration();
  options.limits.second_look = absl::Milliseconds(20);
  fixture::Script script;
  fixture::InProcess server(script.Make(), options);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
  v1::WatchSessionRequest watch;
  watch.set_name(server.OpenSession("job"));
  const auto events = server.sessions->WatchSession(&context, watch);
  v1::WatchSessionResponse event;
  while (events->Read(&event)) {
  }
  EXPECT_EQ(events->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

ServerOptions WithMetrics() {
  ServerOptions options;
  options.http_listen = "127.0.0.1:0";
  return options;
}

// What the server says it has in memory; nothing where it does not say.
std::optional<double> ModelsLoaded(fixture::InProcess& server) {
  const std::map<std::string, double> metrics = load::ReadMetrics(server.server().http_port());
  const auto found = metrics.find("vantage_models_loaded");
  if (found == metrics.end()) return std::nullopt;
  return found->second;
}

// The figures are counted anew every so often: waits for one.
bool LoadedBecomes(double expected, fixture::InProcess& server) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (std::chrono::steady_clock::now() < until) {
    const std::optional<double> loaded = ModelsLoaded(server);
    if (!loaded.has_value()) return false;
    if (*loaded == expected) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

TEST(Serving, AModelInMemoryIsCounted) {
  fixture::Script script;
  fixture::InProcess server(script.Make(), WithMetrics());
  EXPECT_EQ(ModelsLoaded(server), 0.0);
  server.OpenRoom("job");
  EXPECT_TRUE(LoadedBecomes(1, server)) << ModelsLoaded(server).value_or(-1);
}

// However rarely the rest is collected.
TEST(Serving, IdleModelsAreEvictedInTime) {
  ServerOptions options = WithMetrics();
  options.limits.evict_after = absl::Seconds(1);
  fixture::Script script;
  fixture::InProcess server(script.Make(), options);
  server.OpenRoom("job");
  EXPECT_TRUE(LoadedBecomes(0, server)) << ModelsLoaded(server).value_or(-1);
  EXPECT_EQ(server.server().sessions().Totals().sessions, 1U);
}

TEST(Serving, LoopbackIsKnownByItsAddress) {
  for (const char* address :
       {"127.0.0.1:0", "127.9.9.9:7464", "localhost:1", "[::1]:7464", "unix:/tmp/x"}) {
    EXPECT_TRUE(IsLoopback(address)) << address;
  }
  for (const char* address : {"0.0.0.0:7464", "[::]:7464", "10.0.0.1:7464", "127.evil.com:1",
                              "127.0.0.1.evil.com:1", "localhost.evil.com:1"}) {
    EXPECT_FALSE(IsLoopback(address)) << address;
  }
}

TEST(Serving, OnlyLoopbackUnlessAskedForOutLoud) {
  store::MemoryStore store(1 << 20);
  telemetry::Log log = telemetry::Log::Silent();
  ServerOptions options;
  options.listen = {"0.0.0.0:0"};
  const auto server = Server::Start(options, store, log);
  EXPECT_TRUE(absl::IsInvalidArgument(server.status()));
}

// However much is wrong, the error's details stay below what a trailer may hold.
TEST(Serving, ErrorsFitTheTrailer) {
  fixture::Script script;
  fixture::InProcess server(script.Make());
  grpc::ClientContext context;
  v1::CreateSessionRequest request;
  for (int i = 0; i < 16; ++i) {
    v1::ScannerModel& scanner = *request.mutable_session()->add_scanner_models();
    scanner.set_id(std::string(10'000, 'X'));
    scanner.set_min_range_m(-1);
    scanner.set_max_range_m(-2);
    scanner.set_azimuth_step_rad(-1);
    scanner.set_max_incidence_rad(9);
  }
  v1::CreateSessionResponse response;
  const grpc::Status status = server.sessions->CreateSession(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_GE(fixture::ViolatedFields(status).size(), 10U);
  EXPECT_LT(status.error_details().size() + status.error_message().size(), 8192U);
}

TEST(Serving, AnOversizedMessageIsRefusedNotSwallowed) {
  fixture::Script script;
  fixture::InProcess server(script.Make());
  grpc::ClientContext context;
  v1::CreateSessionRequest request;
  request.mutable_session()->set_display_name(std::string(5 << 20, 'x'));
  v1::CreateSessionResponse response;
  EXPECT_EQ(server.sessions->CreateSession(&context, request, &response).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(CheckHealth(server.address()).ok());
}

}  // namespace
}  // namespace vantage::server
