// A restart begins with a snapshot of the model; the model is the same after it, whatever happens
// to the snapshots.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "absl/strings/escaping.h"
#include "server/store/disk_store.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

contract::Limits Keeping(size_t snapshots) {
  contract::Limits limits;
  limits.snapshots_per_session = snapshots;
  return limits;
}

void Withdraw(Session& session, const std::string& scan) {
  ASSERT_TRUE(session.scans().Withdraw(scan, {}).ok());
  session.WaitUntilIdle();
}

void ExpectSame(const ModelSnapshot& model, const ModelSnapshot& before) {
  EXPECT_EQ(model.version, before.version);
  ASSERT_NE(model.view, nullptr);
  ASSERT_EQ(model.view->bricks().size(), before.view->bricks().size());
  for (size_t i = 0; i < model.view->bricks().size(); ++i) {
    const model::Brick& brick = *model.view->bricks()[i].contents;
    const model::Brick& other = *before.view->bricks()[i].contents;
    EXPECT_EQ(model.view->bricks()[i].brick, before.view->bricks()[i].brick);
    EXPECT_EQ(brick.state, other.state);
    ASSERT_EQ(brick.surface.size(), other.surface.size());
    for (size_t k = 0; k < brick.surface.size(); ++k) {
      EXPECT_EQ(brick.surface[k].centroid, other.surface[k].centroid);
      EXPECT_EQ(brick.surface[k].normal, other.surface[k].normal);
      EXPECT_EQ(brick.surface[k].density, other.surface[k].density);
    }
  }
  ASSERT_EQ(model.view->stations().size(), before.view->stations().size());
  for (size_t i = 0; i < model.view->stations().size(); ++i) {
    EXPECT_EQ(model.view->stations()[i].position, before.view->stations()[i].position);
  }
}

