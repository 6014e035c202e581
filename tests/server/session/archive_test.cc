// A session goes from one server to another as an archive: the same there, or not there at all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "google/protobuf/util/message_differencer.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/session/archive_reader.h"
#include "server/session/archive_writer.h"
#include "server/session/export.h"
#include "server/session/renaming.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"
#include "tests/server/session/every_event_job.h"

namespace vantage::session {
namespace {

using google::protobuf::util::MessageDifferencer;
using storage::v1::ArchiveRecord;
using testing::HasSubstr;

std::string Exported(const std::shared_ptr<Session>& session, v1::ExportFormat format) {
  v1::ExportModelRequest request;
  request.set_format(format);
  const auto source = Export::Create(session, request).value();
  std::string file;
  while (true) {
    const std::string part = source->Next().value();
    if (part.empty()) return file;
    file += part;
  }
}

v1::ImportSessionRequest Piece(const std::string& id, absl::string_view bytes, int64_t offset) {
  v1::ImportSessionRequest request;
  request.set_request_id(id);
  request.set_offset(offset);
  request.set_data(bytes.data(), bytes.size());
  request.set_crc32c(bytes::Crc32c(bytes));
  return request;
}

absl::StatusOr<v1::ImportSessionResponse> Import(
    SessionRegistry& registry, const std::string& archive, const std::string& session = "",
    const std::string& tenant = "", const std::string& id = "import", size_t piece = 100'000) {
  absl::StatusOr<v1::ImportSessionResponse> answer = absl::InternalError("nothing to import");
  for (size_t at = 0; at < archive.size(); at += piece) {
    v1::ImportSessionRequest request =
        Piece(id, absl::string_view(archive).substr(at, piece), static_cast<int64_t>(at));
    request.set_session_id(session);
    answer = registry.Import(request, tenant);
    if (!answer.ok()) return answer;
  }
  return answer;
}

std::vector<ArchiveRecord> RecordsOf(const std::string& archive) {
  ArchiveReader reader;
  reader.Add(archive);
  std::vector<ArchiveRecord> records;
  while (true) {
    const auto record = reader.Next().value();
    if (!record.has_value()) return records;
    records.push_back(*record);
  }
}

// The archive of records, with the checksum that it needs.
std::string ArchiveOf(const std::vector<ArchiveRecord>& records) {
  std::string archive;
  for (ArchiveRecord record : records) {
    if (record.has_end()) record.mutable_end()->set_sha256(bytes::Sha256::Of(archive));
    archive += WriteArchiveRecord(record);
  }
  return archive;
}

class ArchiveTest : public testing::Test {
 protected:
  ArchiveTest() {
    script_.EndPlans();
    session_ = fixture::OpenSession(here_.registry, "job");
    const v1::PosePrior at_first = fixture::PriorAt(2.0, 1.5, 1.4);
    Send({2.0, 1.5, 1.4}, at_first);
    const v1::PosePrior near = fixture::PriorAt(3.0, 2.5, 1.4);
    Send({3.0, 2.5, 1.4}, near);
    script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
    Send({1.0, 1.0, 1.4}, near);
    script_.SetVerdict(registration::RegistrationOutcome::kRegistered);
    const std::string gone = Send({1.0, 2.0, 1.4}, near);
    EXPECT_TRUE(session_->scans().Withdraw(gone, {}).ok());
    session_->WaitUntilIdle();
    v1::CreateScannerRequest scanner;
    scanner.set_scanner_id("red");
    scanner.mutable_scanner();
    EXPECT_TRUE(session_->scanners().Create(scanner).ok());
    v1::Rejection reject;
    reject.mutable_position()->set_x(1);
    reject.set_radius_m(0.5);
    EXPECT_TRUE(session_->rejections().Create(reject, std::nullopt, {}).ok());
    EXPECT_TRUE(session_->plans().Create({}).ok());
    EXPECT_TRUE(here_.registry.WaitUntilIdle(std::chrono::seconds(60)));
    archive_ = Exported(session_, v1::EXPORT_FORMAT_ARCHIVE);
  }
  std::string Send(const Eigen::Vector3d& position, const v1::PosePrior& prior) {
    std::string scan =
        fixture::SendScan(*session_, fixture::EncodedRoom(position), &prior).value().scan();
    session_->WaitUntilIdle();
    return scan;
  }
  // What it says of a wrong archive, of which nothing stays.
  std::string WhyNot(const std::string& archive) {
    const size_t before = there_store_.used();
    const absl::Status refused = Import(there_.registry, archive).status();
    EXPECT_EQ(contract::ReasonOf(refused), "ARCHIVE_DAMAGED") << refused;
    EXPECT_EQ(there_store_.used(), before);
    EXPECT_TRUE(there_store_.Spools().value().empty());
    EXPECT_TRUE(there_.registry.Find("job").status().code() == absl::StatusCode::kNotFound);
    return std::string(refused.message());
  }

