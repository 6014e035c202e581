// A session is the fold of its log: loaded again from the store it is as it was.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "google/protobuf/util/message_differencer.h"
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

TEST_F(SessionReplayOnDisk, GivesTheSameSessionScansPlansAndModel) {
  fixture::Script script;
  script.EndPlans();
  v1::Session session_before;
  std::vector<v1::Scan> scans_before;
  std::vector<v1::Plan> plans_before;
  v1::PlanResult full_before;
  ModelSnapshot model_before;
  {
    fixture::SessionHost first(*store_, script.Make());
    v1::CreateSessionRequest create;
    create.set_session_id("job");
    create.set_request_id("r1");
    create.mutable_session()->mutable_origin()->set_x(1000);
    const auto session = first.registry.Create(create).value();
    const v1::PosePrior at_first = fixture::PriorAt(1002.0, 1.5, 1.4);
    SendRoom(*session, {2.0, 1.5, 1.4}, &at_first, "u1");
    const v1::PosePrior near = fixture::PriorAt(1003.0, 2.5, 1.4);
    SendRoom(*session, {3.0, 2.5, 1.4}, &near, "u2");
    script.SetVerdict(registration::RegistrationOutcome::kDoubtful);
    const std::string doubtful = SendRoom(*session, {1.0, 1.0, 1.4}, &near, "u3");
    EXPECT_EQ(session->scans().Get(doubtful)->state(), v1::SCAN_STATE_DOUBTFUL);
    script.SetVerdict(registration::RegistrationOutcome::kRegistered);
    const std::string gone = SendRoom(*session, {1.0, 2.0, 1.4}, &near, "u4");
    ASSERT_TRUE(session->scans().Withdraw(gone, {}).ok());
    session->WaitUntilIdle();
    v1::Rejection reject;
    reject.mutable_position()->set_x(1001);
    reject.set_radius_m(0.5);
    ASSERT_TRUE(session->rejections().Create(reject, std::nullopt, {}).ok());
    v1::CreatePlanRequest plan;
    plan.set_request_id("p1");
    plan.mutable_plan()->set_work_limit_rays(1000);
    ASSERT_TRUE(session->plans().Create(plan).ok());
    ASSERT_TRUE(first.registry.WaitUntilIdle(std::chrono::seconds(60)));

    session_before = session->Describe();
    bool more = false;
    scans_before = session->scans().List("", 100, more).value();
    plans_before = session->plans().List("", 100, more).value();
    full_before = session->plans().GetFullResult("sessions/job/plans/plan-1").value();
    model_before = session->model().Current();
  }
  Reopen();
  fixture::SessionHost second(*store_, script.Make());
  ASSERT_TRUE(second.registry.LoadAll().ok());
  const auto session = second.registry.Find("job").value();
  session->WaitUntilIdle();
  EXPECT_TRUE(MessageDifferencer::Equals(session->Describe(), session_before));
  bool more = false;
  const auto scans = session->scans().List("", 100, more).value();
  ASSERT_EQ(scans.size(), scans_before.size());
  for (size_t i = 0; i < scans.size(); ++i) {
    EXPECT_TRUE(MessageDifferencer::Equals(scans[i], scans_before[i])) << scans[i].DebugString();
  }
  const auto plans = session->plans().List("", 100, more).value();
  ASSERT_EQ(plans.size(), plans_before.size());
  EXPECT_TRUE(MessageDifferencer::Equals(plans[0], plans_before[0]));
  EXPECT_TRUE(MessageDifferencer::Equals(
      session->plans().GetFullResult("sessions/job/plans/plan-1").value(), full_before));

  // The model says the same of every voxel.
  const ModelSnapshot model = session->model().Current();
  EXPECT_EQ(model.version, model_before.version);
  ASSERT_NE(model.view, nullptr);
  ASSERT_EQ(model.view->bricks().size(), model_before.view->bricks().size());
  for (size_t i = 0; i < model.view->bricks().size(); ++i) {
    EXPECT_EQ(model.view->bricks()[i].brick, model_before.view->bricks()[i].brick);
    EXPECT_EQ(model.view->bricks()[i].contents->state,
              model_before.view->bricks()[i].contents->state);
  }

  // Requests that were executed before are known.
  v1::CreatePlanRequest plan;
  plan.set_request_id("p1");
  plan.mutable_plan()->set_work_limit_rays(1000);
  EXPECT_EQ(session->plans().Create(plan)->name(), "sessions/job/plans/plan-1");
  v1::CreateSessionRequest create;
  create.set_session_id("job");
  create.set_request_id("r1");
  create.mutable_session()->mutable_origin()->set_x(1000);
  EXPECT_EQ(second.registry.Create(create).value(), session);
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
