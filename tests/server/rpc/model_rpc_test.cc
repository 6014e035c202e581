// GetCoverage, GetPoseGraph and ExportModel.
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>

#include "core/bytes/checksum.h"
#include "core/sensor/e57.h"
#include "core/sensor/encoding.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::rpc {
namespace {

class ModelRpc : public testing::Test {
 protected:
  fixture::Script script_;
  fixture::InProcess server_{script_.Make()};

  grpc::Status Export(const std::string& session, v1::ExportFormat format, std::string& file) {
    grpc::ClientContext context;
    v1::ExportModelRequest request;
    request.set_name(session);
    request.set_format(format);
    const auto stream = server_.models->ExportModel(&context, request);
    v1::ExportModelResponse part;
    file.clear();
    int64_t total = 0;
    while (stream->Read(&part)) {
      EXPECT_EQ(part.offset(), static_cast<int64_t>(file.size()));
      EXPECT_EQ(part.crc32c(), bytes::Crc32c(part.data()));
      EXPECT_LE(part.data().size(), size_t{256} << 10);
      EXPECT_EQ(part.file_name().empty(), !file.empty());
      file += part.data();
      total = part.total_size_bytes();
    }
    grpc::Status status = stream->Finish();
    // That of an archive is not known before it is made.
    const bool known = format != v1::EXPORT_FORMAT_ARCHIVE;
    EXPECT_EQ(total, known ? static_cast<int64_t>(file.size()) : 0);
    return status;
  }
};

// The second scan is tied to the first, 1 m from it along x and 1 m along y.
class PoseGraphRpc : public testing::Test {
 protected:
  static session::Algorithms Tied(fixture::Script& script) {
    script.TieScans({{{"sessions/room/scans/scan-1", "sessions/room/scans/scan-2"},
                      Eigen::Isometry3d(Eigen::Translation3d(1, 1, 0))}});
    return script.Make();
  }
  grpc::Status Get(const std::string& session, v1::PoseGraph& graph) {
    grpc::ClientContext context;
    v1::GetPoseGraphRequest request;
    request.set_name(session);
    v1::GetPoseGraphResponse response;
    grpc::Status status = server_.models->GetPoseGraph(&context, request, &response);
    graph = response.graph();
    return status;
  }

