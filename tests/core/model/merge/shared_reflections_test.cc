// Reflections that scans tell together: what was believed first goes, nothing real does, and the
// model stays a function of the set of scans.
#include "core/model/merge/shared_reflections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "core/model/carve/carve.h"
#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/mirror_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/support/phantom_oracle.h"
#include "tests/support/three_scanners.h"

namespace vantage::model {
namespace {

class MirrorSite {
 public:
  explicit MirrorSite(uint64_t seed) : MirrorSite(seed, UsualScanner()) {}
  MirrorSite(uint64_t seed, const sensor::ScannerModel& scanner)
      : made_(simulation::RandomMirrorScene(seed)), simulated_(made_.scene.mesh) {
    for (size_t i = 0; i < made_.scene.starts.size(); ++i) {
      scans_.push_back(oracle_.Scan(made_.scene.starts[i], scanner, 100 * seed + i, serial_));
    }
  }

  void Insert(size_t i, PartialModel& model, parallel::Parallel& parallel) const {
    EXPECT_TRUE(model.Insert(Id(i), scans_[i].scan, scans_[i].T_model_scan, parallel).ok());
  }
  std::unique_ptr<PartialModel> ModelOf(const std::vector<size_t>& order, double voxel_size,
                                        parallel::Parallel& parallel) const {
    auto model = PartialModel::Create({.voxel_size = voxel_size}).value();
    for (const size_t i : order) Insert(i, *model, parallel);
    return model;
  }
  // Carved, with what they tell together.
  SharedReflections Carved(SharedReflections::Layers& layers, parallel::Parallel& parallel) const {
    SharedReflections shared;
    for (size_t i = 0; i < scans_.size(); ++i) {
      layers[Id(i)] = Carve(scans_[i].scan, scans_[i].T_model_scan, {}, parallel);
      shared.Add(Id(i), layers, parallel);
    }
    return shared;
  }
  static std::string Id(size_t i) { return "scan" + std::to_string(i); }

  const simulation::MirrorScene& made() const { return made_; }
  const test_support::PhantomOracle& oracle() const { return oracle_; }
  size_t size() const { return scans_.size(); }

 private:
  static sensor::ScannerModel UsualScanner() {
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.4);
    return scanner;
  }

