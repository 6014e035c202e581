// link_client SERVER NAME SCANS DEGREES: a link job in a process of its own, which can be in
// another network namespace than the server. Prints 'arrived once_bytes sent_bytes reconnects
// failure'.
#include <cstdio>
#include <cstdlib>

#include "tests/faults/link_job.h"

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  vantage::faults::LinkJob job;
  job.server = argv[1];
  job.name = argv[2];
  job.scans = std::atoi(argv[3]);
  job.degrees = std::atof(argv[4]);
  const vantage::faults::LinkJobResult result = vantage::faults::PushOverLink(job);
  std::printf("%d %lld %lld %d %s\n", result.arrived, static_cast<long long>(result.once_bytes),
              static_cast<long long>(result.sent_bytes), result.reconnects, result.failure.c_str());
  return result.arrived == job.scans ? 0 : 1;
}
