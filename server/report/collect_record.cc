#include "server/report/collect_record.h"

#include <deque>
#include <utility>

#include "server/contract/error.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/report/decisions.h"
#include "server/session/instrument.h"

namespace vantage::report {
namespace {

// Decisions that are told one by one: some thirty pages.
constexpr size_t kMostDecisions = 1000;
constexpr size_t kEventsAtOnce = 256;

absl::StatusOr<DecisionLog> ReadDecisions(session::Session& session, uint64_t last) {
  DecisionLog log;
  std::deque<v1::SessionEvent> kept;
  uint64_t after = 0;
  while (after < last) {
    absl::StatusOr<std::vector<v1::SessionEvent>> events =
        session.journal().Events(after, kEventsAtOnce);
    if (!events.ok()) return events.status();
    if (events->empty()) break;
    for (v1::SessionEvent& event : *events) {
      after = event.sequence();
      if (event.has_events_left_out()) log.compacted = true;
      if (after > last || !IsDecision(event)) continue;
      kept.push_back(std::move(event));
      if (kept.size() <= kMostDecisions) continue;
      kept.pop_front();
      ++log.left_out;
    }
  }
  log.events.assign(std::make_move_iterator(kept.begin()), std::make_move_iterator(kept.end()));
  return log;
}

// By scanner, in the order of their first scans.
std::vector<InstrumentRecord> ReadInstruments(const session::SessionState& state) {
  std::vector<InstrumentRecord> instruments;
  for (const std::string& name : state.scan_order) {
    const v1::Scan& scan = state.scans.at(name).scan;
    if (scan.state() == v1::SCAN_STATE_WITHDRAWN) continue;
    bool known = false;
    for (const InstrumentRecord& instrument : instruments) {
      known = known || SameScanner(instrument.scanner, scan.scanner_model());
    }
    if (known) continue;
    instruments.push_back(
        {scan.scanner_model(), session::InstrumentShown(state, scan.scanner_model())});
  }
  return instruments;
}

}  // namespace

absl::StatusOr<JobRecord> CollectRecord(session::Session& session,
                                        const session::ModelSnapshot& model) {
  JobRecord record;
  record.view = model.view;
  record.origin = session.origin();
  record.made = session.journal().Now();
  absl::StatusOr<v1::GetCoverageResponse> coverage = session.MeasureCoverage();
  if (!coverage.ok()) return coverage.status();
  record.coverage = *std::move(coverage);
  absl::StatusOr<v1::PoseGraph> graph = session.adjuster().Describe();
  if (!graph.ok()) return graph.status();
  record.graph = *std::move(graph);
  record.session = session.DescribeWithRejections();
  session.journal().Read([&](const session::SessionState& state) {
    for (const std::string& name : state.scan_order) {
      record.scans.push_back(state.scans.at(name).scan);
    }
    for (const auto& [name, scanner] : state.scanners) record.scanners.push_back(scanner);
    for (const auto& [name, station] : state.stations) record.pending.push_back(station);
    for (auto it = state.plan_order.rbegin(); it != state.plan_order.rend(); ++it) {
      const v1::Plan& plan = state.plans.at(*it).plan;
      if (plan.state() != v1::PLAN_STATE_SUCCEEDED) continue;
      record.plan = plan;
      break;
    }
    for (const auto& [name, claim] : state.claims) record.decisions.callers[name] = claim.caller;
    record.instruments = ReadInstruments(state);
  });
  absl::StatusOr<DecisionLog> decisions = ReadDecisions(session, record.session.last_sequence());
  if (!decisions.ok()) return decisions.status();
  decisions->callers = std::move(record.decisions.callers);
  record.decisions = *std::move(decisions);
  if (record.view != nullptr) {
    contract::Violations none;  // it was checked when it came
    record.config = conversion::ReadPlanningConfig(
        record.session.planning_config(), record.session.site_rules(), record.origin,
        record.view->voxel_size(), "planning_config", "site_rules", none);
  }
  return record;
}

}  // namespace vantage::report
