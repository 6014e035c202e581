// vantage_claims [--minutes N] [--seed N] [--out FILE]
//
// Clients that claim, renew, release, plan and push at random on one job, over a link that breaks,
// beside listeners that know the rules. Prints a table of figures and writes them as JSON. The exit
// status is 1 when a rule was broken.
#include <CLI/CLI.hpp>
#include <iostream>

#include "absl/strings/str_format.h"
#include "tests/bench/figures.h"
#include "tests/faults/claim_storm.h"
#include "tests/integration/process.h"

int main(int argc, char** argv) {
  CLI::App app("Whether claims hold whatever happens");
  std::string out = "claims.json";
  double minutes = 10;
  vantage::faults::ClaimStorm storm;
  app.add_option("--minutes", minutes, "how long")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", storm.seed, "of what the clients do")->capture_default_str();
  app.add_option("--out", out, "where to write the JSON")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  const vantage::integration::ServerProcess server;
  if (server.address().empty()) {
    std::cerr << "the server does not start: " << server.Log();
    return 1;
  }
  storm.server = server.address();
  storm.seconds = 60 * minutes;
  storm.breaks = static_cast<int>(6 * minutes);
  const vantage::faults::ClaimStormResult result = vantage::faults::RunClaimStorm(storm);
  for (const std::string& what : result.broken) std::cerr << what << "\n";

  const vantage::faults::ClaimLogCounts& counts = result.counts;
  vantage::bench::Figures figures("");
  figures.Add(
      {"claims.broken", static_cast<double>(result.broken.size()), "", "0",
       absl::StrFormat("%d clients for %g minutes, seed %d, the link broken %d times; %d calls, %d "
                       "of them without an answer; %d events, heard by one that stayed, one that "
                       "came %d times and one that came at the end",
                       storm.clients, minutes, storm.seed, result.breaks, result.calls,
                       result.unknown, counts.events, result.watches)});
  figures.Add({"claims.taken", static_cast<double>(counts.taken), "", "",
               absl::StrFormat("%d refused; ended: %d given back, %d expired, %d by a scan; %d "
                               "plans, %d scans; at most %d held at a time",
                               result.refused, counts.released, counts.expired, counts.fulfilled,
                               result.planned, result.pushed, counts.most_held)});
  figures.Add({"claims.latest_expiry", counts.latest_expiry, "s",
               absl::StrFormat("<= %g", vantage::faults::ClaimLog::kLatestExpiry),
               "after its time"});
  figures.Add({"claims.nearest", counts.nearest, "m",
               absl::StrFormat(">= %g", vantage::faults::ClaimLog::kSeparation),
               "between two places that were claimed at a time"});
  if (!figures.WriteJson(out)) {
    std::cerr << "cannot write " << out << ": name a file in a folder that can be written\n";
    return 1;
  }
  std::cout << "written to " << out << "\n";
  return result.broken.empty() ? 0 : 1;
}
