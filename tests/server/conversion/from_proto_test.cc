#include "server/conversion/from_proto.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "core/sensor/presets.h"
#include "google/protobuf/descriptor.h"
#include "google/rpc/error_details.pb.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/to_proto.h"
#include "vantage/v1/fleet_service.pb.h"

namespace vantage::conversion {
namespace {

using testing::Contains;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<std::string> Fields(const contract::Violations& violations) {
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
  contract::Violations violations;
  CheckSession(session, "", violations);
  EXPECT_THAT(Fields(violations), IsEmpty());
  const planning::PlanningConfig config =
      ReadPlanningConfig({}, {}, Eigen::Vector3d::Zero(), 0.05, "c", "r", violations);
  EXPECT_EQ(config.required_density, planning::PlanningConfig().required_density);
  EXPECT_EQ(config.max_viewpoint_height, planning::PlanningConfig().max_viewpoint_height);
  EXPECT_EQ(config.registration.required_accuracy,
            registration::RegistrationConfig().required_accuracy);
  const sensor::ScannerModel scanner = ReadScannerModel({}, "s", violations);
  EXPECT_EQ(scanner.range_max, sensor::ScannerModel().range_max);
  EXPECT_TRUE(violations.empty());
}

TEST(FromProto, ListsEveryViolationNotTheFirst) {
  v1::Session session;
  v1::ScannerModel& scanner = *session.add_scanner_models();
  scanner.set_min_range_m(5);
  scanner.set_max_range_m(2);
  scanner.set_azimuth_step_rad(kNaN);
  session.mutable_model_config()->set_voxel_size_m(-1);
  session.mutable_planning_config()->set_min_viewpoint_height_m(3);
  session.mutable_planning_config()->set_confidence(1);
  session.mutable_planning_config()->mutable_weights()->set_occlusion(-1);
  session.mutable_site_rules()->add_keep_out()->mutable_min()->set_x(kNaN);
  session.mutable_origin()->set_x(1e12);
  session.mutable_planning_config()->set_min_counted_density_share(1);
  session.set_display_name(std::string(300, 'x'));
  contract::Violations violations;
  CheckSession(session, "session.", violations);
  const std::vector<std::string> fields = Fields(violations);
  for (const char* field :
       {"session.scanner_models[0].max_range_m", "session.scanner_models[0].azimuth_step_rad",
        "session.model_config.voxel_size_m", "session.planning_config.max_viewpoint_height_m",
        "session.planning_config.confidence", "session.planning_config.weights.occlusion",
        "session.planning_config.min_counted_density_share", "session.site_rules.keep_out[0].max",
        "session.origin.x", "session.display_name"}) {
    EXPECT_THAT(fields, Contains(field));
  }
}

TEST(FromProto, APresetGivesTheFiguresThatAreNotSet) {
  const sensor::Preset preset = sensor::FindPreset("leica-rtc360").value();
  v1::ScannerModel scanner;
  scanner.set_preset(preset.name);
  scanner.set_max_range_m(40);
  FillDefaults(scanner);
  EXPECT_EQ(scanner.id(), preset.name);
  EXPECT_EQ(scanner.setting(), "6mm");
  EXPECT_NEAR(ReadDuration(scanner.scan_duration()), 60 * preset.Setting("6mm")->minutes, 1e-6);
  contract::Violations violations;
  const sensor::ScannerModel usual = ReadScannerModel(scanner, "s", violations);
  EXPECT_EQ(usual.azimuth_step, preset.Setting("6mm")->step);
  EXPECT_EQ(usual.range_noise, preset.model.range_noise);
  EXPECT_EQ(usual.range_max, 40);
  v1::ScannerModel fine;
  fine.set_preset(preset.name);
  fine.set_setting("3mm");
  EXPECT_EQ(ReadScannerModel(fine, "s", violations).azimuth_step, preset.Setting("3mm")->step);
  EXPECT_TRUE(violations.empty());

  // A scanner of the fleet that says nothing of its time takes that of its model.
  v1::Session session;
  *session.add_scanner_models() = scanner;
  v1::Scanner member;
  FillDefaults(member, session);
  EXPECT_NEAR(ReadDuration(member.scan_duration()), 60 + ReadDuration(scanner.scan_duration()),
              1e-6);
}

TEST(FromProto, UnknownPresetsAndSettingsListThoseThatExist) {
  const auto message = [](const char* preset, const char* setting, const char* field) {
    v1::ScannerModel scanner;
    scanner.set_preset(preset);
    scanner.set_setting(setting);
    contract::Violations violations;
    ReadScannerModel(scanner, "s", violations);
    EXPECT_THAT(Fields(violations), UnorderedElementsAre(field));
    return std::string(violations.ToStatus().message());
  };
  EXPECT_THAT(message("leica", "", "s.preset"), testing::HasSubstr("leica-rtc360"));
  EXPECT_THAT(message("leica-rtc360", "1mm", "s.setting"), testing::HasSubstr("3mm, 6mm, 12mm"));
  EXPECT_THAT(message("", "3mm", "s.setting"), testing::HasSubstr("preset"));
}

// Whether `path` names a field of the message, through messages and elements of lists.
bool Resolves(const google::protobuf::Descriptor* message, const std::string& path) {
  for (absl::string_view step : absl::StrSplit(path, '.')) {
    const std::string name(step.substr(0, step.find('[')));
    if (message == nullptr) return false;
    const google::protobuf::FieldDescriptor* field = message->FindFieldByName(name);
    if (field == nullptr || field->is_repeated() != (name.size() != step.size())) return false;
    message = field->message_type();
  }
  return true;
}

// Every number that there is in a message, impossible.
void Spoil(google::protobuf::Message& message) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* field = message.GetDescriptor()->field(i);
    if (field->is_repeated()) continue;
    if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_DOUBLE) {
      reflection.SetDouble(&message, field, kNaN);
    } else if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_INT32) {
      reflection.SetInt32(&message, field, -1);
    } else if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) {
      Spoil(*reflection.MutableMessage(&message, field));
    }
  }
}

