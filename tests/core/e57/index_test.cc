// What a file says that is in it.
#include "core/e57/index.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tests/support/e57_writer.h"

namespace vantage::e57 {
namespace {

using test_support::E57Bounds;
using test_support::E57Doubles;
using test_support::E57Integers;
using test_support::E57Pose;
using test_support::E57SetupFile;
using test_support::WriteE57;

absl::StatusOr<std::vector<ScanSetup>> Index(const std::string& bytes) {
  absl::StatusOr<PagedBytes> file = PagedBytes::Open(bytes);
  if (!file.ok()) return file.status();
  return ReadIndex(*file);
}

E57SetupFile SetupOf(const std::string& head) {
  return {head, {E57Doubles("cartesianX", {1}), E57Integers("rowIndex", -3, 4, {2})}, 1, ""};
}

TEST(Index, TellsEachSetup) {
  const double s = std::sqrt(0.5);
  const auto setups = Index(WriteE57(
      {SetupOf(absl::StrCat("<name type=\"String\"><![CDATA[hall <1>]]></name>"
                            "<guid type=\"String\">{1-2}</guid>",
                            E57Pose(s, 0, 0, s, 10, 20, 5'412'000), E57Bounds(0, 99, 5, 204))),
       SetupOf("")}));
  ASSERT_TRUE(setups.ok()) << setups.status();
  ASSERT_EQ(setups->size(), 2U);
  const ScanSetup& hall = (*setups)[0];
  EXPECT_EQ(hall.name, "hall <1>");
  ASSERT_TRUE(hall.T_file_setup.has_value());
  // A quarter turn to the left.
  EXPECT_TRUE((*hall.T_file_setup * Eigen::Vector3d(1, 0, 0))
                  .isApprox(Eigen::Vector3d(10, 21, 5'412'000), 1e-12));
  ASSERT_TRUE(hall.bounds.has_value());
  EXPECT_EQ(hall.bounds->row_min, 0);
  EXPECT_EQ(hall.bounds->row_max, 99);
  EXPECT_EQ(hall.bounds->column_min, 5);
  EXPECT_EQ(hall.bounds->column_max, 204);
  const ScanSetup& bare = (*setups)[1];
  EXPECT_EQ(bare.name, "") << "neither name nor GUID";
  EXPECT_FALSE(bare.T_file_setup.has_value());
  EXPECT_FALSE(bare.bounds.has_value());
  EXPECT_EQ(bare.records, 1U);
}

TEST(Index, TellsHowEachFieldIsStored) {
  E57SetupFile setup = SetupOf("");
  setup.streams.push_back(
      {"<colour type=\"Structure\"><red type=\"Integer\" minimum=\"0\" "
       "maximum=\"255\"/><green type=\"Float\" precision=\"single\"/></colour>",
       std::string(5, 'c')});
  setup.streams.push_back({"<timeStamp type=\"Integer\"/>", std::string(8, 't')});
  setup.streams.push_back(
      {"<intensity type=\"ScaledInteger\" minimum=\"7\" maximum=\"7\" scale=\"1e-3\"/>", ""});
  const auto setups = Index(WriteE57({setup}));
  ASSERT_TRUE(setups.ok()) << setups.status();
  const std::vector<Field>& fields = (*setups)[0].fields;
  ASSERT_EQ(fields.size(), 6U);
  EXPECT_EQ(fields[0].type, FieldType::kDouble);
  EXPECT_EQ(fields[1].minimum, -3);
  EXPECT_EQ(fields[1].bits, 3);
  EXPECT_EQ(fields[2].name, "red") << "in a structure";
  EXPECT_EQ(fields[2].bits, 8);
  EXPECT_EQ(fields[3].type, FieldType::kFloat);
  EXPECT_EQ(fields[4].bits, 64) << "neither minimum nor maximum is stated";
  EXPECT_EQ(fields[5].bits, 0);
  EXPECT_EQ(fields[5].scale, 1e-3);
  EXPECT_EQ((*setups)[0].FieldOf("timeStamp"), 4U);
  EXPECT_FALSE((*setups)[0].FieldOf("rowindex").has_value());
}

TEST(Index, WhatIsNotTheStandardsIsNamed) {
  struct Wrong {
    std::string head;
    const char* says;
  };
  for (const Wrong& wrong :
       {Wrong{E57Pose(2, 0, 0, 0, 0, 0, 0), "set-up 1/pose"},
        Wrong{"<pose type=\"Structure\"><translation><x>here</x></translation></pose>", "pose/x"},
        Wrong{E57Bounds(9, 3, 0, 5), "set-up 1/indexBounds"},
        Wrong{"<name type=\"String\">hall</name><indexBounds><rowMaximum>1.5</rowMaximum>"
              "<columnMaximum/></indexBounds>",
              "set-up 1 (hall)/indexBounds/rowMaximum"},
        Wrong{"<name>", "no XML"}}) {
    const absl::Status status = Index(WriteE57({SetupOf(wrong.head)})).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << wrong.says << ": " << status;
    EXPECT_TRUE(absl::StrContains(status.message(), wrong.says)) << status;
  }
  E57SetupFile setup = SetupOf("");
  setup.codecs = "<vectorChild type=\"Structure\"/>";
  EXPECT_TRUE(absl::IsUnimplemented(Index(WriteE57({setup})).status()));
  for (const std::string& element :
       {std::string("<cartesianY type=\"Blob\"/>"), std::string("<cartesianY/>"),
        std::string("<cartesianY type=\"Float\" precision=\"half\"/>"),
        std::string("<cartesianY type=\"Integer\" minimum=\"3\" maximum=\"2\"/>")}) {
    E57SetupFile odd = SetupOf("");
    odd.streams.push_back({element, ""});
    const absl::Status status = Index(WriteE57({odd})).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << element << ": " << status;
    EXPECT_TRUE(absl::StrContains(status.message(), "prototype/cartesianY")) << status;
  }
}

}  // namespace
}  // namespace vantage::e57
