// A scanner on a bad link: the client library pushes scans one after the other until each has
// arrived, however often the link breaks.
#ifndef VANTAGE_TESTS_FAULTS_LINK_JOB_H_
#define VANTAGE_TESTS_FAULTS_LINK_JOB_H_

#include <cstdint>
#include <string>

namespace vantage::faults {

struct LinkJob {
  std::string server;  // host:port
  std::string name;    // sessions are NAME-0, NAME-1, ...: one for each scan
  int scans = 1;
  double degrees = 2;  // step of the scans
};

struct LinkJobResult {
  int arrived = 0;         // scans that are there exactly once, with their own bytes
  int64_t once_bytes = 0;  // of all pieces, compressed, sent once
  int64_t sent_bytes = 0;  // that were sent, pieces sent again included
  int reconnects = 0;
  std::string failure;  // the first, in words; empty: none
};

LinkJobResult PushOverLink(const LinkJob& job);

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_LINK_JOB_H_
