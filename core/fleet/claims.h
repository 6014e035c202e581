// Reserved views and the life of a reservation (algorithm.md section 11, 'Joint planning'). The
// caller gives the time, and how much of a view other claims cover.
#ifndef VANTAGE_CORE_FLEET_CLAIMS_H_
#define VANTAGE_CORE_FLEET_CLAIMS_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace vantage::fleet {

struct ClaimRules {
  double covered = 0.5;            // share of a view's score; a view covered by this much is taken
  double separation = 0.6;         // m, horizontally; a claim nearer than this is at the same place
  double arrival_tolerance = 0.5;  // m, horizontally, between a scan and the claim that it fulfils
  size_t most_per_scanner = 8;
};

struct ViewClaim {
  std::string id;
  std::string scanner;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m
  absl::Time taken;
  absl::Time expires;  // holds before this
  // Of a scanner that sees a sector: where it will face, rad, and the azimuth covered, rad.
  std::optional<double> heading = {};
  double span = 0;
};

// How much of a view's score the claims that are held cover.
struct ClaimCover {
  std::vector<double> by_claim;  // share that each covers by itself, [0, 1], in the order of held()
  double together = 0;           // share that all of them cover, [0, 1]
};

enum class ClaimEnd { kScanArrived, kExpired, kReleased };
// 'scan arrived', 'expired', 'released'.
const char* ClaimEndName(ClaimEnd end);

// Why a claim is not granted.
struct ClaimRefusal {
  size_t by = 0;       // index into held(): the claim that covers most of it, the earliest if equal
  double covered = 0;  // share of its score that claims cover, [0, 1]
  bool same_place = false;
};

// A state machine: a claim is held from Take() until End(). An expired claim is still held until
// End(), so that the caller's log has its end before anything that follows from it.
class Claims {
 public:
  Claims() = default;
  // Restores the claims of a log, oldest first.
  explicit Claims(std::vector<ViewClaim> held) : held_(std::move(held)) {}

  // Oldest first.
  const std::vector<ViewClaim>& held() const { return held_; }
  // Null when it is not held.
  const ViewClaim* Find(absl::string_view id) const;
  bool IsActive(const ViewClaim& claim, absl::Time now) const { return now < claim.expires; }
  // Claims that have expired.
  std::vector<std::string> Due(absl::Time now) const;

  // The conflict, if the surface or the place of `wanted` is taken. `cover` is that of its view. A
  // scanner's own claims count like those of others.
  std::optional<ClaimRefusal> Conflict(const ViewClaim& wanted, const ClaimCover& cover,
                                       const ClaimRules& rules) const;
  // FAILED_PRECONDITION: a claim is due, end it first. ALREADY_EXISTS: the id, or Conflict().
  // RESOURCE_EXHAUSTED: the scanner holds as many as it may. INVALID_ARGUMENT: the interval.
  absl::Status Take(const ViewClaim& wanted, const ClaimCover& cover, absl::Time now,
                    const ClaimRules& rules);
  // NOT_FOUND: it is not held. FAILED_PRECONDITION: it has expired. INVALID_ARGUMENT: the new end
  // is not after `now`.
  absl::Status Renew(absl::string_view id, absl::Time until, absl::Time now);
  // NOT_FOUND: it is not held. FAILED_PRECONDITION: kExpired before its time.
  absl::Status End(absl::string_view id, ClaimEnd how, absl::Time now);

  // The claim that a scan from `position` with `heading` (rad, of the scanner's +x) fulfils: the
  // nearest within the tolerance, of `scanner` where that is known (not empty), and of a claim with
  // a heading only when the scan shows three quarters of its sector (or has no heading). Null when
  // there is none: a scan that comes after its claim has ended, or a second one, fulfils no claim
  // and is like any other scan.
  const ViewClaim* FulfilledBy(absl::string_view scanner, const Eigen::Vector3d& position,
                               const ClaimRules& rules,
                               std::optional<double> heading = std::nullopt) const;

 private:
  std::vector<ViewClaim> held_;
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_CLAIMS_H_
