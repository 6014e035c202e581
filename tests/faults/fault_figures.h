// The groups of figures of ./dev faults.
#ifndef VANTAGE_TESTS_FAULTS_FAULT_FIGURES_H_
#define VANTAGE_TESTS_FAULTS_FAULT_FIGURES_H_

#include <functional>

#include "tests/bench/figures.h"

namespace vantage::faults {

// How long a group may go on beyond its least.
using GoOn = std::function<bool()>;

// crash.*, disk.*: the scripted job cut off, or refused, at the steps that it makes on its disk.
// True: nothing was lost.
bool MeasureCrashes(size_t stride, const GoOn& more, bench::Figures& figures);
// kill.*: the real server, killed at random moments.
bool MeasureKills(int kills, bench::Figures& figures);
// link.*: scans over links that break, lose, delay and have little bandwidth. True where the system
// does not let us make such links.
bool MeasureLink(bench::Figures& figures);
// upload.*: against a bare stream that syncs every 4 MiB.
bool MeasureUpload(bench::Figures& figures);
// scan.*: a scan of forty million samples by the command line, from its file to a plan.
bool MeasureLargeScan(bench::Figures& figures);
// damage.*: entries of a log that rot, files that go, and come back.
bool MeasureDamage(bench::Figures& figures);
// clock.*: a wall clock that jumps.
bool MeasureClock(bench::Figures& figures);
// restart.*: sessions of ten scans.
bool MeasureRestart(int sessions, bench::Figures& figures);

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_FAULT_FIGURES_H_