// Clients find the field by it.
TEST(FromProto, EveryPathNamesAField) {
  contract::Violations of_model;
  v1::ModelConfig model;
  Spoil(model);
  ReadModelConfig(model, "model_config", of_model);
  contract::Violations of_planning;
  v1::PlanningConfig planning;
  Spoil(planning);
  v1::SiteRules rules;
  Spoil(*rules.mutable_region_of_interest());
  ReadPlanningConfig(planning, rules, Eigen::Vector3d::Zero(), 0.05, "planning_config",
                     "site_rules", of_planning);
  contract::Violations of_scanner;
  v1::ScannerModel scanner;
  Spoil(scanner);
  ReadScannerModel(scanner, "scanner_models[0]", of_scanner);
  EXPECT_GE(Fields(of_model).size(), 5u);
  EXPECT_GE(Fields(of_planning).size(), 30u);
  EXPECT_GE(Fields(of_scanner).size(), 12u);
  for (const contract::Violations* violations : {&of_model, &of_planning, &of_scanner}) {
    for (const std::string& field : Fields(*violations)) {
      EXPECT_TRUE(Resolves(v1::Session::descriptor(), field)) << field;
    }
  }
  contract::Violations of_fleet;
  v1::Scanner member;
  member.set_speed_m_per_s(-1);
  member.mutable_scan_duration()->set_seconds(-1);
  member.add_reach()->mutable_min()->set_x(kNaN);
  v1::Session session;
  session.add_scanner_models();
  CheckScanner(member, session, "scanner", of_fleet);
  EXPECT_GE(Fields(of_fleet).size(), 4u);
  for (const std::string& field : Fields(of_fleet)) {
    EXPECT_TRUE(Resolves(v1::CreateScannerRequest::descriptor(), field)) << field;
  }
  EXPECT_FALSE(Resolves(v1::Session::descriptor(), "planning_config.required_density"));
}

TEST(FromProto, ADensityThatTheScannerCannotReachIsRefused) {
  v1::Session session;
  session.add_scanner_models();
  session.mutable_planning_config()->set_required_density_per_m2(1e9);
  contract::Violations violations;
  CheckSession(session, "", violations);
  EXPECT_THAT(Fields(violations), UnorderedElementsAre("planning_config.required_density_per_m2"));
}

TEST(FromProto, TheViewcellIsAMultipleOfTheVoxel) {
  v1::PlanningConfig config;
  config.set_viewcell_size_m(0.12);
  contract::Violations violations;
  ReadPlanningConfig(config, {}, Eigen::Vector3d::Zero(), 0.05, "c", "r", violations);
  EXPECT_THAT(Fields(violations), UnorderedElementsAre("c.viewcell_size_m"));
}

TEST(FromProto, TheOrderOfEvaluationIsOneOfTwo) {
  v1::PlanningConfig config;
  contract::Violations violations;
  const auto order = [&] {
    return ReadPlanningConfig(config, {}, Eigen::Vector3d::Zero(), 0.05, "c", "r", violations)
        .order;
  };
  EXPECT_EQ(order(), planning::EvaluationOrder::kAnytime);
  config.set_evaluation_order(v1::EVALUATION_ORDER_PATCHES);
  EXPECT_EQ(order(), planning::EvaluationOrder::kPatches);
  config.set_evaluation_order(static_cast<v1::EvaluationOrder>(7));
  order();
  EXPECT_THAT(Fields(violations), UnorderedElementsAre("c.evaluation_order"));
}

TEST(FromProto, PosesAreRigidFiniteAndRelativeToTheOrigin) {
  const Eigen::Vector3d origin(500'000, 5'000'000, 100);
  v1::PosePrior prior;
  contract::Violations missing;
  ReadPosePrior(prior, origin, "p", missing);
  EXPECT_THAT(Fields(missing), UnorderedElementsAre("p.pose.rotation", "p.pose.translation"));

  v1::Quaternion& q = *prior.mutable_pose()->mutable_rotation();
  q.set_w(0.5);
  prior.mutable_pose()->mutable_translation()->set_x(kNaN);
  prior.mutable_covariance()->Resize(7, 1.0);
  prior.set_trusted(true);
  contract::Violations wrong;
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
  contract::Violations none;
  const sensor::PosePrior read = ReadPosePrior(prior, origin, "p", none);
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
  overrides.set_max_view_count(3);
  overrides.mutable_weights()->set_occlusion(7);
  Override(overrides, config);
  EXPECT_EQ(config.max_view_count(), 3);
  EXPECT_EQ(config.weights().occlusion(), 7);
  EXPECT_EQ(config.weights().true_surface(), 1);
  EXPECT_EQ(config.required_density_per_m2(), 2500);
}

TEST(Violations, ManyStayWithinATrailer) {
  contract::Violations violations;
  for (int i = 0; i < 10'000; ++i) violations.Add(std::string(500, 'f'), std::string(5000, 'd'));
  size_t bytes = violations.ToStatus().message().size();
  violations.ToStatus().ForEachPayload(
      [&](absl::string_view, const absl::Cord& payload) { bytes += payload.size(); });
  EXPECT_LT(bytes, 16'000U);
}

}  // namespace
}  // namespace vantage::conversion
