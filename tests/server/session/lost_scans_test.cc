// A merged scan whose data are lost: scan, session and model say so, and nothing is shown as whole
// that is not.
#include "server/session/lost_scans.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "absl/strings/escaping.h"
#include "server/contract/error.h"
#include "server/store/disk_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class LostScansTest : public testing::Test {
 protected:
  LostScansTest() {
    std::string name = testing::TempDir() + "/lost-XXXXXX";
    folder_ = mkdtemp(name.data());
    script_.EndPlans();
    Start();
    session_ = fixture::OpenSession(host_->registry, "job");
    first_ = fixture::SendRoom(*session_, {2.0, 1.5, 1.4}).value();
    second_ = fixture::SendRoom(*session_, {3.0, 2.5, 1.4}).value();
    before_ = session_->model().Current();
    bricks_ = before_.view->bricks().size();
  }
  ~LostScansTest() override {
    session_.reset();
    host_.reset();
    store_.reset();
    fs::remove_all(folder_);
  }

  void Start() {
    session_.reset();
    host_.reset();
    store_.reset();
    store_ = store::DiskStore::Open(folder_).value();
    host_ = std::make_unique<fixture::SessionHost>(*store_, script_.Make());
    ASSERT_TRUE(host_->registry.LoadAll().ok());
    if (const auto session = host_->registry.Find("job"); session.ok()) session_ = *session;
    if (session_ != nullptr) session_->WaitUntilIdle();
  }
  fs::path FileOf(const std::string& scan) {
    const std::string name = absl::BytesToHexString(session_->scans().Get(scan)->sha256());
    return fs::path(folder_) / "blobs" / name.substr(0, 2) / (name + ".pieces");
  }
  fs::path Aside() const { return fs::path(folder_) / "aside"; }
  void DropSnapshots() {
    const auto snapshots = store_->Snapshots("job").value();
    for (const store::SnapshotRecord& snapshot : snapshots) {
      ASSERT_TRUE(store_->DropSnapshot("job", snapshot.sequence).ok());
    }
  }
  static bool Lost(const Session& session, const std::string& scan) {
    return session.Describe().lost_scans_size() == 1 && session.Describe().lost_scans(0) == scan;
  }
  absl::Status Plan() {
    v1::CreatePlanRequest plan;
    plan.mutable_plan()->set_work_limit_rays(1000);
    absl::Status made = session_->plans().Create(plan).status();
    EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
    return made;
  }

  std::string folder_;
  fixture::Script script_;
  std::unique_ptr<store::DiskStore> store_;
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
  std::string first_;
  std::string second_;
  ModelSnapshot before_;
  size_t bricks_ = 0;
};

TEST_F(LostScansTest, TheModelIsNotShownSmallerThanItsVersionSays) {
  const fs::path file = FileOf(second_);
  fs::rename(file, Aside());
  DropSnapshots();
  Start();
  const v1::Scan scan = session_->scans().Get(second_).value();
  EXPECT_EQ(scan.state(), v1::SCAN_STATE_MERGED);
  EXPECT_TRUE(scan.data_lost());
  EXPECT_THAT(scan.state_message(), HasSubstr("lost"));
  EXPECT_FALSE(session_->scans().Get(first_)->data_lost());
  EXPECT_THAT(session_->DescribeWithRejections().lost_scans(), ElementsAre(second_));
  EXPECT_EQ(session_->model().Current().view, nullptr);
  for (const absl::Status& said : {session_->MeasureCoverage().status(), Plan()}) {
    EXPECT_TRUE(absl::IsDataLoss(said)) << said;
    EXPECT_EQ(contract::ReasonOf(said), "DATA_LOST");
    EXPECT_THAT(std::string(said.message()), HasSubstr(second_));
    EXPECT_THAT(std::string(said.message()), Not(HasSubstr(first_)));
  }
  // What comes meanwhile waits, and is not aligned to less than the model is.
  const v1::PosePrior prior = fixture::PriorAt(1.0, 2.0, 1.4);
  const std::string third =
      fixture::SendScan(*session_, fixture::EncodedRoom({1.0, 2.0, 1.4}, 3.0), &prior)->scan();
  session_->WaitUntilIdle();
  EXPECT_EQ(session_->scans().Get(third)->state(), v1::SCAN_STATE_RECEIVED);
  EXPECT_THAT(session_->scans().Get(third)->state_message(), HasSubstr(second_));
  ASSERT_TRUE(session_->scans().Withdraw(third, {}).ok());
  session_->WaitUntilIdle();

  // Put back, it is what it was, under the same version.
  fs::rename(Aside(), file);
  Start();
  EXPECT_FALSE(session_->scans().Get(second_)->data_lost());
  EXPECT_TRUE(session_->Describe().lost_scans().empty());
  const ModelSnapshot again = session_->model().Current();
  ASSERT_NE(again.view, nullptr);
  EXPECT_EQ(again.version, before_.version);
  EXPECT_EQ(again.view->bricks().size(), bricks_);
  EXPECT_EQ(again.view->stations().size(), 2U);
}

