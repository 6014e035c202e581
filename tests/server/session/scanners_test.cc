// A fleet's scanners: changed, taken out, and all of it in the log.
#include "server/session/scanners.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <vector>

#include "server/contract/error.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr char kRed[] = "sessions/job/scanners/red";

class ScannersTest : public testing::Test {
 protected:
  absl::StatusOr<v1::Scanner> Add(const std::string& id) {
    v1::CreateScannerRequest request;
    request.set_scanner_id(id);
    request.mutable_scanner()->set_operator_("Ann");
    request.mutable_scanner()->add_reach()->mutable_max()->set_x(1);
    return session_->scanners().Create(request);
  }
  absl::StatusOr<v1::Scanner> Update(const std::string& name, const v1::Scanner& to,
                                     const std::vector<std::string>& fields,
                                     const std::string& request_id = "") {
    v1::UpdateScannerRequest request;
    *request.mutable_scanner() = to;
    request.mutable_scanner()->set_name(name);
    for (const std::string& field : fields) request.mutable_update_mask()->add_paths(field);
    request.set_request_id(request_id);
    return session_->scanners().Update(request);
  }
  absl::Status Delete(const std::string& name) { return session_->scanners().Delete(name, {}); }
  static std::vector<std::string> Listed(Session& session, size_t page) {
    std::vector<std::string> names;
    std::string after;
    for (bool more = true; more;) {
      const std::vector<v1::Scanner> scanners = session.scanners().List(after, page, more).value();
      for (const v1::Scanner& scanner : scanners) names.push_back(after = scanner.name());
    }
    return names;
  }

  store::MemoryStore store_{64 << 20};
  fixture::Script script_;
  contract::Limits limits_ = [] {
    contract::Limits limits;
    limits.scanners_per_session = 3;
    limits.scanners_ever = 5;
    return limits;
  }();
  fixture::SessionHost host_{store_, script_.Make(), limits_};
  std::shared_ptr<Session> session_ = fixture::OpenSession(host_.registry, "job");
};

TEST_F(ScannersTest, OnlyWhatTheMaskNamesChanges) {
  ASSERT_TRUE(Add("red").ok());
  v1::Scanner wanted;
  wanted.set_display_name("the red one");
  wanted.set_operator_("Bob");
  wanted.set_speed_m_per_s(2);
  const v1::Scanner changed = Update(kRed, wanted, {"display_name", "reach"}, "r").value();
  EXPECT_EQ(changed.display_name(), "the red one");
  EXPECT_EQ(changed.operator_(), "Ann");
  EXPECT_EQ(changed.speed_m_per_s(), 1);
  EXPECT_EQ(changed.reach_size(), 0) << "named, and not given";
  EXPECT_TRUE(changed.has_create_time());
  // A field that has a default gets it again.
  v1::Scanner fast;
  fast.set_speed_m_per_s(3);
  EXPECT_EQ(Update(kRed, fast, {"speed_m_per_s"})->speed_m_per_s(), 3);
  EXPECT_EQ(Update(kRed, {}, {"speed_m_per_s"})->speed_m_per_s(), 1);
  EXPECT_EQ(Update(kRed, wanted, {"display_name", "reach"}, "r")->speed_m_per_s(), 1)
      << "the same request again";
  v1::Scanner other;
  other.set_scanner_model_id("none");
  EXPECT_THAT(Update(kRed, other, {"scanner_model_id"}).status().message(),
              HasSubstr("none of the session's scanner models"));
  EXPECT_TRUE(
      absl::IsNotFound(Update("sessions/job/scanners/blue", wanted, {"operator"}).status()));

  fixture::SessionHost next(store_, script_.Make());
  ASSERT_TRUE(next.registry.LoadAll().ok());
  EXPECT_EQ(next.registry.Find("job").value()->scanners().Get(kRed)->display_name(), "the red one");
}

TEST_F(ScannersTest, OneThatWasTakenOutIsGoneAndItsIdIsNotGivenAgain) {
  for (const char* id : {"red", "blue", "green"}) ASSERT_TRUE(Add(id).ok());
  EXPECT_EQ(contract::ReasonOf(Add("white").status()), "TOO_MANY_SCANNERS");
  bool more = false;
  ASSERT_TRUE(Delete("sessions/job/scanners/blue").ok());
  EXPECT_TRUE(absl::IsNotFound(Delete("sessions/job/scanners/blue")));
  EXPECT_TRUE(absl::IsNotFound(session_->scanners().Get("sessions/job/scanners/blue").status()));
  EXPECT_THAT(Listed(*session_, 1), ElementsAre(kRed, "sessions/job/scanners/green"));
  // A page that began after it goes on where it was.
  EXPECT_EQ(session_->scanners().List("sessions/job/scanners/blue", 9, more)->front().name(),
            "sessions/job/scanners/green");
  const absl::Status again = Add("blue").status();
  EXPECT_EQ(contract::ReasonOf(again), "SCANNER_EXISTS");
  EXPECT_THAT(again.message(), HasSubstr("was deleted"));
  EXPECT_TRUE(Add("").ok());

  fixture::SessionHost next(store_, script_.Make(), limits_);
  ASSERT_TRUE(next.registry.LoadAll().ok());
  session_ = next.registry.Find("job").value();
  EXPECT_EQ(Listed(*session_, 2).size(), 3U);
  EXPECT_EQ(contract::ReasonOf(Add("blue").status()), "TOO_MANY_SCANNERS");
  ASSERT_TRUE(Delete(kRed).ok());
  EXPECT_EQ(contract::ReasonOf(Add("blue").status()), "SCANNER_EXISTS");
  ASSERT_TRUE(Add("white").ok());
  ASSERT_TRUE(Delete("sessions/job/scanners/white").ok());
  EXPECT_THAT(std::string(Add("black").status().message()), HasSubstr("has had 5"));
}

TEST_F(ScannersTest, OneThatIsInUseStays) {
  ASSERT_TRUE(Add("red").ok());
  v1::UploadTotal total;
  total.set_encoded_size_bytes(100);
  total.set_sha256(std::string(32, 'x'));
  v1::CreateUploadRequest upload;
  upload.mutable_upload()->set_scanner(kRed);
  *upload.mutable_upload()->mutable_total() = total;
  const std::string under_way = session_->uploads().Create(upload)->name();
  const absl::Status refused = Delete(kRed);
  EXPECT_EQ(contract::ReasonOf(refused), "SCANNER_IN_USE");
  EXPECT_THAT(refused.message(), HasSubstr(under_way));
  ASSERT_TRUE(session_->uploads().Abort(under_way, {}).ok());

  v1::CreateStationRequest station;
  station.mutable_station()->set_scanner(kRed);
  station.mutable_station()->mutable_position()->set_x(2);
  std::promise<absl::StatusOr<v1::CreateStationResponse>> answer;
  session_->stations().Create(station, [&](const absl::StatusOr<v1::CreateStationResponse>& made) {
    answer.set_value(made);
  });
  const std::string waits = answer.get_future().get()->station().name();
  EXPECT_THAT(Delete(kRed).message(), HasSubstr(waits));
  v1::ListStationsRequest of_red;
  of_red.set_scanner(kRed);
  bool more = false;
  EXPECT_EQ(session_->stations().List("", 9, more, of_red)->size(), 1U);
  of_red.set_scanner("sessions/job/scanners/blue");
  EXPECT_TRUE(session_->stations().List("", 9, more, of_red)->empty());
  ASSERT_TRUE(session_->stations().Delete(waits, {}).ok());
  EXPECT_TRUE(Delete(kRed).ok());
}

}  // namespace
}  // namespace vantage::session
