// Invalid input is refused with its field's name, and the session stays as it was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "absl/strings/str_cat.h"
#include "tests/integration/answers.h"
#include "vantage/v1/scan_service.pb.h"
#include "vantage/v1/session.pb.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;

class BadInputTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_FALSE(server_.address().empty());
    ASSERT_EQ(Vantage(server_, {"session", "create", "job"}).exit_code, 0);
    before_ = Session();
  }

  // However a test ends, the session is as it was.
  void TearDown() override {
    EXPECT_EQ(Session().ShortDebugString(), before_.ShortDebugString());
    EXPECT_EQ(server_.Stop(SIGTERM), 0) << server_.Log();
  }

  v1::Session Session() {
    return Answer<v1::Session>(Vantage(server_, {"session", "show", "job", "--json"}));
  }

  std::string Write(const std::string& name, const std::string& contents) {
    std::ofstream(folder_.File(name), std::ios::binary) << contents;
    return folder_.File(name);
  }

  void ExpectRefused(const std::vector<std::string>& arguments, int exit_code,
                     const std::string& words) {
    const Finished finished = Vantage(server_, arguments);
    EXPECT_EQ(finished.exit_code, exit_code) << finished.out << finished.error;
    EXPECT_THAT(finished.error, HasSubstr(words));
    EXPECT_THAT(finished.error, HasSubstr("vantage: "));
  }

  ServerProcess server_;
  ScratchFolder folder_;
  v1::Session before_;
};

constexpr char kPtxHead[] =
    "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

TEST_F(BadInputTest, TargetsThatAreNone) {
  std::string scan = kPtxHead;
  for (const char* point : {"2 2 -1", "2 2 1", "2 -2 -1", "2 -2 1"}) {
    scan += std::string(point) + " 0.5\n";
  }
  const std::string file = Write("corner.ptx", scan);
  const auto push = [&](const std::string& targets) {
    return std::vector<std::string>{"scan", "push",      "job",
                                    file,   "--targets", Write("targets.txt", targets)};
  };
  ExpectRefused(push("corner T1 1 2\n"), 5, "targets.txt:1: 4 words instead of 5 or 8");
  ExpectRefused(push("corner T1 1 2 north\n"), 5, "'north' is not a number");
  ExpectRefused(push("other T1 1 2 3\n"), 5, "has no targets for 'corner'");
  ExpectRefused(push("corner T1 1 2 3\ncorner T1 1 2 3\n"), 5, "upload.targets[1].name");
}

TEST_F(BadInputTest, FilesThatAreNotWhatTheyClaim) {
  ExpectRefused({"scan", "push", "job", Write("noise.ptx", "this is no scan")}, 5, "noise.ptx");
  ExpectRefused({"scan", "push", "job", Write("noise.pcd", "this is no scan")}, 5, "noise.pcd");
  ExpectRefused({"scan", "push", "job", Write("empty.ptx", "")}, 5, "empty.ptx");
  ExpectRefused({"scan", "push", "job", Write("noise.e57", "this is no scan")}, 5, "noise.e57");
  ExpectRefused({"scan", "push", "job", Write("scan.laz", "LASF")}, 8, "scan.laz");
  ExpectRefused({"scan", "push", "job", Write("scan.xyz", "1 2 3\n")}, 5, "scan.xyz");
  ExpectRefused({"scan", "push", "job", folder_.File("missing.ptx")}, 3, "missing.ptx");
}

TEST_F(BadInputTest, TruncatedScan) {
  ExpectRefused({"scan", "push", "job", Write("short.ptx", absl::StrCat(kPtxHead, "1 0 0 0.5\n"))},
                5, "short.ptx");
}

TEST_F(BadInputTest, NotANumber) {
  ExpectRefused(
      {"scan", "push", "job",
       Write("nan.ptx", absl::StrCat(kPtxHead, "1 0 0 0.5\nnan 0 1 0.5\n0 1 0 0.5\n0 1 1 0.5\n"))},
      5, "nan.ptx");
}

TEST_F(BadInputTest, EmptyGrid) {
  ExpectRefused({"scan", "push", "job",
                 Write("grid.ptx",
                       "0\n0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 "
                       "0 0 1\n")},
                5, "grid.ptx");
}

TEST_F(BadInputTest, BillionPointsAnnounced) {
  ExpectRefused({"scan", "push", "job",
                 Write("huge.ptx",
                       "100000\n10000\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 "
                       "1 0\n0 0 0 1\n1 0 0 0.5\n")},
                5, "huge.ptx");
  ExpectRefused({"scan", "push", "job",
                 Write("huge.pcd",
                       "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 "
                       "1\nWIDTH 100000\nHEIGHT 10000\nVIEWPOINT 0 0 0 1 0 0 "
                       "0\nPOINTS 1000000000\nDATA binary\n")},
                5, "huge.pcd");
}

TEST_F(BadInputTest, UnknownNames) {
  ExpectRefused({"session", "show", "nowhere"}, 3, "nowhere");
  ExpectRefused({"plan", "nowhere"}, 3, "nowhere");
  ExpectRefused({"scan", "show", "job/scan-9"}, 3, "job/scans/scan-9");
  ExpectRefused({"watch", "nowhere"}, 3, "nowhere");
  ExpectRefused({"export", "nowhere", "-o", folder_.File("x.ply")}, 3, "nowhere");
  EXPECT_FALSE(std::filesystem::exists(folder_.File("x.ply")));
}

TEST_F(BadInputTest, ImpossibleConfigurationNamesEveryField) {
  const Finished finished =
      Vantage(server_, {"session", "create", "other", "--density", "-3", "--voxel", "7", "--set",
                        "planning_config.min_viewpoint_height_m=3"});
  EXPECT_EQ(finished.exit_code, 5) << finished.out;
  EXPECT_THAT(finished.error, HasSubstr("required_density_per_m2"));
  EXPECT_THAT(finished.error, HasSubstr("voxel_size_m"));
  EXPECT_THAT(finished.error, HasSubstr("height"));
  EXPECT_EQ(Vantage(server_, {"session", "show", "other"}).exit_code, 3);
  // A density that the scanner reaches nowhere in its range.
  ExpectRefused({"session", "update", "job", "--density", "1e12"}, 5, "required_density_per_m2");
}

TEST_F(BadInputTest, NothingToPlanOrExportYet) {
  ExpectRefused({"plan", "job"}, 5, "");
  ExpectRefused({"export", "job", "-o", folder_.File("x.ply")}, 5, "");
  EXPECT_FALSE(std::filesystem::exists(folder_.File("x.ply")));
}

TEST_F(BadInputTest, TheSameIdTwice) {
  ExpectRefused({"session", "create", "job"}, 5, "job");
  ExpectRefused({"session", "create", "Not A Name"}, 5, "session_id");
}

TEST_F(BadInputTest, AnArchiveThatIsNone) {
  ExpectRefused({"session", "import", folder_.File("nothing")}, 3, "cannot be read");
  ExpectRefused({"session", "import", Write("empty", "")}, 5, "is empty");
  ExpectRefused({"session", "import", Write("noise", std::string(5000, 'n')), "--as", "noise"}, 1,
                "the archive is damaged");
  ExpectRefused({"session", "show", "noise"}, 3, "sessions/noise");
}

}  // namespace
}  // namespace vantage::integration
