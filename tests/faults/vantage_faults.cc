// vantage_faults [--only PREFIX] [--out FILE] [--minutes N]
//
// Breaks things on purpose, prints a table of figures and writes them as JSON. The exit status is 1
// when anything that was acknowledged was lost, or a job ended as it should not.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>

#include "tests/faults/fault_figures.h"

int main(int argc, char** argv) {
  CLI::App app("What Vantage's server keeps when the power, the disk or the link goes");
  std::string only;
  std::string out = "faults.json";
  double minutes = 10;
  app.add_option("--only", only, "only figures whose names start so");
  app.add_option("--out", out, "where to write the JSON")->capture_default_str();
  app.add_option("--minutes", minutes, "about how long; 10 and more visit every crash point")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto until = [&](double share) {
    return [end = start + std::chrono::duration<double>(60 * minutes * share)] {
      return Clock::now() < end;
    };
  };
  const bool full = minutes >= 10;
  vantage::bench::Figures figures(only);
  bool kept = true;
  if (figures.Wants("link.")) kept = vantage::faults::MeasureLink(figures) && kept;
  if (figures.Wants("upload.")) kept = vantage::faults::MeasureUpload(figures) && kept;
  if (full && figures.Wants("scan.")) {
    kept = vantage::faults::MeasureLargeScan(figures) && kept;
  }
  if (figures.Wants("damage.")) kept = vantage::faults::MeasureDamage(figures) && kept;
  if (figures.Wants("clock.")) kept = vantage::faults::MeasureClock(figures) && kept;
  if (figures.Wants("restart."))
    kept = vantage::faults::MeasureRestart(full ? 100 : 10, figures) && kept;
  if (figures.Wants("kill.")) {
    kept = vantage::faults::MeasureKills(std::clamp(static_cast<int>(30 * minutes), 15, 300),
                                         figures) &&
           kept;
  }
  if (figures.Wants("crash.") || figures.Wants("disk.")) {
    kept = vantage::faults::MeasureCrashes(full ? 1 : 7, until(full ? 1e6 : 1), figures) && kept;
  }
  if (!figures.WriteJson(out)) {
    std::cerr << "cannot write " << out << ": name a file in a folder that can be written\n";
    return 1;
  }
  std::cout << "written to " << out << (kept ? "\n" : "; SOMETHING WAS LOST, see above\n");
  return kept ? 0 : 1;
}
