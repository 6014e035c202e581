// Shared by the parts of the client: channel, stubs, deadlines, waiting.
#ifndef VANTAGE_CLIENT_LIBRARY_WIRE_H_
#define VANTAGE_CLIENT_LIBRARY_WIRE_H_

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <memory>
#include <random>
#include <string>

#include "absl/status/status.h"
#include "client/library/client_options.h"
#include "client/library/error.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "vantage/v1/fleet_service.grpc.pb.h"
#include "vantage/v1/model_service.grpc.pb.h"
#include "vantage/v1/plan_service.grpc.pb.h"
#include "vantage/v1/scan_service.grpc.pb.h"
#include "vantage/v1/session_service.grpc.pb.h"

namespace vantage::client {

struct Wire {
  explicit Wire(ClientOptions options);

  // To be called before every call: adds its deadline and credentials. An error when the options
  // cannot be met.
  absl::Status Prepare(grpc::ClientContext& context) const;

  // Waits so many seconds before another attempt, and gets a lost link back meanwhile: gRPC goes on
  // with a connection while somebody waits for it, and otherwise looks after it every 5 s only.
  void Wait(double seconds) const;

  ClientOptions options;
  absl::Status usable;  // why there is no usable channel
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SessionService::Stub> sessions;
  std::unique_ptr<v1::ScanService::Stub> scans;
  std::unique_ptr<v1::PlanService::Stub> plans;
  std::unique_ptr<v1::ModelService::Stub> model;
  std::unique_ptr<v1::FleetService::Stub> fleet;
  std::unique_ptr<grpc::health::v1::Health::Stub> health;

  absl::Status Failure(const grpc::Status& status) const { return FromRpc(status, options.server); }
};

using SteadyClock = std::chrono::steady_clock;

inline double SecondsSince(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

// For ClientContext::set_deadline.
std::chrono::system_clock::time_point DeadlineIn(double seconds);

void SleepSeconds(double seconds);

// 128 random bits in hexadecimal.
std::string NewRequestId();

uint64_t RandomSeed();

// True for failures that a new attempt may cure.
bool IsTransient(const absl::Status& status);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_WIRE_H_
