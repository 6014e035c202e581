// Everything that a plan is computed from.
#ifndef VANTAGE_SERVER_SESSION_PLAN_INPUTS_H_
#define VANTAGE_SERVER_SESSION_PLAN_INPUTS_H_

#include <string>
#include <vector>

#include "core/fleet/joint_plan.h"
#include "server/session/session.h"

namespace vantage::session {

struct Session::PlanInputs {
  ModelSnapshot model;
  v1::PlanningConfig written;  // whole
  planning::PlanningConfig config;
  sensor::ScannerModel scanner;
  std::string scanner_id;
  parallel::Budget budget;
  double seconds = 0;  // time budget, 0: none
  // For scanners by name, around claims, or by minutes.
  bool joint = false;
  fleet::FleetRequest fleet;
  size_t scanner_models = 1;          // distinct ones, of fleet.scanners
  std::vector<std::string> scanners;  // names, of fleet.scanners; empty: for nobody by name
  std::vector<std::string> claims;    // names, of fleet.pledged
  std::shared_ptr<MemoryAccount::Reservation> memory;  // given back with the last copy
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PLAN_INPUTS_H_
