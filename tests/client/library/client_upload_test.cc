// Uploads against a server that behaves as the contract allows: breaks, little credit, damage.
#include <gmock/gmock.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <numbers>
#include <set>

#include "client/library/client.h"
#include "client/library/error.h"
#include "client/library/piece.h"
#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "core/sensor/encoding.h"
#include "vantage/v1/scan_service.grpc.pb.h"

namespace vantage::client {
namespace {

using ::testing::HasSubstr;

sensor::RangeImage SomeImage(int columns) {
  sensor::RangeImage image;
  for (int c = 0; c < columns; ++c) image.azimuth.push_back(2 * std::numbers::pi * c / columns);
  for (int r = 0; r < 360; ++r) image.elevation.push_back(-1.0 + r * 0.006);
  image.native_azimuth_step = 2 * std::numbers::pi / columns;
  image.native_elevation_step = 0.006;
  uint32_t state = 12345;
  for (size_t i = 0; i < image.cells(); ++i) {
    state = state * 1664525 + 1013904223;  // incompressible enough to be several pieces
    image.range.push_back(1.0f + static_cast<float>(state >> 8) * 1e-6f);
  }
  return image;
}

// One upload, kept as the contract says.
class FlakyServer final : public v1::ScanService::Service {
 public:
  int64_t break_every_pieces = 0;  // 0: never
  int breaks_left = 0;
  int64_t window = 1 << 20;
  bool refuse_in_the_end = false;
  std::atomic<bool> unavailable_for_ever = false;
  bool dies_with_the_link = false;
  int creations_refused = 0;  // as when the server is away
  std::set<std::string> request_ids;

  grpc::Status CreateUpload(grpc::ServerContext*, const v1::CreateUploadRequest* request,
                            v1::CreateUploadResponse* response) override {
    const std::lock_guard lock(mutex_);
    EXPECT_FALSE(request->request_id().empty());
    if (--creations_refused >= 0) return {grpc::StatusCode::UNAVAILABLE, "away"};
    request_ids.insert(request->request_id());
    total_ = request->upload().total();
    upload_.set_name("sessions/s/uploads/u");
    upload_.set_state(v1::UPLOAD_STATE_OPEN);
    upload_.set_max_piece_size_bytes(64 << 10);
    Describe(*response->mutable_upload());
    return grpc::Status::OK;
  }

  grpc::Status GetUpload(grpc::ServerContext*, const v1::GetUploadRequest*,
                         v1::GetUploadResponse* response) override {
    const std::lock_guard lock(mutex_);
    Describe(*response->mutable_upload());
    return grpc::Status::OK;
  }

  grpc::Status UploadScan(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::UploadScanResponse, v1::UploadScanRequest>* stream) override {
    if (unavailable_for_ever) return {grpc::StatusCode::UNAVAILABLE, "always"};
    v1::UploadScanRequest request;
    bool first = true;
    int64_t here = 0;
    while (stream->Read(&request)) {
      v1::UploadScanResponse response;
      {
        const std::lock_guard lock(mutex_);
        EXPECT_TRUE(!first || request.upload() == upload_.name());
        first = false;
        if (request.has_piece()) Store(request.piece());
        ++here;
        if (breaks_left > 0 && break_every_pieces > 0 && here >= break_every_pieces) {
          --breaks_left;
          if (dies_with_the_link) unavailable_for_ever = true;
          return {grpc::StatusCode::UNAVAILABLE, "link down"};
        }
        response.set_next_sequence(next_sequence_);
        response.set_next_offset(static_cast<int64_t>(bytes_.size()));
        response.set_credit_offset(static_cast<int64_t>(bytes_.size()) + window);
        response.set_state(upload_.state());
        response.set_state_message(upload_.state_message());
        response.set_scan(upload_.scan());
      }
      stream->Write(response);
      if (response.state() != v1::UPLOAD_STATE_OPEN) return grpc::Status::OK;
    }
    return grpc::Status::OK;
  }

