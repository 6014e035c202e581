// Compacted logs fold to the state of the whole log, whatever happened and happens after.
#include "server/session/log_compaction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/session/journal.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using ::testing::ElementsAre;

constexpr char kSession[] = "sessions/job";
constexpr char kSitePrior[] = "sessions/job/sitePrior";

std::string Named(absl::string_view kind, uint64_t number) {
  return absl::StrCat(kSession, "/", kind, "s/", kind, "-", number);
}

// Keeps a copy of every entry that was ever written.
class CopyingStore : public store::MemoryStore {
 public:
  CopyingStore() : MemoryStore(size_t{1} << 30) {}
  absl::Status Append(const std::string& session, const storage::v1::LogEntry& entry) override {
    absl::Status appended = MemoryStore::Append(session, entry);
    if (appended.ok()) all.push_back(entry);
    return appended;
  }
  std::vector<storage::v1::LogEntry> all;
};

// Everything that a state holds.
std::string Whole(const SessionState& state) {
  std::string out = absl::StrCat(state.tenant, "\n", state.session.SerializeAsString());
  for (const auto& [name, record] : state.scans) {
    absl::StrAppend(&out, "\n", name, record.scan.SerializeAsString(), record.blob, record.in_model,
                    absl::FormatDuration(record.withdrawn), record.received_bytes,
                    record.last_pieces.SerializeAsString(), record.preview.SerializeAsString(),
                    record.preview_blob);
  }
  for (const auto& [ends, link] : state.links) {
    absl::StrAppend(&out, "\n", ends.first, ends.second, link.SerializeAsString());
  }
  absl::StrAppend(&out, "\n", state.poses_due);
  for (const std::string& name : state.scan_order) absl::StrAppend(&out, "\n", name);
  for (const auto& [name, upload] : state.uploads) {
    absl::StrAppend(&out, "\n", name, upload.SerializeAsString());
  }
  for (const std::string& name : state.ended_uploads) absl::StrAppend(&out, "\n", name);
  for (const v1::Rejection& rejection : state.rejections) {
    absl::StrAppend(&out, "\n", rejection.SerializeAsString());
  }
  for (const auto& [name, scanner] : state.scanners) {
    absl::StrAppend(&out, "\n", scanner.SerializeAsString());
  }
  for (const std::string& name : state.scanner_order) absl::StrAppend(&out, "\n", name);
  for (const std::string& name : state.plan_order) {
    const PlanRecord& record = state.plans.at(name);
    absl::StrAppend(&out, "\n", name, record.plan.SerializeAsString(), record.blob);
  }
  for (const auto& [name, record] : state.claims) {
    absl::StrAppend(&out, "\n", name, record.claim.SerializeAsString(), record.caller,
                    record.end_reason);
  }
  for (const std::string& name : state.held_claims) absl::StrAppend(&out, "\n", name);
  for (const std::string& name : state.station_order) {
    absl::StrAppend(&out, "\n", name, state.stations.at(name).SerializeAsString());
  }
  absl::StrAppend(&out, "\n", state.site_prior.SerializeAsString(), state.site_prior_blob, " ",
                  state.site_prior_set);
  for (const auto& [id, record] : state.requests) {
    absl::StrAppend(&out, "\n", id, record.method, record.fingerprint, record.resource, " ",
                    record.sequence);
  }
  for (const auto& [sequence, id] : state.request_order) {
    absl::StrAppend(&out, "\n", sequence, " ", id);
  }
  return absl::StrCat(out, "\n", state.last_sequence, " ", absl::FormatDuration(state.last_seen),
                      " ", state.last_resource, " ", state.model_version, " ", state.upload_count,
                      " ", state.rejection_count, " ", state.station_count, " ", state.plan_count,
                      " ", state.plans.size());
}

std::string Whole(const Journal& journal) {
  std::string whole;
  journal.Read([&](const SessionState& state) { whole = Whole(state); });
  return whole;
}

class LogCompactionTest : public ::testing::Test {
 protected:
  LogCompactionTest() { Reopen(); }

