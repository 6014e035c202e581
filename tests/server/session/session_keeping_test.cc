// Tests retention, quota and erasure: how long and how much is kept, and that deleted data are
// gone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/contract/error.h"
#include "server/session/log_compaction.h"
#include "server/store/backup.h"
#include "server/store/disk_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class SessionKeeping : public testing::Test {
 protected:
  SessionKeeping() {
    std::string name = testing::TempDir() + "/keeping-XXXXXX";
    folder_ = mkdtemp(name.data());
    script_.EndPlans();
    Start();
  }
  ~SessionKeeping() override {
    host_.reset();
    store_.reset();
    fs::remove_all(folder_);
  }

  // A server that starts (anew) with these limits.
  void Start(const contract::Limits& limits = {}) {
    host_.reset();
    store_.reset();
    store_ = store::DiskStore::Open(folder_).value();
    host_ = std::make_unique<fixture::SessionHost>(*store_, script_.Make(), limits,
                                                   [this] { return now_; });
    ASSERT_TRUE(host_->registry.LoadAll().ok());
    ASSERT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
  }
  SessionRegistry& registry() { return host_->registry; }

  // The scan's name, when it is merged.
  static std::string Push(Session& session, const std::string& bytes) {
    const v1::PosePrior prior = fixture::PriorAt(2.0, 1.5, 1.4);
    const absl::StatusOr<v1::Upload> upload = fixture::SendScan(session, bytes, &prior);
    EXPECT_TRUE(upload.ok()) << upload.status();
    session.WaitUntilIdle();
    return upload.ok() ? upload->scan() : "";
  }
  static void Withdraw(Session& session, const std::string& scan) {
    ASSERT_TRUE(session.scans().Withdraw(scan, {}).ok());
    session.WaitUntilIdle();
  }
  // The first bytes of a scan, on an upload that stays open.
  static std::string Begin(Session& session, const std::string& bytes, size_t size) {
    std::string upload = session.uploads().Create({}).value().name();
    v1::Piece piece;
    piece.set_data(bytes.substr(0, size));
    piece.set_crc32c(bytes::Crc32c(piece.data()));
    EXPECT_TRUE(session.uploads().Add(upload, &piece, nullptr).ok());
    return upload;
  }
  void MakePlan(Session& session) {
    v1::CreatePlanRequest plan;
    plan.mutable_plan()->set_work_limit_rays(1000);
    ASSERT_TRUE(session.plans().Create(plan).ok());
    ASSERT_TRUE(registry().WaitUntilIdle(std::chrono::seconds(60)));
  }
  absl::Status Delete(const std::string& id) { return registry().Delete(id).status(); }
  // What goes when two looks agree.
  Collected CollectTwice() {
    EXPECT_EQ(registry().Collect(), Collected());
    now_ += contract::Limits().second_look;
    return registry().Collect();
  }

  bool OnDisk(const std::string& bytes) const {
    for (const auto& file : fs::recursive_directory_iterator(folder_)) {
      if (!file.is_regular_file()) continue;
      std::ifstream in(file.path(), std::ios::binary);
      const std::string contents{std::istreambuf_iterator<char>(in), {}};
      if (contents.find(bytes) != std::string::npos) return true;
    }
    return false;
  }
  std::set<std::string> BlobsOnDisk() const {
    std::set<std::string> names;
    for (const auto& file : fs::recursive_directory_iterator(folder_ + "/blobs")) {
      if (file.is_regular_file()) names.insert(file.path().stem().string());
    }
    return names;
  }
  static std::set<std::string> BlobsOf(const Session& session) {
    std::map<std::string, int> blobs;
    std::set<std::string> spools;
    session.AddReferences(blobs, spools);
    std::set<std::string> names;
    for (const auto& [sha256, holders] : blobs) names.insert(absl::BytesToHexString(sha256));
    return names;
  }

  const std::string shared_ = fixture::EncodedRoom({2.0, 1.5, 1.4}, 3.0);
  const std::string own_ = fixture::EncodedRoom({3.0, 2.5, 1.4}, 3.0);
  const std::string started_ = fixture::EncodedRoom({1.0, 2.0, 1.4}, 3.0);
  absl::Time now_ = fixture::FixtureTime();
  std::string folder_;
  fixture::Script script_;
  std::unique_ptr<store::DiskStore> store_;
  std::unique_ptr<fixture::SessionHost> host_;
};

