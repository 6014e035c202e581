#include "server/session/from_proto.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "server/session/to_proto.h"

namespace vantage {
namespace {

using testing::Contains;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<std::string> Fields(const Violations& violations) {
  google::rpc::BadRequest request;
  const auto payload =
      violations.ToStatus().GetPayload("type.googleapis.com/google.rpc.BadRequest");
  if (payload.has_value()) request.ParseFromString(std::string(*payload));
  std::vector<std::string> fields;
  for (const auto& violation : request.field_violations()) fields.push_back(violation.field());
  return fields;
}

TEST(FromProto, DefaultsAreTheCoresAndValid) {
  v1::Session session;
  session.add_scanner_models();
  Violations violations;
  CheckSession(session, "", violations);
  EXPECT_THAT(Fields(violations), IsEmpty());
  const PlanningConfig config =
      ReadPlanningConfig({}, {}, Eigen::Vector3d::Zero(), 0.05, "c", "r", violations);
  EXPECT_EQ(config.required_density, PlanningConfig().required_density);
  EXPECT_EQ(config.max_height, PlanningConfig().max_height);
  EXPECT_EQ(config.registration.required_accuracy, RegistrationConfig().required_accuracy);
  const ScannerModel scanner = ReadScannerModel({}, "s", violations);
  EXPECT_EQ(scanner.range_max, ScannerModel().range_max);
  EXPECT_TRUE(violations.empty());
}

TEST(FromProto, ListsEveryViolationNotTheFirst) {
  v1::Session session;
  v1::ScannerModel& scanner = *session.add_scanner_models();
  scanner.set_range_min(5);
  scanner.set_range_max(2);
  scanner.set_azimuth_step(kNaN);
  session.mutable_model_config()->set_voxel_size(-1);
  session.mutable_planning_config()->set_min_height(3);
  session.mutable_planning_config()->set_confidence(1);
  session.mutable_planning_config()->mutable_weights()->set_occlusion(-1);
  session.mutable_site_rules()->add_keep_out()->mutable_min()->set_x(kNaN);
  session.mutable_origin()->set_x(1e12);
  session.mutable_planning_config()->set_counts_from(1);
  session.set_display_name(std::string(300, 'x'));
  Violations violations;
  CheckSession(session, "session.", violations);
  const std::vector<std::string> fields = Fields(violations);
  for (const char* field :
       {"session.scanner_models[0].range_max", "session.scanner_models[0].azimuth_step",
        "session.model_config.voxel_size", "session.planning_config.max_height",
        "session.planning_config.confidence", "session.planning_config.weights.occlusion",
        "session.planning_config.counts_from", "session.site_rules.keep_out[0].max",
        "session.origin.x", "session.display_name"}) {
    EXPECT_THAT(fields, Contains(field));
  }
}

TEST(FromProto, ADensityThatTheScannerCannotReachIsRefused) {
  v1::Session session;
  session.add_scanner_models();
  session.mutable_planning_config()->set_required_density(1e9);
  Violations violations;
  CheckSession(session, "", violations);
  EXPECT_THAT(Fields(violations), UnorderedElementsAre("planning_config.required_density"));
}

TEST(FromProto, TheViewcellIsAMultipleOfTheVoxel) {
  v1::PlanningConfig config;
  config.set_viewcell_size(0.12);
  Violations violations;
  ReadPlanningConfig(config, {}, Eigen::Vector3d::Zero(), 0.05, "c", "r", violations);
  EXPECT_THAT(Fields(violations), UnorderedElementsAre("c.viewcell_size"));
}

TEST(FromProto, TheOrderOfEvaluationIsOneOfTwo) {
  v1::PlanningConfig config;
  Violations violations;
  const auto order = [&] {
    return ReadPlanningConfig(config, {}, Eigen::Vector3d::Zero(), 0.05, "c", "r", violations)
        .order;
  };
  EXPECT_EQ(order(), EvaluationOrder::kAnytime);
  config.set_evaluation_order(v1::EVALUATION_ORDER_PATCHES);
  EXPECT_EQ(order(), EvaluationOrder::kPatches);
  config.set_evaluation_order(static_cast<v1::EvaluationOrder>(7));
  order();
  EXPECT_THAT(Fields(violations), UnorderedElementsAre("c.evaluation_order"));
}

TEST(FromProto, PosesAreRigidFiniteAndRelativeToTheOrigin) {
  const Eigen::Vector3d origin(500'000, 5'000'000, 100);
  v1::PosePrior prior;
  Violations missing;
  ReadPosePrior(prior, origin, "p", missing);
  EXPECT_THAT(Fields(missing), UnorderedElementsAre("p.pose.rotation", "p.pose.translation"));

  v1::Quaternion& q = *prior.mutable_pose()->mutable_rotation();
  q.set_w(0.5);
  prior.mutable_pose()->mutable_translation()->set_x(kNaN);
  prior.mutable_covariance()->Resize(7, 1.0);
  prior.set_trusted(true);
  Violations wrong;
  ReadPosePrior(prior, origin, "p", wrong);
  EXPECT_THAT(Fields(wrong),
              UnorderedElementsAre("p.pose.rotation", "p.pose.translation.x", "p.covariance"));

  q.set_w(0.8);
  q.set_z(0.6);
  prior.mutable_pose()->mutable_translation()->set_x(500'001.25);
  prior.mutable_pose()->mutable_translation()->set_y(5'000'002.5);
  prior.mutable_pose()->mutable_translation()->set_z(101);
  prior.clear_covariance();
  prior.set_trusted(false);
  Violations none;
  const PosePrior read = ReadPosePrior(prior, origin, "p", none);
  EXPECT_THAT(Fields(none), IsEmpty());
  EXPECT_LT((read.T_world_scan.translation() - Eigen::Vector3d(1.25, 2.5, 1)).norm(), 1e-9);
  // And back, to the bit of what the log holds.
  const v1::Pose written = WritePose(read.T_world_scan, origin);
  EXPECT_NEAR(written.translation().y(), 5'000'002.5, 1e-9);
  EXPECT_NEAR(written.rotation().z(), 0.6, 1e-12);
  EXPECT_LT((ReadOwnPose(written, origin).matrix() - read.T_world_scan.matrix()).norm(), 1e-9);
}

TEST(FromProto, OverridesKeepWhatTheyDoNotName) {
  v1::PlanningConfig config;
  FillDefaults(config);
  v1::PlanningConfig overrides;
  overrides.set_candidates(3);
  overrides.mutable_weights()->set_occlusion(7);
  Override(overrides, config);
  EXPECT_EQ(config.candidates(), 3);
  EXPECT_EQ(config.weights().occlusion(), 7);
  EXPECT_EQ(config.weights().true_surface(), 1);
  EXPECT_EQ(config.required_density(), 2500);
}

TEST(Violations, ManyStayWithinATrailer) {
  Violations violations;
  for (int i = 0; i < 10'000; ++i) violations.Add(std::string(500, 'f'), std::string(5000, 'd'));
  size_t bytes = violations.ToStatus().message().size();
  violations.ToStatus().ForEachPayload(
      [&](absl::string_view, const absl::Cord& payload) { bytes += payload.size(); });
  EXPECT_LT(bytes, 16'000U);
}

}  // namespace
}  // namespace vantage