  fixture::Script script_;
  store::MemoryStore here_store_{256 << 20};
  fixture::SessionHost here_{here_store_, script_.Make()};
  store::MemoryStore there_store_{256 << 20};
  fixture::SessionHost there_{there_store_, script_.Make()};
  std::shared_ptr<Session> session_;
  std::string archive_;
};

TEST_F(ArchiveTest, TheSessionIsTheSameElsewhere) {
  const v1::ImportSessionResponse done = Import(there_.registry, archive_).value();
  EXPECT_EQ(done.next_offset(), static_cast<int64_t>(archive_.size()));
  const auto session = there_.registry.Find("job").value();
  session->WaitUntilIdle();
  EXPECT_TRUE(MessageDifferencer::Equals(done.session(), session_->Describe()));
  EXPECT_TRUE(MessageDifferencer::Equals(session->DescribeWithRejections(),
                                         session_->DescribeWithRejections()));
  bool more = false;
  const std::vector<v1::Scan> scans = session->scans().List("", 99, more).value();
  const std::vector<v1::Scan> before = session_->scans().List("", 99, more).value();
  ASSERT_EQ(scans.size(), 4U);
  for (size_t i = 0; i < scans.size(); ++i) {
    EXPECT_TRUE(MessageDifferencer::Equals(scans[i], before[i])) << scans[i].DebugString();
  }
  EXPECT_TRUE(MessageDifferencer::Equals(
      session->plans().GetFullResult("sessions/job/plans/plan-1").value(),
      session_->plans().GetFullResult("sessions/job/plans/plan-1").value()));
  const std::vector<v1::SessionEvent> events = session->journal().Events(0, 1000).value();
  const std::vector<v1::SessionEvent> told = session_->journal().Events(0, 1000).value();
  ASSERT_EQ(events.size(), told.size());
  for (size_t i = 0; i < events.size(); ++i) {
    EXPECT_TRUE(MessageDifferencer::Equals(events[i], told[i])) << events[i].DebugString();
  }
  for (const v1::ExportFormat format :
       {v1::EXPORT_FORMAT_OCTOMAP, v1::EXPORT_FORMAT_SURFACE_PLY, v1::EXPORT_FORMAT_SCANS_PLY}) {
    EXPECT_EQ(Exported(session, format), Exported(session_, format)) << format;
  }
  // It goes on, and can go back.
  EXPECT_TRUE(fixture::SendRoom(*session, {2.5, 2.0, 1.4}).ok());
  EXPECT_EQ(session->Describe().scan_counts().merged_count(), 3);
  const std::string back = Exported(session, v1::EXPORT_FORMAT_ARCHIVE);
  EXPECT_EQ(contract::ReasonOf(Import(here_.registry, back).status()), "SESSION_EXISTS");
  EXPECT_TRUE(Import(here_.registry, back, "later", "", "again").ok());
}

TEST_F(ArchiveTest, UnderAnotherIdEveryNameIsItsOwn) {
  const v1::ImportSessionResponse done =
      Import(there_.registry, archive_, "office", "museum").value();
  EXPECT_EQ(done.session().name(), "sessions/office");
  EXPECT_TRUE(absl::IsNotFound(there_.registry.Find("office", "bank").status()));
  const auto session = there_.registry.Find("office", "museum").value();
  session->WaitUntilIdle();
  const std::vector<v1::SessionEvent> events = session->journal().Events(0, 1000).value();
  std::vector<v1::SessionEvent> told = session_->journal().Events(0, 1000).value();
  ASSERT_EQ(events.size(), told.size());
  for (size_t i = 0; i < events.size(); ++i) {
    EXPECT_THAT(events[i].DebugString(), testing::Not(HasSubstr("sessions/job")));
    RenameSession("sessions/job", "sessions/office", told[i]);
    EXPECT_TRUE(MessageDifferencer::Equals(events[i], told[i])) << events[i].DebugString();
  }
  EXPECT_TRUE(session->plans().GetFullResult("sessions/office/plans/plan-1").ok());
  EXPECT_EQ(Exported(session, v1::EXPORT_FORMAT_OCTOMAP),
            Exported(session_, v1::EXPORT_FORMAT_OCTOMAP));
  EXPECT_TRUE(fixture::SendRoom(*session, {2.5, 2.0, 1.4}).ok());
}

TEST_F(ArchiveTest, PiecesMayComeAgainAndAGapSaysWhereToGoOn) {
  const absl::string_view all = archive_;
  const auto half = static_cast<int64_t>(all.size() / 2);
  SessionRegistry& there = there_.registry;
  EXPECT_EQ(contract::ReasonOf(there.Import(Piece("i", all.substr(9), 9)).status()), "IMPORT_GAP");
  ASSERT_TRUE(there.Import(Piece("i", all.substr(0, half), 0)).ok());
  const absl::Status gap = there.Import(Piece("i", all.substr(half + 5), half + 5)).status();
  EXPECT_EQ(contract::ReasonOf(gap), "IMPORT_GAP");
  EXPECT_THAT(gap.message(), HasSubstr(absl::StrCat("expected is ", half)));
  EXPECT_EQ(there.Import(Piece("i", all.substr(0, half), 0))->next_offset(), half);
  v1::ImportSessionRequest damaged = Piece("i", all.substr(half), half);
  damaged.set_crc32c(damaged.crc32c() + 1);
  EXPECT_EQ(contract::ReasonOf(there.Import(damaged).status()), "PIECE_DAMAGED");
  EXPECT_TRUE(absl::IsNotFound(there.Find("job").status()));
  // One that overlaps what is known.
  const v1::ImportSessionResponse done =
      there.Import(Piece("i", all.substr(half - 100), half - 100)).value();
  EXPECT_EQ(done.session().name(), "sessions/job");
  EXPECT_EQ(there.Import(Piece("i", all.substr(half), half))->session().name(), "sessions/job");

  fixture::SessionHost next(there_store_, script_.Make());
  ASSERT_TRUE(next.registry.LoadAll().ok());
  EXPECT_EQ(next.registry.Import(Piece("i", all.substr(half), half))->session().name(),
            "sessions/job");
}

TEST_F(ArchiveTest, OneThatIsNotWholeLeavesNothing) {
  std::vector<ArchiveRecord> records = RecordsOf(archive_);
  const auto without = [&](auto unwanted) {
    std::vector<ArchiveRecord> left = records;
    left.erase(std::find_if(left.begin(), left.end(), unwanted));
    return ArchiveOf(left);
  };
  EXPECT_THAT(WhyNot(without([](const auto& r) { return r.has_header(); })), HasSubstr("header"));
  EXPECT_THAT(WhyNot(without([](const auto& r) { return r.has_chunk(); })), HasSubstr("missing"));
  EXPECT_THAT(WhyNot(without([](const auto& r) { return r.entry().event().has_scan_received(); })),
              HasSubstr("out of sequence"));
  // Data of which only the name is known are nobody's to get.
  std::vector<ArchiveRecord> bare;
  for (const ArchiveRecord& record : records) {
    if (!record.has_blob() && !record.has_chunk()) bare.push_back(record);
  }
  EXPECT_THAT(WhyNot(ArchiveOf(bare)), HasSubstr("lacks the data of sessions/job/scans/scan-1"));
  std::vector<ArchiveRecord> twice = records;
  const auto first =
      std::find_if(twice.begin(), twice.end(), [](const auto& r) { return r.has_blob(); });
  std::vector<ArchiveRecord> blob(
      first, std::find_if(first + 1, twice.end(), [](const auto& r) { return r.has_blob(); }));
  twice.insert(first, blob.begin(), blob.end());
  EXPECT_THAT(WhyNot(ArchiveOf(twice)), HasSubstr("does not name"));
  const size_t before = there_store_.used();
  ASSERT_TRUE(Import(there_.registry, archive_.substr(0, archive_.size() - 1)).ok());
  EXPECT_TRUE(absl::IsNotFound(there_.registry.Find("job").status()));
  EXPECT_GT(there_store_.used(), before) << "the rest may still come";
  EXPECT_TRUE(Import(there_.registry, archive_.substr(archive_.size() - 1)).status().code() !=
              absl::StatusCode::kInternal);
}

TEST_F(ArchiveTest, ABitThatTippedIsFound) {
  // At places all over it, the first and last bytes among them.
  for (size_t at = 0; at < archive_.size(); at += 1 + archive_.size() / 61) {
    std::string damaged = archive_;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    const absl::Status refused =
        Import(there_.registry, damaged, "", "", absl::StrCat(at)).status();
    // A length that is larger than it was waits for more.
    EXPECT_TRUE(!refused.ok() || absl::IsNotFound(there_.registry.Find("job").status())) << at;
    EXPECT_FALSE(absl::IsInternal(refused)) << refused;
  }
}

TEST_F(ArchiveTest, WhatNoServerWouldHaveLoggedIsRefused) {
  const std::vector<ArchiveRecord> records = RecordsOf(archive_);
  const auto changed = [&](auto wanted, auto change) {
    std::vector<ArchiveRecord> wrong = records;
    const auto it = std::find_if(wrong.begin(), wrong.end(), wanted);
    EXPECT_NE(it, wrong.end());
    change(*it->mutable_entry()->mutable_event());
    return ArchiveOf(wrong);
  };
  const auto scan = [](const auto& r) { return r.entry().event().has_scan_received(); };
  EXPECT_THAT(WhyNot(changed(scan,
                             [](v1::SessionEvent& event) {
                               event.mutable_scan_received()->mutable_scan()->set_upload(
                                   "sessions/other/uploads/upload-1");
                             })),
              HasSubstr("entry 3"));
  const auto created = [](const auto& r) { return r.entry().event().has_session_created(); };
  EXPECT_THAT(WhyNot(changed(created,
                             [](v1::SessionEvent& event) {
                               event.mutable_session_created()
                                   ->mutable_session()
                                   ->mutable_model_config()
                                   ->set_voxel_size_m(0);
                             })),
              HasSubstr("voxel_size_m"));
  const auto merged = [](const auto& r) { return r.entry().event().has_scan_merged(); };
  EXPECT_THAT(WhyNot(changed(merged,
                             [](v1::SessionEvent& event) {
                               event.mutable_scan_merged()
                                   ->mutable_scan()
                                   ->mutable_pose()
                                   ->mutable_translation()
                                   ->set_x(std::numeric_limits<double>::quiet_NaN());
                             })),
              HasSubstr("pose"));
  std::vector<ArchiveRecord> newer = records;
  newer[0].mutable_header()->set_format_version(2);
  EXPECT_EQ(contract::ReasonOf(Import(there_.registry, ArchiveOf(newer)).status()),
            "ARCHIVE_NEWER");
}

TEST_F(ArchiveTest, TakesNoMoreThanItsTenantMay) {
  contract::Limits limits;
  limits.tenant_bytes = 100'000;
  limits.imports = 2;
  store::MemoryStore store(256 << 20);
  fixture::SessionHost small(store, script_.Make(), limits);
  EXPECT_EQ(contract::ReasonOf(Import(small.registry, archive_, "", "a").status()),
            "QUOTA_EXCEEDED");
  EXPECT_EQ(small.registry.UsedBy("a"), 0);
  EXPECT_EQ(store.used(), 0U);
  const absl::string_view begin = absl::string_view(archive_).substr(0, 10);
  ASSERT_TRUE(small.registry.Import(Piece("one", begin, 0), "a").ok());
  EXPECT_EQ(contract::ReasonOf(small.registry.Import(Piece("two", begin, 0), "a").status()),
            "TOO_MANY_IMPORTS");
  EXPECT_TRUE(small.registry.Import(Piece("one", begin, 0), "b").ok()) << "another tenant's share";
  limits.tenant_bytes = 0;
  limits.snapshots_per_session = 0;
  {
    fixture::SessionHost enough(store, script_.Make(), limits);
    ASSERT_TRUE(Import(enough.registry, archive_, "", "a").ok());
    enough.registry.Find("job").value()->WaitUntilIdle();
    EXPECT_GT(enough.registry.UsedBy("a"), 100'000);
    fixture::SessionHost again(store, script_.Make(), limits);
    ASSERT_TRUE(again.registry.LoadAll().ok());
    EXPECT_EQ(again.registry.UsedBy("a"), enough.registry.UsedBy("a"));
  }
}

TEST_F(ArchiveTest, AScanThatIsLostIsSaid) {
  v1::ExportModelRequest request;
  request.set_format(v1::EXPORT_FORMAT_ARCHIVE);
  std::string blob;
  session_->journal().Read(
      [&](const SessionState& state) { blob = state.scans.at("sessions/job/scans/scan-2").blob; });
  ASSERT_TRUE(here_store_.ReleaseBlob(blob).ok());
  const auto source = Export::Create(session_, request).value();
  absl::Status status;
  while (status.ok()) {
    const absl::StatusOr<std::string> part = source->Next();
    status = part.status();
    ASSERT_FALSE(part.ok() && part->empty());
  }
  EXPECT_EQ(contract::ReasonOf(status), "SCAN_LOST");
  EXPECT_THAT(status.message(), HasSubstr("scan-2"));
}

TEST(ArchiveOfEveryEvent, GoesElsewhere) {
  store::MemoryStore store(256 << 20);
  RunEveryEventJob(store);
  fixture::SessionHost here(store, Algorithms::Core(), {}, EveryEventJobEnd);
  ASSERT_TRUE(here.registry.LoadAll().ok());
  const auto session = here.registry.Find("job", "office").value();
  session->WaitUntilIdle();
  ASSERT_TRUE(here.registry.WaitUntilIdle(std::chrono::seconds(60)));
  const std::string archive = Exported(session, v1::EXPORT_FORMAT_ARCHIVE);
  store::MemoryStore other(256 << 20);
  fixture::SessionHost there(other, Algorithms::Core(), {}, EveryEventJobEnd);
  const auto done = Import(there.registry, archive, "", "office");
  ASSERT_TRUE(done.ok()) << done.status();
  const auto imported = there.registry.Find("job", "office").value();
  imported->WaitUntilIdle();
  EXPECT_EQ(Exported(imported, v1::EXPORT_FORMAT_OCTOMAP),
            Exported(session, v1::EXPORT_FORMAT_OCTOMAP));
  EXPECT_EQ(imported->uploads().OpenCount(), session->uploads().OpenCount());
  bool more = false;
  EXPECT_EQ(imported->claims().List("", 9, more)->size(),
            session->claims().List("", 9, more)->size());
}

}  // namespace
}  // namespace vantage::session