TEST_F(SessionKeeping, NothingOfADeletedSessionIsOnTheDisk) {
  constexpr char kMarker[] = "the vault below the opera";
  v1::CreateSessionRequest create;
  create.set_session_id("confidential");
  create.mutable_session()->set_display_name(kMarker);
  create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
  const auto gone = registry().Create(create).value();
  const auto stays = fixture::OpenSession(registry(), "stays");
  Push(*gone, own_);
  Push(*gone, shared_);
  const std::string kept = Push(*stays, shared_);
  Begin(*gone, started_, started_.size() / 2);
  MakePlan(*gone);
  MakePlan(*stays);
  const std::string begun = started_.substr(started_.size() / 4, 512);
  const std::string own = own_.substr(own_.size() / 4, 512);
  for (const std::string& text : {std::string(kMarker), begun, own}) EXPECT_TRUE(OnDisk(text));
  ASSERT_EQ(BlobsOf(*gone).size(), 5U) << "two scans, two snapshots, a plan";

  ASSERT_TRUE(Delete("confidential").ok());
  for (const std::string& text : {std::string(kMarker), std::string("confidential"), begun, own}) {
    EXPECT_FALSE(OnDisk(text)) << text.substr(0, 20);
  }
  EXPECT_EQ(BlobsOnDisk(), BlobsOf(*stays));
  EXPECT_TRUE(store_->Spools().value().empty());
  EXPECT_TRUE(stays->scans().LoadImage(kept).ok());
  const auto report = store::VerifyStore(folder_).value();
  EXPECT_TRUE(report.faults.empty()) << report.faults[0];
  // Who still had it in hand adds nothing.
  EXPECT_FALSE(gone->uploads().Create({}).ok());
  EXPECT_FALSE(OnDisk("confidential"));

  ASSERT_TRUE(Delete("stays").ok());
  EXPECT_TRUE(BlobsOnDisk().empty());
  EXPECT_EQ(registry().UsedBy(""), 0);
}

TEST_F(SessionKeeping, SessionsPastTheirTimeGo) {
  contract::Limits limits;
  limits.keep_sessions = absl::Hours(48);
  Start(limits);
  const absl::Time start = now_;
  fixture::OpenSession(registry(), "unused");
  const auto used = fixture::OpenSession(registry(), "used");
  const auto uploading = fixture::OpenSession(registry(), "uploading");
  now_ = start + absl::Hours(30);
  Push(*used, own_);
  now_ = start + absl::Hours(40);
  const std::string upload = Begin(*uploading, started_, 100);

  now_ = start + absl::Hours(47);
  EXPECT_EQ(registry().Collect(), Collected());
  now_ = start + absl::Hours(49);
  EXPECT_EQ(CollectTwice(), (Collected{.sessions = 1, .scans = 0}));
  EXPECT_FALSE(registry().Find("unused").ok());
  EXPECT_EQ(registry().Collect(), Collected());
  // An upload that nobody goes on with ends by itself; that is the session's last event.
  now_ = start + absl::Hours(79);
  EXPECT_EQ(CollectTwice(), (Collected{.sessions = 1, .scans = 0}));
  EXPECT_FALSE(registry().Find("used").ok());
  EXPECT_EQ(uploading->uploads().Get(upload)->state(), v1::UPLOAD_STATE_EXPIRED);
  EXPECT_TRUE(store_->Spools().value().empty());
  now_ += absl::Hours(49);
  EXPECT_EQ(CollectTwice(), (Collected{.sessions = 1, .scans = 0}));
  EXPECT_TRUE(BlobsOnDisk().empty());
  EXPECT_TRUE(store_->Sessions().value().empty());
}