TEST_F(LostScansTest, WithdrawnTheModelGoesOnWithoutIt) {
  fs::remove(FileOf(second_));
  DropSnapshots();
  Start();
  ASSERT_TRUE(session_->scans().Withdraw(second_, {}).ok());
  session_->WaitUntilIdle();
  const ModelSnapshot without = session_->model().Current();
  ASSERT_NE(without.view, nullptr);
  EXPECT_EQ(without.version, before_.version + 1);
  EXPECT_EQ(without.view->stations().size(), 1U);
  EXPECT_TRUE(session_->MeasureCoverage().ok());
  EXPECT_TRUE(Plan().ok());
  // Also after a restart.
  Start();
  EXPECT_EQ(session_->model().Current().version, without.version);
  EXPECT_TRUE(session_->MeasureCoverage().ok());
}

// Where a snapshot has what it says, nothing is missing but the scan itself; and it stays.
TEST_F(LostScansTest, ASnapshotKeepsWhatAModelKnowsOfIt) {
  fs::remove(FileOf(second_));
  Start();
  EXPECT_TRUE(Lost(*session_, second_));
  EXPECT_EQ(session_->model().Current().version, before_.version);
  EXPECT_EQ(session_->model().Current().view->bricks().size(), bricks_);
  EXPECT_TRUE(session_->MeasureCoverage().ok());
  EXPECT_EQ(contract::ReasonOf(session_->scans().LoadImage(second_).status()), "SCAN_LOST");
  const absl::Status moved =
      session_->scans().SetPose(second_, fixture::PriorAt(3.0, 2.5, 1.4), true, {}).status();
  EXPECT_EQ(contract::ReasonOf(moved), "SCAN_LOST");
  EXPECT_EQ(session_->scans().Get(second_)->state(), v1::SCAN_STATE_MERGED);
}

TEST_F(LostScansTest, DamageIsLossAndIsNotedWhenItIsRead) {
  const fs::path file = FileOf(second_);
  fs::copy_file(file, Aside());
  fs::resize_file(file, fs::file_size(file) / 2);
  EXPECT_FALSE(session_->scans().Get(second_)->data_lost()) << "nobody has looked";
  const absl::Status read = session_->scans().LoadImage(second_).status();
  EXPECT_TRUE(absl::IsDataLoss(read)) << read;
  EXPECT_EQ(contract::ReasonOf(read), "SCAN_LOST");
  EXPECT_TRUE(session_->scans().Get(second_)->data_lost());
  EXPECT_TRUE(Lost(*session_, second_));
  fs::remove(file);
  fs::rename(Aside(), file);
  EXPECT_TRUE(session_->scans().LoadImage(second_).ok());
  EXPECT_FALSE(session_->scans().Get(second_)->data_lost());
}

}  // namespace
}  // namespace vantage::session
