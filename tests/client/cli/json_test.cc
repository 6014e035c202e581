#include "client/cli/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vantage/v1/session.pb.h"

namespace vantage::cli {
namespace {

using ::testing::HasSubstr;

TEST(Json, SetsFieldsByPath) {
  v1::Session session;
  ASSERT_TRUE(SetField(session, "planning_config.required_density_per_m2", "1600").ok());
  ASSERT_TRUE(SetField(session, "planning_config.require_reachable", "false").ok());
  ASSERT_TRUE(SetField(session, "display_name", "Flat, 3rd floor").ok());
  ASSERT_TRUE(SetField(session, "origin", "{x: 1 y: -2 z: 0.5}").ok());
  EXPECT_EQ(session.planning_config().required_density_per_m2(), 1600);
  EXPECT_FALSE(session.planning_config().require_reachable());
  EXPECT_TRUE(session.planning_config().has_require_reachable());
  EXPECT_EQ(session.display_name(), "Flat, 3rd floor");
  EXPECT_EQ(session.origin().y(), -2);
}

TEST(Json, NamesThePathAndWhatThereIs) {
  v1::Session session;
  const absl::Status unknown = SetField(session, "planning_config.densty", "1");
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("there is no 'densty'"));
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("required_density"));
  const absl::Status wrong = SetField(session, "planning_config.required_density_per_m2", "much");
  EXPECT_THAT(std::string(wrong.message()), HasSubstr("cannot be 'much'"));
  const absl::Status deep = SetField(session, "display_name.x", "1");
  EXPECT_THAT(std::string(deep.message()), HasSubstr("has no parts"));
}

TEST(SetFields, OneAfterTheOther) {
  v1::PlanningConfig config;
  ASSERT_TRUE(SetFields(config, {"max_view_count=3", "weights.occlusion=0.5"}).ok());
  EXPECT_EQ(config.max_view_count(), 3);
  EXPECT_EQ(config.weights().occlusion(), 0.5);
  EXPECT_THAT(std::string(SetFields(config, {"max_view_count"}).message()),
              HasSubstr("--set 'max_view_count' is not of the form PATH=VALUE"));
  EXPECT_FALSE(SetFields(config, {"max_view_count=4", "none=1"}).ok());
}

TEST(Json, GoesThereAndBack) {
  v1::Session session;
  session.set_name("sessions/a");
  session.mutable_planning_config()->set_required_density_per_m2(12.5);
  v1::Session back;
  ASSERT_TRUE(FromJson(ToJson(session), "test", back).ok());
  EXPECT_EQ(back.SerializeAsString(), session.SerializeAsString());
}

TEST(Json, RefusesWhatIsNotASession) {
  v1::Session session;
  const absl::Status status = FromJson("{\"voxel\": 1}", "hall.json", session);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("hall.json"));
}

}  // namespace
}  // namespace vantage::cli
