// A session is the fold of its log: loaded again from the store it is as it was.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "google/protobuf/util/message_differencer.h"
#include "server/contract/error.h"
#include "server/store/disk_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using google::protobuf::util::MessageDifferencer;

// The scan's name, when all is done.
std::string SendRoom(Session& session, const Eigen::Vector3d& position, const v1::PosePrior* prior,
                     const std::string& request_id) {
  const v1::Upload upload =
      fixture::SendScan(session, fixture::EncodedRoom(position), prior, request_id).value();
  session.WaitUntilIdle();
  return upload.scan();
}

class SessionReplayOnDisk : public testing::Test {
 protected:
  SessionReplayOnDisk() {
    std::string name = testing::TempDir() + "/replay-XXXXXX";
    folder_ = mkdtemp(name.data());
    Reopen();
  }
  ~SessionReplayOnDisk() override {
    store_.reset();
    std::filesystem::remove_all(folder_);
  }
  void Reopen() {
    store_.reset();
    store_ = store::DiskStore::Open(folder_).value();
  }

  std::string folder_;
  std::unique_ptr<store::DiskStore> store_;
};

// A job with a scan in every state, a rejection and a plan: as it was, and as it is once it was
// loaded again.
class ReplayedJob : public SessionReplayOnDisk {
 protected:
  ReplayedJob() {
    script_.EndPlans();
    {
      fixture::SessionHost first(*store_, script_.Make());
      const std::shared_ptr<Session> session = first.registry.Create(CreateRequest()).value();
      Work(*session);
      EXPECT_TRUE(first.registry.WaitUntilIdle(std::chrono::seconds(60)));
      before_ = Look(*session);
    }
    Reopen();
    second_ = std::make_unique<fixture::SessionHost>(*store_, script_.Make());
    EXPECT_TRUE(second_->registry.LoadAll().ok());
    session_ = second_->registry.Find("job").value();
    session_->WaitUntilIdle();
    after_ = Look(*session_);
  }
  ~ReplayedJob() override {
    session_.reset();
    second_.reset();
  }

  static v1::CreateSessionRequest CreateRequest() {
    v1::CreateSessionRequest create;
    create.set_session_id("job");
    create.set_request_id("r1");
    create.mutable_session()->mutable_origin()->set_x(1000);
    return create;
  }
  static v1::CreatePlanRequest PlanRequest() {
    v1::CreatePlanRequest plan;
    plan.set_request_id("p1");
    plan.mutable_plan()->set_work_limit_rays(1000);
    return plan;
  }

  struct Looked {
    v1::Session session;
    std::vector<v1::Scan> scans;
    std::vector<v1::Plan> plans;
    v1::PlanResult full_result;
    ModelSnapshot model;
  };

  fixture::Script script_;
  Looked before_;
  Looked after_;
  std::unique_ptr<fixture::SessionHost> second_;
  std::shared_ptr<Session> session_;  // of `second_`

 private:
  void Work(Session& session) {
    const v1::PosePrior at_first = fixture::PriorAt(1002.0, 1.5, 1.4);
    SendRoom(session, {2.0, 1.5, 1.4}, &at_first, "u1");
    const v1::PosePrior near = fixture::PriorAt(1003.0, 2.5, 1.4);
    SendRoom(session, {3.0, 2.5, 1.4}, &near, "u2");
    script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
    SendRoom(session, {1.0, 1.0, 1.4}, &near, "u3");
    script_.SetVerdict(registration::RegistrationOutcome::kRegistered);
    const std::string gone = SendRoom(session, {1.0, 2.0, 1.4}, &near, "u4");
    EXPECT_TRUE(session.scans().Withdraw(gone, {}).ok());
    session.WaitUntilIdle();
    v1::Rejection reject;
    reject.mutable_position()->set_x(1001);
    reject.set_radius_m(0.5);
    EXPECT_TRUE(session.rejections().Create(reject, std::nullopt, {}).ok());
    EXPECT_TRUE(session.plans().Create(PlanRequest()).ok());
  }
  static Looked Look(Session& session) {
    bool more = false;
    return {session.Describe(), session.scans().List("", 100, more).value(),
            session.plans().List("", 100, more).value(),
            session.plans().GetFullResult("sessions/job/plans/plan-1").value(),
            session.model().Current()};
  }
};

