// Files that the server reads itself, from the announcement to the scans.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/bytes/checksum.h"
#include "core/sensor/encoding.h"
#include "core/sensor/scan_file.h"
#include "server/contract/error.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"
#include "tests/support/scan_files.h"

namespace vantage::session {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string Project(int setups = 3, double degrees = 4) {
  std::vector<test_support::NamedScan> scans;
  const char* names[] = {"door", "window", "corner"};
  for (int i = 0; i < setups; ++i) {
    const Eigen::Vector3d at(1.5 + 0.5 * i, 1.5 + 0.4 * i, 1.4);
    scans.push_back({names[i], fixture::ScanRoom(at, degrees), at});
  }
  return test_support::E57OfSeveral(scans);
}

v1::Upload FileUpload(const std::string& bytes, const std::string& name = "project.e57") {
  v1::Upload upload;
  upload.mutable_file()->set_name(name);
  upload.mutable_total()->set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
  upload.mutable_total()->set_sha256(bytes::Sha256::Of(bytes));
  return upload;
}

class FilesTest : public testing::Test {
 protected:
  absl::StatusOr<v1::Upload> Send(const std::string& bytes, const v1::Upload& described) {
    return fixture::SendDescribed(*session_, bytes, described);
  }
  // As it ended.
  v1::Upload Await(Session& session, const std::string& name) {
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (true) {
      v1::Upload upload = session.uploads().Get(name).value();
      if (upload.state() != v1::UPLOAD_STATE_READING || std::chrono::steady_clock::now() > patience)
        return upload;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  v1::Upload Ended(const std::string& bytes, const v1::Upload& described) {
    const auto sent = Send(bytes, described);
    EXPECT_TRUE(sent.ok()) << sent.status();
    return sent.ok() ? Await(*session_, sent->name()) : v1::Upload();
  }
  v1::Upload Ended(const std::string& bytes, const std::string& name = "project.e57") {
    return Ended(bytes, FileUpload(bytes, name));
  }
  std::vector<v1::Scan> Scans(Session& session) {
    std::vector<v1::Scan> scans;
    session.journal().Read([&](const SessionState& state) {
      for (const std::string& name : state.scan_order) scans.push_back(state.scans.at(name).scan);
    });
    return scans;
  }

  static constexpr size_t piece_bytes_ = 1 << 20;  // as the fixture cuts them
  std::atomic<int64_t> now_{1'700'000'000};
  store::MemoryStore store_{256 << 20};
  fixture::Script script_;
  fixture::SessionHost host_{
      store_, script_.Make(), {}, [this] { return absl::FromUnixSeconds(now_.load()); }};
  std::shared_ptr<Session> session_ = fixture::OpenSession(host_.registry, "job");
};

TEST_F(FilesTest, EachSetupBecomesAScanInTheOrderOfTheFileWithItsPoseAsPrior) {
  const std::string bytes = Project();
  const auto sent = Send(bytes, FileUpload(bytes));
  ASSERT_TRUE(sent.ok()) << sent.status();
  EXPECT_NE(sent->state(), v1::UPLOAD_STATE_OPEN);
  const v1::Upload upload = Await(*session_, sent->name());
  ASSERT_EQ(upload.state(), v1::UPLOAD_STATE_COMMITTED) << upload.state_message();
  EXPECT_EQ(upload.setup_count(), 3);
  EXPECT_EQ(upload.state_message(), "");
  EXPECT_EQ(upload.scan(), "sessions/job/scans/scan-1");
  ASSERT_EQ(upload.scans_size(), 3);
  const std::vector<v1::Scan> scans = Scans(*session_);
  ASSERT_EQ(scans.size(), 3U);
  const std::string path = testing::TempDir() + "/files_test.e57";
  std::ofstream(path, std::ios::binary) << bytes;
  const auto file = sensor::ScanFile::Open(path);
  ASSERT_TRUE(file.ok());
  for (int i = 0; i < 3; ++i) {
    const v1::Scan& scan = scans[static_cast<size_t>(i)];
    const Eigen::Vector3d at(1.5 + 0.5 * i, 1.5 + 0.4 * i, 1.4);
    EXPECT_EQ(scan.name(), upload.scans(i));
    EXPECT_EQ(scan.upload(), upload.name());
    EXPECT_EQ(scan.file_setup(), i + 1);
    EXPECT_EQ(scan.display_name(), std::vector<std::string>({"door", "window", "corner"})[i]);
    EXPECT_EQ(scan.prior().source(), v1::POSE_PRIOR_SOURCE_FILE_HEADER);
    EXPECT_NEAR(scan.prior().pose().translation().x(), at.x(), 1e-9);
    EXPECT_EQ(scan.scanner_model().id(), "from-file");
    const auto stored = store_.GetBlob(scan.sha256());
    ASSERT_TRUE(stored.ok());
    // To the bit what the command line sends.
    const auto read = file->Read(static_cast<size_t>(i), {});
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(*stored, sensor::EncodeRangeImage(read->image));
  }
  EXPECT_THAT(*store_.Spools(), IsEmpty());
}

TEST_F(FilesTest, WhatIsNoScanFailsWithWhatItIsAndCostsNothingElse) {
  const v1::Upload photo = Ended("\xff\xd8\xff\xe0 a photo", "IMG_1.e57");
  EXPECT_EQ(photo.state(), v1::UPLOAD_STATE_FAILED);
  EXPECT_EQ(photo.state_reason(), "NOT_A_SCAN");
  EXPECT_EQ(photo.state_code(), static_cast<int>(absl::StatusCode::kInvalidArgument));
  EXPECT_THAT(photo.state_message(), HasSubstr("IMG_1.e57: this is a photo (JPEG), not a scan"));
  const std::string whole = Project();
  EXPECT_EQ(Ended(whole.substr(0, whole.size() / 2)).state_reason(), "FILE_CUT_OFF");
  EXPECT_EQ(Ended("1 2 3\n4 5 6\n").state_reason(), "STATION_MISSING");
  std::string damaged = whole;
  for (size_t i = damaged.size() / 2; i < damaged.size() / 2 + 100; ++i) damaged[i] ^= 1;
  const v1::Upload unsound = Ended(damaged);
  // What is wrong with one set-up says nothing of the others.
  EXPECT_EQ(unsound.state(), v1::UPLOAD_STATE_COMMITTED);
  EXPECT_EQ(unsound.scans_size(), 2);
  EXPECT_THAT(unsound.state_message(), HasSubstr("not taken"));
  EXPECT_THAT(*store_.Spools(), IsEmpty());
  // It is there after a restart, and so are the others.
  fixture::SessionHost again(store_, script_.Make());
  ASSERT_TRUE(again.registry.LoadAll().ok());
  const auto session = again.registry.Find("job").value();
  EXPECT_EQ(session->uploads().Get(photo.name())->SerializeAsString(), photo.SerializeAsString());
  EXPECT_EQ(session->uploads().Get(unsound.name())->SerializeAsString(),
            unsound.SerializeAsString());
}

TEST_F(FilesTest, AFileOfOneSetupIsCalledAsItIsAndTakesThePriorThatCame) {
  const std::string bytes = Project(1);
  v1::Upload described = FileUpload(bytes);
  *described.mutable_prior() = fixture::PriorAt(2, 2, 1.4);
  ASSERT_EQ(Ended(bytes, described).state(), v1::UPLOAD_STATE_COMMITTED);
  described.clear_prior();
  described.mutable_file()->set_ignore_poses(true);
  described.set_display_name("kitchen");
  ASSERT_EQ(Ended(bytes, described).state(), v1::UPLOAD_STATE_COMMITTED);
  const std::vector<v1::Scan> scans = Scans(*session_);
  EXPECT_EQ(scans[0].display_name(), "project");
  EXPECT_EQ(scans[0].prior().SerializeAsString(), fixture::PriorAt(2, 2, 1.4).SerializeAsString());
  EXPECT_EQ(scans[1].display_name(), "kitchen");
  EXPECT_FALSE(scans[1].has_prior());
}

TEST_F(FilesTest, APlaceThatOneScanHasIsNoneOfAFileWithSeveral) {
  const std::string bytes = Project(2);
  v1::Upload described = FileUpload(bytes);
  *described.mutable_prior() = fixture::PriorAt(2, 2, 1.4);
  const v1::Upload ended = Ended(bytes, described);
  EXPECT_THAT(ended.state_message(), HasSubstr("2 set-ups"));
  EXPECT_EQ(Scans(*session_)[1].prior().source(), v1::POSE_PRIOR_SOURCE_FILE_HEADER);
}

TEST_F(FilesTest, PointsAreReadWithAStationAndPreviewsAreThinnedAndReplaced) {
  const sensor::RangeImage room = fixture::ScanRoom({2, 1.5, 1.4}, 1);
  std::string points = "//X;Y;Z\n";
  for (int c = 0; c < room.columns(); ++c) {
    for (int r = 0; r < room.rows(); ++r) {
      const Eigen::Vector3d p = static_cast<double>(room.at(c, r)) * room.Direction(c, r);
      points += std::to_string(100 + p.x()) + ";" + std::to_string(p.y()) + ";" +
                std::to_string(p.z()) + "\n";
    }
  }
  v1::Upload described = FileUpload(points, "points.txt");
  described.mutable_file()->mutable_station()->set_x(100);
  const v1::Upload loose = Ended(points, described);
  EXPECT_EQ(loose.state(), v1::UPLOAD_STATE_COMMITTED) << loose.state_message();

  const std::string bytes = Project(1, 1);
  v1::Upload preview = FileUpload(bytes);
  preview.set_preview(true);
  preview.mutable_file()->set_preview_step_rad(0.07);
  const std::string scan = Ended(bytes, preview).scan();
  session_->WaitUntilIdle();
  EXPECT_TRUE(session_->scans().Get(scan)->preview());
  EXPECT_LT(session_->scans().Get(scan)->column_count(), 120);
  EXPECT_EQ(Ended(bytes).scan(), scan);
  session_->WaitUntilIdle();
  EXPECT_FALSE(session_->scans().Get(scan)->preview());
  EXPECT_EQ(session_->scans().Get(scan)->column_count(), 360);
}

TEST_F(FilesTest, WhatDoesNotFitIsRefusedWithTheFigureBeforeAByteIsSent) {
  v1::CreateUploadRequest request;
  *request.mutable_upload() = FileUpload("x", "site.e57");
  v1::UploadTotal& total = *request.mutable_upload()->mutable_total();
  total.set_encoded_size_bytes(int64_t{10} << 30);
  const absl::Status large = session_->uploads().Create(request).status();
  EXPECT_EQ(contract::ReasonOf(large), "FILE_TOO_LARGE") << large;
  EXPECT_THAT(std::string(large.message()), HasSubstr("10.00 GiB"));
  EXPECT_THAT(std::string(large.message()), HasSubstr("4.00 GiB"));
  // The store has 256 MiB, and reading takes as much again.
  total.set_encoded_size_bytes(150 << 20);
  const absl::Status full = session_->uploads().Create(request).status();
  EXPECT_EQ(contract::ReasonOf(full), "STORE_FULL") << full;
  EXPECT_THAT(std::string(full.message()), HasSubstr("300.0 MiB"));
  // What was promised to one is not promised to another.
  total.set_encoded_size_bytes(80 << 20);
  const auto first = session_->uploads().Create(request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(contract::ReasonOf(session_->uploads().Create(request).status()), "STORE_FULL");
  ASSERT_TRUE(session_->uploads().Abort(first->name(), {}).ok());
  EXPECT_TRUE(session_->uploads().Create(request).ok());
}

TEST_F(FilesTest, ARequestThatComesAgainMakesNoSecondFile) {
  const std::string bytes = Project(2);
  for (int times = 0; times < 2; ++times) {
    const auto sent = fixture::SendDescribed(*session_, bytes, FileUpload(bytes), "the-file");
    ASSERT_TRUE(sent.ok()) << sent.status();
    EXPECT_EQ(Await(*session_, sent->name()).scans_size(), 2);
  }
  EXPECT_EQ(Scans(*session_).size(), 2U);
}

// Pieces whose answers were lost come again while the file is read, and after.
TEST_F(FilesTest, PiecesThatComeAgainAreKnownAndOthersRefused) {
  const std::string bytes = Project(1);
  const auto sent = Send(bytes, FileUpload(bytes));
  ASSERT_TRUE(sent.ok());
  const std::string name = Await(*session_, sent->name()).name();
  const auto last_known = [&](Session& session) {
    v1::Piece piece;
    int64_t sequence = 0;
    for (size_t at = 0; at < bytes.size();) {
      piece.set_sequence(sequence++);
      piece.set_offset(static_cast<int64_t>(at));
      piece.set_data(bytes.substr(at, piece_bytes_));
      piece.set_crc32c(bytes::Crc32c(piece.data()));
      at += piece.data().size();
    }
    return session.uploads().Add(name, &piece, nullptr);
  };
  EXPECT_EQ(last_known(*session_)->state(), v1::UPLOAD_STATE_COMMITTED);
  v1::Piece other;
  other.set_data("something else");
  other.set_crc32c(bytes::Crc32c(other.data()));
  EXPECT_EQ(contract::ReasonOf(session_->uploads().Add(name, &other, nullptr).status()),
            "UPLOAD_ENDED");
  fixture::SessionHost again(store_, script_.Make());
  ASSERT_TRUE(again.registry.LoadAll().ok());
  EXPECT_TRUE(last_known(*again.registry.Find("job").value()).ok());
}

// Killed at any step: what was read is not doubled, and the rest follows.
TEST_F(FilesTest, AfterARestartReadingGoesOnWhereItWas) {
  const std::string bytes = Project();
  const auto sent = Send(bytes, FileUpload(bytes));
  ASSERT_TRUE(sent.ok());
  ASSERT_EQ(Await(*session_, sent->name()).scans_size(), 3);
  std::vector<storage::v1::LogEntry> log = store_.Read("job", 0, 1000).value();
  const auto is_received = [](const storage::v1::LogEntry& entry) {
    return entry.event().has_upload_received();
  };
  size_t begun = 0;
  while (!is_received(log[begun])) ++begun;
  // The log as far as each scan of it, and as far as the file alone.
  for (size_t scans = 0; scans <= 3; ++scans) {
    store::MemoryStore cut(256 << 20);
    size_t taken = 0;
    uint64_t sequence = 0;
    for (size_t i = 0; i < log.size(); ++i) {
      storage::v1::LogEntry entry = log[i];
      const v1::SessionEvent& event = entry.event();
      const bool scan = event.has_scan_received();
      if (i > begun && (!scan || taken == scans)) continue;
      if (scan) {
        ++taken;
        const auto blob = store_.GetBlob(entry.blob());
        ASSERT_TRUE(blob.ok() && cut.PutBlob(*blob).ok());
      }
      entry.mutable_event()->set_sequence(++sequence);
      ASSERT_TRUE(cut.Append("job", entry).ok());
    }
    ASSERT_EQ(taken, scans);
    {
      v1::Upload open = log[begun].event().upload_received().upload();
      open.set_state(v1::UPLOAD_STATE_OPEN);
      Upload filled(open, cut, contract::Limits());
      v1::Piece piece;
      piece.set_data(bytes);
      piece.set_crc32c(bytes::Crc32c(bytes));
      ASSERT_TRUE(filled.Accept(piece, {absl::Now(), {}}).ok());
      ASSERT_TRUE(filled.Sync().ok());
    }
    fixture::SessionHost host(cut, script_.Make());
    ASSERT_TRUE(host.registry.LoadAll().ok());
    const auto session = host.registry.Find("job").value();
    const v1::Upload ended = Await(*session, sent->name());
    EXPECT_EQ(ended.state(), v1::UPLOAD_STATE_COMMITTED) << ended.state_message();
    const std::vector<v1::Scan> there = Scans(*session);
    ASSERT_EQ(there.size(), 3U) << scans;
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(there[i].file_setup(), static_cast<int>(i) + 1);
      EXPECT_EQ(ended.scans(static_cast<int>(i)), there[i].name());
    }
    EXPECT_THAT(*cut.Spools(), IsEmpty());
  }
}

TEST_F(FilesTest, AFileThatDidNotComeAlongIsAskedForAgain) {
  const std::string bytes = Project(1);
  const auto sent = Send(bytes, FileUpload(bytes));
  ASSERT_TRUE(sent.ok());
  Await(*session_, sent->name());
  store::MemoryStore cut(256 << 20);
  const std::vector<storage::v1::LogEntry> log = store_.Read("job", 0, 1000).value();
  for (const storage::v1::LogEntry& entry : log) {
    ASSERT_TRUE(cut.Append("job", entry).ok());
    if (entry.event().has_upload_received()) break;
  }
  fixture::SessionHost host(cut, script_.Make());
  ASSERT_TRUE(host.registry.LoadAll().ok());
  const v1::Upload ended = Await(*host.registry.Find("job").value(), sent->name());
  EXPECT_EQ(ended.state(), v1::UPLOAD_STATE_FAILED);
  EXPECT_EQ(ended.state_reason(), "FILE_LOST");
}

TEST_F(FilesTest, ADeletedSessionEndsItsReadingAndLeavesNothing) {
  const std::string bytes = Project(3, 1);
  ASSERT_TRUE(Send(bytes, FileUpload(bytes)).ok());
  ASSERT_TRUE(host_.registry.Delete("job").ok());
  EXPECT_THAT(*store_.Spools(), IsEmpty());
  EXPECT_THAT(*store_.Sessions(), IsEmpty());
}

TEST_F(FilesTest, AnUploadThatIsGivenUpWhileItIsReadStopsAndScansStay) {
  const std::string bytes = Project(3, 1);
  const auto sent = Send(bytes, FileUpload(bytes));
  ASSERT_TRUE(sent.ok());
  const auto aborted = session_->uploads().Abort(sent->name(), {});
  const v1::Upload ended = Await(*session_, sent->name());
  if (aborted.ok()) {
    EXPECT_EQ(ended.state(), v1::UPLOAD_STATE_ABORTED);
  } else {
    EXPECT_EQ(ended.state(), v1::UPLOAD_STATE_COMMITTED);  // it was quicker
  }
  EXPECT_EQ(static_cast<size_t>(ended.scans_size()), Scans(*session_).size());
}

// What a scan of a file keeps counts as that of any other, and the file no more.
TEST_F(FilesTest, OnlyTheScansCountInTheEnd) {
  contract::Limits limits;
  limits.snapshots_per_session = 0;  // they count, too
  store::MemoryStore store(256 << 20);
  fixture::SessionHost host(store, script_.Make(), limits);
  const std::shared_ptr<Session> session = fixture::OpenSession(host.registry, "job");
  const std::string bytes = Project(2);
  const int64_t before = host.registry.UsedBy("");
  v1::CreateUploadRequest request;
  *request.mutable_upload() = FileUpload(bytes);
  ASSERT_TRUE(session->uploads().Create(request).ok());
  EXPECT_EQ(host.registry.UsedBy("") - before, static_cast<int64_t>(bytes.size()));
  const auto sent = fixture::SendDescribed(*session, bytes, FileUpload(bytes));
  ASSERT_TRUE(sent.ok()) << sent.status();
  ASSERT_EQ(Await(*session, sent->name()).scans_size(), 2);
  ASSERT_TRUE(session->uploads().Abort("sessions/job/uploads/upload-1", {}).ok());
  session->WaitUntilIdle();
  int64_t kept = 0;
  for (const v1::Scan& scan : Scans(*session)) kept += scan.encoded_size_bytes();
  EXPECT_EQ(host.registry.UsedBy("") - before, kept);
}

}  // namespace
}  // namespace vantage::session
