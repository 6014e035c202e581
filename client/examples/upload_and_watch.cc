// Sends a scan and asks where the next one goes: upload_and_watch SERVER SESSION SCAN.ptx
#include <vantage/client/library/client.h>
#include <vantage/client/library/geometry.h>
#include <vantage/core/sensor/scan_file.h>

#include "or_exit.h"
using namespace vantage;

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const auto file = OrExit(sensor::ReadScanFile(argv[3], {}));
  client::ClientOptions options;
  options.server = argv[1];
  client::Client client(options);
  v1::CreateSessionRequest job;
  job.set_session_id(argv[2]);
  *job.mutable_session()->add_scanner_models() = client::ToProto(file.scanner, "scanner");
  const auto session = OrExit(client.Call(job)).session().name();
  const auto scan = OrExit(client.Upload(session, {}, file.image, [](const auto& progress) {
    std::printf("%ld of %ld bytes\n", progress.acknowledged_bytes, progress.total_bytes);
  }));
  OrExit(client.WaitForScan(scan, [](const auto& now) { std::printf("%d\n", now.state()); }));
  v1::CreatePlanRequest plan;
  plan.set_parent(session);
  const auto made = OrExit(client.Call(plan)).plan().name();
  const auto best = OrExit(client.WatchPlan(made, [](const v1::Plan& now) {
    std::printf("revision %lu: %d views\n", now.revision(), now.result().views_size());
  }));
  for (const auto& view : best.result().views()) std::puts(view.location().description().c_str());
}
