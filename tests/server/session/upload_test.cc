#include "server/session/upload.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/bytes/compression.h"
#include "core/sensor/encoding.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/store/memory_store.h"
#include "vantage/v1/error.pb.h"

namespace vantage::session {
namespace {

class UploadTest : public testing::Test {
 protected:
  UploadTest() {
    std::mt19937 random(11);
    sensor::RangeImage image;
    for (int c = 0; c < 100; ++c) image.azimuth.push_back(0.06 * c);
    for (int r = 0; r < 24; ++r) image.elevation.push_back(0.06 * (r - 12));
    image.native_azimuth_step = image.native_elevation_step = 0.06;
    for (size_t i = 0; i < image.cells(); ++i) {
      image.range.push_back(random() % 9 == 0 ? sensor::RangeImage::kNoReturn
                                              : 2.0f + 1e-4f * static_cast<float>(random() % 50));
    }
    samples_ = image.SampleCount();
    whole_ = sensor::EncodeRangeImage(image);
    limits_.piece_bytes = 4096;
    limits_.encoded_scan_bytes = 1 << 20;
  }

  v1::Upload Created(bool with_total) const {
    v1::Upload upload;
    upload.set_name("sessions/s/uploads/upload-1");
    upload.set_state(v1::UPLOAD_STATE_OPEN);
    if (with_total) *upload.mutable_total() = Total();
    return upload;
  }
  v1::UploadTotal Total() const {
    v1::UploadTotal total;
    total.set_encoded_size_bytes(static_cast<int64_t>(whole_.size()));
    total.set_sha256(bytes::Sha256::Of(whole_));
    return total;
  }
  v1::Piece Cut(int64_t sequence, size_t offset, size_t size, bool compressed = false) const {
    v1::Piece piece;
    const std::string bytes = whole_.substr(offset, size);
    piece.set_sequence(sequence);
    piece.set_offset(static_cast<int64_t>(offset));
    piece.set_crc32c(bytes::Crc32c(bytes));
    piece.set_data(compressed ? bytes::ZstdCompress(bytes) : bytes);
    piece.set_compression(compressed ? v1::COMPRESSION_ZSTD : v1::COMPRESSION_NONE);
    if (compressed) piece.set_uncompressed_size_bytes(static_cast<int64_t>(bytes.size()));
    return piece;
  }

  // Committed, it is kept as the whole; then it ends.
  void ExpectWhole(Upload& upload, store::Store& store) const {
    const absl::StatusOr<Upload::Content> content = upload.Inspect();
    ASSERT_TRUE(content.ok()) << content.status();
    EXPECT_EQ(content->columns, 100U);
    EXPECT_EQ(content->rows, 24U);
    EXPECT_EQ(content->samples, samples_);
    EXPECT_EQ(content->encoded_size, static_cast<int64_t>(whole_.size()));
    ASSERT_TRUE(upload.Sync().ok());
    ASSERT_TRUE(store.PutSpool(upload.Describe().name(), content->sha256).ok());
    upload.End(v1::UPLOAD_STATE_COMMITTED, "", "scan");
    EXPECT_TRUE(store.GetBlob(bytes::Sha256::Of(whole_)).value() == whole_);
  }

