// A server that loads a model first is waited for, and says so meanwhile.
#include <gmock/gmock.h>
#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/command.h"
#include "client/library/client.h"
#include "client/library/error.h"
#include "core/bytes/checksum.h"
#include "vantage/v1/model_service.grpc.pb.h"

namespace vantage::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Loads for so many calls.
class LoadingServer final : public v1::ModelService::Service {
 public:
  explicit LoadingServer(int calls) : left_(calls) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~LoadingServer() override { server_->Shutdown(); }

  ClientOptions Options() const {
    ClientOptions options;
    options.server = absl::StrCat("127.0.0.1:", port_);
    options.attempts = 2;  // fewer than it loads for
    return options;
  }

  grpc::Status GetCoverage(grpc::ServerContext*, const v1::GetCoverageRequest*,
                           v1::GetCoverageResponse* response) override {
    if (--left_ >= 0) return Loading();
    response->mutable_coverage()->set_estimated_coverage(0.5);
    return grpc::Status::OK;
  }

  grpc::Status ExportModel(grpc::ServerContext*, const v1::ExportModelRequest*,
                           grpc::ServerWriter<v1::ExportModelResponse>* writer) override {
    if (--left_ >= 0) return Loading();
    v1::ExportModelResponse piece;
    piece.set_data("model");
    piece.set_crc32c(bytes::Crc32c("model"));
    piece.set_total_size_bytes(5);
    writer->Write(piece);
    return grpc::Status::OK;
  }

 private:
  static grpc::Status Loading() {
    google::rpc::ErrorInfo info;
    info.set_reason("MODEL_LOADING");
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_nanos(1'000'000);
    google::rpc::Status status;
    status.set_code(grpc::StatusCode::UNAVAILABLE);
    status.set_message("the model of sessions/s is being loaded");
    status.add_details()->PackFrom(info);
    status.add_details()->PackFrom(retry);
    return {grpc::StatusCode::UNAVAILABLE, status.message(), status.SerializeAsString()};
  }

  std::atomic<int> left_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

TEST(LoadingWait, AModelThatIsBeingLoadedIsWaitedForAndTold) {
  const LoadingServer server(5);
  ClientOptions options = server.Options();
  std::vector<std::optional<double>> told;
  options.on_loading = [&](std::optional<double> seconds) { told.push_back(seconds); };
  Client client(options);
  const auto got = client.Call(v1::GetCoverageRequest());
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(got->coverage().estimated_coverage(), 0.5);
  ASSERT_EQ(told.size(), 6u);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(told[static_cast<size_t>(i)].has_value()) << i;
  EXPECT_EQ(told.back(), std::nullopt);
}

TEST(LoadingWait, AnExportBeginsWhenTheModelIsThere) {
  const LoadingServer server(3);
  Client client(server.Options());
  std::string bytes;
  ExportProgress last;
  const auto name = client.Export(
      v1::ExportModelRequest(),
      [&](absl::string_view piece) {
        bytes.append(piece.data(), piece.size());
        return absl::OkStatus();
      },
      [&](const ExportProgress& progress) { last = progress; });
  ASSERT_TRUE(name.ok()) << name.status();
  EXPECT_EQ(bytes, "model");
  EXPECT_EQ(last.received_bytes, 5);
  EXPECT_EQ(last.total_bytes, 5);
}

TEST(LoadingWait, WhatTakesTooLongIsNoReasonToStartTheServer) {
  const LoadingServer server(1'000'000);
  ClientOptions options = server.Options();
  options.loading_patience = 0.2;
  Client client(options);
  const auto got = client.Call(v1::GetCoverageRequest());
  ASSERT_FALSE(got.ok());
  const Explanation why = Explain(got.status());
  EXPECT_EQ(why.reason, "MODEL_LOADING");
  EXPECT_THAT(why.cause, HasSubstr("is being loaded"));
  EXPECT_THAT(why.fix, Not(HasSubstr("start the server")));
  EXPECT_THAT(why.fix, HasSubstr("try again"));
  EXPECT_EQ(cli::ExitCodeOf(got.status()), cli::ExitCode::kTryAgain);
}

}  // namespace
}  // namespace vantage::client