class SessionSnapshots : public testing::Test {
 protected:
  SessionSnapshots() {
    std::string name = testing::TempDir() + "/snapshots-XXXXXX";
    folder_ = mkdtemp(name.data());
    Reopen();
    script_.EndPlans();
  }
  ~SessionSnapshots() override {
    store_.reset();
    std::filesystem::remove_all(folder_);
  }
  void Reopen() {
    store_.reset();
    store_ = store::DiskStore::Open(folder_).value();
  }
  std::string FileOf(const std::string& blob) const {
    const std::string name = absl::BytesToHexString(blob);
    return folder_ + "/blobs/" + name.substr(0, 2) + "/" + name;
  }
  void Damage(const std::string& blob) const {
    std::fstream file(FileOf(blob), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(200);
    file.put('!');
    ASSERT_TRUE(file.good());
  }

  // Three scans, the second withdrawn again; what the model is then.
  ModelSnapshot MakeJob(size_t snapshots = 2) {
    fixture::SessionHost first(*store_, script_.Make(), Keeping(snapshots));
    v1::CreateSessionRequest create;
    create.set_session_id("job");
    create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
    const auto session = first.registry.Create(create).value();
    first_scan_ = fixture::SendRoom(*session, {2.0, 1.5, 1.4}).value();
    const std::string second = fixture::SendRoom(*session, {3.0, 2.5, 1.4}).value();
    fixture::SendRoom(*session, {1.0, 2.0, 1.4}).value();
    Withdraw(*session, second);
    journal_ = session->journal().Events(0, 1000).value();
    return session->model().Current();
  }

  // What a server that is started anew shows; whoever destroys the scans first shows that they were
  // not needed.
  ModelSnapshot AfterRestart() {
    Reopen();
    fixture::SessionHost second(*store_, script_.Make());
    EXPECT_TRUE(second.registry.LoadAll().ok());
    const auto session = second.registry.Find("job").value();
    session->WaitUntilIdle();
    return session->model().Current();
  }
  void DestroyScans() {
    for (const v1::SessionEvent& event : journal_) {
      if (!event.has_scan_received()) continue;
      const auto entries = store_->Read("job", event.sequence() - 1, 1).value();
      std::ofstream(FileOf(entries[0].blob()), std::ios::trunc) << "gone";
    }
  }

  // A server that erases withdrawn scans after a day, a week after they were; its models are only
  // loaded when somebody needs them.
  std::unique_ptr<fixture::SessionHost> AWeekLater() {
    contract::Limits limits;
    limits.keep_withdrawn_scans = absl::Hours(24);
    limits.evict_after = absl::Hours(1);
    Reopen();
    now_ += absl::Hours(24 * 7);
    auto host = std::make_unique<fixture::SessionHost>(*store_, script_.Make(), limits,
                                                       [this] { return now_; });
    EXPECT_TRUE(host->registry.LoadAll().ok());
    EXPECT_TRUE(host->registry.WaitUntilIdle(std::chrono::seconds(60)));
    now_ += absl::Hours(48);
    return host;
  }
  // How many scans went when two looks agreed.
  int Erased(fixture::SessionHost& host) {
    EXPECT_EQ(host.registry.Collect().scans, 0);
    now_ += contract::Limits().second_look;
    const int erased = host.registry.Collect().scans;
    EXPECT_TRUE(host.registry.WaitUntilIdle(std::chrono::seconds(60)));
    return erased;
  }
  // Leaves the snapshot of before the withdrawal alone; its file.
  std::string KeepTheOlderOnly() {
    const auto known = store_->Snapshots("job").value();
    EXPECT_EQ(known.size(), 2U);
    EXPECT_TRUE(store_->DropSnapshot("job", known[0].sequence).ok());
    EXPECT_TRUE(store_->ReleaseBlob(known[0].blob).ok());
    return FileOf(known[1].blob);
  }

  std::string folder_;
  absl::Time now_ = fixture::FixtureTime();
  std::unique_ptr<store::DiskStore> store_;
  fixture::Script script_;
  std::string first_scan_;
  std::vector<v1::SessionEvent> journal_;
};

TEST_F(SessionSnapshots, AreWhatARestartBeginsWith) {
  const ModelSnapshot before = MakeJob();
  EXPECT_EQ(store_->Snapshots("job").value().size(), 2U);
  DestroyScans();
  ExpectSame(AfterRestart(), before);
}

TEST_F(SessionSnapshots, WhatCameAfterOneIsReplayed) {
  const ModelSnapshot before = MakeJob();
  // Only the older one, of three scans, is left: the withdrawal came after it.
  const auto known = store_->Snapshots("job").value();
  ASSERT_TRUE(store_->DropSnapshot("job", known[0].sequence).ok());
  DestroyScans();
  ExpectSame(AfterRestart(), before);
  // And the next snapshot says so.
  EXPECT_GE(store_->Snapshots("job").value()[0].sequence, known[0].sequence);
}

TEST_F(SessionSnapshots, ADamagedOneFallsBackToTheOneBefore) {
  const ModelSnapshot before = MakeJob();
  const auto known = store_->Snapshots("job").value();
  Damage(known[0].blob);
  DestroyScans();
  ExpectSame(AfterRestart(), before);
  // The damaged one was let go and written anew.
  const auto now = store_->Snapshots("job").value();
  ASSERT_EQ(now.size(), 2U);
  for (const store::SnapshotRecord& snapshot : now)
    EXPECT_TRUE(store_->GetBlob(snapshot.blob).ok());
}

TEST_F(SessionSnapshots, WithoutAnyTheScansDo) {
  const ModelSnapshot before = MakeJob();
  const std::vector<store::SnapshotRecord> known = store_->Snapshots("job").value();
  for (const store::SnapshotRecord& snapshot : known) Damage(snapshot.blob);
  ExpectSame(AfterRestart(), before);
  ASSERT_EQ(store_->Snapshots("job").value().size(), 1U);
  DestroyScans();
  ExpectSame(AfterRestart(), before);
}

TEST_F(SessionSnapshots, AreWrittenForAFolderThatHasNone) {
  const ModelSnapshot before = MakeJob(0);
  EXPECT_TRUE(store_->Snapshots("job").value().empty());
  ExpectSame(AfterRestart(), before);
  EXPECT_EQ(store_->Snapshots("job").value().size(), 1U);
}

TEST_F(SessionSnapshots, GoOnToTheSameModelAsASessionThatNeverStopped) {
  fixture::Script script;
  store::MemoryStore memory(size_t{1} << 30);
  fixture::SessionHost stayed(memory, script.Make());
  v1::CreateSessionRequest create;
  create.set_session_id("job");
  create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
  const auto never_stopped = stayed.registry.Create(create).value();
  fixture::SendRoom(*never_stopped, {2.0, 1.5, 1.4}).value();
  fixture::SendRoom(*never_stopped, {3.0, 2.5, 1.4}).value();
  fixture::SendRoom(*never_stopped, {1.0, 2.0, 1.4}).value();
  Withdraw(*never_stopped, "sessions/job/scans/scan-2");

  MakeJob();
  ExpectSame(AfterRestart(), never_stopped->model().Current());
  Reopen();
  fixture::SessionHost again(*store_, script_.Make());
  ASSERT_TRUE(again.registry.LoadAll().ok());
  const auto session = again.registry.Find("job").value();
  session->WaitUntilIdle();
  for (Session* one : {session.get(), never_stopped.get()}) {
    fixture::SendRoom(*one, {2.5, 3.0, 1.5}).value();
    Withdraw(*one, "sessions/job/scans/scan-1");
  }
  ExpectSame(session->model().Current(), never_stopped->model().Current());
}

// What release 0.1 left, before there were snapshots: two scans, one of them aligned, and a plan.
TEST_F(SessionSnapshots, AFolderOfTheFirstReleaseIsLoaded) {
  store_.reset();
  std::filesystem::remove_all(folder_);
  std::filesystem::copy(std::string(TEST_DATA_FOLDER) + "/release_0_1", folder_,
                        std::filesystem::copy_options::recursive);
  store_ = store::DiskStore::Open(folder_).value();
  ModelSnapshot before;
  for (const bool again : {false, true}) {
    fixture::SessionHost server(*store_, Algorithms::Core());
    ASSERT_TRUE(server.registry.LoadAll().ok());
    const auto session = server.registry.Find("flat").value();
    session->WaitUntilIdle();
    bool more = false;
    const std::vector<v1::Scan> scans = session->scans().List("", 10, more).value();
    ASSERT_EQ(scans.size(), 2U);
    EXPECT_EQ(scans[0].state(), v1::SCAN_STATE_MERGED);
    EXPECT_EQ(scans[1].pose_source(), v1::POSE_SOURCE_REGISTRATION);
    const v1::Plan plan = session->plans().Get("sessions/flat/plans/plan-1").value();
    EXPECT_EQ(plan.state(), v1::PLAN_STATE_SUCCEEDED);
    EXPECT_EQ(plan.result().views_size(), 3);
    EXPECT_GT(session->plans().GetFullResult(plan.name())->patches_size(), 0);
    if (again) ExpectSame(session->model().Current(), before);
    before = session->model().Current();
    ASSERT_NE(before.view, nullptr);
    EXPECT_EQ(before.view->stations().size(), 2U);
    EXPECT_EQ(store_->Snapshots("flat").value().size(), 1U);
  }
}

// ---- Erased scans ------------------------------------------------------------------------------

TEST_F(SessionSnapshots, ThoseThatHoldAnErasedScanGoWithIt) {
  const ModelSnapshot before = MakeJob();
  const auto known = store_->Snapshots("job").value();
  ASSERT_TRUE(std::filesystem::exists(FileOf(known[1].blob)));
  {
    const auto host = AWeekLater();
    const int64_t used = host->registry.UsedBy("");
    const int64_t snapshot = store_->BlobSize(known[1].blob).value();
    EXPECT_EQ(Erased(*host), 1);
    EXPECT_FALSE(std::filesystem::exists(FileOf(known[1].blob)));
    EXPECT_TRUE(std::filesystem::exists(FileOf(known[0].blob)));
    ASSERT_EQ(store_->Snapshots("job").value().size(), 1U);
    EXPECT_LE(host->registry.UsedBy(""), used - snapshot);
  }
  DestroyScans();
  ExpectSame(AfterRestart(), before);
}

TEST_F(SessionSnapshots, WhereAllHoldAnErasedScanANewOneIsWritten) {
  const ModelSnapshot before = MakeJob();
  const std::string file = KeepTheOlderOnly();
  {
    const auto host = AWeekLater();
    ASSERT_TRUE(std::filesystem::exists(file));
    EXPECT_EQ(Erased(*host), 1);
    EXPECT_FALSE(std::filesystem::exists(file));
    EXPECT_EQ(store_->Snapshots("job").value().size(), 1U);
    ExpectSame(host->registry.Find("job").value()->model().Current(), before);
  }
  DestroyScans();
  ExpectSame(AfterRestart(), before);
}

// What the model knows of a scan whose data are lost is in the snapshots only.
TEST_F(SessionSnapshots, ThoseThatHoldALostScanGoOnceThereIsANewerOne) {
  const ModelSnapshot before = MakeJob();
  const std::string file = KeepTheOlderOnly();
  for (const v1::SessionEvent& event : journal_) {
    if (!event.has_scan_received() || event.scan_received().scan().name() != first_scan_) continue;
    const auto entries = store_->Read("job", event.sequence() - 1, 1).value();
    ASSERT_TRUE(std::filesystem::remove(FileOf(entries[0].blob()) + ".pieces") ||
                std::filesystem::remove(FileOf(entries[0].blob())));
  }
  const auto host = AWeekLater();
  EXPECT_EQ(Erased(*host), 0);
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_EQ(store_->Snapshots("job").value().size(), 2U);
  EXPECT_EQ(host->registry.Collect().scans, 1);
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_EQ(store_->Snapshots("job").value().size(), 1U);
  ExpectSame(host->registry.Find("job").value()->model().Current(), before);
}

// A crash after each step of an erasure: the snapshot is forgotten, its file is not yet removed, or
// it is, and the log does not say yet that the scan is erased.
TEST_F(SessionSnapshots, AnErasureThatACrashCutOffIsFinished) {
  for (const bool file_removed : {false, true}) {
    SCOPED_TRACE(file_removed);
    store_.reset();
    std::filesystem::remove_all(folder_);
    Reopen();
    const ModelSnapshot before = MakeJob();
    const auto known = store_->Snapshots("job").value();
    ASSERT_TRUE(store_->DropSnapshot("job", known[1].sequence).ok());
    if (file_removed) {
      ASSERT_TRUE(store_->ReleaseBlob(known[1].blob).ok());
    }
    {
      const auto host = AWeekLater();
      EXPECT_FALSE(std::filesystem::exists(FileOf(known[1].blob)));
      EXPECT_EQ(Erased(*host), 1);
    }
    ExpectSame(AfterRestart(), before);
  }
}

// As earlier releases left them, which erased scans and kept the snapshots.
TEST_F(SessionSnapshots, ThoseThatHoldAScanErasedBeforeGoToo) {
  MakeJob();
  const auto known = store_->Snapshots("job").value();
  const std::string bytes = store_->GetBlob(known[1].blob).value();
  EXPECT_EQ(Erased(*AWeekLater()), 1);
  ASSERT_TRUE(store_->PutBlob(bytes).ok());
  ASSERT_TRUE(store_->PutSnapshot("job", known[1]).ok());
  const auto host = AWeekLater();
  ASSERT_TRUE(std::filesystem::exists(FileOf(known[1].blob)));
  EXPECT_EQ(host->registry.Collect().scans, 0);
  EXPECT_FALSE(std::filesystem::exists(FileOf(known[1].blob)));
  EXPECT_EQ(store_->Snapshots("job").value().size(), 1U);
}

TEST_F(SessionSnapshots, DeletingTheSessionErasesThemAndItsScans) {
  MakeJob();
  Reopen();
  fixture::SessionHost second(*store_, script_.Make());
  ASSERT_TRUE(second.registry.LoadAll().ok());
  ASSERT_TRUE(second.registry.Delete("job").ok());
  EXPECT_TRUE(store_->Snapshots("job").value().empty());
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ + "/blobs")) {
    EXPECT_FALSE(file.is_regular_file()) << file.path();
  }
}

}  // namespace
}  // namespace vantage::session
