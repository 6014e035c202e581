#include "tests/faults/claim_log.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/store/left_out.h"

namespace vantage::faults {
namespace {

constexpr size_t kMostBroken = 100;

double Seconds(const google::protobuf::Timestamp& time) {
  return static_cast<double>(time.seconds()) + 1e-9 * time.nanos();
}

double Apart(const v1::Vector3& a, const v1::Vector3& b) {
  return std::hypot(a.x() - b.x(), a.y() - b.y());
}

}  // namespace

void ClaimLog::Broken(const std::string& what) {
  if (broken_.size() < kMostBroken) broken_.push_back(absl::StrCat("event ", last_, ": ", what));
}

void ClaimLog::Take(const v1::SessionEvent& event) {
  const uint64_t expected = last_ + 1;
  last_ = event.sequence();
  if (store::FirstSequence(event) > expected || last_ < expected) {
    Broken(absl::StrCat("came where ", expected, " was due: an event is lost, or came twice"));
  }
  ++counts_.events;
  const double now = Seconds(event.time());
  switch (event.event_case()) {
    case v1::SessionEvent::kScannerCreated:
      scanners_.insert(event.scanner_created().scanner().name());
      break;
    case v1::SessionEvent::kScanMerged:
      if (!merged_names_.insert(event.scan_merged().scan().name()).second) {
        Broken(absl::StrCat(event.scan_merged().scan().name(), " is merged twice"));
      }
      merged_[event.scan_merged().scan().name()] = event.scan_merged().scan();
      break;
    case v1::SessionEvent::kClaimTaken:
      Taken(event.claim_taken().claim(), now);
      break;
    case v1::SessionEvent::kClaimRenewed:
      Renewed(event.claim_renewed().claim(), now);
      break;
    case v1::SessionEvent::kClaimEnded:
      Ended(event.claim_ended(), now);
      break;
    default:
      break;
  }
}

// What has expired is ended before anything follows from it.
void ClaimLog::NothingIsDue(double now) {
  for (const auto& [name, claim] : held_) {
    if (Seconds(claim.expire_time()) < now - 1e-6) {
      Broken(absl::StrFormat("%s is %.3f s past its time and still stands", name,
                             now - Seconds(claim.expire_time())));
    }
  }
}

void ClaimLog::Taken(const v1::Claim& claim, double now) {
  ++counts_.taken;
  if (!taken_.emplace(claim.name(), claim).second) {
    Broken(absl::StrCat(claim.name(), " is taken twice"));
  }
  if (scanners_.count(claim.scanner()) == 0) {
    Broken(absl::StrCat(claim.name(), " is for ", claim.scanner(), ", which nobody added"));
  }
  const double ttl = Seconds(claim.expire_time()) - Seconds(claim.create_time());
  if (!(ttl > 10 - 1e-3 && ttl < 24 * 3600 + 1e-3)) {
    Broken(absl::StrFormat("%s is for %.3f s, must be 10 s to 24 h", claim.name(), ttl));
  }
  NothingIsDue(Seconds(claim.create_time()));
  size_t own = 0;
  for (const auto& [name, other] : held_) {
    own += other.scanner() == claim.scanner() ? 1 : 0;
    const double apart = Apart(other.position(), claim.position());
    counts_.nearest = std::min(counts_.nearest, apart);
    if (apart < kSeparation) {
      Broken(absl::StrFormat("%s is %.2f m from %s, which stands until %.3f s later", claim.name(),
                             apart, name, Seconds(other.expire_time()) - now));
    }
  }
  if (own >= kMostOfOne) {
    Broken(absl::StrCat(claim.scanner(), " has ", own + 1, " claims, at most ", kMostOfOne));
  }
  held_[claim.name()] = claim;
  counts_.most_held = std::max(counts_.most_held, held_.size());
}

void ClaimLog::Renewed(const v1::Claim& claim, double now) {
  ++counts_.renewed;
  const auto it = held_.find(claim.name());
  if (it == held_.end()) return Broken(absl::StrCat(claim.name(), " is renewed and not held"));
  if (Seconds(it->second.expire_time()) < now - kLatestExpiry) {
    Broken(absl::StrCat(claim.name(), " is renewed after its time"));
  }
  if (it->second.scanner() != claim.scanner() ||
      Apart(it->second.position(), claim.position()) > 0) {
    Broken(absl::StrCat(claim.name(), " is another's, or elsewhere, once it is renewed"));
  }
  it->second = claim;
}

void ClaimLog::Ended(const v1::ClaimEndedEvent& event, double now) {
  const std::string& name = event.claim().name();
  const auto it = held_.find(name);
  if (it == held_.end()) return Broken(absl::StrCat(name, " ends and is not held"));
  const v1::Claim claim = it->second;
  held_.erase(it);
  ended_.insert(name);
  const double late = now - Seconds(claim.expire_time());
  if (late > kLatestExpiry) {
    Broken(absl::StrFormat("%s ends %.3f s after its time (%s)", name, late,
                           v1::ClaimEndReason_Name(event.end_reason())));
  }
  if (event.end_reason() == v1::CLAIM_END_REASON_EXPIRED) {
    ++counts_.expired;
    counts_.latest_expiry = std::max(counts_.latest_expiry, late);
    if (late < -1e-6) Broken(absl::StrFormat("%s expires %.3f s before its time", name, -late));
  } else if (event.end_reason() == v1::CLAIM_END_REASON_RELEASED) {
    ++counts_.released;
  } else if (event.end_reason() == v1::CLAIM_END_REASON_SCAN_ARRIVED) {
    ++counts_.fulfilled;
    const auto scan = merged_.find(event.scan());
    if (scan == merged_.end()) {
      return Broken(absl::StrCat(name, " ends with '", event.scan(),
                                 "', which is not merged or has ended another"));
    }
    const double apart = Apart(scan->second.pose().translation(), claim.position());
    if (apart > kArrival) {
      Broken(absl::StrFormat("%s ends with a scan made %.2f m away", name, apart));
    }
    if (scan->second.scanner() != claim.scanner()) {
      Broken(absl::StrCat(name, " ends with a scan of ", scan->second.scanner()));
    }
    merged_.erase(scan);
  } else {
    Broken(absl::StrCat(
        name, " ends for no known reason: ", v1::ClaimEndReason_Name(event.end_reason())));
  }
}

}  // namespace vantage::faults
