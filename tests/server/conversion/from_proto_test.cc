#include "server/conversion/from_proto.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
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
  CheckScanner(member, "scanner", of_fleet);
  EXPECT_GE(Fields(of_fleet).size(), 4u);
  for (const std::string& field : Fields(of_fleet)) {
    EXPECT_TRUE(Resolves(v1::CreateScannerRequest::descriptor(), field)) << field;
  }
  EXPECT_FALSE(Resolves(v1::Session::descriptor(), "planning_config.required_density"));
}

// Calls `with` for each number that there is in a message, set to values of every size.
void ForEachValue(google::protobuf::Message& message, const std::function<void()>& with) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* field = message.GetDescriptor()->field(i);
    if (field->is_repeated()) continue;
    if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) {
      ForEachValue(*reflection.MutableMessage(&message, field), with);
      continue;
    }
    for (int size = -13; size <= 40; ++size) {
      const double value = size == -13 ? 0 : 1e-4 * std::pow(1.7, size);
      if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_DOUBLE) {
        reflection.SetDouble(&message, field, value);
      } else if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_INT32) {
        reflection.SetInt32(&message, field, static_cast<int>(std::min(value, 1e9)));
      } else {
        break;
      }
      with();
    }
    reflection.ClearField(&message, field);
  }
}

// What a session is created with is used much later: nothing may fail only then.
TEST(FromProto, WhatASessionIsCreatedWithTheCoreTakes) {
  v1::Session session;
  session.add_scanner_models();
  int taken = 0;
  int refused = 0;
  const auto check = [&] {
    contract::Violations violations;
    CheckSession(session, "", violations);
    ++(violations.empty() ? taken : refused);
    if (!violations.empty()) return;
    const model::ModelConfig model = ReadModelConfig(session.model_config(), "", violations);
    const sensor::ScannerModel scanner =
        ReadScannerModel(session.scanner_models(0), "", violations);
    const planning::PlanningConfig planning =
        ReadPlanningConfig(session.planning_config(), session.site_rules(),
                           ReadOwnVector(session.origin()), model.voxel_size, "", "", violations);
    EXPECT_TRUE(model.Validate().ok()) << session.DebugString() << model.Validate();
    EXPECT_TRUE(scanner.Validate().ok()) << session.DebugString() << scanner.Validate();
    EXPECT_TRUE(planning.Validate(scanner).ok())
        << session.DebugString() << planning.Validate(scanner);
  };
  ForEachValue(*session.mutable_planning_config(), check);
  ForEachValue(*session.mutable_scanner_models(0), check);
  session.clear_planning_config();
  session.mutable_scanner_models(0)->Clear();
  ForEachValue(*session.mutable_model_config(), check);
  EXPECT_GT(taken, 500);
  EXPECT_GT(refused, 500);
}

TEST(FromProto, ADensityThatTheScannerCannotReachIsRefused) {
  v1::Session session;
  session.add_scanner_models();
  session.mutable_planning_config()->set_required_density_per_m2(1e9);
  contract::Violations violations;
  CheckSession(session, "", violations);
  EXPECT_THAT(Fields(violations), UnorderedElementsAre("planning_config.required_density_per_m2"));
}

v1::RequiredRegion& AddSquare(v1::SiteRules& rules, const std::string& name, double x0, double x1) {
  v1::RequiredRegion& region = *rules.add_regions();
  region.set_name(name);
  for (const auto& [x, y] : {std::pair(x0, 0.0), {x1, 0.0}, {x1, 2.0}, {x0, 2.0}}) {
    v1::Vector3& corner = *region.mutable_polygon()->add_corners();
    corner.set_x(x);
    corner.set_y(y);
  }
  return region;
}

