#include "server/conversion/to_proto.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace vantage::conversion {
namespace {

using registration::RegistrationBasis;
using testing::ElementsAre;
using testing::IsEmpty;

v1::RegistrationVerdict Written(const std::vector<RegistrationBasis>& bases) {
  registration::RegistrationVerdict verdict;
  verdict.bases = bases;
  return WriteVerdict(verdict);
}

// No two of the core's bases are the same on the wire, and none is missing there.
TEST(ToProto, EveryBasisOfAVerdictHasItsValue) {
  const std::pair<RegistrationBasis, v1::RegistrationBasis> kBases[] = {
      {RegistrationBasis::kScanGeometry, v1::REGISTRATION_BASIS_SCAN_GEOMETRY},
      {RegistrationBasis::kLevelling, v1::REGISTRATION_BASIS_LEVELLING},
      {RegistrationBasis::kTargets, v1::REGISTRATION_BASIS_TARGETS},
      {RegistrationBasis::kTrustedPose, v1::REGISTRATION_BASIS_TRUSTED_POSE},
      {RegistrationBasis::kOverlap, v1::REGISTRATION_BASIS_OVERLAP},
      {RegistrationBasis::kNoPosePrior, v1::REGISTRATION_BASIS_NO_POSE_PRIOR},
      {RegistrationBasis::kResiduals, v1::REGISTRATION_BASIS_RESIDUALS},
      {RegistrationBasis::kContradiction, v1::REGISTRATION_BASIS_CONTRADICTION},
      {RegistrationBasis::kRivalPose, v1::REGISTRATION_BASIS_RIVAL_POSE},
      {RegistrationBasis::kNotConverged, v1::REGISTRATION_BASIS_NOT_CONVERGED},
  };
  std::set<int> seen = {v1::REGISTRATION_BASIS_UNSPECIFIED, v1::REGISTRATION_BASIS_COMBINED};
  for (const auto& [basis, written] : kBases) {
    const v1::RegistrationVerdict verdict = Written({basis});
    EXPECT_EQ(verdict.basis(), written) << registration::BasisName(basis);
    EXPECT_THAT(verdict.combined_bases(), IsEmpty());
    EXPECT_TRUE(seen.insert(verdict.basis()).second) << registration::BasisName(basis);
  }
  EXPECT_EQ(seen.size(), static_cast<size_t>(v1::RegistrationBasis_descriptor()->value_count()));
}

TEST(ToProto, SeveralBasesTogetherAreNamed) {
  const v1::RegistrationVerdict verdict =
      Written({RegistrationBasis::kLevelling, RegistrationBasis::kTargets});
  EXPECT_EQ(verdict.basis(), v1::REGISTRATION_BASIS_COMBINED);
  EXPECT_THAT(verdict.combined_bases(),
              ElementsAre(v1::REGISTRATION_BASIS_LEVELLING, v1::REGISTRATION_BASIS_TARGETS));
  EXPECT_EQ(Written({}).basis(), v1::REGISTRATION_BASIS_UNSPECIFIED);
}

// What is not known is absent, not 0.
TEST(ToProto, AViewThatWasNotCheckedHasNoVerdict) {
  planning::RankedView view;
  view.score = 5000;
  view.model_gain_upper = 3;
  view.checked = false;
  const v1::RankedView interim = WriteView(view, {}, Eigen::Vector3d::Zero());
  EXPECT_EQ(interim.model_gain_m2(), 0);
  EXPECT_EQ(interim.model_gain_upper_m2(), 3);
  EXPECT_FALSE(interim.has_verdict() || interim.has_location() || interim.has_region());
  view.checked = true;
  v1::RankedView written = WriteView(view, {}, Eigen::Vector3d::Zero());
  EXPECT_TRUE(written.has_verdict() && written.has_location());
  EXPECT_FALSE(written.location().has_last_station_distance_m());
  EXPECT_FALSE(written.location().has_last_station_bearing_rad());
  view.location.last_station_distance = 0;
  view.location.last_station_bearing = 0;
  written = WriteView(view, {}, Eigen::Vector3d::Zero());
  EXPECT_TRUE(written.location().has_last_station_distance_m());
  EXPECT_TRUE(written.location().has_last_station_bearing_rad());
}

TEST(ToProto, AViewNamesItsStoreyWhereThereIsFloorBelow) {
  const Eigen::Vector3d origin(0, 0, 100);
  planning::RankedView view;
  view.floor_measured = true;  // without a floor it says nothing
  v1::RankedView written = WriteView(view, {}, origin);
  EXPECT_FALSE(written.has_storey());
  EXPECT_FALSE(written.has_floor_measured());
  view.storey = planning::Storey{2, std::nullopt, ""};
  written = WriteView(view, {}, origin);
  EXPECT_EQ(written.storey().number(), 2);
  EXPECT_FALSE(written.storey().has_floor_z_m());
  EXPECT_TRUE(written.floor_measured());
  view.storey = planning::Storey{0, -2.5, "cellar"};
  view.floor_measured = false;
  written = WriteView(view, {}, origin);
  EXPECT_TRUE(written.has_storey());
  EXPECT_EQ(written.storey().number(), 0);
  EXPECT_EQ(written.storey().floor_z_m(), 97.5);  // world
  EXPECT_EQ(written.storey().name(), "cellar");
  EXPECT_TRUE(written.has_floor_measured());
  EXPECT_FALSE(written.floor_measured());
}

TEST(ToProto, CoverageHasTheFiguresOfEachRegion) {
  planning::Coverage coverage;
  coverage.regions.resize(2);
  coverage.regions[0].name = "machine room";
  coverage.regions[0].required_density = 10'000;
  coverage.regions[0].area = {4, 3, 2, 1};
  coverage.regions[0].area_at_density = 2.5;
  coverage.regions[0].area_given_up = 0.5;
  coverage.regions[0].estimated_coverage = 0.25;
  const v1::Coverage written = WriteCoverage(coverage, 2500, Eigen::Vector3d::Zero());
  ASSERT_EQ(written.regions_size(), 2);
  EXPECT_EQ(written.regions(0).name(), "machine room");
  EXPECT_EQ(written.regions(0).required_density_per_m2(), 10'000);
  EXPECT_EQ(written.regions(0).area_by_kind_m2().hole_boundary(), 2);
  EXPECT_EQ(written.regions(0).area_at_density_m2(), 2.5);
  EXPECT_EQ(written.regions(0).area_given_up_m2(), 0.5);
  EXPECT_EQ(written.regions(0).estimated_coverage(), 0.25);
  EXPECT_FALSE(written.regions(1).has_estimated_coverage());
}

TEST(ToProto, APlanListsItsStoreys) {
  planning::Plan plan;
  EXPECT_EQ(WritePlanResult(plan, {}, false, Eigen::Vector3d::Zero()).storeys_size(), 0);
  plan.storeys = {{0, 0.0, ""}, {1, 2.75, ""}};
  const v1::PlanResult written = WritePlanResult(plan, {}, false, {0, 0, 10});
  ASSERT_EQ(written.storeys_size(), 2);
  EXPECT_EQ(written.storeys(0).floor_z_m(), 10);
  EXPECT_EQ(written.storeys(1).number(), 1);
  EXPECT_EQ(written.storeys(1).floor_z_m(), 12.75);
}

TEST(ToProto, AViewSaysWhichRefusedOneRegistersAfterIt) {
  planning::RankedView view;
  EXPECT_FALSE(WriteView(view, {}, Eigen::Vector3d::Zero()).has_enabled_view_index());
  view.enables = 0;
  EXPECT_TRUE(WriteView(view, {}, Eigen::Vector3d::Zero()).has_enabled_view_index());
  view.enables = 3;
  EXPECT_EQ(WriteView(view, {}, Eigen::Vector3d::Zero()).enabled_view_index(), 3);
}

TEST(ToProto, AnExpectedStationIsInTheWorld) {
  planning::RankedView view;
  EXPECT_FALSE(WriteView(view, {}, Eigen::Vector3d::Zero()).has_expected_station());
  view.expected = planning::ExpectedStation{Eigen::Vector3d(1, 2, -1), 1.2, 0.9, 3};
  view.model_gain = 4;
  view.gain_by_kind = {1, 3, 0, 0};
  view.gain_without_hidden = 7;
  view.expected_gain = 10;
  view.expected_gain_lower = 5;
  view.expected_gain_upper = 15;
  const v1::RankedView written = WriteView(view, {}, {100, 200, 10});
  EXPECT_EQ(written.expected_gain_m2(), 10);
  EXPECT_EQ(written.expected_gain_lower_m2(), 5);
  EXPECT_EQ(written.expected_gain_upper_m2(), 15);
  EXPECT_EQ(written.expected_surface_gain_m2(), 3);
  EXPECT_EQ(written.model_gain_by_kind_m2().true_surface(), 1);
  EXPECT_EQ(written.model_gain_by_kind_m2().occlusion(), 3);
  EXPECT_EQ(written.model_gain_m2(), 4);
  const v1::ExpectedStation& expected = written.expected_station();
  EXPECT_EQ(expected.doorway().x(), 101);
  EXPECT_EQ(expected.doorway().z(), 9);
  EXPECT_EQ(expected.radius_m(), 1.2);
  EXPECT_EQ(expected.chance(), 0.9);
  EXPECT_EQ(expected.fallback_view_index(), 3);
  EXPECT_THAT(expected.message(), testing::HasSubstr("doorway at (101.00, 202.00)"));
  view.expected->doorway.reset();
  view.expected->fallback.reset();
  const v1::RankedView other = WriteView(view, {}, {100, 200, 10});
  EXPECT_FALSE(other.expected_station().has_doorway());
  EXPECT_FALSE(other.expected_station().has_fallback_view_index());
}

TEST(ToProto, ResidualsComeBackAsTheyWere) {
  registration::RegistrationResult result;
  EXPECT_TRUE(WriteRegistration(result, 1, {0, 0, 0}).class_residuals().empty());
  result.residuals.emplace();
  (*result.residuals)[3] = {17, -1.0 / 3, 400, 1.0 / 7, 1e-300};
  (*result.residuals)[23] = {1e9, 1, 2e9, 3, 4};
  const v1::Registration written = WriteRegistration(result, 1, {0, 0, 0});
  EXPECT_EQ(written.class_residuals_size(), 2);
  EXPECT_EQ(ReadOwnResiduals(written), *result.residuals);
}

TEST(ToProto, AdviceOnTargetsIsInTheWorld) {
  planning::RankedView view;
  EXPECT_FALSE(WriteView(view, {}, {0, 0, 0}).has_target_advice());
  view.targets.emplace();
  view.targets->places = {{{1, 2, 3}, Eigen::Vector3d(0, 1, 0), "", 2.5},
                          {{4, 5, 6}, std::nullopt, "C7", 3.5}};
  view.targets->error_bound = 0.004;
  view.targets->seen_from = {"sessions/job/scans/scan-2", "sessions/job/scans/scan-5"};
  const v1::TargetAdvice advice = WriteView(view, {}, {100, 0, 0}).target_advice();
  ASSERT_EQ(advice.places_size(), 2);
  EXPECT_EQ(advice.places(0).position().x(), 101);
  EXPECT_EQ(advice.places(0).normal().y(), 1);
  EXPECT_FALSE(advice.places(1).has_normal());
  EXPECT_EQ(advice.places(1).target(), "C7");
  EXPECT_EQ(advice.places(1).distance_m(), 3.5);
  EXPECT_FALSE(advice.has_first_view_index());
  EXPECT_THAT(advice.seen_from_scans(),
              ElementsAre("sessions/job/scans/scan-2", "sessions/job/scans/scan-5"));
  EXPECT_EQ(advice.message(),
            "scan target 'C7' at (104.00, 5.00, 6.00) too, and put up 1 target: on the wall at "
            "(101.00, 2.00, 3.00), 2.5 m away; seen from the stations of scan-2 and scan-5: scan "
            "at one of them again, coarsely, to measure them; with them the error bound is 4.0 mm");
  view.targets->first_view = 0;
  view.targets->seen_from.clear();
  const v1::TargetAdvice next = WriteView(view, {}, {100, 0, 0}).target_advice();
  EXPECT_EQ(next.first_view_index(), 0);
  EXPECT_NE(next.message().find("the scan from rank 1, which sees them, comes first"),
            std::string::npos)
      << next.message();
}

TEST(ToProto, APlanSaysWhatWasMeasuredOnly) {
  planning::Plan plan;
  v1::PlanningConfig config;
  config.set_required_density_per_m2(2500);
  v1::PlanResult written = WritePlanResult(plan, config, false, Eigen::Vector3d::Zero());
  EXPECT_FALSE(written.has_coverage());
  EXPECT_FALSE(written.termination().has_best_score_upper());
  EXPECT_FALSE(written.termination().has_best_model_gain_upper_m2());
  plan.coverage.emplace();
  plan.termination.best_upper = 0;
  plan.termination.best_gain_without_hidden_upper = 0;
  written = WritePlanResult(plan, config, false, Eigen::Vector3d::Zero());
  EXPECT_TRUE(written.has_coverage());
  EXPECT_FALSE(written.coverage().has_estimated_coverage());  // of no surface there is no share
  EXPECT_TRUE(written.termination().has_best_score_upper());
  EXPECT_TRUE(written.termination().has_best_model_gain_upper_m2());
  EXPECT_FALSE(written.termination().has_best_model_gain_lower_m2());
  plan.termination.best_model_gain = 1;
  plan.termination.best_gain_without_hidden = 2;
  plan.termination.best_gain_without_hidden_upper = 3;
  plan.narrow_ways.push_back({.model_gain = 4, .gain_without_hidden = 5});
  written = WritePlanResult(plan, config, false, Eigen::Vector3d::Zero());
  EXPECT_EQ(written.termination().best_model_gain_lower_m2(), 1);
  EXPECT_EQ(written.termination().best_model_gain_upper_m2(), 3);
  EXPECT_EQ(written.termination().best_expected_gain_lower_m2(), 2);
  EXPECT_EQ(written.termination().best_expected_gain_upper_m2(), 3);
  EXPECT_EQ(written.narrow_ways(0).model_gain_m2(), 4);
  EXPECT_EQ(written.narrow_ways(0).expected_gain_m2(), 5);
}

}  // namespace
}  // namespace vantage::conversion
