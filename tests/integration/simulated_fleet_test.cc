// A whole job with two simulated scanners, through the command line and a real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/integration/answers.h"
#include "vantage/v1/fleet_service.pb.h"
#include "vantage/v1/scan_service.pb.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;

struct Row {
  int scan = 0;
  std::string scanner;
  double minute = 0;
  double walked = 0;    // m
  double attained = 0;  // percent
};

std::vector<Row> RowsOf(const std::string& report) {
  static const std::regex kRow(
      R"(^\s*(\d+)  (scanner-\d)\s+([\d.]+)\s+([\d.]+)\s.*?([\d.]+) %\s+[\d.]+ %$)");
  std::vector<Row> rows;
  std::istringstream lines(report);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (!std::regex_search(line, match, kRow)) continue;
    rows.push_back({std::stoi(match[1]), match[2], std::stod(match[3]), std::stod(match[4]),
                    std::stod(match[5])});
  }
  return rows;
}

std::vector<std::string> Simulate(const std::string& session) {
  return {"simulate", "--scene",    "flat",      "--seed",  "3",      "--scans", "5",
          "--step",   "1",          "--density", "150",     "--work", "3000000", "--session",
          session,    "--scanners", "2",         "--speed", "0.5"};
}

TEST(SimulatedFleet, TwoScannersShareTheFlat) {
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  const ScratchFolder folder;
  std::vector<std::string> arguments = Simulate("flat");
  arguments.insert(arguments.end(), {"--pictures", folder.path()});
  const Finished finished = Vantage(server, arguments);
  ASSERT_EQ(finished.exit_code, 0) << finished.out << finished.error;
  const std::vector<Row> rows = RowsOf(finished.out);
  ASSERT_EQ(rows.size(), 5u) << finished.out;

  // The clock: nobody is faster than walking and scanning, and the scans come in in order.
  std::map<std::string, double> last;
  for (const Row& row : rows) {
    const double least = (last.count(row.scanner) ? last[row.scanner] : 0) + 3 + row.walked / 30;
    EXPECT_GE(row.minute, least - 0.1) << finished.out;
    last[row.scanner] = row.minute;
  }
  EXPECT_EQ(last.size(), 2u) << "one of them never went\n" << finished.out;
  for (size_t i = 1; i < rows.size(); ++i) {
    EXPECT_GE(rows[i].minute, rows[i - 1].minute);
    EXPECT_GE(rows[i].attained, rows[i - 1].attained);
  }
  EXPECT_GT(rows[4].attained, rows[0].attained + 10) << finished.out;
  EXPECT_THAT(finished.out, HasSubstr("Waste: "));
  EXPECT_TRUE(std::filesystem::exists(folder.File("tours.png")));

  // The server knows who made what, and every claim has ended with its scan.
  std::set<std::string> makers;
  const auto scans =
      Answer<v1::ListScansResponse>(Vantage(server, {"scan", "list", "flat", "--json"}));
  for (const v1::Scan& scan : scans.scans()) {
    EXPECT_EQ(scan.state(), v1::SCAN_STATE_MERGED) << scan.state_message();
    makers.insert(scan.scanner());
  }
  EXPECT_EQ(makers, (std::set<std::string>{"sessions/flat/scanners/scanner-1",
                                           "sessions/flat/scanners/scanner-2"}));
  const auto claims =
      Answer<v1::ListClaimsResponse>(Vantage(server, {"claim", "list", "flat", "--json"}));
  // The job ended while the other was on its way.
  EXPECT_LE(claims.claims_size(), 1);
}

TEST(SimulatedFleet, FlagsOfAFleetNeedOne) {
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  EXPECT_EQ(Vantage(server, {"simulate", "--independent"}).exit_code, 2);
  EXPECT_EQ(Vantage(server, {"simulate", "--scanners", "0"}).exit_code, 2);
}

}  // namespace
}  // namespace vantage::integration
