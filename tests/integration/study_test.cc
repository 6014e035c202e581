// A study from the command line, with servers of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/integration/answers.h"
#include "tests/integration/process.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;

Finished Study(const std::string& folder, const std::vector<std::string>& more = {},
               const std::string& server = VANTAGED_BINARY) {
  std::vector<std::string> arguments = {VANTAGE_BINARY,
                                        "study",
                                        "--tuning",
                                        "--scene",
                                        "two-rooms-1",
                                        "--planner",
                                        "ours,oracle",
                                        "--seeds",
                                        "1",
                                        "--step",
                                        "1",
                                        "--density",
                                        "150",
                                        "--truth-samples",
                                        "3000",
                                        "--scans",
                                        "3",
                                        "--vantaged",
                                        server,
                                        "-o",
                                        folder};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunProgram(arguments);
}

TEST(Study, GoesOnWhereItWasAndRedoesWhatIsDamaged) {
  const ScratchFolder scratch;
  const std::string folder = scratch.File("study");
  // Begun too late: nothing is done, and it says so.
  const Finished none = Study(folder, {"--no-job-after", "1e-9"});
  EXPECT_EQ(none.exit_code, 6) << none.out << none.error;
  EXPECT_THAT(none.error, HasSubstr("2 jobs are not done yet"));

  const Finished first = Study(folder);
  ASSERT_EQ(first.exit_code, 0) << first.out << first.error;
  EXPECT_THAT(first.out, HasSubstr("study.scans95_over_oracle"));
  const std::string ours = folder + "/jobs/two-rooms-1_ours_1.json";
  const std::string oracle = folder + "/jobs/two-rooms-1_oracle_1.json";
  const std::string record = Contents(ours);
  EXPECT_THAT(record, HasSubstr("\"predicted\""));
  EXPECT_THAT(record, HasSubstr("\"planBudget\": 1")) << "what it was given";
  EXPECT_THAT(Contents(folder + "/table.json"), HasSubstr("shareOfBest"));
  EXPECT_THAT(Contents(folder + "/study.html"), HasSubstr("two-rooms-1"));

  std::ofstream(ours, std::ios::binary | std::ios::trunc) << record.substr(0, record.size() / 2);
  const auto untouched = std::filesystem::last_write_time(oracle);
  const Finished second = Study(folder);
  ASSERT_EQ(second.exit_code, 0) << second.out << second.error;
  EXPECT_GT(Contents(ours).size(), record.size() / 2);
  EXPECT_EQ(std::filesystem::last_write_time(oracle), untouched);

  const auto redone = std::filesystem::last_write_time(ours);
  ASSERT_EQ(Study(folder).exit_code, 0);
  EXPECT_EQ(std::filesystem::last_write_time(ours), redone) << "all was done";
}

TEST(Study, RunsWithARealInstrumentUnlessAStepIsAskedFor) {
  const ScratchFolder scratch;
  const auto settings = [&](const std::vector<std::string>& more) {
    const std::string folder = scratch.File("settings");
    std::vector<std::string> arguments = {VANTAGE_BINARY, "study",  "--scene",        "two-rooms-1",
                                          "--planner",    "oracle", "--no-job-after", "1e-9",
                                          "-o",           folder};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Finished finished = RunProgram(arguments);
    EXPECT_EQ(finished.exit_code, 6) << finished.out << finished.error;
    return Contents(folder + "/table.json");
  };
  const std::string usual = settings({});
  EXPECT_THAT(usual, HasSubstr("Leica RTC360 at 6mm, steps 0.0344 x 0.0344 deg, rays each 0.250"));
  EXPECT_THAT(usual, HasSubstr("1.0 + 0.85 min a scan"));
  EXPECT_THAT(settings({"--setting", "12mm", "--preview", "0.5"}),
              HasSubstr("at 12mm, steps 0.0688 x 0.0688 deg, rays each 0.500"));
  const std::string coarse = settings({"--step", "0.25"});
  EXPECT_THAT(coarse, HasSubstr("\"steps 0.2500 x 0.2500 deg, rays each step"));
  EXPECT_THAT(coarse, HasSubstr("range 0.5 to 20.0 m"));
  EXPECT_THAT(settings({"--preset", "leica-blk360", "--step", "0.1"}),
              HasSubstr("Leica BLK360 at medium, steps 0.1000"));
}

TEST(Study, NamesWhatThereIsNot) {
  const ScratchFolder scratch;
  const Finished planner = Study(scratch.File("a"), {"--planner", "best"});
  EXPECT_EQ(planner.exit_code, 3) << planner.error;
  EXPECT_THAT(planner.error, HasSubstr("best"));
  const Finished server = Study(scratch.File("b"), {}, "/nowhere/vantaged");
  EXPECT_EQ(server.exit_code, 3) << server.error;
  EXPECT_THAT(server.error, HasSubstr("--vantaged"));
}

}  // namespace
}  // namespace vantage::integration
