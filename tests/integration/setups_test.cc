// A registered project, several set-ups in one file, is pushed as such.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/integration/answers.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/support/e57_writer.h"
#include "vantage/v1/scan_service.pb.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A scan of the simulated room, with that place as its pose.
test_support::E57SetupFile SetupAt(const Eigen::Vector3d& position, const std::string& name) {
  const sensor::RangeImage image = fixture::ScanRoom(position, 1.5);
  std::vector<double> x, y, z;
  std::vector<int64_t> row, column;
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      if (!sensor::RangeImage::IsRange(image.at(c, r))) continue;
      const Eigen::Vector3d p = static_cast<double>(image.at(c, r)) * image.Direction(c, r);
      x.push_back(p.x());
      y.push_back(p.y());
      z.push_back(p.z());
      row.push_back(r);
      column.push_back(c);
    }
  }
  return {absl::StrCat("<name type=\"String\">", name, "</name>",
                       test_support::E57Pose(1, 0, 0, 0, position.x(), position.y(), position.z()),
                       test_support::E57Bounds(0, image.rows() - 1, 0, image.columns() - 1)),
          {test_support::E57Floats("cartesianX", x), test_support::E57Floats("cartesianY", y),
           test_support::E57Floats("cartesianZ", z),
           test_support::E57Integers("rowIndex", 0, 4095, row),
           test_support::E57Integers("columnIndex", 0, 4095, column)},
          x.size(),
          ""};
}

TEST(Setups, OfAFileArePushedInOrderEachWithItsPose) {
  const ScratchFolder scratch;
  const std::string path = scratch.File("project.e57");
  test_support::E57Options options;
  options.packets = 40;  // a packet has at most 64 KiB
  std::ofstream(path, std::ios::binary)
      << test_support::WriteE57({SetupAt({2.0, 1.5, 1.4}, "door"), SetupAt({3.0, 2.5, 1.4}, ""),
                                 SetupAt({1.2, 2.2, 1.4}, "corner")},
                                options);
  const Finished told = RunProgram({VANTAGE_BINARY, "file", path});
  ASSERT_EQ(told.exit_code, 0) << told.error;
  EXPECT_THAT(told.out, HasSubstr("240 x 99"));
  EXPECT_THAT(told.out, HasSubstr("3.000, 2.500, 1.400"));
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  ASSERT_EQ(Vantage(server, {"session", "create", "job", "--scanner-from", path}).exit_code, 0);
  const Finished both = Vantage(server, {"scan", "push", "job", path, "--prior", "1,2,0,0"});
  EXPECT_EQ(both.exit_code, 5) << both.out;
  EXPECT_THAT(both.error, HasSubstr("3 set-ups"));
  const Finished none = Vantage(server, {"scan", "push", "job", path, "--setup", "4"});
  EXPECT_EQ(none.exit_code, 5) << none.out;
  EXPECT_THAT(none.error, HasSubstr("no set-up 4"));
  const Finished first = Vantage(server, {"scan", "push", "job", path, "--setup", "1"});
  ASSERT_EQ(first.exit_code, 0) << first.error;
  EXPECT_THAT(first.out, HasSubstr("door"));
  EXPECT_THAT(first.out, HasSubstr("to density"));
  // The one that has arrived already is not sent again.
  const Finished all = Vantage(server, {"scan", "push", "job", path});
  ASSERT_EQ(all.exit_code, 0) << all.error;
  const Finished list = Vantage(server, {"scan", "list", "job"});
  for (const char* name : {"door", "project-2", "corner"}) EXPECT_THAT(list.out, HasSubstr(name));
  EXPECT_THAT(list.out, Not(HasSubstr("scan-4")));
  EXPECT_THAT(all.out, HasSubstr("3.00"));
  // What is exported is a registered project, too: it is pushed as such, and stands where it stood.
  const std::string exported = scratch.File("exported.e57");
  const Finished saved =
      Vantage(server, {"export", "job", "--format", "scans-e57", "-o", exported});
  ASSERT_EQ(saved.exit_code, 0) << saved.error;
  ASSERT_EQ(Vantage(server, {"session", "create", "copy", "--scanner-from", exported}).exit_code,
            0);
  const Finished pushed = Vantage(server, {"scan", "push", "copy", exported});
  ASSERT_EQ(pushed.exit_code, 0) << pushed.error;
  const auto before =
      Answer<v1::ListScansResponse>(Vantage(server, {"scan", "list", "job", "--json"}));
  const auto after =
      Answer<v1::ListScansResponse>(Vantage(server, {"scan", "list", "copy", "--json"}));
  ASSERT_EQ(after.scans_size(), 3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(after.scans(i).sample_count(), before.scans(i).sample_count());
    const v1::Vector3& was = before.scans(i).pose().translation();
    const v1::Vector3& is = after.scans(i).pose().translation();
    for (const double apart : {is.x() - was.x(), is.y() - was.y(), is.z() - was.z()}) {
      EXPECT_LT(std::abs(apart), 1e-3) << "m; aligned again from where it was";
    }
  }
}

// Text of points as any program writes it, in the frame of the first scan.
TEST(PointFiles, ArePushedWithTheirStation) {
  const ScratchFolder scratch;
  const auto write = [&](const std::string& name, const Eigen::Vector3d& at) {
    const sensor::RangeImage image = fixture::ScanRoom(at, 1.5);
    std::ofstream file(scratch.File(name));
    file << "X,Y,Z\n";
    for (int c = 0; c < image.columns(); ++c) {
      for (int r = 0; r < image.rows(); ++r) {
        if (!sensor::RangeImage::IsRange(image.at(c, r))) continue;
        const Eigen::Vector3d p = at + static_cast<double>(image.at(c, r)) * image.Direction(c, r);
        file << absl::StrCat(p.x(), ",", p.y(), ",", p.z(), "\n");
      }
    }
    return scratch.File(name);
  };
  const std::string door = write("door.csv", {2.0, 1.5, 1.4});
  const std::string corner = write("corner.csv", {3.0, 2.5, 1.4});
  const Finished unsaid = RunProgram({VANTAGE_BINARY, "file", door});
  EXPECT_EQ(unsaid.exit_code, 5) << unsaid.out;
  EXPECT_THAT(unsaid.error, HasSubstr("--station x,y,z"));
  const Finished told = RunProgram({VANTAGE_BINARY, "file", door, "--station", "2,1.5,1.4"});
  ASSERT_EQ(told.exit_code, 0) << told.error;
  EXPECT_THAT(told.out, HasSubstr("2.000, 1.500, 1.400"));

  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  ASSERT_EQ(Vantage(server, {"session", "create", "job"}).exit_code, 0);
  const Finished both =
      Vantage(server, {"scan", "push", "job", door, corner, "--station", "2,1,1"});
  EXPECT_EQ(both.exit_code, 5) << both.out;
  EXPECT_THAT(both.error, HasSubstr("--station"));
  const Finished first = Vantage(server, {"scan", "push", "job", door, "--station", "2,1.5,1.4",
                                          "--trusted", "--sigma", "0.01,0.1"});
  ASSERT_EQ(first.exit_code, 0) << first.error;
  EXPECT_THAT(first.error, HasSubstr("made of loose points"));
  const Finished second = Vantage(
      server, {"scan", "push", "job", corner, "--station", "3.05,2.5,1.4", "--vendor-registered"});
  ASSERT_EQ(second.exit_code, 0) << second.error << second.out;
  EXPECT_THAT(second.out, HasSubstr("registered"));
}

}  // namespace
}  // namespace vantage::integration