  parallel::Serial serial_;
  simulation::MirrorScene made_;
  simulation::SimulatedScanner simulated_;
  test_support::PhantomOracle oracle_{simulated_};
  std::vector<test_support::PhantomOracle::PosedScan> scans_;
};

// The mirror is the door of a wardrobe at a side wall, which goes on in it without a break; and one
// whose plane, found by steps, is half a degree off.
TEST(SharedReflectionsTest, MirrorsAtSideWallsAndThoseMissedByHalfADegreeAreFound) {
  for (const uint64_t seed : {181u, 124u, 99u}) {
    SCOPED_TRACE(seed);
    const MirrorSite site(seed);
    parallel::Serial serial;
    auto model = PartialModel::Create({}).value();
    for (size_t i = 0; i < site.size(); ++i) site.Insert(i, *model, serial);
    EXPECT_LT(site.oracle().PhantomArea(*model->Publish()), 3);  // m^2; 11 to 19 were left
  }
}

TEST(SharedReflectionsTest, ARoomThatIsOnlyInAMirrorGoesWhenOthersHaveSeenWhatItShows) {
  const MirrorSite site(50);
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  double most = 0;
  double left = 0;
  for (size_t i = 0; i < site.size(); ++i) {
    site.Insert(i, *model, serial);
    left = site.oracle().PhantomArea(*model->Publish());
    most = std::max(most, left);
  }
  ASSERT_GT(most, 5) << "m2: the first scans were to be deceived";
  EXPECT_LE(left, 0.05 * most);
}

// Rooms that are mirror images of each other, seen through a doorway: all that a plane in it shows
// agrees with its reflection, also for other scans. Who stands behind it knows better.
TEST(SharedReflectionsTest, NoOpeningBetweenTwinRoomsIsLost) {
  for (const uint64_t seed : {23, 43}) {
    const MirrorSite site(seed);
    parallel::Serial serial;
    const auto view = site.ModelOf({0, 1, 2, 3, 4}, 0.05, serial)->Publish();
    for (const Eigen::AlignedBox3d& opening : site.made().openings) {
      const auto through = site.oracle().LostThrough(opening, *view);
      EXPECT_LE(through.share(), 0.1) << seed << ": " << opening.center().transpose();
    }
  }
}

// The share of an opening that is taken for a mirror.
double ShareTaken(const Eigen::AlignedBox3d& opening, const Aperture& aperture) {
  constexpr int kParts = 6;  // each way
  Eigen::Index across = 0;
  opening.sizes().minCoeff(&across);
  const Eigen::Index along = across == 0 ? 1 : 0;
  const Eigen::Vector3d through = 0.5 * Eigen::Vector3d::Unit(across);
  int taken = 0;
  for (int i = 0; i < kParts * kParts; ++i) {
    Eigen::Vector3d at = opening.center();
    const int row = i / kParts;
    at[along] = opening.min()[along] + (i % kParts + 0.5) / kParts * opening.sizes()[along];
    at.z() = opening.min().z() + (row + 0.5) / kParts * opening.sizes().z();
    taken +=
        aperture.Between(at + through, at - through) || aperture.Between(at - through, at + through)
            ? 1
            : 0;
  }
  return taken / static_cast<double>(kParts * kParts);
}

// Nor while nobody has been behind it: then nothing but its own shape tells that it is one. Any of
// the scans may be all there are.
void ExpectNoOpeningLost(const MirrorSite& site) {
  parallel::Serial serial;
  SharedReflections::Layers layers;
  const SharedReflections all = site.Carved(layers, serial);
  for (uint32_t some = 1; some < 1u << site.size(); ++some) {
    SharedReflections shared = all;
    SharedReflections::Layers gone;
    for (size_t i = 0; i < site.size(); ++i) {
      if ((some >> i & 1u) != 0) continue;
      gone.insert(layers.extract(MirrorSite::Id(i)));
      shared.Remove(MirrorSite::Id(i), layers, serial);
    }
    for (const Aperture& aperture : shared.Apertures()) {
      for (const Eigen::AlignedBox3d& opening : site.made().openings) {
        EXPECT_LE(ShareTaken(opening, aperture), 0.1)
            << opening.center().transpose() << " by scans " << some;
      }
    }
    layers.merge(gone);
  }
}

TEST(SharedReflectionsTest, NoOpeningIsLostToAnyOfTheScansAlone) {
  for (const uint64_t seed : {2, 17, 18, 23, 32, 35, 42, 43}) {
    SCOPED_TRACE(seed);
    ExpectNoOpeningLost(MirrorSite(seed));
  }
}

class SharedReflectionsAtThreeScanners : public testing::TestWithParam<test_support::ScannerCase> {
 protected:
  static sensor::ScannerModel Scanner() {
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = GetParam().step;
    scanner.range_noise = GetParam().noise;
    return scanner;
  }
};

TEST_P(SharedReflectionsAtThreeScanners, NoOpeningIsLostToAnyOfTheScansAlone) {
  for (const uint64_t seed : {18, 43}) {
    SCOPED_TRACE(seed);
    ExpectNoOpeningLost(MirrorSite(seed, Scanner()));
  }
}

TEST_P(SharedReflectionsAtThreeScanners, ARoomThatIsOnlyInAMirrorGoes) {
  if (GetParam().step > sensor::Radians(0.75)) GTEST_SKIP() << "goes unnoticed at one degree";
  const MirrorSite site(50, Scanner());
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  double most = 0;
  double left = 0;
  for (size_t i = 0; i < site.size(); ++i) {
    site.Insert(i, *model, serial);
    left = site.oracle().PhantomArea(*model->Publish());
    most = std::max(most, left);
  }
  ASSERT_GT(most, 5) << "m2: the first scans were to be deceived";
  EXPECT_LE(left, 0.05 * most);
}

INSTANTIATE_TEST_SUITE_P(ThreeScanners, SharedReflectionsAtThreeScanners,
                         testing::ValuesIn(test_support::kThreeScanners));

TEST(SharedReflectionsTest, NeitherOrderNorWithdrawingNorThreadsShow) {
  const MirrorSite site(50);
  parallel::Serial serial;
  parallel::ThreadPool pool(3);
  constexpr double kVoxel = 0.1;  // m
  std::vector<size_t> order(site.size());
  std::iota(order.begin(), order.end(), 0);
  const auto model = site.ModelOf(order, kVoxel, serial);
  const uint64_t all = model->Digest();
  std::reverse(order.begin(), order.end());
  EXPECT_EQ(site.ModelOf(order, kVoxel, pool)->Digest(), all);
  std::rotate(order.begin(), order.begin() + 2, order.end());
  EXPECT_EQ(site.ModelOf(order, kVoxel, serial)->Digest(), all);
  for (size_t gone = 0; gone < site.size(); ++gone) {
    ASSERT_TRUE(model->Withdraw(MirrorSite::Id(gone), serial).ok());
    std::vector<size_t> left = order;
    std::erase(left, gone);
    EXPECT_EQ(model->Digest(), site.ModelOf(left, kVoxel, serial)->Digest()) << "without " << gone;
    site.Insert(gone, *model, serial);
    EXPECT_EQ(model->Digest(), all) << gone << " back again";
  }
}

}  // namespace
}  // namespace vantage::model