  std::string whole_;
  size_t samples_ = 0;
  contract::Limits limits_;
  store::MemoryStore store_{1 << 20};
  Moment now_{absl::FromUnixSeconds(1'000'000), absl::Hours(3)};
};

// Property: however it is cut, compressed or not, with pieces repeated at random, the whole comes
// out, and the acknowledgement always says where to go on.
TEST_F(UploadTest, AnyCutWithRepetitionsGivesTheWhole) {
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    store::MemoryStore store(1 << 20);
    Upload upload(Created(seed % 2 == 0), store, limits_);
    std::vector<v1::Piece> sent;
    size_t offset = 0;
    size_t durable = 0;
    size_t durable_pieces = 0;
    const auto expect_durable = [&] {
      EXPECT_EQ(upload.Describe().next_offset(), static_cast<int64_t>(durable));
      EXPECT_EQ(upload.Describe().next_sequence(), static_cast<int64_t>(durable_pieces));
      EXPECT_EQ(upload.Unsynced(), static_cast<int64_t>(offset - durable));
    };
    while (offset < whole_.size()) {
      const size_t size = std::min<size_t>(1 + random() % 4096, whole_.size() - offset);
      sent.push_back(Cut(static_cast<int64_t>(sent.size()), offset, size, random() % 2 == 0));
      offset += size;
      ASSERT_TRUE(upload.Accept(sent.back(), now_).ok());
      expect_durable();
      if (random() % 3 == 0) {
        ASSERT_TRUE(upload.Sync().ok());
        durable = offset;
        durable_pieces = sent.size();
      }
      if (random() % 3 == 0) {
        ASSERT_TRUE(upload.Accept(sent[random() % sent.size()], now_).ok());
        expect_durable();
      }
    }
    if (seed % 2 == 1) {
      EXPECT_FALSE(upload.Complete());
      ASSERT_TRUE(upload.SetTotal(Total()).ok());
    }
    EXPECT_TRUE(upload.Complete());
    ExpectWhole(upload, store);
    ASSERT_TRUE(store.ReleaseBlob(bytes::Sha256::Of(whole_)).ok());
    EXPECT_EQ(store.used(), 0U);
  }
}

// Its syncs fail when told to.
class FailingStore final : public store::MemoryStore {
 public:
  using store::MemoryStore::MemoryStore;
  absl::Status SyncSpool(const std::string& spool) override {
    if (!failing) return store::MemoryStore::SyncSpool(spool);
    return absl::UnavailableError("the medium fails");
  }
  bool failing = false;
};

// After a failed sync nobody knows what is on the medium: what was durable stays, the rest is asked
// for again.
TEST_F(UploadTest, AFailedSyncTakesBackWhatWasNotDurable) {
  for (uint32_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    FailingStore store(1 << 20);
    Upload upload(Created(seed % 2 == 0), store, limits_);
    if (seed % 2 == 1) {
      ASSERT_TRUE(upload.SetTotal(Total()).ok());
    }
    while (!upload.Complete()) {
      const v1::Upload now = upload.Describe();
      size_t offset = static_cast<size_t>(now.next_offset());
      int64_t sequence = now.next_sequence();
      for (uint32_t pieces = 1 + random() % 4; pieces > 0 && offset < whole_.size(); --pieces) {
        const size_t size = std::min<size_t>(1 + random() % 4096, whole_.size() - offset);
        ASSERT_TRUE(upload.Accept(Cut(sequence++, offset, size), now_).ok());
        offset += size;
      }
      store.failing = random() % 2 == 0;
      EXPECT_EQ(upload.Sync().ok(), !store.failing);
      if (store.failing) {
        EXPECT_EQ(upload.Describe().next_offset(), now.next_offset());
        EXPECT_EQ(upload.Unsynced(), 0);
        if (!upload.Describe().has_total()) {
          ASSERT_TRUE(upload.SetTotal(Total()).ok());
        }
      }
      store.failing = false;
    }
    ExpectWhole(upload, store);
  }
}

TEST_F(UploadTest, ADifferentPieceInItsPlaceIsRefusedAndChangesNothing) {
  Upload upload(Created(true), store_, limits_);
  ASSERT_TRUE(upload.Accept(Cut(0, 0, 1000), now_).ok());
  v1::Piece other = Cut(0, 0, 1000);
  (*other.mutable_data())[5] ^= 1;
  other.set_crc32c(bytes::Crc32c(other.data()));
  EXPECT_EQ(contract::ReasonOf(upload.Accept(other, now_)), "PIECE_DIFFERS");
  EXPECT_EQ(contract::ReasonOf(upload.Accept(Cut(0, 0, 999), now_)), "PIECE_DIFFERS");
  EXPECT_TRUE(upload.Sync().ok());
  EXPECT_EQ(upload.Describe().next_offset(), 1000);
}

// Other bytes of the same size and checksum: CRC-32C is linear, so any four bytes can be made up
// for by four others.
TEST_F(UploadTest, ADifferentPieceOfTheSameChecksumIsAnotherPiece) {
  const v1::Piece sound = Cut(0, 0, 1000);
  std::string other = sound.data();
  other[10] ^= 0x7f;
  std::string base = other;
  base.replace(996, 4, 4, '\0');
  const uint32_t zero = bytes::Crc32c(base);
  std::vector<std::pair<uint32_t, uint32_t>> rows;  // effect on the checksum, bits that have it
  for (int bit = 0; bit < 32; ++bit) {
    std::string one = base;
    one[static_cast<size_t>(996 + bit / 8)] = static_cast<char>(1 << (bit % 8));
    rows.emplace_back(bytes::Crc32c(one) ^ zero, 1U << bit);
  }
  uint32_t left = sound.crc32c() ^ zero;
  uint32_t bits = 0;
  for (int bit = 31; bit >= 0; --bit) {
    const auto pivot = std::find_if(rows.begin(), rows.end(),
                                    [bit](const auto& row) { return (row.first >> bit & 1) != 0; });
    ASSERT_NE(pivot, rows.end());
    const auto [effect, changed] = *pivot;
    rows.erase(pivot);
    for (auto& row : rows) {
      if ((row.first >> bit & 1) == 0) continue;
      row.first ^= effect;
      row.second ^= changed;
    }
    if ((left >> bit & 1) == 0) continue;
    left ^= effect;
    bits ^= changed;
  }
  for (size_t i = 0; i < 4; ++i) base[996 + i] = static_cast<char>(bits >> (8 * i));
  ASSERT_EQ(bytes::Crc32c(base), sound.crc32c());
  ASSERT_NE(base, sound.data());
  v1::Piece collision = sound;
  collision.set_data(base);
  Upload upload(Created(true), store_, limits_);
  ASSERT_TRUE(upload.Accept(sound, now_).ok());
  EXPECT_EQ(contract::ReasonOf(upload.Accept(collision, now_)), "PIECE_DIFFERS");
  // Also when what came before was read back from the store.
  Upload again(Created(true), store_, limits_);
  ASSERT_TRUE(again.Resume(now_).ok());
  EXPECT_EQ(contract::ReasonOf(again.Accept(collision, now_)), "PIECE_DIFFERS");
  EXPECT_TRUE(again.Accept(sound, now_).ok());
}

TEST_F(UploadTest, AGapSaysWhichPieceIsExpected) {
  Upload upload(Created(true), store_, limits_);
  ASSERT_TRUE(upload.Accept(Cut(0, 0, 1000), now_).ok());
  const absl::Status gap = upload.Accept(Cut(2, 5000, 10), now_);
  EXPECT_EQ(contract::ReasonOf(gap), "UPLOAD_GAP");
  v1::ExpectedPiece expected;
  const auto detail = gap.GetPayload("type.googleapis.com/vantage.v1.ExpectedPiece");
  ASSERT_TRUE(detail.has_value() && expected.ParseFromString(std::string(*detail)));
  EXPECT_EQ(expected.sequence(), 1);
  EXPECT_EQ(expected.offset(), 1000);
}

TEST_F(UploadTest, GapsDamageAndOverrunsAreRefused) {
  Upload upload(Created(true), store_, limits_);
  EXPECT_EQ(contract::ReasonOf(upload.Accept(Cut(1, 1000, 10), now_)), "UPLOAD_GAP");
  EXPECT_EQ(contract::ReasonOf(upload.Accept(Cut(0, 5, 10), now_)), "UPLOAD_GAP");
  v1::Piece damaged = Cut(0, 0, 100);
  (*damaged.mutable_data())[0] ^= 1;
  EXPECT_EQ(contract::ReasonOf(upload.Accept(damaged, now_)), "PIECE_DAMAGED");
  v1::Piece truncated = Cut(0, 0, 100, true);
  truncated.mutable_data()->pop_back();
  EXPECT_EQ(contract::ReasonOf(upload.Accept(truncated, now_)), "PIECE_DAMAGED");
  // A bomb: much more than stated.
  v1::Piece bomb = Cut(0, 0, 100, true);
  std::string zeros;
  zeros.resize(100'000'000);
  bomb.set_data(bytes::ZstdCompress(zeros));
  EXPECT_EQ(contract::ReasonOf(upload.Accept(bomb, now_)), "PIECE_DAMAGED");
  v1::Piece announced = Cut(0, 0, 100, true);
  announced.set_uncompressed_size_bytes(int64_t{1} << 60);
  EXPECT_EQ(contract::ReasonOf(upload.Accept(announced, now_)), "INVALID_FIELDS");
  v1::Piece empty = Cut(0, 0, 100);
  empty.clear_data();
  EXPECT_EQ(contract::ReasonOf(upload.Accept(empty, now_)), "INVALID_FIELDS");
  EXPECT_EQ(upload.Describe().next_offset(), 0);

  v1::Upload small = Created(true);
  small.mutable_total()->set_encoded_size_bytes(50);
  Upload overrun(small, store_, limits_);
  EXPECT_EQ(contract::ReasonOf(overrun.Accept(Cut(0, 0, 51), now_)), "INVALID_FIELDS");
}

TEST_F(UploadTest, TheWholeIsCheckedAgainstWhatWasAnnounced) {
  v1::Upload created = Created(true);
  created.mutable_total()->set_sha256(bytes::Sha256::Of("something else"));
  created.mutable_total()->set_encoded_size_bytes(1000);
  Upload upload(created, store_, limits_);
  ASSERT_TRUE(upload.Accept(Cut(0, 0, 1000), now_).ok());
  EXPECT_TRUE(upload.Complete());
  EXPECT_EQ(contract::ReasonOf(upload.Inspect().status()), "SHA256_DIFFERS");
  EXPECT_EQ(contract::ReasonOf(upload.SetTotal(Total())), "TOTAL_DIFFERS");
  upload.End(v1::UPLOAD_STATE_FAILED, "differs", "");
  EXPECT_EQ(contract::ReasonOf(upload.Accept(Cut(1, 1000, 10), now_)), "UPLOAD_ENDED");
  EXPECT_TRUE(upload.Accept(Cut(0, 0, 1000), now_).ok());  // still harmless
}

TEST_F(UploadTest, WhatIsNoRangeImageIsFoundOut) {
  for (const size_t broken : {size_t{0}, size_t{9}, size_t{309}, whole_.size() - 20}) {
    SCOPED_TRACE(broken);
    const std::string sound = whole_;
    whole_[broken] = '\x7f';
    store::MemoryStore store(1 << 20);
    Upload upload(Created(true), store, limits_);
    for (size_t at = 0; at < whole_.size(); at += 700) {
      const size_t size = std::min<size_t>(700, whole_.size() - at);
      ASSERT_TRUE(upload.Accept(Cut(static_cast<int64_t>(at / 700), at, size), now_).ok());
    }
    EXPECT_TRUE(upload.Complete());
    const absl::Status status = upload.Inspect().status();
    EXPECT_EQ(contract::ReasonOf(status), "INVALID_FIELDS") << status;
    // As it would be found in the whole.
    const absl::Status whole = sensor::DecodeRangeImage(whole_, limits_.scan_cells).status();
    EXPECT_NE(status.message().find(whole.message()), absl::string_view::npos) << status << whole;
    whole_ = sound;
  }
}

// A frame that is longer than what it holds takes no more room than that.
TEST_F(UploadTest, KeepsNoFrameThatLengthens) {
  const std::string one = whole_.substr(0, 1);
  v1::Piece piece = Cut(0, 0, 1, true);
  ASSERT_GT(piece.data().size(), 1U);
  Upload upload(Created(true), store_, limits_);
  ASSERT_TRUE(upload.Accept(piece, now_).ok());
  EXPECT_LT(store_.used(), 20U);
}

TEST_F(UploadTest, FailsWithoutRoomAndGoesOnWhenThereIs) {
  store::MemoryStore store(1500);
  Upload upload(Created(true), store, limits_);
  ASSERT_TRUE(upload.Accept(Cut(0, 0, 1000), now_).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(upload.Accept(Cut(1, 1000, 1000), now_)));
  EXPECT_TRUE(upload.Sync().ok());
  EXPECT_EQ(upload.Describe().next_offset(), 1000);
  EXPECT_TRUE(upload.Accept(Cut(1, 1000, 400), now_).ok());
}

// Property: loaded from the store after any piece, it goes on as if nothing had happened.
TEST_F(UploadTest, GoesOnAfterARestart) {
  for (uint32_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    store::MemoryStore store(1 << 20);
    const bool announced = seed % 2 == 0;
    const v1::Upload created = Created(announced);
    auto upload = std::make_unique<Upload>(created, store, limits_);
    std::vector<v1::Piece> sent;
    size_t offset = 0;
    bool stated = announced;
    while (offset < whole_.size()) {
      const size_t size = std::min<size_t>(1 + random() % 4096, whole_.size() - offset);
      sent.push_back(Cut(static_cast<int64_t>(sent.size()), offset, size, random() % 2 == 0));
      offset += size;
      ASSERT_TRUE(upload->Accept(sent.back(), now_).ok());
      if (!stated && random() % 3 == 0) {
        ASSERT_TRUE(upload->SetTotal(Total()).ok());
        stated = true;
      }
      if (random() % 3 != 0) continue;
      upload = std::make_unique<Upload>(created, store, limits_);
      ASSERT_TRUE(upload->Resume(now_).ok());
      EXPECT_EQ(upload->Describe().next_offset(), static_cast<int64_t>(offset));
      EXPECT_EQ(upload->Describe().next_sequence(), static_cast<int64_t>(sent.size()));
      EXPECT_EQ(upload->Describe().has_total(), stated);
      ASSERT_TRUE(upload->Accept(sent[random() % sent.size()], now_).ok());
    }
    if (!stated) {
      ASSERT_TRUE(upload->SetTotal(Total()).ok());
    }
    ASSERT_TRUE(upload->Complete());
    ExpectWhole(*upload, store);
  }
}

TEST_F(UploadTest, IsIdleAfterItsTime) {
  Upload upload(Created(true), store_, limits_);
  ASSERT_TRUE(upload.Accept(Cut(0, 0, 1000), now_).ok());
  EXPECT_FALSE(upload.Idle(now_.seen + limits_.upload_idle));
  EXPECT_TRUE(upload.Idle(now_.seen + limits_.upload_idle + absl::Seconds(1)));
}

}  // namespace
}  // namespace vantage::session
