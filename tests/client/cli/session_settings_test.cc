#include "client/cli/session_settings.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

namespace vantage::cli {
namespace {

// A file with the rules of a site, as the README has it.
TEST(SessionSettings, TheListsOfAFileReplaceThoseOfTheSession) {
  const std::string path = testing::TempDir() + "site_rules.json";
  std::ofstream(path) << R"({"siteRules": {
    "storeys": [{"name": "cellar", "floorZM": -2.7}, {"name": "shop", "floorZM": 0}],
    "regions": [{"name": "machine room", "storey": "cellar", "requiredDensityPerM2": 10000,
                 "weight": 2, "polygon": {"corners": [
                   {"x": 0, "y": 0}, {"x": 4, "y": 0}, {"x": 4, "y": 3}, {"x": 0, "y": 3}]}}]}})";
  SessionSettings settings;
  settings.config = path;
  v1::Session session;
  session.mutable_site_rules()->add_regions()->set_name("before");
  session.mutable_site_rules()->add_keep_out();
  for (int times = 0; times < 2; ++times) {
    const auto paths = ApplySettings(settings, session);
    ASSERT_TRUE(paths.ok()) << paths.status();
    EXPECT_EQ(*paths, std::vector<std::string>{"site_rules"});
    ASSERT_EQ(session.site_rules().regions_size(), 1);
    EXPECT_EQ(session.site_rules().regions(0).name(), "machine room");
    EXPECT_EQ(session.site_rules().regions(0).polygon().corners_size(), 4);
    EXPECT_EQ(session.site_rules().storeys_size(), 2);
    EXPECT_EQ(session.site_rules().keep_out_size(), 1);  // the file has none
  }
}

}  // namespace
}  // namespace vantage::cli
