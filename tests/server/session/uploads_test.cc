// An upload that is held while others end it: who holds it hears what those hear who find it by
// name.
#include "server/session/uploads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes/checksum.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

class UploadsTest : public testing::Test {
 protected:
  UploadsTest() { name_ = session_->uploads().Create({}).value().name(); }

  v1::UploadTotal Total() const {
    v1::UploadTotal total;
    total.set_encoded_size_bytes(static_cast<int64_t>(whole_.size()));
    total.set_sha256(bytes::Sha256::Of(whole_));
    return total;
  }
  v1::Piece Cut(int64_t sequence, size_t offset, size_t size) const {
    v1::Piece piece;
    piece.set_sequence(sequence);
    piece.set_offset(static_cast<int64_t>(offset));
    piece.set_data(whole_.substr(offset, size));
    piece.set_crc32c(bytes::Crc32c(piece.data()));
    return piece;
  }
  absl::StatusOr<v1::Upload> Take(HeldUpload& held, const v1::Piece& piece) const {
    const UnpackedPiece unpacked(piece, contract::Limits());
    return held.Take(&unpacked, nullptr);
  }
  // With a piece that is taken and not durable.
  HeldUpload Begun() {
    HeldUpload held = session_->uploads().Hold(name_);
    EXPECT_EQ(Take(held, Cut(0, 0, 1000))->state(), v1::UPLOAD_STATE_OPEN);
    EXPECT_EQ(held.UnsyncedBytes(), 1000);
    return held;
  }