  void Reopen() {
    const auto clock = [this] { return now_; };
    const auto seen = [this] { return now_ - fixture::FixtureTime(); };
    if (journal_ == nullptr) {
      journal_ = std::make_unique<Journal>("job", store_, clock, seen);
      v1::SessionEvent opened;
      opened.mutable_session_created()->mutable_session()->set_name(kSession);
      Do(opened);
      return;
    }
    auto again = Journal::Open("job", store_, clock, seen);
    ASSERT_TRUE(again.ok()) << again.status();
    journal_ = *std::move(again);
  }

  void Do(const v1::SessionEvent& event, const std::string& request = "") {
    now_ += absl::Seconds(1);
    const auto made = journal_->Execute({request, request.empty() ? "" : "Do", "hash"},
                                        [&](const SessionState&) -> absl::StatusOr<Draft> {
                                          Draft draft;
                                          draft.event = event;
                                          return draft;
                                        });
    ASSERT_TRUE(made.ok()) << made.status();
  }

  // Of the log as if it had never been compacted.
  std::string WholeOfAll() const {
    SessionState state;
    for (const storage::v1::LogEntry& entry : store_.all) {
      const absl::Status applied = state.Apply(entry);
      EXPECT_TRUE(applied.ok()) << applied;
    }
    return Whole(state);
  }

