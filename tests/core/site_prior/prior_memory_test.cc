// What a prior is said to hold, against what the heap says.
#include <gtest/gtest.h>
#include <malloc.h>

#include <memory>
#include <utility>

#include "core/planning/expectation/expected_site.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/site_prior/prior_space.h"
#include "core/site_prior/site_prior.h"

namespace vantage::site_prior {
namespace {

// Bytes that this thread's memory is in use for; 0 under sanitizers, which have a heap of their
// own.
double InUse() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

// A flat of furniture, which has more surface than walls alone.
PriorMesh FlatMesh() {
  const simulation::Scene scene = simulation::FurnishedFlat(3);
  PriorMesh mesh;
  mesh.vertices = scene.mesh.vertices;
  mesh.triangles = scene.mesh.triangles;
  return mesh;
}

TEST(PriorMemoryTest, APriorHoldsWhatItSays) {
  PriorMesh mesh = FlatMesh();
  const double before = InUse();
  if (before == 0) GTEST_SKIP() << "the heap tells nothing";
  const auto prior = SitePrior::Create(mesh, {});
  ASSERT_TRUE(prior.ok()) << prior.status();
  const double held = InUse() - before;
  EXPECT_NEAR(held / static_cast<double>((*prior)->Bytes()), 1, 0.15);
}

// As the server counts it: the space, and its floors.
TEST(PriorMemoryTest, AnExpectedSiteHoldsItsSpaceAndItsFloors) {
  const PriorMesh mesh = FlatMesh();
  const double before = InUse();
  if (before == 0) GTEST_SKIP() << "the heap tells nothing";
  auto space = SpaceOf(mesh, {}, 0.05);
  ASSERT_TRUE(space.ok()) << space.status();
  const auto of_space = static_cast<double>(BytesOf(*space));
  auto site = planning::ExpectedSite::Of(*std::move(space));
  ASSERT_TRUE(site.ok()) << site.status();
  const double held = InUse() - before;
  EXPECT_GT((*site)->floors().size(), 10'000U);
  EXPECT_NEAR(held / (of_space + static_cast<double>((*site)->floors().size_bytes())), 1, 0.15);
}

}  // namespace
}  // namespace vantage::site_prior
