// What a job says of its scanner holds for the scans that are pushed, and plans call scans by their
// names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "core/sensor/scanner_model.h"
#include "tests/integration/answers.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/support/scan_files.h"
#include "vantage/v1/plan_service.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;

void WriteRoom(const std::string& path, const Eigen::Vector3d& position) {
  std::ofstream(path, std::ios::binary) << test_support::PtxOf(fixture::ScanRoom(position, 1.5));
}

TEST(ScannerSettings, OfTheJobHoldForScansThatArePushed) {
  const ScratchFolder scratch;
  const std::string file = scratch.File("room.ptx");
  WriteRoom(file, {2.0, 1.5, 1.4});
  ServerProcess server;
  ASSERT_EQ(Vantage(server, {"session", "create", "job", "--set", "scanner.max_range_m=2.25",
                             "--set", "scanner.range_noise_m=0.004"})
                .exit_code,
            0);
  const Finished pushed = Vantage(server, {"scan", "push", "job", file, "--json"});
  ASSERT_EQ(pushed.exit_code, 0) << pushed.error;
  const v1::ScannerModel scanner = Answer<v1::Scan>(pushed).scanner_model();
  EXPECT_DOUBLE_EQ(scanner.max_range_m(), 2.25);
  EXPECT_DOUBLE_EQ(scanner.range_noise_m(), 0.004);
  // Its rays are those of the file.
  EXPECT_NEAR(sensor::Degrees(scanner.azimuth_step_rad()), 1.5, 1e-6);
}

TEST(ScannerSettings, OfAnInstrumentHoldToo) {
  const ScratchFolder scratch;
  const std::string file = scratch.File("room.ptx");
  WriteRoom(file, {2.0, 1.5, 1.4});
  ServerProcess server;
  ASSERT_EQ(Vantage(server, {"session", "create", "job", "--preset", "leica-rtc360"}).exit_code, 0);
  const Finished pushed = Vantage(server, {"scan", "push", "job", file, "--json"});
  ASSERT_EQ(pushed.exit_code, 0) << pushed.error;
  const v1::ScannerModel scanner = Answer<v1::Scan>(pushed).scanner_model();
  EXPECT_GT(scanner.max_range_m(), 100);
  EXPECT_NEAR(sensor::Degrees(scanner.azimuth_step_rad()), 1.5, 1e-6);
}

TEST(StationNames, AreThoseOfTheScans) {
  const ScratchFolder scratch;
  ServerProcess server;
  ASSERT_EQ(Vantage(server, {"session", "create", "job"}).exit_code, 0);
  const auto push = [&](const std::string& name, const Eigen::Vector3d& position,
                        const std::string& prior) {
    const std::string file = scratch.File(name);
    WriteRoom(file, position);
    const Finished pushed = Vantage(server, {"scan", "push", "job", file, "--prior", prior});
    EXPECT_EQ(pushed.exit_code, 0) << pushed.out << pushed.error;
  };
  push("one.ptx", {2.0, 1.5, 1.4}, "0,0,0,0");
  push("two.ptx", {3.0, 2.5, 1.4}, "1,1,0,0");
  ASSERT_EQ(Vantage(server, {"scan", "withdraw", "job/scan-2"}).exit_code, 0);
  push("three.ptx", {1.2, 2.2, 1.4}, "-0.8,0.7,0,0");
  const Finished told = Vantage(server, {"evaluate", "job", "0.5,0.5,0", "--json"});
  const auto evaluated = Answer<v1::EvaluateViewResponse>(told);
  EXPECT_THAT(evaluated.view().location().description(), HasSubstr("from scan-3 at a bearing"));
}

}  // namespace
}  // namespace vantage::integration