  v1::SessionEvent CreatedUpload(uint64_t number) const {
    v1::SessionEvent event;
    event.mutable_upload_created()->mutable_upload()->set_name(Named("upload", number));
    event.mutable_upload_created()->mutable_upload()->set_display_name(std::string(200, 'u'));
    return event;
  }
  static v1::SessionEvent EndedUpload(uint64_t number) {
    v1::SessionEvent event;
    event.mutable_upload_ended()->mutable_upload()->set_name(Named("upload", number));
    return event;
  }
  v1::SessionEvent RejectedView(uint64_t number, absl::Duration lasts) const {
    v1::SessionEvent event;
    v1::Rejection& rejection = *event.mutable_view_rejected()->mutable_rejection();
    rejection.set_name(Named("rejection", number));
    *rejection.mutable_expire_time() = conversion::WriteTime(now_ + lasts);
    return event;
  }
  static v1::SessionEvent ConfiguredSession(const std::string& name) {
    v1::SessionEvent event;
    event.mutable_session_updated()->mutable_session()->set_name(kSession);
    event.mutable_session_updated()->mutable_session()->set_display_name(name);
    return event;
  }
  // So many that what was before is old enough to go.
  void DoOthers() {
    for (uint64_t i = 0; i < LogCompaction::kNewest; ++i) {
      v1::SessionEvent event;
      event.mutable_scanner_created()->mutable_scanner()->set_name(Named("scanner", ++scanners_));
      Do(event);
    }
  }
  std::vector<std::pair<uint64_t, uint64_t>> LeftOut() const {
    std::vector<std::pair<uint64_t, uint64_t>> spans;
    const std::vector<storage::v1::LogEntry> entries = store_.Read("job", 0, 100'000).value();
    for (const storage::v1::LogEntry& entry : entries) {
      const v1::SessionEvent& event = entry.event();
      if (!event.has_events_left_out()) continue;
      spans.emplace_back(event.events_left_out().first_sequence(), event.sequence());
    }
    return spans;
  }

  CopyingStore store_;
  absl::Time now_ = fixture::FixtureTime();
  std::unique_ptr<Journal> journal_;
  uint64_t scanners_ = 0;
};

TEST_F(LogCompactionTest, WhatIsReplacedOrOverGoes) {
  using Span = std::pair<uint64_t, uint64_t>;
  for (uint64_t i = 1; i <= SessionState::kEndedUploads + 2; ++i) {
    Do(CreatedUpload(i));  // 2, 4, ...
    Do(EndedUpload(i));
  }
  const uint64_t uploads_end = 1 + 2 * (SessionState::kEndedUploads + 2);
  Do(RejectedView(1, absl::Seconds(1)));
  now_ += absl::Seconds(5);
  Do(RejectedView(2, absl::Hours(9000)));
  Do(ConfiguredSession("first"));
  Do(ConfiguredSession("second"));
  DoOthers();
  const std::string before = Whole(*journal_);
  const int64_t bytes = journal_->bytes();
  const absl::StatusOr<int64_t> saved = journal_->Compact();
  ASSERT_TRUE(saved.ok()) << saved.status();
  // Two uploads are forgotten; 64 are remembered.
  EXPECT_THAT(LeftOut(), ElementsAre(Span(2, 5), Span(uploads_end + 1, uploads_end + 1),
                                     Span(uploads_end + 3, uploads_end + 3)));
  EXPECT_GT(*saved, 400);
  EXPECT_EQ(journal_->bytes(), bytes - *saved);
  EXPECT_EQ(Whole(*journal_), before);
  Reopen();
  EXPECT_EQ(Whole(*journal_), before);
  EXPECT_EQ(journal_->bytes(), bytes - *saved);
  EXPECT_EQ(journal_->Compact().value(), 0);
}

// A merge looks at when the claims of its scanner expire, so the prolongation before it stays.
TEST_F(LogCompactionTest, ProlongationsGoButTheLastBeforeAMerge) {
  v1::SessionEvent scanner;
  scanner.mutable_scanner_created()->mutable_scanner()->set_name(Named("scanner", ++scanners_));
  Do(scanner);
  v1::SessionEvent taken;
  v1::Claim& claim = *taken.mutable_claim_taken()->mutable_claim();
  claim.set_name(Named("claim", 1));
  claim.set_scanner(Named("scanner", 1));
  Do(taken);
  v1::SessionEvent renewed;
  const auto prolong = [&] {
    *claim.mutable_expire_time() = conversion::WriteTime(now_ + absl::Minutes(5));
    *renewed.mutable_claim_renewed()->mutable_claim() = claim;
    Do(renewed);
  };
  v1::SessionEvent received;
  received.mutable_scan_received()->mutable_scan()->set_name(Named("scan", 1));
  received.mutable_scan_received()->mutable_scan()->set_upload(Named("upload", 1));
  Do(received);                           // 4
  for (int i = 0; i < 3; ++i) prolong();  // 5 to 7
  v1::SessionEvent merged;
  *merged.mutable_scan_merged()->mutable_scan() = received.scan_received().scan();
  Do(merged);
  for (int i = 0; i < 3; ++i) prolong();  // 9 to 11
  DoOthers();
  const std::string before = Whole(*journal_);
  ASSERT_TRUE(journal_->Compact().ok());
  using Span = std::pair<uint64_t, uint64_t>;
  EXPECT_THAT(LeftOut(), ElementsAre(Span(5, 6), Span(9, 10)));
  Reopen();
  EXPECT_EQ(Whole(*journal_), before);
}

// A request that is still remembered is answered as before, whatever became of what it made.
TEST_F(LogCompactionTest, RememberedRequestsAreAnswered) {
  for (uint64_t i = 1; i <= SessionState::kEndedUploads + 2; ++i) {
    Do(CreatedUpload(i), absl::StrCat("create-", i));
    Do(EndedUpload(i));
  }
  DoOthers();
  ASSERT_GT(journal_->Compact().value(), 0);
  using Span = std::pair<uint64_t, uint64_t>;
  EXPECT_THAT(LeftOut(), ElementsAre(Span(2, 2), Span(3, 3), Span(4, 4), Span(5, 5)));
  Reopen();
  const auto again = journal_->Execute({"create-1", "Do", "hash"}, [](const SessionState&) {
    return absl::StatusOr<Draft>(absl::InternalError("it was made before"));
  });
  EXPECT_EQ(again.value(), Named("upload", 1));
  // Watchers need not know.
  const std::vector<v1::SessionEvent> events = journal_->Events(0, 10).value();
  EXPECT_EQ(events[1].sequence(), 5U);
  EXPECT_EQ(events[1].events_left_out().first_sequence(), 2U);
  EXPECT_EQ(events[2].sequence(), 6U);
}

TEST_F(LogCompactionTest, ItIsDueWhenTheLogHasGrown) {
  EXPECT_FALSE(journal_->DueForCompaction());
  uint64_t rejections = 0;
  const auto grow = [&](int64_t to) {
    while (journal_->bytes() < to) {
      v1::SessionEvent event = RejectedView(++rejections, absl::Seconds(1));
      event.mutable_view_rejected()->mutable_rejection()->set_reason(std::string(2000, 'r'));
      now_ += absl::Seconds(2);
      Do(event);
    }
  };
  grow((1 << 20) + 5000);
  EXPECT_TRUE(journal_->DueForCompaction());
  EXPECT_FALSE(journal_->DueForCompaction());  // once
  ASSERT_TRUE(journal_->Compact().ok());
  EXPECT_FALSE(journal_->DueForCompaction());
  // The newest stay: 2 MB.
  grow(8 << 20);
  EXPECT_TRUE(journal_->DueForCompaction());
  ASSERT_TRUE(journal_->Compact().ok());
  EXPECT_LT(journal_->bytes(), 5 << 19);
  EXPECT_FALSE(journal_->DueForCompaction());
}

TEST_F(LogCompactionTest, AClosedLogIsLeftAlone) {
  for (uint64_t i = 1; i <= SessionState::kEndedUploads + 2; ++i) {
    Do(CreatedUpload(i));
    Do(EndedUpload(i));
  }
  DoOthers();
  journal_->Close();
  EXPECT_TRUE(absl::IsAborted(journal_->Compact().status()));
  EXPECT_TRUE(LeftOut().empty());
}

TEST_F(LogCompactionTest, ADeletedPlanAndWhatAScannerWasBeforeGo) {
  using Span = std::pair<uint64_t, uint64_t>;
  v1::SessionEvent event;
  event.mutable_scanner_created()->mutable_scanner()->set_name(Named("scanner", ++scanners_));
  Do(event);  // 2
  for (const char* by : {"a", "b", "c"}) {
    v1::SessionEvent changed;
    changed.mutable_scanner_updated()->mutable_scanner()->set_name(Named("scanner", 1));
    changed.mutable_scanner_updated()->mutable_scanner()->set_operator_(by);
    Do(changed);  // 3 to 5
  }
  for (const uint64_t number : {1, 2}) {
    v1::SessionEvent created;
    created.mutable_plan_created()->mutable_plan()->set_name(Named("plan", number));
    Do(created);
    v1::SessionEvent ended;
    ended.mutable_plan_ended()->mutable_plan()->set_name(Named("plan", number));
    Do(ended);  // 6 to 9
  }
  v1::SessionEvent deleted;
  deleted.mutable_plan_deleted()->set_plan(Named("plan", 1));
  Do(deleted);  // 10
  DoOthers();
  const std::string before = Whole(*journal_);
  ASSERT_TRUE(journal_->Compact().ok());
  EXPECT_THAT(LeftOut(), ElementsAre(Span(3, 4), Span(6, 7), Span(10, 10)));
  EXPECT_EQ(Whole(*journal_), before);
  Reopen();
  EXPECT_EQ(Whole(*journal_), before);
}

TEST_F(LogCompactionTest, APriorThatWasReplacedOrTakenOutGoes) {
  using Span = std::pair<uint64_t, uint64_t>;
  const auto set = [&](const char* name) {
    v1::SessionEvent event;
    v1::SitePrior& prior = *event.mutable_site_prior_set()->mutable_site_prior();
    prior.set_name(kSitePrior);
    prior.set_display_name(name);
    Do(event);
  };
  set("a");
  set("b");
  v1::SessionEvent cleared;
  cleared.mutable_site_prior_cleared()->mutable_site_prior()->set_name(kSitePrior);
  Do(cleared);  // 4
  Do(ConfiguredSession("between"));
  set("c");
  set("d");  // 7
  DoOthers();
  const std::string before = Whole(*journal_);
  ASSERT_TRUE(journal_->Compact().ok());
  EXPECT_THAT(LeftOut(), ElementsAre(Span(2, 4), Span(6, 6)));
  EXPECT_EQ(Whole(*journal_), before);
  Reopen();
  EXPECT_EQ(Whole(*journal_), before);
  journal_->Read([](const SessionState& state) {
    EXPECT_EQ(state.site_prior.display_name(), "d");
    EXPECT_EQ(state.site_prior_set, 7U);
  });
}

// Poses that were adjusted go with a later entry that says again where all of their scans are.
TEST_F(LogCompactionTest, PosesThatWereAdjustedAgainGo) {
  using Span = std::pair<uint64_t, uint64_t>;
  const auto receive = [&](uint64_t number) {
    v1::SessionEvent event;
    event.mutable_scan_received()->mutable_scan()->set_name(Named("scan", number));
    event.mutable_scan_received()->mutable_scan()->set_upload(Named("upload", number));
    Do(event);
    v1::SessionEvent merged;
    *merged.mutable_scan_merged()->mutable_scan() = event.scan_received().scan();
    for (uint64_t before = 1; before < number; ++before) {
      v1::ScanLink& link = *merged.mutable_scan_merged()->add_links();
      link.set_first_scan(Named("scan", before));
      link.set_second_scan(Named("scan", number));
    }
    Do(merged);
  };
  const auto adjust = [&](const std::vector<uint64_t>& scans, double x) {
    v1::SessionEvent event;
    for (const uint64_t number : scans) {
      v1::AdjustedPose& pose = *event.mutable_poses_adjusted()->add_poses();
      pose.set_scan(Named("scan", number));
      pose.mutable_pose()->mutable_translation()->set_x(x);
      pose.mutable_adjustment()->set_position_sigma_m(x);
    }
    Do(event);
  };
  for (uint64_t number = 1; number <= 3; ++number) receive(number);  // 2 to 7
  adjust({1, 2, 3}, 1);                                              // 8: goes with 10
  adjust({1, 2}, 2);                                                 // 9: scan 2 is there still
  adjust({1, 3}, 3);                                                 // 10
  v1::SessionEvent removed;
  removed.mutable_scan_removed()->mutable_scan()->set_name(Named("scan", 2));
  Do(removed);        // 11
  adjust({1, 3}, 4);  // 12: with this go 9 and 10
  DoOthers();
  const std::string before = Whole(*journal_);
  journal_->Read([&](const SessionState& state) {
    EXPECT_EQ(state.links.size(), 1U);
    EXPECT_FALSE(state.poses_due);
    EXPECT_EQ(state.scans.at(Named("scan", 3)).scan.pose().translation().x(), 4);
  });
  ASSERT_TRUE(journal_->Compact().ok());
  EXPECT_THAT(LeftOut(), ElementsAre(Span(8, 10)));
  EXPECT_EQ(Whole(*journal_), before);
  Reopen();
  EXPECT_EQ(Whole(*journal_), before);
}

// Steps at random, by name of what there is.
class RandomSteps {
 public:
  explicit RandomSteps(uint32_t seed) : random_(seed) {}

