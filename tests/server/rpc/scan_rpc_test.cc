// Uploads and scans over the wire: CreateUpload, GetUpload, UploadScan, UploadPiece, GetScan,
// ListScans, AcceptScan, SetScanPose, WithdrawScan.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <string>

#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "core/sensor/encoding.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::rpc {
namespace {

class ScanRpc : public testing::Test {
 protected:
  fixture::Script script_;
  fixture::InProcess server_{script_.Make()};

  v1::Session Session(const std::string& name) {
    grpc::ClientContext context;
    v1::GetSessionRequest request;
    request.set_name(name);
    v1::GetSessionResponse response;
    EXPECT_TRUE(server_.sessions->GetSession(&context, request, &response).ok());
    return response.session();
  }
  // A scan that waits for somebody to decide.
  v1::Scan SendInDoubt(const std::string& session) {
    script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
    const v1::PosePrior prior = fixture::PriorAt(0.3, 0.2, 0);
    const v1::Upload upload = server_.Send(session, fixture::EncodedRoom({2.3, 1.7, 1.4}), &prior);
    return server_.WaitFor(session, upload.scan(), v1::SCAN_STATE_DOUBTFUL);
  }
  grpc::Status CreateUpload(const v1::CreateUploadRequest& request, v1::Upload& upload) {
    grpc::ClientContext context;
    v1::CreateUploadResponse response;
    grpc::Status status = server_.scans->CreateUpload(&context, request, &response);
    upload = response.upload();
    return status;
  }
  v1::Upload Announce(const std::string& session, const std::string& bytes) {
    v1::CreateUploadRequest request;
    request.set_parent(session);
    v1::UploadTotal& total = *request.mutable_upload()->mutable_total();
    total.set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
    total.set_sha256(bytes::Sha256::Of(bytes));
    v1::Upload upload;
    EXPECT_TRUE(CreateUpload(request, upload).ok());
    return upload;
  }
  grpc::Status SendPiece(const std::string& upload, const v1::Piece& piece, v1::Upload& after) {
    grpc::ClientContext context;
    v1::UploadPieceRequest request;
    request.set_upload(upload);
    *request.mutable_piece() = piece;
    v1::UploadPieceResponse response;
    grpc::Status status = server_.scans->UploadPiece(&context, request, &response);
    after = response.upload();
    return status;
  }
  static v1::Piece Cut(const std::string& bytes, int64_t sequence, int64_t offset, size_t size) {
    v1::Piece piece;
    const std::string part = bytes.substr(static_cast<size_t>(offset), size);
    piece.set_sequence(sequence);
    piece.set_offset(offset);
    piece.set_uncompressed_size_bytes(static_cast<int64_t>(part.size()));
    piece.set_crc32c(bytes::Crc32c(part));
    piece.set_data(bytes::ZstdCompress(part));
    piece.set_compression(v1::COMPRESSION_ZSTD);
    return piece;
  }
};

TEST_F(ScanRpc, StreamedWholeItIsMergedAndDefinesTheWorld) {
  const std::string session = server_.OpenSession("job");
  const std::string bytes = fixture::EncodedRoom();
  const v1::Upload upload = Announce(session, bytes);
  EXPECT_GT(upload.credit_offset(), 0);
  grpc::ClientContext context;
  const auto stream = server_.scans->UploadScan(&context);
  int64_t offset = 0;
  for (int64_t sequence = 0; offset < static_cast<int64_t>(bytes.size()); ++sequence) {
    v1::UploadScanRequest request;
    if (sequence == 0) request.set_upload(upload.name());
    *request.mutable_piece() = Cut(bytes, sequence, offset, 10'000);
    offset += request.piece().uncompressed_size_bytes();
    ASSERT_TRUE(stream->Write(request));
  }
  v1::UploadScanResponse ack;
  int64_t acknowledged = 0;
  while (stream->Read(&ack)) {
    EXPECT_GE(ack.next_offset(), acknowledged);
    acknowledged = ack.next_offset();
  }
  ASSERT_TRUE(stream->Finish().ok());
  EXPECT_EQ(ack.state(), v1::UPLOAD_STATE_COMMITTED);
  EXPECT_EQ(acknowledged, static_cast<int64_t>(bytes.size()));
  const v1::Scan scan = server_.WaitFor(session, ack.scan(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(scan.pose_source(), v1::POSE_SOURCE_FIRST_SCAN);
  EXPECT_EQ(scan.pose().translation().x(), 0);
  EXPECT_EQ(scan.sha256(), bytes::Sha256::Of(bytes));
  EXPECT_EQ(scan.sample_count(),
            static_cast<int64_t>(fixture::ScanRoom({2.0, 1.5, 1.4}, 2.0).SampleCount()));
  EXPECT_GT(scan.merge().surface_voxel_count(), 0);
  EXPECT_EQ(Session(session).model_version(), 1U);
}

// The model's box is 50 m high by default, and the scanner's range 20 m.
TEST_F(ScanRpc, AReturnThroughAWindowRefusesNothing) {
  const std::string session = server_.OpenSession("job");
  sensor::RangeImage image = fixture::ScanRoom({2.0, 1.5, 1.4}, 2.0);
  const auto level = std::lower_bound(image.elevation.begin(), image.elevation.end(), 0.0);
  image.range[image.Index(10, static_cast<int>(level - image.elevation.begin()))] = 49;
  const std::string bytes = sensor::EncodeRangeImage(image);
  const v1::Upload upload = Announce(session, bytes);
  v1::Upload after;
  int64_t offset = 0;
  for (int64_t sequence = 0; offset < static_cast<int64_t>(bytes.size()); ++sequence) {
    const v1::Piece piece = Cut(bytes, sequence, offset, 10'000);
    ASSERT_TRUE(SendPiece(upload.name(), piece, after).ok());
    offset += piece.uncompressed_size_bytes();
  }
  const v1::Scan scan = server_.WaitFor(session, after.scan(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(scan.merge().beyond_range_count(), 1);
  EXPECT_EQ(scan.merge().beyond_site_count(), 0);
  EXPECT_EQ(scan.merge().sky_ray_count(), 0);
  EXPECT_EQ(scan.merge().sample_count(), scan.sample_count() - 1);
}

// Nobody has named an upload yet: the time is all that there is to say.
TEST(UploadHeartbeats, AStreamSaysThatItIsAliveFromTheBeginning) {
  fixture::Script script;
  server::ServerOptions options;
  options.heartbeat = std::chrono::milliseconds(20);
  fixture::InProcess server(script.Make(), options);
  v1::CreateUploadRequest create;
  create.set_parent(server.OpenSession("job"));
  v1::CreateUploadResponse created;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(server.scans->CreateUpload(&context, create, &created).ok());
  }
  grpc::ClientContext context;
  const auto stream = server.scans->UploadScan(&context);
  v1::UploadScanResponse ack;
  for (int beats = 0; beats < 3; ++beats) {
    ASSERT_TRUE(stream->Read(&ack));
    EXPECT_GT(ack.time().seconds(), 0);
    ack.clear_time();
    EXPECT_EQ(ack.ByteSizeLong(), 0U);
  }
  v1::UploadScanRequest request;
  request.set_upload(created.upload().name());
  ASSERT_TRUE(stream->Write(request));
  // Then it says how far the upload is, and goes on to do so while nothing comes.
  for (int acknowledged = 0; acknowledged < 3;) {
    ASSERT_TRUE(stream->Read(&ack));
    acknowledged += ack.state() == v1::UPLOAD_STATE_OPEN ? 1 : 0;
  }
  EXPECT_GT(ack.credit_offset(), 0);
  stream->WritesDone();
  while (stream->Read(&ack)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
}

// The link breaks after every number of pieces; GetUpload says where to go on, and the scan arrives
// once.
TEST_F(ScanRpc, ResumesAfterAnyBreak) {
  const std::string session = server_.OpenSession("job");
  const std::string bytes = fixture::EncodedRoom();
  const v1::Upload upload = Announce(session, bytes);
  const size_t size = bytes.size() / 5 + 1;
  std::string committed;
  for (int stretch = 0; committed.empty(); ++stretch) {
    ASSERT_LT(stretch, 100);
    grpc::ClientContext get;
    v1::GetUploadRequest read;
    read.set_name(upload.name());
    v1::GetUploadResponse where;
    ASSERT_TRUE(server_.scans->GetUpload(&get, read, &where).ok());
    if (where.upload().state() == v1::UPLOAD_STATE_COMMITTED) {
      committed = where.upload().scan();
      break;
    }
    grpc::ClientContext context;
    const auto stream = server_.scans->UploadScan(&context);
    v1::UploadScanRequest request;
    request.set_upload(upload.name());
    int64_t sequence = where.upload().next_sequence();
    int64_t offset = where.upload().next_offset();
    // One piece that is there already, then one that is not; then the link is cut.
    if (sequence > 0) {
      *request.mutable_piece() =
          Cut(bytes, sequence - 1, offset - static_cast<int64_t>(size), size);
      stream->Write(request);
    }
    *request.mutable_piece() = Cut(bytes, sequence, offset, size);
    stream->Write(request);
    v1::UploadScanResponse ack;
    while (stream->Read(&ack) && ack.next_sequence() <= sequence) {
    }
    if (ack.state() != v1::UPLOAD_STATE_COMMITTED) context.TryCancel();
    stream->Finish();
  }
  EXPECT_EQ(committed, session + "/scans/scan-1");
  server_.WaitFor(session, committed, v1::SCAN_STATE_MERGED);
  grpc::ClientContext context;
  v1::ListScansRequest list;
  list.set_parent(session);
  v1::ListScansResponse listed;
  ASSERT_TRUE(server_.scans->ListScans(&context, list, &listed).ok());
  EXPECT_EQ(listed.scans_size(), 1);
}

// What the client does not know in advance it may say at the end; the last piece again is harmless.
TEST_F(ScanRpc, TheTotalMayComeLast) {
  const std::string session = server_.OpenSession("job");
  const std::string bytes = fixture::EncodedRoom();
  v1::CreateUploadRequest create;
  create.set_parent(session);
  v1::Upload upload;
  ASSERT_TRUE(CreateUpload(create, upload).ok());
  v1::UploadPieceRequest request;
  request.set_upload(upload.name());
  *request.mutable_piece() = Cut(bytes, 0, 0, bytes.size());
  request.mutable_total()->set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
  request.mutable_total()->set_sha256(bytes::Sha256::Of(bytes));
  for (int i = 0; i < 3; ++i) {
    grpc::ClientContext context;
    v1::UploadPieceResponse response;
    const grpc::Status status = server_.scans->UploadPiece(&context, request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.upload().state(), v1::UPLOAD_STATE_COMMITTED);
    EXPECT_EQ(response.upload().scan(), session + "/scans/scan-1");
  }
}

// Bad input gets a canonical error and leaves scans and model as they were.
TEST_F(ScanRpc, GarbageIsRefusedAndLeavesTheSessionAsItWas) {
  const std::string session = server_.OpenRoom("job");
  const v1::Session before = Session(session);
  std::mt19937 random(3);
  const std::string good = fixture::EncodedRoom();
  std::string garbage(5000, '\0');
  for (char& c : garbage) c = static_cast<char>(random());
  std::string announced = good;  // a billion points announced
  for (size_t i = 8; i < 16; ++i) announced[i] = '\x7f';
  std::string nan = good;  // elevation NaN
  for (size_t i = 32; i < 40; ++i) nan[i] = '\xff';
  for (const std::string& bytes :
       {garbage, good.substr(0, good.size() - 1), good + "x", announced, nan, std::string("V")}) {
    const v1::Upload upload = Announce(session, bytes);
    grpc::Status status;
    v1::Upload after;
    int64_t sequence = 0;
    for (int64_t offset = 0; offset < static_cast<int64_t>(bytes.size()) && status.ok();) {
      const v1::Piece piece = Cut(bytes, sequence++, offset, 1 << 19);
      offset += piece.uncompressed_size_bytes();
      status = SendPiece(upload.name(), piece, after);
    }
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_FALSE(status.error_message().empty());
    grpc::ClientContext context;
    v1::GetUploadRequest read;
    read.set_name(upload.name());
    v1::GetUploadResponse where;
    ASSERT_TRUE(server_.scans->GetUpload(&context, read, &where).ok());
    EXPECT_EQ(where.upload().state(), v1::UPLOAD_STATE_FAILED);
    EXPECT_FALSE(where.upload().state_message().empty());
  }
  const v1::Session after = Session(session);
  EXPECT_EQ(after.model_version(), before.model_version());
  EXPECT_EQ(after.scan_counts().SerializeAsString(), before.scan_counts().SerializeAsString());
}

TEST_F(ScanRpc, AnnouncementsAreChecked) {
  const std::string session = server_.OpenSession("job");
  v1::CreateUploadRequest request;
  request.set_parent(session);
  request.mutable_upload()->mutable_total()->set_encoded_size_bytes(int64_t{1} << 50);
  request.mutable_upload()->mutable_total()->set_sha256("short");
  *request.mutable_upload()->mutable_prior() = fixture::PriorAt(std::nan(""), 0, 0);
  request.mutable_upload()->mutable_scanner_model()->set_min_range_m(-1);
  v1::Upload upload;
  EXPECT_THAT(fixture::ViolatedFields(CreateUpload(request, upload)),
              testing::UnorderedElementsAre(
                  "upload.total.encoded_size_bytes", "upload.total.sha256",
                  "upload.prior.pose.translation.x", "upload.scanner_model.min_range_m"));
  request.clear_upload();
  request.mutable_upload()->set_scanner_model_id("nobody");
  EXPECT_THAT(fixture::ViolatedFields(CreateUpload(request, upload)),
              testing::UnorderedElementsAre("upload.scanner_model_id"));
  request.set_parent("sessions/nobody");
  EXPECT_EQ(CreateUpload(request, upload).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(ScanRpc, OpenUploadsAreBoundedWithARetryDelay) {
  const std::string session = server_.OpenSession("job");
  v1::CreateUploadRequest request;
  request.set_parent(session);
  v1::Upload upload;
  grpc::Status status;
  for (int i = 0; i < 17; ++i) {
    status = CreateUpload(request, upload);
    EXPECT_EQ(status.ok(), i < 16);
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  bool retry = false;
  for (const auto& any : fixture::Details(status)) retry |= any.Is<google::rpc::RetryInfo>();
  EXPECT_TRUE(retry);
}

TEST_F(ScanRpc, DoubtfulIsKeptUntilSomebodyDecides) {
  const std::string session = server_.OpenRoom("job");
  const v1::Scan doubtful = SendInDoubt(session);
  EXPECT_EQ(Session(session).model_version(), 1U);
  EXPECT_EQ(doubtful.state_message(), "slides along x; remedy: two targets");
  EXPECT_FALSE(doubtful.has_pose());

  v1::AcceptScanRequest accept;
  accept.set_name(doubtful.name());
  accept.set_request_id("accept-1");
  for (int i = 0; i < 2; ++i) {  // the second time is the same request
    grpc::ClientContext context;
    v1::AcceptScanResponse response;
    EXPECT_TRUE(server_.scans->AcceptScan(&context, accept, &response).ok());
  }
  const v1::Scan merged = server_.WaitFor(session, doubtful.name(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(merged.pose_source(), v1::POSE_SOURCE_ACCEPTED);
  EXPECT_EQ(merged.pose().translation().x(), 0.3);
  grpc::ClientContext context;
  accept.clear_request_id();
  v1::AcceptScanResponse response;
  const grpc::Status again = server_.scans->AcceptScan(&context, accept, &response);
  EXPECT_EQ(again.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(fixture::InfoOf(again).reason(), "SCAN_STATE");
}

TEST_F(ScanRpc, AnotherPoseThatFitsAsWellMayBeAccepted) {
  const std::string session = server_.OpenRoom("job");
  const v1::Scan doubtful = SendInDoubt(session);
  ASSERT_EQ(doubtful.registration().rival_poses_size(), 1);
  const v1::RivalPose& rival = doubtful.registration().rival_poses(0);
  EXPECT_EQ(rival.distance_m(), fixture::Script::kRivalPoseAway);
  EXPECT_EQ(rival.fit_share(), 0.9);

  v1::AcceptScanRequest accept;
  accept.set_name(doubtful.name());
  for (const int wrong : {-1, 2}) {
    accept.set_rival_pose(wrong);
    grpc::ClientContext context;
    v1::AcceptScanResponse response;
    const grpc::Status refused = server_.scans->AcceptScan(&context, accept, &response);
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(refused.error_message(), testing::HasSubstr("rival_pose"));
  }
  accept.set_rival_pose(1);
  grpc::ClientContext context;
  v1::AcceptScanResponse response;
  EXPECT_TRUE(server_.scans->AcceptScan(&context, accept, &response).ok());
  const v1::Scan merged = server_.WaitFor(session, doubtful.name(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(merged.pose_source(), v1::POSE_SOURCE_ACCEPTED);
  EXPECT_EQ(merged.pose().translation().x(), rival.pose().translation().x());
}

TEST_F(ScanRpc, WhatIsAcceptedIsWhatWasSeen) {
  const std::string session = server_.OpenRoom("job");
  const v1::Scan doubtful = SendInDoubt(session);
  ASSERT_FALSE(doubtful.etag().empty()) << "watchers have it, too";
  v1::AcceptScanRequest accept;
  accept.set_name(doubtful.name());
  const auto call = [&] {
    grpc::ClientContext context;
    v1::AcceptScanResponse response;
    return server_.scans->AcceptScan(&context, accept, &response);
  };
  accept.set_proposed(true);
  accept.set_rival_pose(1);
  EXPECT_EQ(fixture::ViolatedFields(call()), std::vector<std::string>{"proposed"});
  accept.set_rival_pose(0);
  EXPECT_EQ(fixture::ViolatedFields(call()), std::vector<std::string>{"proposed"})
      << "nothing is proposed";
  accept.set_proposed(false);
  accept.set_etag("00000000");
  const grpc::Status stale = call();
  EXPECT_EQ(stale.error_code(), grpc::StatusCode::ABORTED);
  EXPECT_EQ(fixture::InfoOf(stale).reason(), "ETAG_STALE");
  EXPECT_EQ(fixture::InfoOf(stale).metadata().at("field"), "etag");
  EXPECT_EQ(fixture::InfoOf(stale).metadata().at("etag"), doubtful.etag());
  accept.set_etag(doubtful.etag());
  EXPECT_TRUE(call().ok());
  EXPECT_EQ(server_.WaitFor(session, doubtful.name(), v1::SCAN_STATE_MERGED).etag(), "");
}

TEST_F(ScanRpc, PosesAreComparedUntilTheScanIsWithdrawn) {
  const std::string session = server_.OpenRoom("job");
  const v1::Scan doubtful = SendInDoubt(session);
  v1::CompareScanPosesRequest request;
  request.set_name(doubtful.name());
  request.set_max_sample_count(200);
  request.set_max_surface_count(300);
  const auto compare = [&](v1::CompareScanPosesResponse& response) {
    grpc::ClientContext context;
    return server_.scans->CompareScanPoses(&context, request, &response);
  };
  v1::CompareScanPosesResponse response;
  const grpc::Status compared = compare(response);
  ASSERT_TRUE(compared.ok()) << compared.error_message();
  const v1::PoseComparison& comparison = response.comparison();
  EXPECT_EQ(comparison.model_version(), 1U);
  EXPECT_FALSE(comparison.in_model());
  // The prior is the aligned pose.
  ASSERT_EQ(comparison.poses_size(), 2);
  EXPECT_EQ(comparison.poses(0).kind(), v1::COMPARED_POSE_KIND_ALIGNED);
  EXPECT_EQ(comparison.poses(1).kind(), v1::COMPARED_POSE_KIND_RIVAL);
  EXPECT_EQ(comparison.poses(1).rival_pose(), 1);
  EXPECT_EQ(comparison.poses(1).pose().SerializeAsString(),
            doubtful.registration().rival_poses(0).pose().SerializeAsString());
  const int samples = comparison.sample_points_size() / 3;
  const int pieces = comparison.surface_points_size() / 3;
  EXPECT_EQ(samples, 200);
  EXPECT_GT(pieces, 50);
  EXPECT_LE(pieces, 300);
  for (const v1::ComparedPose& pose : comparison.poses()) {
    EXPECT_EQ(pose.agreements_size(), samples);
    EXPECT_EQ(pose.residuals_m_size(), samples);
    EXPECT_EQ(pose.sights_size(), pieces);
  }
  EXPECT_GT(comparison.poses(0).overlap_share(), comparison.poses(1).overlap_share());
  EXPECT_LT(comparison.poses(0).contradiction_share(), 0.02);
  EXPECT_GT(comparison.poses(1).contradiction_share(), 0.1);
  ASSERT_GT(comparison.poses(1).disagreements_size(), 0);

  request.set_max_sample_count(7);
  EXPECT_EQ(compare(response).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  request.clear_max_sample_count();
  v1::CompareScanPosesRequest nobody = request;
  request.set_name(session + "/scans/nobody");
  EXPECT_EQ(compare(response).error_code(), grpc::StatusCode::NOT_FOUND);
  request = nobody;

  grpc::ClientContext context;
  v1::WithdrawScanRequest withdraw;
  withdraw.set_name(doubtful.name());
  v1::WithdrawScanResponse withdrawn;
  ASSERT_TRUE(server_.scans->WithdrawScan(&context, withdraw, &withdrawn).ok());
  const grpc::Status refused = compare(response);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(fixture::InfoOf(refused).reason(), "SCAN_STATE");
}

TEST_F(ScanRpc, APoseMaySetAndAScanBeWithdrawn) {
  const std::string session = server_.OpenRoom("job");
  const v1::PosePrior prior = fixture::PriorAt(0.3, 0.2, 0);
  const v1::Upload upload = server_.Send(session, fixture::EncodedRoom({2.3, 1.7, 1.4}), &prior);
  server_.WaitFor(session, upload.scan(), v1::SCAN_STATE_MERGED);
  const uint64_t version = Session(session).model_version();
  {
    grpc::ClientContext context;
    v1::SetScanPoseRequest request;
    request.set_name(upload.scan());
    *request.mutable_prior() = fixture::PriorAt(0.31, 0.2, 0);
    request.set_use(v1::POSE_USE_AS_IS);
    v1::SetScanPoseResponse response;
    ASSERT_TRUE(server_.scans->SetScanPose(&context, request, &response).ok());
    EXPECT_EQ(response.scan().state(), v1::SCAN_STATE_MERGING);
  }
  const v1::Scan set = server_.WaitFor(session, upload.scan(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(set.pose_source(), v1::POSE_SOURCE_SET);
  EXPECT_EQ(set.pose().translation().x(), 0.31);
  EXPECT_EQ(Session(session).model_version(), version + 2);  // out and in

  const std::string first = session + "/scans/scan-1";
  v1::WithdrawScanRequest withdraw;
  withdraw.set_name(first);
  withdraw.set_request_id("w");
  v1::WithdrawScanResponse response;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(server_.scans->WithdrawScan(&context, withdraw, &response).ok());
  }
  EXPECT_EQ(response.scan().state(), v1::SCAN_STATE_WITHDRAWN);
  // Only a scan that was aligned would depend on it: this one's pose was set by hand.
  EXPECT_EQ(response.dependent_scans_size(), 0);
  ASSERT_TRUE(server_.server().sessions().WaitUntilIdle(std::chrono::seconds(60)));
  {
    grpc::ClientContext again_context;
    v1::WithdrawScanResponse again;
    ASSERT_TRUE(server_.scans->WithdrawScan(&again_context, withdraw, &again).ok());
    EXPECT_EQ(again.scan().name(), response.scan().name());
  }
  withdraw.clear_request_id();
  grpc::ClientContext context;
  EXPECT_EQ(server_.scans->WithdrawScan(&context, withdraw, &response).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
}

// Who withdraws a scan hears when its data go, here and from backups, where the server knows.
TEST(WithdrawnScan, SaysWhenItsDataGo) {
  for (const bool erases : {false, true}) {
    fixture::Script script;
    server::ServerOptions options;
    options.limits.keep_backups = absl::Hours(24 * 90);
    if (erases) options.limits.keep_withdrawn_scans = absl::Hours(24 * 2);
    fixture::InProcess server(script.Make(), options);
    const std::string session = server.OpenRoom("job");
    v1::WithdrawScanRequest request;
    request.set_name(session + "/scans/scan-1");
    v1::WithdrawScanResponse response;
    grpc::ClientContext context;
    ASSERT_TRUE(server.scans->WithdrawScan(&context, request, &response).ok());
    ASSERT_EQ(response.has_erase_time(), erases);
    ASSERT_EQ(response.has_backups_forget_time(), erases);
    if (!erases) continue;
    const int64_t withdrawn = response.scan().update_time().seconds();
    EXPECT_EQ(response.erase_time().seconds() - withdrawn, 2 * 24 * 3600);
    EXPECT_EQ(response.backups_forget_time().seconds() - withdrawn, 92 * 24 * 3600);
  }
}

// Withdrawn while it is being aligned, a scan never gets into the model.
TEST_F(ScanRpc, WithdrawnWhileAligningItNeverMerges) {
  const std::string session = server_.OpenRoom("job");
  script_.PauseAlignments();
  const v1::PosePrior prior = fixture::PriorAt(0.3, 0.2, 0);
  const v1::Upload upload = server_.Send(session, fixture::EncodedRoom({2.3, 1.7, 1.4}), &prior);
  script_.WaitForAlignment();
  {
    grpc::ClientContext context;
    v1::GetScanRequest get;
    get.set_name(upload.scan());
    v1::GetScanResponse got;
    ASSERT_TRUE(server_.scans->GetScan(&context, get, &got).ok());
    EXPECT_EQ(got.scan().state(), v1::SCAN_STATE_REGISTERING);
  }
  grpc::ClientContext context;
  v1::WithdrawScanRequest withdraw;
  withdraw.set_name(upload.scan());
  v1::WithdrawScanResponse response;
  ASSERT_TRUE(server_.scans->WithdrawScan(&context, withdraw, &response).ok());
  script_.ReleaseAlignments();
  ASSERT_TRUE(server_.server().sessions().WaitUntilIdle(std::chrono::seconds(60)));
  EXPECT_EQ(Session(session).model_version(), 1U);
  EXPECT_EQ(Session(session).scan_counts().withdrawn_count(), 1);
  EXPECT_EQ(Session(session).scan_counts().merged_count(), 1);
}

TEST_F(ScanRpc, ACancelledStreamKeepsWhatCame) {
  const std::string session = server_.OpenSession("job");
  const std::string bytes = fixture::EncodedRoom();
  const v1::Upload upload = Announce(session, bytes);
  grpc::ClientContext context;
  const auto stream = server_.scans->UploadScan(&context);
  v1::UploadScanRequest request;
  request.set_upload(upload.name());
  *request.mutable_piece() = Cut(bytes, 0, 0, 1000);
  ASSERT_TRUE(stream->Write(request));
  // The first answer only grants credit; what came is kept for sure when that is acknowledged.
  v1::UploadScanResponse ack;
  while (ack.next_offset() == 0) ASSERT_TRUE(stream->Read(&ack));
  context.TryCancel();
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  grpc::ClientContext get;
  v1::GetUploadRequest read;
  read.set_name(upload.name());
  v1::GetUploadResponse where;
  ASSERT_TRUE(server_.scans->GetUpload(&get, read, &where).ok());
  EXPECT_EQ(where.upload().next_offset(), 1000);
}

// All of it was sent when there was no place for one more scan: whoever opens a stream for it
// again, with nothing left to send, gets it committed.
TEST(UploadToAFullSession, IsCommittedWhenItsSenderComesAgain) {
  fixture::Script script;
  server::ServerOptions options;
  options.limits.pending_scans_per_session = 1;
  fixture::InProcess server(script.Make(), options);
  const std::string session = server.OpenRoom("job");
  script.PauseAlignments();
  const v1::PosePrior prior = fixture::PriorAt(3.0, 2.5, 1.4);
  const v1::Upload held = server.Send(session, fixture::EncodedRoom({3.0, 2.5, 1.4}), &prior);
  ASSERT_EQ(held.state(), v1::UPLOAD_STATE_COMMITTED);

  const std::string bytes = fixture::EncodedRoom({1.0, 1.0, 1.4});
  v1::CreateUploadRequest create;
  create.set_parent(session);
  create.mutable_upload()->mutable_total()->set_encoded_size_bytes(
      static_cast<int64_t>(bytes.size()));
  create.mutable_upload()->mutable_total()->set_sha256(bytes::Sha256::Of(bytes));
  v1::CreateUploadResponse created;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(server.scans->CreateUpload(&context, create, &created).ok());
  }
  v1::UploadPieceRequest piece;
  piece.set_upload(created.upload().name());
  piece.mutable_piece()->set_data(bytes);
  piece.mutable_piece()->set_crc32c(bytes::Crc32c(bytes));
  v1::UploadPieceResponse response;
  {
    grpc::ClientContext context;
    const grpc::Status refused = server.scans->UploadPiece(&context, piece, &response);
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(fixture::InfoOf(refused).reason(), "TOO_MANY_PENDING_SCANS");
  }
  script.ReleaseAlignments();
  server.WaitFor(session, held.scan(), v1::SCAN_STATE_MERGED);

  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
  const auto stream = server.scans->UploadScan(&context);
  v1::UploadScanRequest again;
  again.set_upload(created.upload().name());
  ASSERT_TRUE(stream->Write(again));
  v1::UploadScanResponse state;
  while (stream->Read(&state) && state.state() == v1::UPLOAD_STATE_OPEN) {
  }
  EXPECT_EQ(state.state(), v1::UPLOAD_STATE_COMMITTED);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

}  // namespace
}  // namespace vantage::rpc
