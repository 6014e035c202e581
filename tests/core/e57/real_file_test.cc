// A file that an instrument's program wrote, against what it says of its own points.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "core/e57/index.h"
#include "core/e57/paged_bytes.h"
#include "core/e57/records.h"

namespace vantage::e57 {
namespace {

std::string Shared(const std::string& name) {
  const char* folder = std::getenv("VANTAGE_SHARED_DATA");
  std::ifstream file(std::string(folder == nullptr ? "" : folder) + "/e57_files/" + name,
                     std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(RealE57, OfAPumpRoomHasThePointsThatItStates) {
  const std::string bytes = Shared("pumpARowColumnIndexNoInvalidPoints.e57");
  if (bytes.empty()) GTEST_SKIP() << "set VANTAGE_SHARED_DATA to the folder with e57_files";
  PagedBytes file = PagedBytes::Open(bytes).value();
  const std::vector<ScanSetup> setups = ReadIndex(file).value();
  ASSERT_EQ(setups.size(), 1U);
  const ScanSetup& pumps = setups[0];
  EXPECT_EQ(pumps.name, "pumpsA");
  EXPECT_FALSE(pumps.T_file_setup.has_value());
  ASSERT_TRUE(pumps.bounds.has_value());
  EXPECT_EQ(pumps.bounds->row_max, 1073);
  EXPECT_EQ(pumps.bounds->column_max, 344);
  const std::vector<size_t> fields = {
      pumps.FieldOf("cartesianX").value(),  pumps.FieldOf("cartesianY").value(),
      pumps.FieldOf("cartesianZ").value(),  pumps.FieldOf("rowIndex").value(),
      pumps.FieldOf("columnIndex").value(), pumps.FieldOf("cartesianInvalidState").value()};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 6> least;
  std::array<double, 6> most;
  least.fill(kInfinity);
  most.fill(-kInfinity);
  size_t count = 0;
  const absl::Status read = ReadRecords(file, pumps, fields, [&](RecordBlock block) {
    for (size_t f = 0; f < fields.size(); ++f) {
      for (const double value : block[f]) {
        least[f] = std::min(least[f], value);
        most[f] = std::max(most[f], value);
      }
    }
    count += block[0].size();
    return absl::OkStatus();
  });
  ASSERT_TRUE(read.ok()) << read;
  EXPECT_EQ(count, 155'201U);
  // Its cartesianBounds, which lie a step of its scaled integers (1e-6 m) farther out.
  const std::array<double, 6> stated_least = {-2.903764, -5.301103, -1.899705, 0, 0, 0};
  const std::array<double, 6> stated_most = {1.721604, -0.792647, 1.843003, 1073, 344, 0};
  for (size_t f = 0; f < fields.size(); ++f) {
    EXPECT_NEAR(least[f], stated_least[f], 1.1e-6) << f;
    EXPECT_NEAR(most[f], stated_most[f], 1.1e-6) << f;
  }
}

TEST(RealE57, FilesThatAreBrokenAreRefusedInWords) {
  if (Shared("empty.e57").empty()) {
    GTEST_SKIP() << "set VANTAGE_SHARED_DATA to the folder with e57_files";
  }
  for (const char* name : {"InvalidFileLength.e57", "NoPrototype.e57", "bad-crc.e57"}) {
    const std::string bytes = Shared(name);
    absl::StatusOr<PagedBytes> file = PagedBytes::Open(bytes);
    absl::Status status = file.status();
    if (status.ok()) {
      const absl::StatusOr<std::vector<ScanSetup>> setups = ReadIndex(*file);
      status = setups.status();
      for (size_t i = 0; status.ok() && i < setups->size(); ++i) {
        const std::vector<size_t> fields = {0};
        status =
            ReadRecords(*file, (*setups)[i], fields, [](RecordBlock) { return absl::OkStatus(); });
      }
    }
    EXPECT_FALSE(status.ok()) << name;
    EXPECT_EQ(status.message().substr(0, 3), "E57") << name << ": " << status;
  }
}

}  // namespace
}  // namespace vantage::e57