  std::string bytes() {
    const std::lock_guard lock(mutex_);
    return bytes_;
  }
  int64_t beyond_credit() {
    const std::lock_guard lock(mutex_);
    return beyond_credit_;
  }

 private:
  void Describe(v1::Upload& upload) {
    upload = upload_;
    upload.set_next_sequence(next_sequence_);
    upload.set_next_offset(static_cast<int64_t>(bytes_.size()));
    upload.set_credit_offset(static_cast<int64_t>(bytes_.size()) + window);
    granted_ = std::max(granted_, upload.credit_offset());
  }

  void Store(const v1::Piece& piece) {
    EXPECT_EQ(piece.sequence(), next_sequence_);
    EXPECT_EQ(piece.offset(), static_cast<int64_t>(bytes_.size()));
    EXPECT_LE(piece.uncompressed_size_bytes(), 64 << 10);
    std::string data = piece.data();
    if (piece.compression() == v1::COMPRESSION_ZSTD) {
      const auto plain =
          bytes::ZstdDecompress(piece.data(), static_cast<size_t>(piece.uncompressed_size_bytes()));
      ASSERT_TRUE(plain.ok());
      data = *plain;
    }
    EXPECT_EQ(bytes::Crc32c(data), piece.crc32c());
    beyond_credit_ =
        std::max(beyond_credit_, piece.offset() + piece.uncompressed_size_bytes() - granted_);
    bytes_ += data;
    granted_ = std::max(granted_, static_cast<int64_t>(bytes_.size()) + window);
    ++next_sequence_;
    if (static_cast<int64_t>(bytes_.size()) < total_.encoded_size_bytes()) return;
    EXPECT_EQ(bytes::Sha256::Of(bytes_), total_.sha256());
    upload_.set_state(refuse_in_the_end ? v1::UPLOAD_STATE_FAILED : v1::UPLOAD_STATE_COMMITTED);
    if (refuse_in_the_end) {
      upload_.set_state_message("not a range image");
    } else {
      upload_.set_scan("sessions/s/scans/1");
    }
  }

  std::mutex mutex_;
  v1::Upload upload_;
  v1::UploadTotal total_;
  std::string bytes_;
  int64_t next_sequence_ = 0;
  int64_t granted_ = 0;
  int64_t beyond_credit_ = -1;
};

class UploadTest : public ::testing::Test {
 protected:
  void Start() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(port, 0);
    ClientOptions options;
    address_ = "127.0.0.1:" + std::to_string(port);
    options.server = address_;
    options.give_up_after = give_up_after_;
    client_ = std::make_unique<Client>(options);
  }

  absl::StatusOr<std::string> Push(const sensor::RangeImage& image) {
    return client_->Upload("sessions/s", v1::Upload(), image, [&](const UploadProgress& progress) {
      EXPECT_GE(progress.acknowledged_bytes, last_.acknowledged_bytes);
      last_ = progress;
    });
  }