  fixture::Script script_;
  fixture::InProcess server_{Tied(script_)};
};

TEST_F(PoseGraphRpc, SaysWhatTiesScansOnceThereAreAny) {
  v1::PoseGraph graph;
  EXPECT_EQ(Get("sessions/none", graph).error_code(), grpc::StatusCode::NOT_FOUND);
  ASSERT_TRUE(Get(server_.OpenSession("empty"), graph).ok());
  EXPECT_TRUE(graph.scans().empty());

  const std::string room = server_.OpenRoom("room");
  v1::PosePrior prior;
  prior.mutable_pose()->mutable_rotation()->set_w(1);
  prior.mutable_pose()->mutable_translation()->set_x(1);
  prior.mutable_pose()->mutable_translation()->set_y(1);
  const v1::Upload second = server_.Send(room, fixture::EncodedRoom({3, 2.5, 1.4}), &prior);
  server_.WaitFor(room, second.scan(), v1::SCAN_STATE_MERGED);
  ASSERT_TRUE(Get(room, graph).ok());
  ASSERT_EQ(graph.scans_size(), 2);
  EXPECT_TRUE(graph.scans(0).held());
  EXPECT_FALSE(graph.scans(1).held());
  // The tie's, and half of its variance for what the measurements of either scan share in all
  // links.
  EXPECT_NEAR(graph.scans(1).position_sigma_m(), std::sqrt(2) * fixture::Script::kTieSigma, 1e-4);
  ASSERT_EQ(graph.links_size(), 1);
  EXPECT_EQ(graph.links(0).second_scan(), second.scan());
  EXPECT_TRUE(graph.links(0).information().empty());
  ASSERT_EQ(graph.weak_links_size(), 1);
  EXPECT_TRUE(graph.weak_links(0).bridge());
  EXPECT_EQ(graph.weak_links(0).hanging_scan_count(), 1);
  EXPECT_EQ(graph.worst_scan(), second.scan());
}

TEST_F(ModelRpc, CoverageIsZeroWithoutAModelAndMeasuredWithOne) {
  for (const bool with_model : {false, true}) {
    const std::string session =
        with_model ? server_.OpenRoom("room") : server_.OpenSession("empty");
    grpc::ClientContext context;
    v1::GetCoverageRequest request;
    request.set_name(session);
    v1::GetCoverageResponse response;
    ASSERT_TRUE(server_.models->GetCoverage(&context, request, &response).ok());
    EXPECT_EQ(response.coverage().area_by_kind_m2().occlusion(), with_model ? 2 : 0);
    EXPECT_EQ(response.coverage().required_density_per_m2(), 2500);
    ASSERT_EQ(response.storeys_size(), with_model ? 1 : 0);
    if (with_model) {
      EXPECT_EQ(response.storeys(0).floor_z_m(), 0.25);
    }
    EXPECT_EQ(response.model_version(), with_model ? 1U : 0U);
    EXPECT_FALSE(response.has_best_remaining_model_gain_m2());
    // The script's figure, and none without a model: never 0 %.
    EXPECT_EQ(response.coverage().has_estimated_coverage(), with_model);
    EXPECT_EQ(response.coverage().estimated_coverage(), with_model ? 0.4 : 0);
  }
}

// An alignment holds the only thread that could make the file.
TEST(ExportHeartbeats, AnExportThatWaitsForAThreadSaysThatItIsAlive) {
  fixture::Script script;
  server::ServerOptions options;
  options.threads = 1;
  options.heartbeat = std::chrono::milliseconds(20);
  fixture::InProcess server(script.Make(), options);
  const std::string session = server.OpenRoom("job");
  script.PauseAlignments();
  server.Send(session, fixture::EncodedRoom({2.2, 1.5, 1.4}));
  script.WaitForAlignment();
  grpc::ClientContext context;
  v1::ExportModelRequest request;
  request.set_name(session);
  request.set_format(v1::EXPORT_FORMAT_SURFACE_PLY);
  const auto stream = server.models->ExportModel(&context, request);
  v1::ExportModelResponse part;
  for (int beats = 0; beats < 3; ++beats) {
    ASSERT_TRUE(stream->Read(&part));
    EXPECT_GT(part.heartbeat().time().seconds(), 0);
    EXPECT_TRUE(part.data().empty());
  }
  script.ReleaseAlignments();
  std::string file;
  while (stream->Read(&part)) file += part.data();
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(file.substr(0, 4), "ply\n");
}

// Both OctoMap files open with OctoMap and agree with one another.
TEST_F(ModelRpc, OctomapFilesOpen) {
  const std::string session = server_.OpenRoom("room");
  std::string file;
  ASSERT_TRUE(Export(session, v1::EXPORT_FORMAT_OCTOMAP, file).ok());
  std::istringstream in(file);
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(in));
  const auto* tree = dynamic_cast<const octomap::OcTree*>(read.get());
  ASSERT_NE(tree, nullptr);
  ASSERT_TRUE(Export(session, v1::EXPORT_FORMAT_OCTOMAP_BINARY, file).ok());
  std::istringstream binary_in(file);
  octomap::OcTree binary(1.0);
  ASSERT_TRUE(binary.readBinary(binary_in));
  EXPECT_EQ(binary.getResolution(), 0.05);
  // The scanner is at the origin of the world: free; the wall at x = +3 m is occupied.
  for (const octomap::OcTree* which : {tree, static_cast<const octomap::OcTree*>(&binary)}) {
    const octomap::OcTreeNode* here = which->search(1.0, 0.5, 0.0);
    ASSERT_NE(here, nullptr);
    EXPECT_FALSE(which->isNodeOccupied(here));
    bool wall = false;
    for (double x = 2.9; x <= 3.1; x += 0.05) {
      const octomap::OcTreeNode* node = which->search(x, 0.02, 0.02);
      wall |= node != nullptr && which->isNodeOccupied(node);
    }
    EXPECT_TRUE(wall);
  }
}

TEST_F(ModelRpc, RegisteredSamplesLieOnTheRoom) {
  const std::string session = server_.OpenRoom("room");
  std::string file;
  ASSERT_TRUE(Export(session, v1::EXPORT_FORMAT_SCANS_PLY, file).ok());
  const size_t header = file.find("end_header\n") + 11;
  const size_t samples = fixture::ScanRoom({2.0, 1.5, 1.4}, 2.0).SampleCount();
  ASSERT_EQ(file.size(), header + samples * 28);
  for (size_t i = 0; i < samples; ++i) {
    double p[3];
    std::memcpy(p, file.data() + header + i * 28, sizeof(p));
    const double distance =
        std::min({std::abs(p[0] + 2.0), std::abs(p[0] - 3.0), std::abs(p[1] + 1.5),
                  std::abs(p[1] - 2.5), std::abs(p[2] + 1.4), std::abs(p[2] - 1.2)});
    ASSERT_LT(distance, 1e-3);  // ranges travel to 0.1 mm
  }
}

