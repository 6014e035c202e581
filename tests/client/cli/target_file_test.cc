#include "client/cli/target_file.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

namespace vantage::cli {
namespace {

TEST(TargetFile, LinesWithAndWithoutAControlNetwork) {
  const auto parsed = ParseTargets(
      "# seen on Monday\n"
      "s1 T1 1 2 3\n"
      "\n"
      "s2, T1, -1.5, 2e0, 0.25, 1001, 2002, 3.5   # from the network\n",
      "list");
  ASSERT_TRUE(parsed.ok()) << parsed.status();
  ASSERT_EQ(parsed->size(), 2u);
  EXPECT_EQ((*parsed)[0].first, "s1");
  EXPECT_EQ((*parsed)[0].second.name(), "T1");
  EXPECT_EQ((*parsed)[0].second.in_scan().z(), 3);
  EXPECT_FALSE((*parsed)[0].second.has_in_world());
  EXPECT_EQ((*parsed)[1].second.in_scan().x(), -1.5);
  EXPECT_EQ((*parsed)[1].second.in_world().y(), 2002);
}

TEST(TargetFile, ErrorsNameTheLine) {
  for (const char* line : {"s1 T1 1 2", "s1 T1 1 2 3 4", "s1 T1 1 two 3", "s1 T1 1 2 inf"}) {
    const auto parsed = ParseTargets(std::string("s0 T0 0 0 0\n") + line, "list");
    EXPECT_EQ(parsed.status().code(), absl::StatusCode::kInvalidArgument) << line;
    EXPECT_NE(parsed.status().message().find("list:2"), absl::string_view::npos) << parsed.status();
  }
}

TEST(TargetFile, OfOneScanAlone) {
  const std::string file = testing::TempDir() + "/targets.txt";
  std::ofstream(file) << "a T1 1 0 0\nb T1 2 0 0\na T2 3 0 0\n";
  const auto targets = ReadTargets(file, "a");
  ASSERT_TRUE(targets.ok()) << targets.status();
  ASSERT_EQ(targets->size(), 2u);
  EXPECT_EQ((*targets)[1].name(), "T2");
  const auto none = ReadTargets(file, "c");
  EXPECT_EQ(none.status().code(), absl::StatusCode::kInvalidArgument);
  std::remove(file.c_str());
}

}  // namespace
}  // namespace vantage::cli
