// A loaded model continues as if it had never been saved; damaged bytes are never accepted as a
// model.
#include "core/model/snapshot/snapshot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/checksum.h"
#include "core/model/carve/carve.h"
#include "core/model/merge/merge.h"
#include "core/model/partial_model.h"
#include "core/model/snapshot/layer_codec.h"
#include "core/model/snapshot/snapshot_header.h"
#include "core/model/view/algorithm_version.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/mirror_scenes.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/core/model/snapshot/format1_snapshot.h"
#include "tests/support/runs.h"

namespace vantage::model {
namespace {

constexpr size_t kPlenty = size_t{1} << 30;

std::unique_ptr<PartialModel> CoarseModel() {
  ModelConfig config;
  config.voxel_size = 0.12;
  return PartialModel::Create(config).value();
}

struct PosedScan {
  std::string id;
  sensor::Scan scan;
  Eigen::Isometry3d pose;
};

std::vector<PosedScan> ScansOf(const ClosedFormScene& scene, uint64_t seed) {
  std::vector<PosedScan> scans;
  for (size_t i = 0; i < scene.stations.size(); ++i) {
    const Eigen::Isometry3d pose =
        PoseAt(scene.stations[i], 0.7 * static_cast<double>(i), 0.01, -0.02);
    // Ids whose order is not that in which they come.
    scans.push_back(
        {"scan" + std::to_string(9 - i),
         ScanScene(scene, pose, {sensor::Radians(2.0), sensor::Radians(-60), 0.003, seed + i}),
         pose});
  }
  return scans;
}

// A room whose mirror one scan tells from a doorway and the other does not.
std::vector<PosedScan> MirrorScans() {
  parallel::Serial serial;
  const simulation::Scene scene = simulation::PaneRoom({false, true, false, false});
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.6);
  std::vector<PosedScan> scans;
  const std::vector<Eigen::Vector3d> stations = {{3.3, 2.1, 1.5}, {1.1, 1.9, 1.7}};
  for (size_t i = 0; i < stations.size(); ++i) {
    const Eigen::Isometry3d pose = PoseAt(stations[i], static_cast<double>(i));
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = simulation::SimulatedScanner(scene.mesh).Scan(scanner, pose, {}, 7 + i, serial);
    scans.push_back({"scan" + std::to_string(i), std::move(scan), pose});
  }
  return scans;
}

void InsertAll(const std::vector<PosedScan>& scans, size_t count, PartialModel& model) {
  parallel::Serial serial;
  for (size_t i = 0; i < count; ++i) {
    ASSERT_TRUE(model.Insert(scans[i].id, scans[i].scan, scans[i].pose, serial).ok());
  }
}

void ExpectSameStations(const PartialModel& a, const PartialModel& b) {
  const auto view_a = a.Publish();
  const auto view_b = b.Publish();
  EXPECT_EQ(view_a->version(), view_b->version());
  ASSERT_EQ(view_a->stations().size(), view_b->stations().size());
  for (size_t i = 0; i < view_a->stations().size(); ++i) {
    EXPECT_EQ(view_a->stations()[i].position, view_b->stations()[i].position);
    EXPECT_EQ(view_a->stations()[i].floor_height, view_b->stations()[i].floor_height);
    EXPECT_EQ(view_a->stations()[i].floor_found, view_b->stations()[i].floor_found);
    EXPECT_EQ(view_a->stations()[i].clearance, view_b->stations()[i].clearance);
  }
}

// Saves and loads after `saved` scans; every merge and withdrawal afterwards gives the same bits.
void GoesOn(const std::vector<PosedScan>& scans, size_t saved) {
  parallel::Serial serial;
  auto stayed = CoarseModel();
  InsertAll(scans, saved, *stayed);
  const std::string bytes = stayed->Save(serial);
  const auto loaded = PartialModel::Load(bytes, kPlenty, serial);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  PartialModel& back = **loaded;
  EXPECT_EQ(back.Digest(), stayed->Digest());
  EXPECT_EQ(back.scans(), stayed->scans());
  ExpectSameStations(back, *stayed);
  EXPECT_TRUE(back.Save(serial) == bytes) << "saved again it differs";
  for (size_t i = saved; i < scans.size(); ++i) {
    ASSERT_TRUE(stayed->Insert(scans[i].id, scans[i].scan, scans[i].pose, serial).ok());
    ASSERT_TRUE(back.Insert(scans[i].id, scans[i].scan, scans[i].pose, serial).ok());
    EXPECT_EQ(back.Digest(), stayed->Digest()) << "after merging " << scans[i].id;
  }
  for (const PosedScan& scan : scans) {
    ASSERT_TRUE(stayed->Withdraw(scan.id, serial).ok());
    ASSERT_TRUE(back.Withdraw(scan.id, serial).ok());
    EXPECT_EQ(back.Digest(), stayed->Digest()) << "without " << scan.id;
    EXPECT_TRUE(back.Save(serial) == stayed->Save(serial)) << "without " << scan.id;
    ExpectSameStations(back, *stayed);
  }
}

TEST(SnapshotTest, WhatIsLoadedGoesOnAsIfItHadNeverBeenAway) {
  for (uint64_t seed = 1; seed <= test_support::Runs(4u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const std::vector<PosedScan> scans = ScansOf(RandomScene(seed), seed);
    GoesOn(scans, 1 + seed % scans.size());
  }
}

TEST(SnapshotTest, OutdoorsAndThroughADoorway) {
  for (const ClosedFormScene& scene : {RoomWithWindow(), DoorwayRooms()}) {
    SCOPED_TRACE(scene.name);
    const std::vector<PosedScan> scans = ScansOf(scene, 3);
    GoesOn(scans, scans.size() - 1);
  }
}

TEST(SnapshotTest, MirrorsHideAfterwardsWhatTheyHidBefore) {
  const std::vector<PosedScan> scans = MirrorScans();
  parallel::Serial serial;
  size_t reflectors = 0;
  for (const PosedScan& scan : scans) {
    reflectors += Carve(scan.scan, scan.pose, CoarseModel()->config(), serial)->reflectors.size();
  }
  ASSERT_GT(reflectors, 0u) << "there is nothing to hide";
  GoesOn(scans, 1);
}

TEST(SnapshotTest, AnEmptyModel) {
  parallel::Serial serial;
  ModelConfig config;
  config.voxel_size = 0.08;
  config.discontinuity_angle = 0.2;
  config.max_half_extent = {20, 30, 5};
  const auto model = PartialModel::Create(config).value();
  const auto loaded = PartialModel::Load(model->Save(serial), kPlenty, serial);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ((*loaded)->Digest(), model->Digest());
  EXPECT_EQ((*loaded)->config().voxel_size, config.voxel_size);
  EXPECT_EQ((*loaded)->config().discontinuity_angle, config.discontinuity_angle);
  EXPECT_EQ((*loaded)->config().max_half_extent, config.max_half_extent);
}

// Loading costs memory for bricks that exist, not for the space between them.
TEST(SnapshotTest, BricksAtEitherEndOfTheOctree) {
  parallel::Serial serial;
  const ModelLeaf all_empty = MakeAllEmpty();
  const std::vector<BrickAt> bricks = {{VoxelIndex::Constant(-32000), all_empty},
                                       {VoxelIndex::Constant(32000), all_empty}};
  const std::string bytes = EncodeSnapshot(SavedSite{}, {}, {}, bricks, all_empty, serial);
  const auto loaded = PartialModel::Load(bytes, kPlenty, serial);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  const auto view = (*loaded)->Publish();
  EXPECT_EQ(view->bricks().size(), 2u);
  EXPECT_EQ(view->State(VoxelIndex::Constant(32000 * 8)), VoxelState::kEmpty);
  EXPECT_EQ(view->State(VoxelIndex::Zero()), VoxelState::kUnknown);
  EXPECT_TRUE((*loaded)->Save(serial) == bytes);
}

class SavedRoom : public testing::Test {
 protected:
  SavedRoom() {
    const ClosedFormScene scene = BoxInRoom();
    auto model = CoarseModel();
    const std::vector<PosedScan> scans = ScansOf(scene, 1);
    InsertAll(scans, 1, *model);
    digest_ = model->Digest();
    bytes_ = model->Save(serial_);
    pose_ = scans[0].pose;
    id_ = scans[0].id;
  }

  absl::Status LoadStatus(absl::string_view bytes, size_t most = kPlenty) {
    return PartialModel::Load(bytes, most, serial_).status();
  }
  // With the header's checksum as it should be.
  static std::string Resealed(std::string bytes) {
    const auto sections = bytes::LoadLittleEndian<uint32_t>(bytes.data() + 12);
    const size_t summed = 16 + size_t{sections} * 24;
    std::string sum;
    bytes::AppendLittleEndian(bytes::Crc32c(absl::string_view(bytes).substr(0, summed)), sum);
    return bytes.replace(summed, 4, sum);
  }

  parallel::Serial serial_;
  std::string bytes_;
  std::string id_;
  Eigen::Isometry3d pose_;
  uint64_t digest_ = 0;
};

TEST_F(SavedRoom, KeepsPoses) {
  const auto loaded = PartialModel::Load(bytes_, kPlenty, serial_).value();
  ASSERT_TRUE(loaded->PoseOf(id_).has_value());
  EXPECT_EQ(loaded->PoseOf(id_)->matrix(), pose_.matrix());
  EXPECT_FALSE(loaded->PoseOf("nobody").has_value());
}

TEST_F(SavedRoom, TheNumberOfThreadsNeverShows) {
  for (const int width : {2, 8}) {
    parallel::ThreadPool pool(width);
    const auto loaded = PartialModel::Load(bytes_, kPlenty, pool).value();
    EXPECT_EQ(loaded->Digest(), digest_);
    EXPECT_TRUE(loaded->Save(pool) == bytes_) << width << " threads";
  }
}

TEST_F(SavedRoom, EveryDamageIsRefusedWithAReason) {
  std::mt19937_64 random(4);
  const size_t tries = test_support::Runs(250u);
  for (size_t i = 0; i < tries; ++i) {
    // All of the header, then anywhere.
    const size_t at = i < 60 ? i : random() % bytes_.size();
    std::string damaged = bytes_;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
    const absl::Status status = LoadStatus(damaged);
    EXPECT_TRUE(absl::IsDataLoss(status) || absl::IsFailedPrecondition(status))
        << "byte " << at << ": " << status;
    EXPECT_FALSE(status.message().empty());
  }
}

TEST_F(SavedRoom, EveryTruncationIsRefused) {
  std::mt19937_64 random(5);
  for (size_t i = 0; i < test_support::Runs(120u); ++i) {
    const size_t size = i < 60 ? i : random() % bytes_.size();
    EXPECT_TRUE(absl::IsDataLoss(LoadStatus(bytes_.substr(0, size)))) << size;
  }
  EXPECT_TRUE(absl::IsDataLoss(LoadStatus(bytes_ + "x")));
}

TEST_F(SavedRoom, NewerOnesAreRefusedAndOlderAlgorithmsAreNot) {
  std::string newer = bytes_;
  newer[4] = static_cast<char>(kSnapshotFormatVersion + 1);
  const absl::Status format = LoadStatus(Resealed(newer));
  EXPECT_TRUE(absl::IsFailedPrecondition(format));
  EXPECT_NE(format.message().find("newer release"), absl::string_view::npos) << format;

  newer = bytes_;
  newer[8] = static_cast<char>(kModelAlgorithmVersion + 1);
  const absl::Status algorithms = LoadStatus(Resealed(newer));
  EXPECT_TRUE(absl::IsFailedPrecondition(algorithms));
  EXPECT_NE(algorithms.message().find("newer algorithms"), absl::string_view::npos) << algorithms;

  std::string older = bytes_;
  older[8] = static_cast<char>(kModelAlgorithmVersion - 1);
  EXPECT_TRUE(LoadStatus(Resealed(older)).ok());
  EXPECT_EQ(ReadSnapshotHeader(Resealed(older))->algorithm_version, kModelAlgorithmVersion - 1);
}

// The model as a release would have saved it whose algorithms were of that version when the scan of
// that id was carved.
std::string CarvedByVersion(absl::string_view bytes, const std::string& id, uint32_t version) {
  parallel::Serial serial;
  const ModelLeaf all_empty = MakeAllEmpty();
  ModelParts parts = DecodeSnapshot(bytes, kPlenty, all_empty, serial).value();
  parts.layers.at(id)->algorithm_version = version;
  parts.site.algorithm_version = std::min(parts.site.algorithm_version, version);
  return EncodeSnapshot(parts.site, parts.order, parts.layers, parts.bricks, all_empty, serial);
}

TEST(SnapshotVersionTest, AModelIsAsOldAsItsOldestScan) {
  parallel::Serial serial;
  const std::vector<PosedScan> scans = ScansOf(BoxInRoom(), 1);
  ASSERT_GE(scans.size(), 2u);
  const auto model = CoarseModel();
  EXPECT_EQ(model->algorithm_version(), kModelAlgorithmVersion);
  InsertAll(scans, 1, *model);
  EXPECT_EQ(model->algorithm_version(), kModelAlgorithmVersion);
  constexpr uint32_t kOlder = kModelAlgorithmVersion - 1;
  const std::string older = CarvedByVersion(model->Save(serial), scans[0].id, kOlder);
  EXPECT_EQ(ReadSnapshotHeader(older)->algorithm_version, kOlder);

  const auto loaded = PartialModel::Load(older, kPlenty, serial).value();
  EXPECT_EQ(loaded->algorithm_version(), kOlder);
  EXPECT_TRUE(loaded->Save(serial) == older) << "saved again it is not what it was";
  // With a scan of today it is still not one of today, nor after another rest.
  ASSERT_TRUE(loaded->Insert(scans[1].id, scans[1].scan, scans[1].pose, serial).ok());
  const std::string mixed = loaded->Save(serial);
  EXPECT_EQ(ReadSnapshotHeader(mixed)->algorithm_version, kOlder);
  const auto again = PartialModel::Load(mixed, kPlenty, serial).value();
  EXPECT_EQ(again->algorithm_version(), kOlder);
  EXPECT_TRUE(again->Save(serial) == mixed);
  // When the old scan goes, nothing of its age is left.
  ASSERT_TRUE(again->Withdraw(scans[0].id, serial).ok());
  EXPECT_EQ(again->algorithm_version(), kModelAlgorithmVersion);
  EXPECT_EQ(ReadSnapshotHeader(again->Save(serial))->algorithm_version, kModelAlgorithmVersion);
}

TEST(SnapshotVersionTest, OneScanCarvedByNewerAlgorithmsIsTooNew) {
  parallel::Serial serial;
  const std::vector<PosedScan> scans = ScansOf(BoxInRoom(), 1);
  const auto model = CoarseModel();
  InsertAll(scans, 2, *model);
  const std::string newer =
      CarvedByVersion(model->Save(serial), scans[1].id, kModelAlgorithmVersion + 1);
  const absl::Status status = PartialModel::Load(newer, kPlenty, serial).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_NE(status.message().find("newer algorithms"), absl::string_view::npos) << status;
}

// What scans suspect together is asked anew after loading, of what was saved of each.
TEST(SnapshotTest, SuspectedMirrorsAreToldAfterwardsAsBefore) {
  parallel::Serial serial;
  const simulation::MirrorScene scene = simulation::RandomMirrorScene(50);
  const simulation::SimulatedScanner simulated(scene.scene.mesh);
  std::vector<PosedScan> scans;
  size_t suspects = 0;
  for (size_t i = 0; i < 3; ++i) {
    const Eigen::Isometry3d pose = PoseAt(scene.scene.starts[i], static_cast<double>(i));
    sensor::Scan scan;
    scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(0.4);
    scan.image = simulated.Scan(scan.scanner, pose, {}, 7 + i, serial);
    suspects += Carve(scan, pose, CoarseModel()->config(), serial)->suspects.size();
    scans.push_back({"scan" + std::to_string(i), std::move(scan), pose});
  }
  ASSERT_GT(suspects, 0u) << "there is nothing to tell";
  GoesOn(scans, 1);
  GoesOn(scans, 2);
}

// What is compared allows for the noise, which has to come back with the scan.
TEST(SnapshotTest, TheNoiseOfAScanComesBackWithIt) {
  parallel::Serial serial;
  sensor::Scan scan = ScanScene(EmptyRoom(), PoseAt({0, 0, 1.4}, 0), {.noise = 0.003});
  scan.scanner.range_noise = 0.015;
  const auto layer = Carve(scan, PoseAt({0, 0, 1.4}, 0), CoarseModel()->config(), serial);
  const auto again = LayerCodec::Read(LayerCodec::Write(*layer), SnapshotHeader{});
  ASSERT_NE(again, nullptr);
  EXPECT_GE(layer->range_surface.range_sigma(), 0.015);
  EXPECT_EQ(again->range_surface.range_sigma(), layer->range_surface.range_sigma());
}

// A snapshot that the release which wrote format 1 saved.
TEST(SnapshotVersionTest, TheFormatBeforeIsReadAsWhatItWas) {
  parallel::Serial serial;
  std::string bytes;
  ASSERT_TRUE(absl::Base64Unescape(kFormat1Snapshot, &bytes));
  ASSERT_EQ(ReadSnapshotHeader(bytes)->format_version, 1);
  const auto loaded = PartialModel::Load(bytes, kPlenty, serial);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  PartialModel& model = **loaded;
  EXPECT_EQ(model.scans(), (std::vector<std::string>{"first", "second"}));
  EXPECT_EQ(model.Digest(), kFormat1Digest);
  EXPECT_EQ(model.algorithm_version(), 1u);
  const std::string now = model.Save(serial);
  EXPECT_EQ(ReadSnapshotHeader(now)->format_version, kSnapshotFormatVersion);
  EXPECT_LT(now.size(), bytes.size());
  const auto again = PartialModel::Load(now, kPlenty, serial).value();
  EXPECT_EQ(again->Digest(), kFormat1Digest);
  for (const char* id : {"second", "first"}) {
    ASSERT_TRUE(model.Withdraw(id, serial).ok());
    ASSERT_TRUE(again->Withdraw(id, serial).ok());
    EXPECT_EQ(again->Digest(), model.Digest()) << "without " << id;
  }
  EXPECT_TRUE(model.Publish()->bricks().empty());
  // Damage in it is found as in any other.
  std::mt19937_64 random(6);
  for (size_t i = 0; i < test_support::Runs(200u); ++i) {
    std::string damaged = bytes;
    const size_t at = random() % bytes.size();
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
    EXPECT_FALSE(PartialModel::Load(damaged, kPlenty, serial).ok());
  }
}

TEST_F(SavedRoom, NeverTakesMoreThanAllowed) {
  EXPECT_TRUE(absl::IsResourceExhausted(LoadStatus(bytes_, 100'000)));
  // Sizes that a header only claims.
  std::string huge = bytes_;
  huge[16 + 16 + 5] = 1;
  EXPECT_TRUE(absl::IsResourceExhausted(LoadStatus(Resealed(huge))));
}

}  // namespace
}  // namespace vantage::model