TEST_F(SessionReplayOnDisk, ADeletionThatIsAskedForAgainHasTheSameAnswer) {
  fixture::Script script;
  {
    fixture::SessionHost first(*store_, script.Make());
    fixture::OpenSession(first.registry, "job");
    fixture::OpenSession(first.registry, "other");
    ASSERT_TRUE(first.registry.Delete("job", "gone").ok());
  }
  Reopen();
  fixture::SessionHost second(*store_, script.Make());
  ASSERT_TRUE(second.registry.LoadAll().ok());
  EXPECT_TRUE(second.registry.Delete("job", "gone").ok());
  EXPECT_TRUE(absl::IsNotFound(second.registry.Delete("job", "again").status()));
  EXPECT_EQ(contract::ReasonOf(second.registry.Delete("other", "gone").status()),
            "REQUEST_ID_REUSED");
  EXPECT_TRUE(second.registry.Find("other").ok());
}

TEST_F(ReplayedJob, HasTheSameSession) {
  EXPECT_TRUE(MessageDifferencer::Equals(after_.session, before_.session))
      << after_.session.DebugString();
}

TEST_F(ReplayedJob, HasTheSameScans) {
  ASSERT_EQ(before_.scans.size(), 4u);
  EXPECT_EQ(before_.scans[2].state(), v1::SCAN_STATE_DOUBTFUL);
  EXPECT_EQ(before_.scans[3].state(), v1::SCAN_STATE_WITHDRAWN);
  ASSERT_EQ(after_.scans.size(), before_.scans.size());
  for (size_t i = 0; i < before_.scans.size(); ++i) {
    EXPECT_TRUE(MessageDifferencer::Equals(after_.scans[i], before_.scans[i]))
        << after_.scans[i].DebugString();
  }
}

TEST_F(ReplayedJob, HasTheSamePlans) {
  ASSERT_EQ(before_.plans.size(), 1u);
  ASSERT_EQ(after_.plans.size(), before_.plans.size());
  EXPECT_TRUE(MessageDifferencer::Equals(after_.plans[0], before_.plans[0]));
  EXPECT_TRUE(MessageDifferencer::Equals(after_.full_result, before_.full_result));
}

// It says the same of every voxel.
TEST_F(ReplayedJob, HasTheSameModel) {
  const ModelSnapshot& model = after_.model;
  EXPECT_EQ(model.version, before_.model.version);
  ASSERT_NE(model.view, nullptr);
  ASSERT_FALSE(model.view->bricks().empty());
  ASSERT_EQ(model.view->bricks().size(), before_.model.view->bricks().size());
  for (size_t i = 0; i < model.view->bricks().size(); ++i) {
    EXPECT_EQ(model.view->bricks()[i].brick, before_.model.view->bricks()[i].brick);
    EXPECT_EQ(model.view->bricks()[i].contents->state,
              before_.model.view->bricks()[i].contents->state);
  }
}

TEST_F(ReplayedJob, KnowsRequestsThatWereExecutedBefore) {
  EXPECT_EQ(session_->plans().Create(PlanRequest())->name(), "sessions/job/plans/plan-1");
  EXPECT_EQ(second_->registry.Create(CreateRequest()).value(), session_);
}

