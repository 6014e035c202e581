// Simulated surveyors that scan and plan in turns, and their measurements.
#ifndef VANTAGE_TESTS_LOAD_LOAD_JOB_H_
#define VANTAGE_TESTS_LOAD_LOAD_JOB_H_

#include <atomic>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/sensor/scan.h"

namespace vantage::load {

struct LoadPlan {
  std::string server;      // HOST:PORT
  std::string token_file;  // of the tenant that all jobs are of
  double period = 20;      // s between the scans of one job
  double budget = 0.5;     // s of each plan
};

// The measurements of all jobs together. Thread safe.
class LoadLog {
 public:
  void Cycle(int job, double seconds_to_plan, double over_budget, double rays);
  // A plan of the quiet tenant: s until it began and until it had ended, and its rays.
  void Quiet(double seconds_to_start, double seconds_to_end, double rays);
  // A scan was decided, and is in its model or not.
  void Decided(bool merged);
  void Unary(double seconds);
  // Errors by code and reason.
  void Error(const absl::Status& status);

  int merged() const;
  int not_merged() const;
  std::vector<double> to_plan() const;         // s, last piece stored to plan ended
  std::vector<double> over_budget() const;     // s
  std::vector<double> unary() const;           // s
  std::map<int, double> rays() const;          // by job
  std::vector<double> quiet_to_start() const;  // s
  std::vector<double> quiet_to_end() const;    // s
  std::vector<double> quiet_rays() const;      // of each plan
  std::map<std::string, int> errors() const;

 private:
  mutable std::mutex mutex_;
  int merged_ = 0;
  int not_merged_ = 0;
  std::vector<double> to_plan_;
  std::vector<double> over_budget_;
  std::vector<double> unary_;
  std::map<int, double> rays_;
  std::vector<double> quiet_to_start_;
  std::vector<double> quiet_to_end_;
  std::vector<double> quiet_rays_;
  std::map<std::string, int> errors_;
};

// Pushes a scan, waits until it is merged, plans, again and again until `stop`. When all of `scans`
// are in a session, the next one begins. No two scans that are pushed have the same bytes.
void RunLoadJob(int job, const LoadPlan& plan, const std::vector<sensor::Scan>& scans,
                const std::atomic<bool>& stop, LoadLog& log);

// A tenant with a session of that id and one scan, who asks for a plan every five seconds until
// `stop`.
void RunQuietTenant(const std::string& id, const LoadPlan& plan, const sensor::Scan& first,
                    const std::atomic<bool>& stop, LoadLog& log);

// Asks for sessions and lists, ten times a second, until `stop`.
void RunProber(const LoadPlan& plan, const std::vector<std::string>& sessions,
               const std::atomic<bool>& stop, LoadLog& log);

}  // namespace vantage::load

#endif  // VANTAGE_TESTS_LOAD_LOAD_JOB_H_
