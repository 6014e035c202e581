// Places that people refused: listed, taken back, and all of it in the log.
#include "server/session/rejections.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

class RejectionsTest : public testing::Test {
 protected:
  v1::Rejection Refuse(double x, std::optional<absl::Duration> ttl = std::nullopt) {
    v1::Rejection wanted;
    wanted.mutable_position()->set_x(x);
    wanted.set_radius_m(0.5);
    return session_->rejections().Create(wanted, ttl, {}).value();
  }
  std::vector<int64_t> Listed(Session& session, size_t page = 2) {
    std::vector<int64_t> numbers;
    std::string after;
    for (bool more = true; more;) {
      const auto rejections = session.rejections().List(after, page, more).value();
      for (const v1::Rejection& rejection : rejections) {
        after = rejection.name();
        numbers.push_back(contract::NumberOf(after));
      }
    }
    return numbers;
  }

  std::atomic<int64_t> now_{1'700'000'000};
  store::MemoryStore store_{64 << 20};
  fixture::Script script_;
  fixture::SessionHost host_{
      store_, script_.Make(), {}, [this] { return absl::FromUnixSeconds(now_.load()); }};
  std::shared_ptr<Session> session_ = fixture::OpenSession(host_.registry, "job");
};

TEST_F(RejectionsTest, AreListedUntilTheyExpireOrAreTakenBack) {
  EXPECT_TRUE(Listed(*session_).empty());
  Refuse(1);
  const v1::Rejection second = Refuse(2);
  Refuse(3, absl::Minutes(5));
  Refuse(4);
  EXPECT_EQ(Listed(*session_), (std::vector<int64_t>{1, 2, 3, 4}));
  now_ += 600;
  EXPECT_EQ(Listed(*session_), (std::vector<int64_t>{1, 2, 4}));
  v1::DeleteRejectionRequest request;
  request.set_name(second.name());
  const RequestKey key = RequestKey::Of("once", "DeleteRejection", request);
  EXPECT_TRUE(session_->rejections().Delete(second.name(), key).ok());
  EXPECT_TRUE(session_->rejections().Delete(second.name(), key).ok()) << "the same request";
  EXPECT_TRUE(absl::IsNotFound(session_->rejections().Delete(second.name(), {})));
  EXPECT_TRUE(
      absl::IsNotFound(session_->rejections().Delete("sessions/job/rejections/rejection-3", {})))
      << "it has expired";
  EXPECT_EQ(Listed(*session_), (std::vector<int64_t>{1, 4}));
  // A number is never used again.
  EXPECT_EQ(Refuse(5).name(), "sessions/job/rejections/rejection-5");
  bool more = false;
  EXPECT_TRUE(absl::IsInvalidArgument(
      session_->rejections().List("sessions/job/rejections/rejection-9", 3, more).status()));

  fixture::SessionHost next(store_, script_.Make(), {},
                            [this] { return absl::FromUnixSeconds(now_.load()); });
  ASSERT_TRUE(next.registry.LoadAll().ok());
  EXPECT_EQ(Listed(*next.registry.Find("job").value()), (std::vector<int64_t>{1, 4, 5}));
}

}  // namespace
}  // namespace vantage::session