  FlakyServer service_;
  double give_up_after_ = 30;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Client> client_;
  UploadProgress last_;
};

TEST_F(UploadTest, ArrivesWhole) {
  Start();
  const sensor::RangeImage image = SomeImage(500);
  const auto scan = Push(image);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(*scan, "sessions/s/scans/1");
  EXPECT_EQ(service_.bytes(), sensor::EncodeRangeImage(image));
  EXPECT_TRUE(last_.committed);
  EXPECT_EQ(last_.acknowledged_bytes, last_.total_bytes);
  EXPECT_EQ(last_.reconnects, 0);
}

TEST_F(UploadTest, GoesOnWhereTheLinkBroke) {
  service_.break_every_pieces = 3;
  service_.breaks_left = 4;
  Start();
  const sensor::RangeImage image = SomeImage(700);
  const auto scan = Push(image);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(service_.bytes(), sensor::EncodeRangeImage(image));
  EXPECT_EQ(last_.reconnects, 4);
}

TEST_F(UploadTest, BegunDuringAnOutageItWaits) {
  service_.creations_refused = ClientOptions().attempts + 2;
  Start();
  const sensor::RangeImage image = SomeImage(20);
  const auto scan = Push(image);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(service_.bytes(), sensor::EncodeRangeImage(image));
  EXPECT_GE(last_.reconnects, 1);
  EXPECT_EQ(service_.request_ids.size(), 1u);
}

TEST_F(UploadTest, BegunWhereNobodyEverAnswersItGivesUp) {
  service_.creations_refused = 1'000'000;
  give_up_after_ = 0.1;
  Start();
  EXPECT_TRUE(absl::IsUnavailable(Push(SomeImage(20)).status()));
}

TEST_F(UploadTest, BreakAfterTheLastPieceIsNoLoss) {
  const sensor::RangeImage image = SomeImage(20);  // one piece
  ASSERT_LT(sensor::EncodeRangeImage(image).size(), 64u << 10);
  service_.break_every_pieces = 1;
  service_.breaks_left = 1;
  Start();
  const auto scan = Push(image);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(*scan, "sessions/s/scans/1");
}

TEST_F(UploadTest, KeepsWithinItsCredit) {
  service_.window = 10'000;  // less than a piece
  Start();
  const sensor::RangeImage image = SomeImage(300);
  const auto scan = Push(image);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(service_.bytes(), sensor::EncodeRangeImage(image));
  EXPECT_LE(service_.beyond_credit(), 0);
}

TEST_F(UploadTest, SaysWhyTheServerRefusedIt) {
  service_.refuse_in_the_end = true;
  Start();
  const auto scan = Push(SomeImage(100));
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(Explain(scan.status()).cause, HasSubstr("not a range image"));
  EXPECT_FALSE(Explain(scan.status()).fix.empty());
}

TEST_F(UploadTest, GivesUpWithoutProgress) {
  service_.unavailable_for_ever = true;
  give_up_after_ = 0.5;
  Start();
  EXPECT_EQ(Push(SomeImage(100)).status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(UploadTest, StartedAnewItGoesOn) {
  service_.break_every_pieces = 3;
  service_.breaks_left = 1;
  service_.dies_with_the_link = true;
  give_up_after_ = 0.5;
  Start();
  const sensor::RangeImage image = SomeImage(700);
  EXPECT_FALSE(Push(image).ok());
  const size_t stored = service_.bytes().size();
  EXPECT_GT(stored, 0u);
  service_.unavailable_for_ever = false;
  ClientOptions options;
  options.server = address_;
  client_ = std::make_unique<Client>(options);
  last_ = {};
  const auto scan = Push(image);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(service_.bytes(), sensor::EncodeRangeImage(image));
  EXPECT_LT(last_.sent_bytes, static_cast<int64_t>(sensor::EncodeRangeImage(image).size()));
  EXPECT_EQ(service_.request_ids.size(), 1u);
}

TEST_F(UploadTest, RefusesAnEmptyImageBeforeSending) {
  Start();
  EXPECT_EQ(Push(sensor::RangeImage()).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(service_.bytes().empty());
}

TEST(Piece, CompressesOnlyWhatShrinks) {
  const std::string zeros(10'000, '\0');
  const v1::Piece small = MakePiece(zeros, 3, 40);
  EXPECT_EQ(small.compression(), v1::COMPRESSION_ZSTD);
  EXPECT_LT(small.data().size(), 100u);
  EXPECT_EQ(small.uncompressed_size_bytes(), 10'000);
  EXPECT_EQ(*bytes::ZstdDecompress(small.data(), 10'000), zeros);
  const v1::Piece tiny = MakePiece("x", 0, 0);
  EXPECT_EQ(tiny.compression(), v1::COMPRESSION_NONE);
  EXPECT_EQ(tiny.data(), "x");
  EXPECT_EQ(tiny.crc32c(), bytes::Crc32c("x"));
}

}  // namespace
}  // namespace vantage::client
