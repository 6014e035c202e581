// The log of one session as it is written, read again and watched, with a store that can fail.
#include "server/session/journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using ::testing::ElementsAre;

constexpr char kName[] = "sessions/job";

// Appends fail for as long as it is told to.
class FickleStore : public store::MemoryStore {
 public:
  FickleStore() : MemoryStore(size_t{1} << 20) {}
  absl::Status Append(const std::string& session, const storage::v1::LogEntry& entry) override {
    if (failing) return absl::UnavailableError("the medium fails");
    return MemoryStore::Append(session, entry);
  }
  bool failing = false;
};

class JournalTest : public ::testing::Test {
 protected:
  JournalTest() {
    v1::SessionEvent opened;
    opened.mutable_session_created()->mutable_session()->set_name(kName);
    EXPECT_TRUE(Step(journal_, {}, opened).ok());
  }
  static RequestKey KeyOf(const std::string& id, const std::string& scanner) {
    return RequestKey::Of(id, "CreateScanner", Scanner(scanner));
  }
  static v1::Scanner Scanner(const std::string& id) {
    v1::Scanner scanner;
    scanner.set_name(absl::StrCat(kName, "/scanners/", id));
    return scanner;
  }
  static absl::StatusOr<std::string> Step(Journal& journal, const RequestKey& key,
                                          const v1::SessionEvent& event) {
    return journal.Execute(key, [&](const SessionState&) -> absl::StatusOr<Draft> {
      Draft draft;
      draft.event = event;
      return draft;
    });
  }
  static absl::StatusOr<std::string> AddScanner(Journal& journal, const std::string& id,
                                                const RequestKey& key = {}) {
    v1::SessionEvent event;
    *event.mutable_scanner_created()->mutable_scanner() = Scanner(id);
    return Step(journal, key, event);
  }
  static std::vector<std::string> Scanners(const Journal& journal) {
    std::vector<std::string> names;
    journal.Read([&](const SessionState& state) { names = state.scanner_order; });
    return names;
  }
  static std::vector<uint64_t> Sequences(const Journal& journal, uint64_t after, size_t limit) {
    std::vector<uint64_t> sequences;
    const auto events = journal.Events(after, limit);
    EXPECT_TRUE(events.ok()) << events.status();
    for (const v1::SessionEvent& event : events.value()) sequences.push_back(event.sequence());
    return sequences;
  }

  absl::StatusOr<std::unique_ptr<Journal>> Open(const std::string& session) {
    return Journal::Open(session, store_, fixture::FixtureTime, absl::ZeroDuration);
  }

  FickleStore store_;
  Journal journal_{"job", store_, fixture::FixtureTime, absl::ZeroDuration};
};

TEST_F(JournalTest, AStepIsWrittenWithItsNumberAndTimeAndAnswersItsResource) {
  EXPECT_EQ(AddScanner(journal_, "red").value(), "sessions/job/scanners/red");
  EXPECT_EQ(AddScanner(journal_, "blue").value(), "sessions/job/scanners/blue");
  const auto entries = store_.Read("job", 0, 10).value();
  ASSERT_EQ(entries.size(), 3U);
  for (size_t i = 0; i < entries.size(); ++i) {
    EXPECT_EQ(entries[i].event().sequence(), i + 1);
    EXPECT_EQ(entries[i].event().time().seconds(), absl::ToUnixSeconds(fixture::FixtureTime()));
    EXPECT_EQ(entries[i].format_version(), store::kLogFormatVersion);
  }
  EXPECT_THAT(Scanners(journal_),
              ElementsAre("sessions/job/scanners/red", "sessions/job/scanners/blue"));
}

