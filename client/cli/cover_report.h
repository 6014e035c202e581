// `vantage study --cover`: the fewest stations of scenes and of tables, and what given ones cover.
#ifndef VANTAGE_CLIENT_CLI_COVER_REPORT_H_
#define VANTAGE_CLIENT_CLI_COVER_REPORT_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/command.h"
#include "client/study/study.h"

namespace vantage::cli {

struct CoverArguments {
  bool cover = false;
  std::string table;        // folder of a table that is searched instead of scenes
  std::string write_table;  // folder that the scenes' tables are written to
  std::string stations;     // file of stations that are scored
  bool asked() const { return cover || !table.empty() || !write_table.empty(); }
};

// Makes each scene's table, or reads the one that is named, chooses its fewest stations, writes
// them to stations-SCENE.csv in `output` and prints what they are worth. kUnwelcome: the stations
// that were given miss the goal.
absl::StatusOr<ExitCode> ReportCovers(const study::StudyPlan& plan, const CoverArguments& arguments,
                                      const std::string& output, bool json);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_COVER_REPORT_H_