// The clock is set forward by days, and back: what nobody has seen pass makes nothing old.
TEST_F(SessionKeeping, AClockThatJumpsMakesNothingOld) {
  contract::Limits limits;
  limits.keep_sessions = absl::Hours(24 * 30);
  limits.keep_withdrawn_scans = absl::Hours(24 * 30);
  absl::Duration passed;
  const auto begin = [&] {
    host_.reset();
    host_ = std::make_unique<fixture::SessionHost>(
        *store_, script_.Make(), limits, [this] { return now_; }, 2,
        std::make_shared<execution::SeenTime>([&passed] { return passed; }));
    ASSERT_TRUE(registry().LoadAll().ok());
    ASSERT_TRUE(registry().WaitUntilIdle(std::chrono::seconds(60)));
  };
  begin();
  const auto pass = [&](absl::Duration time) {
    passed += time;
    now_ += time;
  };
  auto session = fixture::OpenSession(registry(), "job");
  const auto other = fixture::OpenSession(registry(), "other");
  const std::string withdrawn = Push(*session, own_);
  Withdraw(*session, withdrawn);
  const std::string upload = Begin(*session, started_, 1000);
  for (const absl::Duration jump : {absl::Hours(25), absl::Hours(24 * 60), -absl::Hours(87'600)}) {
    SCOPED_TRACE(jump);
    now_ += jump;
    pass(absl::Seconds(6));
    EXPECT_EQ(registry().Collect(), Collected());
    pass(absl::Hours(2));
    EXPECT_EQ(registry().Collect(), Collected());
    EXPECT_EQ(session->uploads().Get(upload)->state(), v1::UPLOAD_STATE_OPEN);
    EXPECT_TRUE(session->scans().LoadImage(withdrawn).ok());
  }
  // Time that passes while a server runs makes it old, also if that one starts between.
  pass(absl::Hours(24 * 20));
  EXPECT_EQ(registry().Collect(), Collected());
  EXPECT_EQ(session->uploads().Get(upload)->state(), v1::UPLOAD_STATE_EXPIRED);
  now_ += absl::Hours(24 * 365);
  session.reset();
  begin();
  EXPECT_EQ(registry().Collect(), Collected());
  pass(absl::Hours(24 * 11));
  EXPECT_EQ(registry().Collect(), Collected()) << "the first look";
  pass(absl::Minutes(59));
  EXPECT_EQ(registry().Collect(), Collected());
  pass(absl::Minutes(1));
  // The other one's last event is the upload that expired after 20 days.
  EXPECT_EQ(registry().Collect(), (Collected{.sessions = 1, .scans = 1}));
  EXPECT_FALSE(registry().Find("other").ok());
  ASSERT_TRUE(registry().Find("job").ok());
}

// What comes to be used between two looks stays.
TEST_F(SessionKeeping, ASecondLookMustAgree) {
  contract::Limits limits;
  limits.keep_sessions = absl::Hours(48);
  Start(limits);
  const auto session = fixture::OpenSession(registry(), "job");
  now_ += absl::Hours(49);
  EXPECT_EQ(registry().Collect(), Collected());
  now_ += absl::Minutes(30);
  Begin(*session, started_, 100);
  now_ += absl::Minutes(31);
  EXPECT_EQ(registry().Collect(), Collected());
  EXPECT_TRUE(registry().Find("job").ok());
}

TEST_F(SessionKeeping, NothingGoesByItselfUnlessAsked) {
  const auto session = fixture::OpenSession(registry(), "job");
  const std::string scan = Push(*session, own_);
  Withdraw(*session, scan);
  now_ += absl::Hours(24 * 365 * 100);
  EXPECT_EQ(CollectTwice(), Collected());
  EXPECT_TRUE(session->scans().LoadImage(scan).ok());
}

TEST_F(SessionKeeping, DataOfWithdrawnScansGo) {
  contract::Limits limits;
  limits.keep_withdrawn_scans = absl::Hours(240);
  Start(limits);
  auto session = fixture::OpenSession(registry(), "job");
  const auto other = fixture::OpenSession(registry(), "other");
  const std::string withdrawn = Push(*session, own_);
  const std::string also_elsewhere = Push(*session, shared_);
  const std::string merged = Push(*session, started_);
  const std::string elsewhere = Push(*other, shared_);
  Withdraw(*session, withdrawn);
  Withdraw(*session, also_elsewhere);
  const auto used_but_for_snapshots = [this] {
    int64_t bytes = registry().UsedBy("");
    for (const char* id : {"job", "other"}) {
      const std::vector<store::SnapshotRecord> listed = store_->Snapshots(id).value();
      for (const store::SnapshotRecord& snapshot : listed) {
        bytes -= store_->BlobSize(snapshot.blob).value();
      }
    }
    return bytes;
  };
  const int64_t used = used_but_for_snapshots();

  now_ += absl::Hours(239);
  EXPECT_EQ(registry().Collect(), Collected());
  now_ += absl::Hours(2);
  EXPECT_EQ(CollectTwice(), (Collected{.sessions = 0, .scans = 2}));
  EXPECT_EQ(registry().Collect(), Collected());
  ASSERT_TRUE(registry().WaitUntilIdle(std::chrono::seconds(60)));
  EXPECT_EQ(used_but_for_snapshots(), used - static_cast<int64_t>(own_.size() + shared_.size()));
  EXPECT_FALSE(OnDisk(own_.substr(own_.size() / 4, 512)));
  EXPECT_TRUE(other->scans().LoadImage(elsewhere).ok());
  for (const bool again : {false, true}) {
    SCOPED_TRACE(again);
    if (again) {
      Start(limits);
      session = registry().Find("job").value();
    }
    for (const std::string& scan : {withdrawn, also_elsewhere}) {
      EXPECT_EQ(contract::ReasonOf(session->scans().LoadImage(scan).status()), "SCAN_ERASED");
      EXPECT_EQ(session->scans().Get(scan)->state(), v1::SCAN_STATE_WITHDRAWN);
      EXPECT_EQ(session->scans().Get(scan)->encoded_size_bytes(), 0);
    }
    EXPECT_TRUE(session->scans().LoadImage(merged).ok());
    const auto report = store::VerifyStore(folder_).value();
    EXPECT_TRUE(report.faults.empty()) << report.faults[0];
    EXPECT_EQ(registry().Collect(), Collected());
  }
}

TEST_F(SessionKeeping, AQuotaIsForEachTenantAndLosesNothing) {
  contract::Limits limits;
  limits.snapshots_per_session = 0;
  const auto size = static_cast<int64_t>(own_.size());
  ASSERT_EQ(shared_.size(), own_.size());
  ASSERT_EQ(started_.size(), own_.size());
  limits.tenant_bytes = 5 * size / 2;
  Start(limits);
  const auto first = fixture::OpenSession(registry(), "first", "x");
  const auto second = fixture::OpenSession(registry(), "second", "x");
  const std::string scan = Push(*first, own_);
  Push(*second, shared_);
  EXPECT_EQ(registry().UsedBy("x"), 2 * size);

  // Announced: refused before anything is sent.
  v1::CreateUploadRequest announced;
  announced.mutable_upload()->mutable_total()->set_encoded_size_bytes(size);
  announced.mutable_upload()->mutable_total()->set_sha256(bytes::Sha256::Of(started_));
  const absl::Status refused = first->uploads().Create(announced).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_EQ(contract::ReasonOf(refused), "QUOTA_EXCEEDED");
  EXPECT_THAT(std::string(refused.message()), HasSubstr("the quota of tenant 'x' is"));
  EXPECT_EQ(registry().UsedBy("x"), 2 * size);
  // Not announced: refused where it ends, and it goes on from there when there is room.
  const std::string upload = Begin(*first, started_, started_.size() / 3);
  v1::UploadTotal total = announced.upload().total();
  v1::Piece rest;
  rest.set_sequence(1);
  rest.set_offset(static_cast<int64_t>(started_.size() / 3));
  rest.set_data(started_.substr(started_.size() / 3));
  rest.set_crc32c(bytes::Crc32c(rest.data()));
  EXPECT_EQ(contract::ReasonOf(first->uploads().Add(upload, nullptr, &total).status()),
            "QUOTA_EXCEEDED");
  EXPECT_EQ(contract::ReasonOf(first->uploads().Add(upload, &rest, nullptr).status()),
            "QUOTA_EXCEEDED");
  EXPECT_EQ(first->uploads().Get(upload)->next_offset(), rest.offset());
  // Others are not concerned.
  const auto stranger = fixture::OpenSession(registry(), "stranger", "y");
  Push(*stranger, own_);
  EXPECT_EQ(registry().UsedBy("y"), size);

  ASSERT_TRUE(Delete("second").ok());
  const auto done = first->uploads().Add(upload, &rest, &total);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->state(), v1::UPLOAD_STATE_COMMITTED);
  first->WaitUntilIdle();
  EXPECT_EQ(registry().UsedBy("x"), 2 * size);
  EXPECT_TRUE(first->scans().LoadImage(scan).ok());

  // With less than what is there everything is there, and nothing more comes in.
  limits.tenant_bytes = size;
  Start(limits);
  EXPECT_EQ(registry().UsedBy("x"), 2 * size);
  const auto again = registry().Find("first").value();
  EXPECT_TRUE(again->scans().LoadImage(scan).ok());
  EXPECT_TRUE(again->scans().LoadImage(done->scan()).ok());
  EXPECT_EQ(contract::ReasonOf(again->uploads().Create(announced).status()), "QUOTA_EXCEEDED");
  v1::CreateSessionRequest another;
  another.set_session_id("another");
  EXPECT_EQ(contract::ReasonOf(registry().Create(another, "x").status()), "QUOTA_EXCEEDED");
  EXPECT_TRUE(registry().Create(another, "y").ok());
}

// What is counted is what a restart counts, whatever it was counted for.
TEST_F(SessionKeeping, AccountsSurviveARestart) {
  const auto session = fixture::OpenSession(registry(), "job", "x");
  const std::string scan = Push(*session, own_);
  Push(*session, shared_);
  Push(*session, fixture::EncodedRoom({3.5, 1.5, 1.4}, 3.0));
  Withdraw(*session, scan);
  MakePlan(*session);
  v1::CreateUploadRequest announced;
  announced.mutable_upload()->mutable_total()->set_encoded_size_bytes(1 << 20);
  announced.mutable_upload()->mutable_total()->set_sha256(std::string(32, 's'));
  ASSERT_TRUE(session->uploads().Create(announced).ok());
  Begin(*session, started_, 1000);
  const int64_t used = registry().UsedBy("x");
  // Scans count as they are encoded, however they are compressed where they are kept.
  size_t blobs = 0;
  for (const std::string& name : BlobsOnDisk()) {
    blobs += store_->GetBlob(absl::HexStringToBytes(name)).value().size();
  }
  EXPECT_EQ(used, static_cast<int64_t>(blobs) + (1 << 20) + 1000);
  Start();
  EXPECT_EQ(registry().UsedBy("x"), used);
  ASSERT_TRUE(Delete("job").ok());
  EXPECT_EQ(registry().UsedBy("x"), 0);
}

// However many one tenant opens, there is room for others.
TEST_F(SessionKeeping, NoTenantTakesEverySession) {
  contract::Limits limits;
  limits.sessions = 8;
  Start(limits);
  const auto fill = [&](const std::string& tenant) {
    int opened = 0;
    while (true) {
      const auto session = registry().Create({}, tenant);
      if (session.ok()) {
        ++opened;
        continue;
      }
      EXPECT_EQ(contract::ReasonOf(session.status()), "TOO_MANY_SESSIONS");
      return opened;
    }
  };
  EXPECT_EQ(fill("greedy"), 4);
  EXPECT_EQ(fill("second"), 2);
  EXPECT_EQ(fill("third"), 1);
  // Where callers are not told apart, all are one.
  EXPECT_EQ(fill(""), 1);
}

// A log grows with every change; what adds to a session ends at its limit, what takes away does
// not.
TEST_F(SessionKeeping, ALogIsBoundedAndCounts) {
  contract::Limits limits;
  limits.log_bytes_per_session = 3 << 20;
  Start(limits);
  const auto session = fixture::OpenSession(registry(), "job", "museum");
  const std::string scan = Push(*session, fixture::EncodedRoom());
  const int64_t scans_alone = registry().UsedBy("museum");
  v1::Rejection rejection;
  rejection.set_reason(std::string(4000, 'r'));
  absl::Status full;
  while (full.ok()) {
    full = session->rejections().Create(rejection, absl::Seconds(1), {}).status();
    now_ += absl::Seconds(2);
  }
  EXPECT_EQ(contract::ReasonOf(full), "LOG_FULL") << full;
  EXPECT_EQ(contract::ReasonOf(session->uploads().Create({}).status()), "LOG_FULL");
  EXPECT_GT(registry().UsedBy("museum"), scans_alone + (1 << 20));
  EXPECT_TRUE(session->scans().Withdraw(scan, {}).ok());
  EXPECT_TRUE(registry().Delete("job").ok());
  EXPECT_EQ(registry().UsedBy("museum"), 0);
}

// What failed, expired or was replaced is compacted while the session goes on.
TEST_F(SessionKeeping, AFloodOfWhatExpiresLeavesLittle) {
  const auto session = fixture::OpenSession(registry(), "job", "museum");
  const std::string scan = Push(*session, fixture::EncodedRoom());
  const int64_t scans_alone = registry().UsedBy("museum");
  v1::Rejection rejection;
  rejection.set_reason(std::string(4000, 'r'));
  constexpr int kRejections = 5000;
  for (int i = 0; i < kRejections; ++i) {
    ASSERT_TRUE(session->rejections().Create(rejection, absl::Seconds(1), {}).ok());
    now_ += absl::Seconds(2);
  }
  // The newest stay, and what came since it was compacted, before it is due again.
  const auto most = static_cast<int64_t>(LogCompaction::kNewest * 4200 * 3);
  for (int i = 0; i < 1000 && session->journal().bytes() > most; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_LT(session->journal().bytes(), most);
  EXPECT_LT(registry().UsedBy("museum"), scans_alone + most);
  const v1::Session before = session->DescribeWithRejections();
  Start();
  const auto again = registry().Find("job", "museum").value();
  EXPECT_EQ(again->DescribeWithRejections().SerializeAsString(), before.SerializeAsString());
  EXPECT_EQ(again->scans().Get(scan).value().state(), v1::SCAN_STATE_MERGED);
  // Numbers are not given again.
  EXPECT_EQ(again->rejections().Create(rejection, absl::Seconds(1), {}).value().name(),
            absl::StrCat("sessions/job/rejections/rejection-", kRejections + 1));
}

}  // namespace
}  // namespace vantage::session