// A session with two storeys, and a region on each.
v1::Session WithRegions() {
  v1::Session session;
  session.add_scanner_models();
  v1::SiteRules& rules = *session.mutable_site_rules();
  for (const auto& [name, z] : {std::pair("attic", 2.8), {"ground floor", 0.0}}) {
    v1::NamedStorey& storey = *rules.add_storeys();
    storey.set_name(name);
    storey.set_floor_z_m(z);
  }
  AddSquare(rules, "machine room", 0, 2).set_storey("ground floor");
  AddSquare(rules, "store", 0, 2).set_storey("attic");
  return session;
}

std::vector<std::string> WrongIn(const v1::Session& session) {
  contract::Violations violations;
  CheckSession(session, "", violations);
  std::vector<std::string> fields = Fields(violations);
  for (const std::string& field : fields) {
    // Of a list, too, or of one of its elements.
    EXPECT_TRUE(Resolves(v1::Session::descriptor(), field) ||
                Resolves(v1::Session::descriptor(), field + "[0]"))
        << field;
  }
  return fields;
}

TEST(FromProto, RegionsAreReadInTheModelsFrame) {
  v1::Session session = WithRegions();
  v1::SiteRules& rules = *session.mutable_site_rules();
  rules.mutable_regions(0)->set_required_density_per_m2(10'000);
  rules.mutable_regions(1)->set_weight(0);
  v1::RequiredRegion& box = *rules.add_regions();
  box.set_name("yard");
  *box.mutable_box()->mutable_min() = WriteVector({5, 5, -1});
  *box.mutable_box()->mutable_max() = WriteVector({7, 9, 4});
  EXPECT_THAT(WrongIn(session), IsEmpty());
  contract::Violations none;
  const planning::PlanningConfig config =
      ReadPlanningConfig({}, rules, {1, 2, 0.5}, 0.05, "c", "r", none);
  ASSERT_EQ(config.regions.size(), 3u);
  EXPECT_EQ(config.regions[0].name, "machine room");
  EXPECT_EQ(config.regions[0].outline[2], Eigen::Vector2d(1, 0));
  EXPECT_EQ(config.regions[0].density, 10'000);
  EXPECT_EQ(config.regions[0].weight, 1);
  EXPECT_NEAR(config.regions[0].min_z, -0.6, 1e-9);  // a little below its floor
  EXPECT_NEAR(config.regions[0].max_z, 2.2, 1e-9);   // to as little below the next
  EXPECT_NEAR(config.regions[1].min_z, 2.2, 1e-9);
  EXPECT_EQ(config.regions[1].max_z, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(config.regions[1].density.has_value());
  EXPECT_EQ(config.regions[1].weight, 0);
  EXPECT_EQ(config.regions[2].min_z, -1.5);
  EXPECT_TRUE(config.regions[2].Contains({5, 4, 0}));
  EXPECT_FALSE(config.regions[2].Contains({7, 4, 0}));
  ASSERT_EQ(config.storeys.size(), 2u);
  EXPECT_EQ(config.storeys[1].name, "ground floor");
  EXPECT_EQ(config.storeys[1].floor_z, -0.5);
}

TEST(FromProto, ImpossibleRegionsAreRefusedByTheirField) {
  const auto wrong = [](const std::function<void(v1::SiteRules&)>& change) {
    v1::Session session = WithRegions();
    change(*session.mutable_site_rules());
    return WrongIn(session);
  };
  const std::string second = "site_rules.regions[1]";
  EXPECT_THAT(wrong([](v1::SiteRules& r) { r.mutable_regions(1)->clear_storey(); }),
              UnorderedElementsAre(second));  // overlaps
  EXPECT_THAT(wrong([](v1::SiteRules& r) { r.mutable_regions(1)->set_storey("cellar"); }),
              UnorderedElementsAre(second + ".storey"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) { r.mutable_regions(1)->set_min_z_m(3); }),
              UnorderedElementsAre(second + ".storey"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) {
                r.mutable_regions(1)->clear_storey();
                r.mutable_regions(1)->set_min_z_m(5);
                r.mutable_regions(1)->set_max_z_m(5);
              }),
              UnorderedElementsAre(second + ".max_z_m"));
  EXPECT_THAT(
      wrong([](v1::SiteRules& r) {
        for (v1::Vector3& corner : *r.mutable_regions(1)->mutable_polygon()->mutable_corners())
          corner.set_x(corner.x() + 1000);
      }),
      UnorderedElementsAre(second));  // outside of the site
  EXPECT_THAT(wrong([](v1::SiteRules& r) {
                r.mutable_regions(1)->mutable_polygon()->mutable_corners()->RemoveLast();
                r.mutable_regions(1)->mutable_polygon()->mutable_corners()->RemoveLast();
              }),
              UnorderedElementsAre(second + ".polygon.corners"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) {
                r.mutable_regions(1)->mutable_polygon()->mutable_corners(2)->set_y(kNaN);
              }),
              UnorderedElementsAre(second + ".polygon.corners[2].y"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) {
                r.mutable_regions(1)->mutable_polygon()->mutable_corners()->SwapElements(0, 1);
              }),
              UnorderedElementsAre(second + ".polygon.corners"));  // crosses itself
  EXPECT_THAT(wrong([](v1::SiteRules& r) { r.mutable_regions(1)->clear_polygon(); }),
              UnorderedElementsAre(second + ".polygon"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) {
                *r.mutable_regions(1)->mutable_box()->mutable_min() = WriteVector({0, 0, kNaN});
                *r.mutable_regions(1)->mutable_box()->mutable_max() = WriteVector({1, 1, 9});
              }),
              UnorderedElementsAre(second + ".box.min.z", second + ".box", second + ".storey"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) {
                r.mutable_regions(0)->set_name("store");
                r.mutable_regions(1)->set_weight(-1);
                r.mutable_regions(1)->set_required_density_per_m2(0);
              }),
              UnorderedElementsAre(second + ".name", second + ".weight",
                                   second + ".required_density_per_m2"));
  EXPECT_THAT(
      wrong([](v1::SiteRules& r) { r.mutable_regions(1)->set_required_density_per_m2(1e9); }),
      UnorderedElementsAre(second + ".required_density_per_m2"));  // out of reach
  EXPECT_THAT(wrong([](v1::SiteRules& r) { r.mutable_regions(1)->clear_name(); }),
              UnorderedElementsAre(second + ".name"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) { r.mutable_storeys(0)->set_floor_z_m(1.5); }),
              UnorderedElementsAre("site_rules.storeys[1].floor_z_m"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) {
                r.mutable_storeys(0)->set_name("ground floor");
                r.mutable_regions(1)->set_storey("ground floor");
              }),
              Contains("site_rules.storeys[1].name"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) { r.mutable_storeys(0)->set_floor_z_m(kNaN); }),
              Contains("site_rules.storeys[0].floor_z_m"));
  EXPECT_THAT(wrong([](v1::SiteRules& r) {
                for (int i = 0; i < 65; ++i)
                  AddSquare(r, std::to_string(i), 10 + 2 * i, 12 + 2 * i);
              }),
              UnorderedElementsAre("site_rules.regions"));
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

TEST(FromProto, PeopleMayStandWherePlacesAreExpected) {
  v1::PlanningConfig config;
  contract::Violations violations;
  const auto basis = [&] {
    return ReadPlanningConfig(config, {}, Eigen::Vector3d::Zero(), 0.05, "c", "r", violations)
        .station_basis;
  };
  EXPECT_EQ(basis(), planning::StationBasis::kExpected);
  config.set_station_basis(v1::STATION_BASIS_KNOWN);
  EXPECT_EQ(basis(), planning::StationBasis::kKnown);
  config.set_station_basis(static_cast<v1::StationBasis>(7));
  basis();
  EXPECT_THAT(Fields(violations), UnorderedElementsAre("c.station_basis"));
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