  v1::SessionEvent Next(absl::Time now) {
    v1::SessionEvent event;
    switch (Pick(20)) {
      case 0:
      case 1: {
        const std::string name = Named("upload", ++uploads_);
        event.mutable_upload_created()->mutable_upload()->set_name(name);
        open_.insert(name);
        return event;
      }
      case 2:
        if (open_.empty()) break;
        event.mutable_upload_ended()->mutable_upload()->set_name(Take(open_));
        return event;
      case 3: {
        if (open_.empty() || Pick(4) != 0) break;
        v1::Scan& scan = *event.mutable_scan_received()->mutable_scan();
        scan.set_upload(Take(open_));
        scan.set_name(Named("scan", scans_.size() + 1));
        scan.set_scanner(Scanner());
        *scan.mutable_create_time() = conversion::WriteTime(now);
        *scan.mutable_pose()->mutable_translation() = Place();
        scans_.push_back(scan);
        return event;
      }
      case 4:
        if (scans_.empty() || Pick(4) != 0) break;
        *event.mutable_scan_merged()->mutable_scan() = scans_[Pick(scans_.size())];
        Link(*event.mutable_scan_merged());
        return event;
      case 16: {
        if (scans_.empty() || Pick(4) != 0) break;
        v1::ScanRemovedEvent& removed = *event.mutable_scan_removed();
        *removed.mutable_scan() = scans_[Pick(scans_.size())];
        removed.set_model_version(++model_version_);
        return event;
      }
      case 17: {
        if (scans_.empty()) break;
        // A few of the last, so that some are adjusted again and some are not.
        const size_t first = scans_.size() - std::min<size_t>(scans_.size(), 1 + Pick(4));
        for (size_t i = first; i < scans_.size(); ++i) {
          v1::AdjustedPose& pose = *event.mutable_poses_adjusted()->add_poses();
          pose.set_scan(scans_[i].name());
          *pose.mutable_pose()->mutable_translation() = Place();
          if (Pick(2) == 0) pose.mutable_adjustment()->set_position_sigma_m(Pick(100));
        }
        event.mutable_poses_adjusted()->set_model_version(++model_version_);
        return event;
      }
      case 18: {
        v1::SitePrior& prior = *event.mutable_site_prior_set()->mutable_site_prior();
        prior.set_name(kSitePrior);
        prior.set_display_name(absl::StrCat(Pick(1'000)));
        return event;
      }
      case 19:
        if (Pick(3) != 0) break;
        event.mutable_site_prior_cleared()->mutable_site_prior()->set_name(kSitePrior);
        return event;
      case 5: {
        v1::Rejection& rejection = *event.mutable_view_rejected()->mutable_rejection();
        rejection.set_name(Named("rejection", ++rejections_));
        if (Pick(4) == 0 && rejections_ > 3) {
          // One of the last, which may have expired.
          const std::string before = Named("rejection", --rejections_ - Pick(3));
          event.mutable_rejection_deleted()->mutable_rejection()->set_name(before);
          return event;
        }
        if (Pick(500) != 0) {
          *rejection.mutable_expire_time() = conversion::WriteTime(now + absl::Seconds(Pick(300)));
        }
        return event;
      }
      case 6: {
        if (held_.size() > 5) break;
        v1::Claim& claim = *event.mutable_claim_taken()->mutable_claim();
        claim.set_name(Named("claim", ++claims_));
        claim.set_scanner(Scanner());
        *claim.mutable_position() = Place();
        *claim.mutable_create_time() = conversion::WriteTime(now);
        *claim.mutable_expire_time() = conversion::WriteTime(now + absl::Seconds(Pick(60)));
        held_[claim.name()] = claim;
        return event;
      }
      case 7:
      case 8: {
        if (held_.empty()) break;
        v1::Claim& claim = Held();
        *claim.mutable_expire_time() = conversion::WriteTime(now + absl::Seconds(Pick(60)));
        *event.mutable_claim_renewed()->mutable_claim() = claim;
        return event;
      }
      case 9: {
        if (held_.empty()) break;
        const v1::Claim claim = Held();
        *event.mutable_claim_ended()->mutable_claim() = claim;
        event.mutable_claim_ended()->set_end_reason(
            Pick(2) == 0 ? v1::CLAIM_END_REASON_RELEASED : v1::CLAIM_END_REASON_SCAN_ARRIVED);
        held_.erase(claim.name());
        return event;
      }
      case 10: {
        if (stations_.size() > 3) break;
        const std::string name = Named("station", ++station_count_);
        event.mutable_station_created()->mutable_station()->set_name(name);
        stations_.insert(name);
        return event;
      }
      case 11: {
        v1::Scanner& scanner = *event.mutable_scanner_updated()->mutable_scanner();
        scanner.set_name(Scanner());
        scanner.set_operator_(absl::StrCat(Pick(1'000)));
        return event;
      }
      case 12: {
        const std::string name = Named("plan", ++plan_count_);
        event.mutable_plan_created()->mutable_plan()->set_name(name);
        running_.insert(name);
        return event;
      }
      case 13: {
        if (running_.empty()) break;
        const std::string name = Take(running_);
        event.mutable_plan_ended()->mutable_plan()->set_name(name);
        ended_plans_.insert(name);
        return event;
      }
      case 14:
        if (ended_plans_.empty()) break;
        event.mutable_plan_deleted()->set_plan(Take(ended_plans_));
        return event;
      default:
        if (stations_.empty()) break;
        event.mutable_station_ended()->mutable_station()->set_name(Take(stations_));
        if (Pick(3) == 0) event.mutable_station_ended()->set_scan(Named("scan", 1));
        return event;
    }
    event.mutable_session_updated()->mutable_session()->set_name(kSession);
    event.mutable_session_updated()->mutable_session()->set_display_name(
        absl::StrCat(Pick(1'000'000)));
    return event;
  }
  // Most have one. Those that were forgotten are used again.
  std::string Request() { return Pick(5) == 0 ? "" : absl::StrCat("request-", requests_++ % 5000); }

 private:
  uint32_t Pick(size_t below) { return static_cast<uint32_t>(random_() % below); }
  std::string Take(std::set<std::string>& from) {
    auto it = from.begin();
    std::advance(it, Pick(from.size()));
    std::string name = *it;
    from.erase(it);
    return name;
  }
  // To some of those before it.
  void Link(v1::ScanMergedEvent& merged) {
    for (const v1::Scan& scan : scans_) {
      if (!(scan.name() < merged.scan().name()) || Pick(3) != 0) continue;
      v1::ScanLink& link = *merged.add_links();
      link.set_first_scan(scan.name());
      link.set_second_scan(merged.scan().name());
      link.set_overlap_share(Pick(100));
    }
  }
  std::string Scanner() { return Named("scanner", 1 + Pick(2)); }
  v1::Claim& Held() {
    auto it = held_.begin();
    std::advance(it, Pick(held_.size()));
    return it->second;
  }
  v1::Vector3 Place() {
    v1::Vector3 place;
    place.set_x(Pick(3) * 2.0);
    return place;
  }

  std::mt19937 random_;
  uint64_t uploads_ = 0;
  uint64_t rejections_ = 0;
  uint64_t claims_ = 0;
  uint64_t station_count_ = 0;
  uint64_t plan_count_ = 0;
  uint64_t requests_ = 0;
  uint64_t model_version_ = 0;
  std::set<std::string> open_;
  std::set<std::string> stations_;
  std::set<std::string> running_;
  std::set<std::string> ended_plans_;
  std::map<std::string, v1::Claim> held_;
  std::vector<v1::Scan> scans_;
};

class RandomLogTest : public LogCompactionTest, public ::testing::WithParamInterface<uint32_t> {};

TEST_P(RandomLogTest, FoldsToTheSameStateForEver) {
  RandomSteps steps(GetParam());
  for (int i = 0; i < 2; ++i) {
    v1::SessionEvent event;
    event.mutable_scanner_created()->mutable_scanner()->set_name(Named("scanner", ++scanners_));
    Do(event);
  }
  for (int round = 0; round < 6; ++round) {
    for (int i = 0; i < 2500; ++i) Do(steps.Next(now_), steps.Request());
    const std::string whole = WholeOfAll();
    ASSERT_EQ(Whole(*journal_), whole) << "round " << round;
    ASSERT_GT(journal_->Compact().value(), 0);
    ASSERT_EQ(Whole(*journal_), whole) << "round " << round;
    // The next round goes on from what was read again, or from what was there.
    if (round % 2 == 0) Reopen();
    ASSERT_EQ(Whole(*journal_), whole) << "round " << round;
  }
  // What nothing depends on does not add up.
  const std::vector<storage::v1::LogEntry> left = store_.Read("job", 0, 100'000).value();
  const auto ended = std::count_if(
      left.begin(), left.end(), [](const auto& entry) { return entry.event().has_upload_ended(); });
  EXPECT_LE(static_cast<size_t>(ended), SessionState::kEndedUploads + LogCompaction::kNewest / 12);
  EXPECT_GT(ended, 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomLogTest, ::testing::Values(1U, 2U));

}  // namespace
}  // namespace vantage::session