TEST_F(SessionReplayOnDisk, OpenUploadsGoOnAndLeftoversGo) {
  fixture::Script script;
  const std::string bytes = fixture::EncodedRoom({2.0, 1.5, 1.4});
  const size_t half = bytes.size() / 2;
  v1::UploadTotal total;
  total.set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
  total.set_sha256(bytes::Sha256::Of(bytes));
  std::string upload;
  {
    fixture::SessionHost first(*store_, script.Make());
    v1::CreateSessionRequest create;
    create.set_session_id("job");
    const auto session = first.registry.Create(create).value();
    upload = session->uploads().Create({}).value().name();
    v1::Piece piece;
    piece.set_data(bytes.substr(0, half));
    piece.set_crc32c(bytes::Crc32c(piece.data()));
    ASSERT_TRUE(session->uploads().Add(upload, &piece, &total).ok());
  }
  // As a crash between two steps leaves them.
  ASSERT_TRUE(store_->PutBlob("named by no log").ok());
  ASSERT_TRUE(store_->AppendSpool("sessions/gone/uploads/upload-1", "of no session").ok());
  Reopen();
  {
    fixture::SessionHost second(*store_, script.Make());
    ASSERT_TRUE(second.registry.LoadAll().ok());
    EXPECT_TRUE(absl::IsNotFound(store_->GetBlob(bytes::Sha256::Of("named by no log")).status()));
    EXPECT_EQ(store_->Spools().value(), std::vector<std::string>{upload});
    const auto session = second.registry.Find("job").value();
    EXPECT_EQ(session->uploads().Get(upload)->next_offset(), static_cast<int64_t>(half));
    v1::Piece rest;
    rest.set_sequence(1);
    rest.set_offset(static_cast<int64_t>(half));
    rest.set_data(bytes.substr(half));
    rest.set_crc32c(bytes::Crc32c(rest.data()));
    const auto done = session->uploads().Add(upload, &rest, nullptr);
    ASSERT_TRUE(done.ok()) << done.status();
    EXPECT_EQ(done->state(), v1::UPLOAD_STATE_COMMITTED);
    session->WaitUntilIdle();
    EXPECT_EQ(session->scans().Get(done->scan())->state(), v1::SCAN_STATE_MERGED);
  }
  EXPECT_TRUE(store_->Spools().value().empty());
}

// All pieces were stored, and the crash came before the scan was committed.
TEST_F(SessionReplayOnDisk, ACompleteUploadBecomesAScan) {
  fixture::Script script;
  const std::string bytes = fixture::EncodedRoom({2.0, 1.5, 1.4});
  std::string upload;
  {
    fixture::SessionHost first(*store_, script.Make());
    v1::CreateSessionRequest create;
    create.set_session_id("job");
    const auto session = first.registry.Create(create).value();
    v1::CreateUploadRequest request;
    request.mutable_upload()->mutable_total()->set_encoded_size_bytes(
        static_cast<int64_t>(bytes.size()));
    request.mutable_upload()->mutable_total()->set_sha256(bytes::Sha256::Of(bytes));
    upload = session->uploads().Create(request).value().name();
    storage::v1::SpoolRecord record;
    record.mutable_piece()->set_data(bytes);
    record.mutable_piece()->set_crc32c(bytes::Crc32c(bytes));
    ASSERT_TRUE(store_->AppendSpool(upload, record.SerializeAsString()).ok());
  }
  Reopen();
  fixture::SessionHost second(*store_, script.Make());
  ASSERT_TRUE(second.registry.LoadAll().ok());
  const auto session = second.registry.Find("job").value();
  session->WaitUntilIdle();
  EXPECT_EQ(session->uploads().Get(upload)->state(), v1::UPLOAD_STATE_COMMITTED);
  bool more = false;
  EXPECT_EQ(session->scans().List("", 10, more).value().size(), 1U);
}

TEST(SessionReplay, EntriesOfANewerFormatAreRefused) {
  SessionState state;
  storage::v1::LogEntry entry;
  entry.set_format_version(store::kLogFormatVersion + 1);
  entry.mutable_event()->set_sequence(1);
  entry.mutable_event()->mutable_session_created();
  EXPECT_TRUE(absl::IsFailedPrecondition(state.Apply(entry)));
  entry.set_format_version(store::kLogFormatVersion);
  EXPECT_TRUE(state.Apply(entry).ok());
  EXPECT_FALSE(state.Apply(entry).ok());  // twice
}

}  // namespace
}  // namespace vantage::session
