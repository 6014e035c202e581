// What must be true of every session's log, whoever does what: it has no gap and tells everything
// once, no place is claimed twice at a time, and claims end when they say.
#ifndef VANTAGE_TESTS_FAULTS_CLAIM_LOG_H_
#define VANTAGE_TESTS_FAULTS_CLAIM_LOG_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "vantage/v1/event.pb.h"

namespace vantage::faults {

struct ClaimLogCounts {
  size_t events = 0;
  size_t taken = 0;
  size_t renewed = 0;
  size_t released = 0;
  size_t expired = 0;
  size_t fulfilled = 0;
  size_t most_held = 0;      // at a time
  double latest_expiry = 0;  // s, by which a claim was ended after its time, at worst
  double nearest = 1e9;      // m, between places that were held at the same time
};

// Takes a session's events in the order in which they come and says what is wrong with them. Knows
// the rules from the service's description, not from the server.
class ClaimLog {
 public:
  static constexpr double kSeparation = 0.6;  // m, horizontally
  static constexpr double kArrival = 0.5;     // m, horizontally
  static constexpr size_t kMostOfOne = 8;     // claims of a scanner
  static constexpr double kLatestExpiry = 2;  // s

  void Take(const v1::SessionEvent& event);

  uint64_t last() const { return last_; }  // sequence number
  size_t held() const { return held_.size(); }
  // Claims that were ever taken, and those that have ended.
  const std::map<std::string, v1::Claim>& taken() const { return taken_; }
  const std::set<std::string>& ended() const { return ended_; }
  const std::set<std::string>& merged() const { return merged_names_; }
  const ClaimLogCounts& counts() const { return counts_; }
  // At most a hundred.
  const std::vector<std::string>& broken() const { return broken_; }

 private:
  void Taken(const v1::Claim& claim, double now);
  void Renewed(const v1::Claim& claim, double now);
  void Ended(const v1::ClaimEndedEvent& event, double now);
  void NothingIsDue(double now);
  void Broken(const std::string& what);

  uint64_t last_ = 0;
  std::map<std::string, v1::Claim> held_;
  std::map<std::string, v1::Claim> taken_;
  std::set<std::string> ended_;
  std::set<std::string> scanners_;
  std::map<std::string, v1::Scan> merged_;  // not yet given a claim to
  std::set<std::string> merged_names_;
  ClaimLogCounts counts_;
  std::vector<std::string> broken_;
};

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_CLAIM_LOG_H_