TEST_F(ModelRpc, ScansComeBackFromE57) {
  const std::string session = server_.OpenRoom("room");
  std::string file;
  ASSERT_TRUE(Export(session, v1::EXPORT_FORMAT_SCANS_E57, file).ok());
  const auto back = sensor::ParseE57(file, 0, sensor::ImportLimits());
  ASSERT_TRUE(back.ok()) << back.status();
  // Ranges travel to 0.1 mm.
  const auto sent = sensor::DecodeRangeImage(fixture::EncodedRoom({2.0, 1.5, 1.4}, 2.0), 1'000'000);
  ASSERT_TRUE(sent.ok());
  EXPECT_FALSE(back->resampled);
  ASSERT_EQ(back->image.cells(), sent->cells());
  constexpr double kDirection = 1e-7;  // rad: files are read by way of floats
  // The first column looks along -x, which is the first or the last.
  for (int c = 0; c < sent->columns(); ++c) {
    const int there = (c + sent->columns() - 1) % sent->columns();
    ASSERT_NEAR(std::remainder(back->image.azimuth[static_cast<size_t>(there)] -
                                   sent->azimuth[static_cast<size_t>(c)],
                               2 * sensor::kPi),
                0, kDirection);
    for (int r = 0; r < sent->rows(); ++r) {
      ASSERT_EQ(std::lround(back->image.at(there, r) * 1e4f), std::lround(sent->at(c, r) * 1e4f));
    }
  }
}

// Data that the server has lost are DATA_LOSS, not NOT_FOUND.
TEST_F(ModelRpc, LostSamplesAreDataLoss) {
  const std::string session = server_.OpenRoom("room");
  grpc::ClientContext context;
  v1::GetScanRequest get;
  get.set_name(session + "/scans/scan-1");
  v1::GetScanResponse got;
  ASSERT_TRUE(server_.scans->GetScan(&context, get, &got).ok());
  ASSERT_TRUE(server_.store().ReleaseBlob(got.scan().sha256()).ok());
  grpc::ClientContext exporting;
  v1::ExportModelRequest request;
  request.set_name(session);
  request.set_format(v1::EXPORT_FORMAT_SCANS_PLY);
  const auto stream = server_.models->ExportModel(&exporting, request);
  v1::ExportModelResponse part;  // the file's header may come before it is found out
  while (stream->Read(&part)) {
  }
  const grpc::Status lost = stream->Finish();
  EXPECT_EQ(lost.error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(fixture::InfoOf(lost).reason(), "SCAN_LOST");
}

TEST_F(ModelRpc, SurfaceAndPatchesAsPly) {
  const std::string session = server_.OpenRoom("room");
  std::string file;
  ASSERT_TRUE(Export(session, v1::EXPORT_FORMAT_SURFACE_PLY, file).ok());
  EXPECT_EQ(file.substr(0, 4), "ply\n");
  EXPECT_EQ(fixture::InfoOf(Export(session, v1::EXPORT_FORMAT_PATCH_PLY, file)).reason(),
            "NO_PLAN");
  script_.EndPlans();
  grpc::ClientContext context;
  v1::CreatePlanRequest plan;
  plan.set_parent(session);
  v1::CreatePlanResponse created;
  ASSERT_TRUE(server_.plans->CreatePlan(&context, plan, &created).ok());
  ASSERT_TRUE(server_.server().sessions().WaitUntilIdle(std::chrono::seconds(60)));
  ASSERT_TRUE(Export(session, v1::EXPORT_FORMAT_PATCH_PLY, file).ok());
  EXPECT_EQ(file.size(), file.find("end_header\n") + 11 + 3 * (4 * 24 + 1 + 16 + 1 + 8));
}

TEST_F(ModelRpc, WhatCannotBeExportedSaysWhy) {
  const std::string empty = server_.OpenSession("empty");
  std::string file;
  EXPECT_EQ(fixture::InfoOf(Export(empty, v1::EXPORT_FORMAT_OCTOMAP, file)).reason(),
            "MODEL_EMPTY");
  EXPECT_EQ(Export(empty, v1::EXPORT_FORMAT_UNSPECIFIED, file).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(Export(empty, v1::EXPORT_FORMAT_ARCHIVE, file).ok()) << "an archive needs no model";
}

}  // namespace
}  // namespace vantage::rpc