  const std::string whole_ = fixture::EncodedRoom();
  std::atomic<int64_t> now_{1'700'000'000};
  store::MemoryStore store_{64 << 20};
  fixture::Script script_;
  fixture::SessionHost host_{
      store_, script_.Make(), {}, [this] { return absl::FromUnixSeconds(now_.load()); }};
  std::shared_ptr<Session> session_ = fixture::OpenSession(host_.registry, "job");
  std::string name_;
};

TEST_F(UploadsTest, AHeldUploadTakesItsPiecesToTheScan) {
  HeldUpload held = Begun();
  EXPECT_EQ(session_->uploads().Get(name_)->next_offset(), 0);
  EXPECT_EQ(held.Sync()->next_offset(), 1000);
  EXPECT_EQ(held.UnsyncedBytes(), 0);
  ASSERT_TRUE(Take(held, Cut(1, 1000, whole_.size())).ok());
  const v1::UploadTotal total = Total();
  const v1::Upload ended = held.Take(nullptr, &total).value();
  EXPECT_EQ(ended.state(), v1::UPLOAD_STATE_COMMITTED);
  EXPECT_EQ(ended.scan(), "sessions/job/scans/scan-1");
  EXPECT_EQ(session_->uploads().OpenCount(), 0U);
}

TEST_F(UploadsTest, WhenAnotherHandHasCommittedItTheHolderHearsOfTheScan) {
  HeldUpload held = Begun();
  const v1::Piece rest = Cut(1, 1000, whole_.size());
  const v1::UploadTotal total = Total();
  const v1::Upload committed = session_->uploads().Add(name_, &rest, &total).value();
  ASSERT_EQ(committed.state(), v1::UPLOAD_STATE_COMMITTED);
  EXPECT_EQ(Take(held, rest)->SerializeAsString(), committed.SerializeAsString());
  EXPECT_EQ(held.Take(nullptr, nullptr)->SerializeAsString(), committed.SerializeAsString());
  EXPECT_EQ(held.Sync()->SerializeAsString(), committed.SerializeAsString());
  EXPECT_EQ(held.UnsyncedBytes(), 0);
}

// A piece that is sent again since its answer was lost is known, also after a restart; any other
// has come to the wrong upload.
TEST_F(UploadsTest, AfterTheCommitAnythingElseIsRefused) {
  const v1::UploadTotal total = Total();
  ASSERT_TRUE(session_->uploads().Create({}).ok());
  const v1::Piece first = Cut(0, 0, 1000);
  const v1::Piece rest = Cut(1, 1000, whole_.size());
  ASSERT_TRUE(session_->uploads().Add(name_, &first, nullptr).ok());
  ASSERT_EQ(session_->uploads().Add(name_, &rest, &total)->state(), v1::UPLOAD_STATE_COMMITTED);
  session_->WaitUntilIdle();
  v1::Piece other = rest;
  (*other.mutable_data())[500] ^= 1;
  other.set_crc32c(bytes::Crc32c(other.data()));
  v1::Piece elsewhere = rest;
  elsewhere.set_offset(1001);
  v1::Piece beyond = rest;
  beyond.set_sequence(2);
  v1::UploadTotal other_total = total;
  other_total.set_sha256(bytes::Sha256::Of("another"));
  fixture::SessionHost again(store_, script_.Make());
  ASSERT_TRUE(again.registry.LoadAll().ok());
  for (const auto& session : {session_, again.registry.Find("job").value()}) {
    Uploads& uploads = session->uploads();
    for (const v1::Piece* known : {&first, &rest}) {
      const auto repeated = uploads.Add(name_, known, nullptr);
      ASSERT_TRUE(repeated.ok()) << repeated.status();
      EXPECT_EQ(repeated->scan(), "sessions/job/scans/scan-1");
      EXPECT_TRUE(uploads.Add(name_, known, &total).ok());
    }
    EXPECT_TRUE(uploads.Add(name_, nullptr, &total).ok());
    for (const v1::Piece* unknown : {&other, &elsewhere, &beyond}) {
      const absl::Status refused = uploads.Add(name_, unknown, nullptr).status();
      EXPECT_EQ(contract::ReasonOf(refused), "UPLOAD_ENDED") << refused;
      EXPECT_TRUE(absl::IsFailedPrecondition(refused));
    }
    EXPECT_EQ(contract::ReasonOf(uploads.Add(name_, &rest, &other_total).status()), "UPLOAD_ENDED");
    EXPECT_EQ(contract::ReasonOf(uploads.Add(name_, nullptr, &other_total).status()),
              "UPLOAD_ENDED");
    v1::Piece damaged = rest;
    damaged.set_crc32c(1);
    EXPECT_EQ(contract::ReasonOf(uploads.Add(name_, &damaged, nullptr).status()), "PIECE_DAMAGED");
  }
}

// Not after half a gigabyte.
TEST_F(UploadsTest, WhatIsNoRangeImageEndsWithThePieceThatShowsIt) {
  v1::Piece junk;
  junk.set_data(std::string(1000, 'X'));
  junk.set_crc32c(bytes::Crc32c(junk.data()));
  const absl::Status refused = session_->uploads().Add(name_, &junk, nullptr).status();
  EXPECT_TRUE(absl::IsInvalidArgument(refused)) << refused;
  EXPECT_NE(refused.message().find("magic"), absl::string_view::npos) << refused;
  const v1::Upload ended = session_->uploads().Get(name_).value();
  EXPECT_EQ(ended.state(), v1::UPLOAD_STATE_FAILED);
  EXPECT_FALSE(ended.state_message().empty());
  EXPECT_EQ(session_->uploads().OpenCount(), 0U);
  EXPECT_TRUE(store_.Spools()->empty());
  junk.set_sequence(1);
  junk.set_offset(1000);
  EXPECT_EQ(contract::ReasonOf(session_->uploads().Add(name_, &junk, nullptr).status()),
            "UPLOAD_ENDED");
}

TEST_F(UploadsTest, WhenItHasExpiredTheHolderHearsWhy) {
  HeldUpload held = Begun();
  now_ += absl::ToInt64Seconds(contract::Limits().upload_idle) + 1;
  session_->uploads().Expire();
  const v1::Piece next = Cut(1, 1000, 1000);
  const absl::Status refused = Take(held, next).status();
  EXPECT_EQ(contract::ReasonOf(refused), "UPLOAD_ENDED");
  EXPECT_EQ(refused.message(), name_ + " is UPLOAD_STATE_EXPIRED: no piece came for too long");
  EXPECT_EQ(refused, session_->uploads().Add(name_, &next, nullptr).status());
  // A question, or what was taken before, is answered from the log.
  EXPECT_EQ(held.Take(nullptr, nullptr)->state(), v1::UPLOAD_STATE_EXPIRED);
  EXPECT_EQ(held.Sync()->state(), v1::UPLOAD_STATE_EXPIRED);
  EXPECT_EQ(held.UnsyncedBytes(), 0);
  EXPECT_FALSE(held.WindowFull());
}

TEST_F(UploadsTest, WhenItsSessionIsDeletedThereIsNoSuchUpload) {
  HeldUpload held = Begun();
  ASSERT_TRUE(host_.registry.Delete("job").ok());
  const v1::Piece next = Cut(1, 1000, 1000);
  EXPECT_EQ(Take(held, next).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Take(held, next).status(), session_->uploads().Add(name_, &next, nullptr).status());
  EXPECT_EQ(held.UnsyncedBytes(), 0);
  EXPECT_EQ(store_.Spools()->size(), 0U);
}

TEST_F(UploadsTest, OneThatThereNeverWasIsNotFound) {
  HeldUpload held = session_->uploads().Hold("sessions/job/uploads/upload-7");
  EXPECT_EQ(Take(held, Cut(0, 0, 1000)).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(held.Sync().status().code(), absl::StatusCode::kNotFound);
}

// Nobody ends an upload but its sender, and some never come back.
TEST_F(UploadsTest, IdleOnesGiveWayToANewOne) {
  const v1::Piece piece = Cut(0, 0, 1000);
  ASSERT_TRUE(session_->uploads().Add(name_, &piece, nullptr).ok());
  absl::Status full;
  while (full.ok()) full = session_->uploads().Create({}).status();
  EXPECT_EQ(contract::ReasonOf(full), "TOO_MANY_UPLOADS");
  now_ += 59;
  EXPECT_FALSE(session_->uploads().Create({}).ok());
  now_ += 2;
  EXPECT_TRUE(session_->uploads().Create({}).ok());
  EXPECT_EQ(session_->uploads().Get(name_)->state(), v1::UPLOAD_STATE_OPEN);
  EXPECT_EQ(session_->uploads().OpenCount(), contract::Limits().open_uploads_per_session);
  now_ += 10 * 60;
  while (session_->uploads().Get(name_)->state() == v1::UPLOAD_STATE_OPEN) {
    ASSERT_TRUE(session_->uploads().Create({}).ok());
  }
}

// What ends without a scan must not add up.
TEST_F(UploadsTest, ThoseThatEndedLongAgoAreForgotten) {
  std::string last = name_;
  for (size_t i = 0; i < SessionState::kEndedUploads; ++i) {
    now_ += 25 * 60 * 60;
    EXPECT_EQ(session_->uploads().Get(last)->state(), v1::UPLOAD_STATE_EXPIRED);
    last = session_->uploads().Create({}).value().name();
  }
  EXPECT_EQ(session_->uploads().Get(name_)->state(), v1::UPLOAD_STATE_EXPIRED);
  now_ += 25 * 60 * 60;
  EXPECT_EQ(session_->uploads().Get(last)->state(), v1::UPLOAD_STATE_EXPIRED);
  EXPECT_TRUE(absl::IsNotFound(session_->uploads().Get(name_).status()));
  session_->journal().Read([](const SessionState& state) {
    EXPECT_EQ(state.uploads.size(), SessionState::kEndedUploads);
  });
}

TEST_F(UploadsTest, RejectionsThatHaveExpiredGo) {
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(session_->rejections().Create({}, absl::Seconds(1), {}).ok());
  }
  now_ += 10;
  const std::string held = session_->rejections().Create({}, std::nullopt, {}).value().name();
  session_->journal().Read([&](const SessionState& state) {
    ASSERT_EQ(state.rejections.size(), 1U);
    EXPECT_EQ(state.rejections[0].name(), held);
  });
}

// Its place and its bytes are free at once, whoever holds it hears of it, and asking again changes
// nothing, after a restart either.
TEST_F(UploadsTest, OneThatIsGivenUpMakesRoomAndStaysEnded) {
  HeldUpload held = Begun();
  ASSERT_TRUE(held.Sync().ok());
  v1::AbortUploadRequest request;
  request.set_name(name_);
  request.set_request_id("once");
  const RequestKey key = RequestKey::Of("once", "AbortUpload", request);
  const v1::Upload ended = session_->uploads().Abort(name_, key).value();
  EXPECT_EQ(ended.state(), v1::UPLOAD_STATE_ABORTED);
  EXPECT_EQ(session_->uploads().OpenCount(), 0U);
  EXPECT_EQ(contract::ReasonOf(Take(held, Cut(1, 1000, 500)).status()), "UPLOAD_ENDED");
  for (const RequestKey& again : {key, RequestKey()}) {
    EXPECT_EQ(session_->uploads().Abort(name_, again)->SerializeAsString(),
              ended.SerializeAsString());
  }
  EXPECT_TRUE(
      absl::IsNotFound(session_->uploads().Abort("sessions/job/uploads/none", {}).status()));
  fixture::SessionHost next(store_, script_.Make(), {},
                            [this] { return absl::FromUnixSeconds(now_.load()); });
  ASSERT_TRUE(next.registry.LoadAll().ok());
  EXPECT_EQ(next.registry.Find("job").value()->uploads().Get(name_)->state(),
            v1::UPLOAD_STATE_ABORTED);
}

TEST_F(UploadsTest, OneThatHasBecomeAScanIsNotGivenUp) {
  const v1::Piece all = Cut(0, 0, whole_.size());
  const v1::UploadTotal total = Total();
  ASSERT_EQ(session_->uploads().Add(name_, &all, &total)->state(), v1::UPLOAD_STATE_COMMITTED);
  const absl::Status refused = session_->uploads().Abort(name_, {}).status();
  EXPECT_EQ(contract::ReasonOf(refused), "UPLOAD_ENDED");
  EXPECT_NE(refused.message().find("scan-1"), std::string::npos) << refused;
}

TEST_F(UploadsTest, AreListedInOrderByStateAndInPages) {
  for (int i = 2; i <= 11; ++i) ASSERT_TRUE(session_->uploads().Create({}).ok());
  ASSERT_TRUE(session_->uploads().Abort("sessions/job/uploads/upload-3", {}).ok());
  ASSERT_TRUE(Begun().Sync().ok());
  const auto names = [&](const v1::ListUploadsRequest& request, size_t page) {
    std::vector<int64_t> numbers;
    std::string after;
    for (bool more = true; more;) {
      for (const v1::Upload& upload :
           std::vector<v1::Upload>(session_->uploads().List(request, after, page, more).value())) {
        numbers.push_back(contract::NumberOf(upload.name()));
        after = upload.name();
        EXPECT_EQ(upload.next_offset(), upload.name() == name_ ? 1000 : 0);
      }
    }
    return numbers;
  };
  v1::ListUploadsRequest request;
  EXPECT_EQ(names(request, 4), (std::vector<int64_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
  request.add_states(v1::UPLOAD_STATE_OPEN);
  EXPECT_EQ(names(request, 3), (std::vector<int64_t>{1, 2, 4, 5, 6, 7, 8, 9, 10, 11}));
  request.set_states(0, v1::UPLOAD_STATE_ABORTED);
  EXPECT_EQ(names(request, 3), (std::vector<int64_t>{3}));
  bool more = false;
  EXPECT_TRUE(absl::IsInvalidArgument(
      session_->uploads().List(request, "sessions/job/uploads/upload-12", 3, more).status()));
}

}  // namespace
}  // namespace vantage::session
