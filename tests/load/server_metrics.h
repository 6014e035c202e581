// Reads a server's metrics over HTTP.
#ifndef VANTAGE_TESTS_LOAD_SERVER_METRICS_H_
#define VANTAGE_TESTS_LOAD_SERVER_METRICS_H_

#include <map>
#include <string>

namespace vantage::load {

// Samples by name with labels, as they stand in /metrics of 127.0.0.1:port; empty when nobody
// answers.
std::map<std::string, double> ReadMetrics(int port);

}  // namespace vantage::load

#endif  // VANTAGE_TESTS_LOAD_SERVER_METRICS_H_
