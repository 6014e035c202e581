// The pages of the HTTP listener: metrics, health, readiness, a status page. None of them names a
// session, a tenant or a caller.
#ifndef VANTAGE_SERVER_MAIN_MONITOR_H_
#define VANTAGE_SERVER_MAIN_MONITOR_H_

#include <functional>
#include <map>
#include <string>

#include "server/auth/tls_files.h"
#include "server/execution/planning_pool.h"
#include "server/execution/task_pool.h"
#include "server/session/session_registry.h"
#include "server/telemetry/http_listener.h"
#include "server/telemetry/log.h"
#include "server/telemetry/metrics.h"

namespace vantage::server {

// All of these outlive the listener.
struct Monitored {
  telemetry::Metrics& metrics;
  session::SessionRegistry& sessions;
  execution::PlanningPool& pool;
  execution::TaskPool& tasks;
  const telemetry::Log& log;
  const auth::TlsFiles* tls_files;     // null: the port is not encrypted
  std::string data_folder;             // empty: nothing is kept on disk
  std::function<std::string()> state;  // 'serving', or why not
};

// Adds the metrics that are read when the page is read.
void AddGauges(const Monitored& monitored);

// /metrics, /healthz, /readyz and /.
std::map<std::string, telemetry::HttpListener::Page> MonitorPages(const Monitored& monitored);

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_MONITOR_H_