TEST_F(JournalTest, EventsComeInOrderFromAnyPlaceOn) {
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(AddScanner(journal_, id).ok());
  EXPECT_THAT(Sequences(journal_, 0, 10), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(Sequences(journal_, 1, 2), ElementsAre(2, 3));
  EXPECT_THAT(Sequences(journal_, 4, 10), ElementsAre());
}

// More entries than are read at a time.
TEST_F(JournalTest, IsReadAgainAsItWas) {
  std::vector<std::string> names;
  names.reserve(600);
  for (int i = 0; i < 600; ++i) names.push_back(AddScanner(journal_, absl::StrCat(i)).value());
  const auto opened = Open("job");
  ASSERT_TRUE(opened.ok()) << opened.status();
  Journal& again = **opened;
  EXPECT_EQ(Scanners(again), names);
  // And goes on where it ended.
  ASSERT_TRUE(AddScanner(again, "next").ok());
  EXPECT_THAT(Sequences(again, 601, 10), ElementsAre(602));
}

TEST_F(JournalTest, ARefusalChangesNothing) {
  const absl::Status refused =
      journal_.Execute({}, [](const SessionState&) { return absl::OutOfRangeError("too far"); })
          .status();
  EXPECT_EQ(refused, absl::OutOfRangeError("too far"));
  EXPECT_THAT(Sequences(journal_, 0, 10), ElementsAre(1));
}

// What was not written has not happened, and its number goes to the next.
TEST_F(JournalTest, WhatTheStoreCannotKeepHasNotHappened) {
  int woken = 0;
  journal_.Watch([&] { ++woken; });
  bool applied = false;
  store_.failing = true;
  v1::SessionEvent event;
  *event.mutable_scanner_created()->mutable_scanner() = Scanner("red");
  const absl::Status failed = journal_
                                  .Execute(
                                      KeyOf("r1", "red"),
                                      [&](const SessionState&) -> absl::StatusOr<Draft> {
                                        Draft draft;
                                        draft.event = event;
                                        return draft;
                                      },
                                      [&] { applied = true; })
                                  .status();
  EXPECT_TRUE(absl::IsUnavailable(failed)) << failed;
  EXPECT_FALSE(applied);
  EXPECT_EQ(woken, 0);
  EXPECT_THAT(Scanners(journal_), ElementsAre());
  store_.failing = false;
  EXPECT_TRUE(AddScanner(journal_, "red", KeyOf("r1", "red")).ok());
  EXPECT_THAT(Sequences(journal_, 0, 10), ElementsAre(1, 2));
}

TEST_F(JournalTest, ARepeatedRequestIsAnsweredAndDoesNothing) {
  const std::string made = AddScanner(journal_, "red", KeyOf("r1", "red")).value();
  ASSERT_TRUE(AddScanner(journal_, "blue").ok());
  int woken = 0;
  journal_.Watch([&] { ++woken; });
  EXPECT_EQ(AddScanner(journal_, "red", KeyOf("r1", "red")).value(), made);
  EXPECT_THAT(Sequences(journal_, 0, 10), ElementsAre(1, 2, 3));
  EXPECT_EQ(woken, 0);
  // After a restart, too.
  const auto opened = Open("job");
  ASSERT_TRUE(opened.ok()) << opened.status();
  Journal& again = **opened;
  EXPECT_EQ(AddScanner(again, "red", KeyOf("r1", "red")).value(), made);
}

TEST_F(JournalTest, ARequestIdIsForOneRequest) {
  ASSERT_TRUE(AddScanner(journal_, "red", KeyOf("r1", "red")).ok());
  RequestKey method = KeyOf("r1", "red");
  method.method = "ClaimView";
  for (const RequestKey& other : {KeyOf("r1", "blue"), method}) {
    const absl::Status reused = AddScanner(journal_, "blue", other).status();
    EXPECT_TRUE(absl::IsAlreadyExists(reused)) << reused;
    EXPECT_EQ(contract::ReasonOf(reused), "REQUEST_ID_REUSED");
  }
  EXPECT_THAT(Sequences(journal_, 0, 10), ElementsAre(1, 2));
}

TEST_F(JournalTest, RequestsWithoutAnIdAreNeverRepetitions) {
  EXPECT_TRUE(AddScanner(journal_, "red", KeyOf("", "red")).ok());
  EXPECT_TRUE(AddScanner(journal_, "blue", KeyOf("", "red")).ok());
  EXPECT_THAT(Sequences(journal_, 0, 10), ElementsAre(1, 2, 3));
}

// Whoever is told sees it done; what runs before that, `applied`, is seen by nobody else.
TEST_F(JournalTest, WatchersAreToldAfterEachStepUntilTheyLeave) {
  std::vector<size_t> seen;
  const Journal::WatchId first = journal_.Watch([&] { seen.push_back(Scanners(journal_).size()); });
  int second = 0;
  journal_.Watch([&] { ++second; });
  ASSERT_TRUE(AddScanner(journal_, "red").ok());
  ASSERT_TRUE(AddScanner(journal_, "blue").ok());
  journal_.Unwatch(first);
  ASSERT_TRUE(AddScanner(journal_, "green").ok());
  journal_.Wake();
  EXPECT_THAT(seen, ElementsAre(1, 2));
  EXPECT_EQ(second, 4);
}

TEST_F(JournalTest, AfterItsEndEveryStepIsRefused) {
  journal_.Close();
  EXPECT_TRUE(absl::IsAborted(AddScanner(journal_, "red").status()));
  EXPECT_EQ(store_.Read("job", 0, 10).value().size(), 1U);
  EXPECT_TRUE(absl::IsNotFound(journal_.Events(0, 10).status()));
}

// Each step is checked against the state that the one before it left.
TEST_F(JournalTest, StepsOfManyThreadsComeOneAfterTheOther) {
  constexpr int kThreads = 4;
  constexpr int kSteps = 50;
  std::vector<std::thread> threads;
  threads.reserve(kThreads);
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < kSteps; ++i) {
        const auto made = journal_.Execute({}, [](const SessionState& state) {
          Draft draft;
          *draft.event.mutable_scanner_created()->mutable_scanner() =
              Scanner(absl::StrCat(state.scanner_order.size()));
          return absl::StatusOr<Draft>(draft);
        });
        EXPECT_TRUE(made.ok()) << made.status();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const std::vector<std::string> names = Scanners(journal_);
  ASSERT_EQ(names.size(), static_cast<size_t>(kThreads * kSteps));
  for (size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(names[i], absl::StrCat(kName, "/scanners/", i));
  }
}

TEST_F(JournalTest, ALogThatDoesNotFitTogetherIsNotRead) {
  storage::v1::LogEntry entry;
  entry.set_format_version(store::kLogFormatVersion);
  entry.mutable_event()->set_sequence(2);
  *entry.mutable_event()->mutable_scanner_created()->mutable_scanner() = Scanner("red");
  ASSERT_TRUE(store_.Append("job", entry).ok());
  entry.mutable_event()->set_sequence(3);  // the same scanner again
  ASSERT_TRUE(store_.Append("job", entry).ok());
  const absl::Status read = Open("job").status();
  EXPECT_TRUE(absl::IsInternal(read)) << read;
  EXPECT_TRUE(absl::IsNotFound(Open("none").status()));
}

// Another session may be opened with the id of one that was deleted, by another tenant.
TEST_F(JournalTest, AClosedLogReadsNothingOfTheNextOneOfItsId) {
  EXPECT_EQ(journal_.Events(0, 10).value().size(), 1U);
  ASSERT_TRUE(store_.Drop("job").ok());
  journal_.Close();
  Journal next("job", store_, fixture::FixtureTime, absl::ZeroDuration);
  v1::SessionEvent opened;
  opened.mutable_session_created()->mutable_session()->set_name(kName);
  ASSERT_TRUE(Step(next, {}, opened).ok());
  ASSERT_TRUE(AddScanner(next, "drone").ok());
  EXPECT_EQ(next.Events(0, 10).value().size(), 2U);
  EXPECT_TRUE(absl::IsNotFound(journal_.Events(0, 10).status()));
  EXPECT_TRUE(absl::IsNotFound(journal_.Events(1, 10).status()));
}

// A log gives the same state whenever it is read, whatever was forgotten meanwhile.
TEST_F(JournalTest, TheLastRequestsAreRemembered) {
  v1::SessionEvent updated;
  updated.mutable_session_updated()->mutable_session()->set_name(kName);
  const auto key = [](size_t i) { return KeyOf(absl::StrCat("request-", i), "red"); };
  for (size_t i = 0; i < SessionState::kRequests + 10; ++i) {
    ASSERT_TRUE(Step(journal_, key(i), updated).ok());
  }
  const auto opened = Open("job");
  ASSERT_TRUE(opened.ok()) << opened.status();
  Journal& again = **opened;
  for (const Journal* journal : {&journal_, &again}) {
    journal->Read([](const SessionState& state) {
      EXPECT_EQ(state.requests.size(), SessionState::kRequests);
      EXPECT_EQ(state.requests.count("request-9"), 0U);
      EXPECT_EQ(state.requests.count("request-10"), 1U);
    });
  }
  EXPECT_EQ(again.bytes(), journal_.bytes());
  // Executed before: nothing is written.
  const int64_t before = journal_.bytes();
  EXPECT_TRUE(Step(journal_, key(10), updated).ok());
  EXPECT_EQ(journal_.bytes(), before);
  EXPECT_TRUE(Step(journal_, key(9), updated).ok());
  EXPECT_GT(journal_.bytes(), before);
}

// Whenever it begins, and whoever writes meanwhile.
TEST_F(JournalTest, WhoCountsItsBytesMissesNone) {
  ASSERT_TRUE(AddScanner(journal_, "before").ok());
  std::thread writer([&] {
    for (int i = 0; i < 200; ++i) EXPECT_TRUE(AddScanner(journal_, absl::StrCat(i)).ok());
  });
  int64_t counted = 0;
  journal_.OnWritten([&](int64_t bytes) { counted += bytes; });
  writer.join();
  ASSERT_TRUE(AddScanner(journal_, "after").ok());
  EXPECT_EQ(counted, journal_.bytes());
}

TEST_F(JournalTest, ALogThatIsFullSaysSo) {
  EXPECT_TRUE(journal_.CheckRoom(journal_.bytes() + 1).ok());
  EXPECT_EQ(contract::ReasonOf(journal_.CheckRoom(journal_.bytes())), "LOG_FULL");
}

}  // namespace
}  // namespace vantage::session
