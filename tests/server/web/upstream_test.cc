#include "server/web/upstream.h"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "tests/server/web/endless_server.h"

namespace vantage::web {
namespace {

TEST(Upstream, NothingIsFetchedThatNobodyAskedFor) {
  EndlessServer server(1000);
  std::promise<grpc::Status> done;
  std::atomic<int> messages{0};
  std::promise<void> third;
  std::shared_ptr<Upstream> call;
  call = CallStream(
      server.channel(), {"/any/Stream", {}, std::nullopt, "request"},
      [&](const std::string& message) {
        EXPECT_EQ(message.size(), 1000);
        if (++messages == 3) return third.set_value();
        call->Next();
      },
      [&](const grpc::Status& status) { done.set_value(status); });
  call->Next();
  third.get_future().wait();
  // One more may be written, and wait for somebody to read it.
  EXPECT_LE(server.written(), 4);
  call->Cancel();
  call->Cancel();
  EXPECT_EQ(done.get_future().get().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(messages, 3);
  server.WaitForEnd();
}

TEST(Upstream, ACallThatIsCancelledWhileAMessageIsOnItsWayEnds) {
  for (int i = 0; i < 200; ++i) {
    EndlessServer server(10);
    std::promise<grpc::Status> done;
    const std::shared_ptr<Upstream> call = CallStream(
        server.channel(), {"/any/Stream", {}, std::nullopt, ""}, [](const std::string&) {},
        [&](const grpc::Status& status) { done.set_value(status); });
    call->Next();
    call->Cancel();
    done.get_future().wait();
    server.WaitForEnd();
  }
}

TEST(Upstream, ADeadlineEndsAStream) {
  EndlessServer server(10);
  std::promise<grpc::Status> done;
  std::shared_ptr<Upstream> call;
  call = CallStream(
      server.channel(), {"/any/Stream", {}, std::chrono::milliseconds(50), ""},
      [&](const std::string&) { call->Next(); },
      [&](const grpc::Status& status) { done.set_value(status); });
  call->Next();
  EXPECT_EQ(done.get_future().get().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

}  // namespace
}  // namespace vantage::web
