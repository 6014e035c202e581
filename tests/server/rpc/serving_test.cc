// The server as a whole: health, reflection, draining, addresses, errors as they travel.
#include <gtest/gtest.h>

#include <chrono>
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

namespace vantage::rpc {
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
  ASSERT_EQ(Services::Names().size(), 5U);
  for (const std::string& name : Services::Names()) {
    EXPECT_EQ(Health(server, name), HealthCheckResponse::SERVING) << name;
    EXPECT_NE(google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name), nullptr);
  }
  EXPECT_NE(google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
                "grpc.health.v1.Health"),
            nullptr);
  EXPECT_TRUE(server::CheckHealth(server.address()).ok());
}

// Plans end with their best, watchers are told where to resume, uploads that the rest stays.
TEST(Serving, DrainEndsEverythingInOrder) {
  fixture::Script script;
  fixture::InProcess server(script.Make());
  const std::string session = server.OpenRoom("job");

  grpc::ClientContext plan_context;
  v1::CreatePlanRequest create;
  create.set_parent(session);
  create.mutable_plan()->mutable_time_budget()->set_seconds(3000);
  v1::CreatePlanResponse created;
  ASSERT_TRUE(server.plans->CreatePlan(&plan_context, create, &created).ok());
  script.WaitForPlans(1);
  grpc::ClientContext watch_plan_context;
  v1::WatchPlanRequest watch_plan;
  watch_plan.set_name(created.plan().name());
  const auto plan = server.plans->WatchPlan(&watch_plan_context, watch_plan);
  v1::WatchPlanResponse plan_step;
  ASSERT_TRUE(plan->Read(&plan_step));

  grpc::ClientContext watch_context;
  v1::WatchSessionRequest watch;
  watch.set_name(session);
  const auto events = server.sessions->WatchSession(&watch_context, watch);
  v1::WatchSessionResponse event;
  ASSERT_TRUE(events->Read(&event));

  grpc::ClientContext upload_context;
  const auto upload = server.scans->UploadScan(&upload_context);
  v1::UploadScanRequest silent;
  v1::CreateUploadRequest announce;
  announce.set_parent(session);
  v1::CreateUploadResponse announced;
  grpc::ClientContext announce_context;
  ASSERT_TRUE(server.scans->CreateUpload(&announce_context, announce, &announced).ok());
  silent.set_upload(announced.upload().name());
  ASSERT_TRUE(upload->Write(silent));
  v1::UploadScanResponse ack;
  ASSERT_TRUE(upload->Read(&ack));

  std::thread drain([&] { server.Drain(); });
  while (plan->Read(&plan_step)) {
  }
  EXPECT_TRUE(plan->Finish().ok());
  EXPECT_TRUE(plan_step.last());
  EXPECT_EQ(plan_step.plan().state(), v1::PLAN_STATE_SUCCEEDED);
  EXPECT_EQ(plan_step.plan().result().views_size(), 1);

  uint64_t last = 0;
  while (events->Read(&event)) {
    if (event.has_event()) last = event.event().sequence();
  }
  ASSERT_TRUE(event.has_resume());
  EXPECT_EQ(event.resume().after_sequence(), last);
  const grpc::Status watched = events->Finish();
  EXPECT_EQ(watched.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(fixture::InfoOf(watched).reason(), "DRAINING");

  while (upload->Read(&ack)) {
  }
  EXPECT_EQ(fixture::InfoOf(upload->Finish()).reason(), "DRAINING");
  drain.join();
  EXPECT_FALSE(server::CheckHealth(server.address()).ok());
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
  server::ServerOptions options;
  options.collect_every = std::chrono::milliseconds(5);
  options.limits.keep_sessions = absl::ZeroDuration();
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

// However rarely the rest is collected.
TEST(Serving, IdleModelsAreEvictedInTime) {
  server::ServerOptions options;
  options.http_listen = "127.0.0.1:0";
  options.limits.evict_after = absl::Seconds(1);
  fixture::Script script;
  fixture::InProcess server(script.Make(), options);
  server.OpenRoom("job");
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  double loaded = 1;
  while (loaded > 0 && std::chrono::steady_clock::now() < until) {
    loaded = load::ReadMetrics(server.server().http_port())["vantage_models_loaded"];
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(loaded, 0);
}

TEST(Serving, OnlyLoopbackUnlessAskedForOutLoud) {
  for (const char* address :
       {"127.0.0.1:0", "127.9.9.9:7464", "localhost:1", "[::1]:7464", "unix:/tmp/x"}) {
    EXPECT_TRUE(server::IsLoopback(address)) << address;
  }
  for (const char* address : {"0.0.0.0:7464", "[::]:7464", "10.0.0.1:7464", "127.evil.com:1",
                              "127.0.0.1.evil.com:1", "localhost.evil.com:1"}) {
    EXPECT_FALSE(server::IsLoopback(address)) << address;
  }
  store::MemoryStore store(1 << 20);
  telemetry::Log log(telemetry::LogLevel::kOff, telemetry::Log::Stderr());
  server::ServerOptions options;
  options.listen = "0.0.0.0:0";
  const auto server = server::Server::Start(options, store, log);
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
  EXPECT_TRUE(server::CheckHealth(server.address()).ok());
}

}  // namespace
}  // namespace vantage::rpc
