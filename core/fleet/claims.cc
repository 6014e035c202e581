#include "core/fleet/claims.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/fleet/horizontal_distance.h"
#include "core/fleet/same_sector.h"

namespace vantage::fleet {

const char* ClaimEndName(ClaimEnd end) {
  switch (end) {
    case ClaimEnd::kScanArrived:
      return "scan arrived";
    case ClaimEnd::kExpired:
      return "expired";
    case ClaimEnd::kReleased:
      return "released";
  }
  return "";
}

const ViewClaim* Claims::Find(absl::string_view id) const {
  const auto it = std::find_if(held_.begin(), held_.end(),
                               [&](const ViewClaim& claim) { return claim.id == id; });
  return it == held_.end() ? nullptr : &*it;
}

std::vector<std::string> Claims::Due(absl::Time now) const {
  std::vector<std::string> due;
  for (const ViewClaim& claim : held_) {
    if (!IsActive(claim, now)) due.push_back(claim.id);
  }
  return due;
}

std::optional<ClaimRefusal> Claims::Conflict(const ViewClaim& wanted, const ClaimCover& cover,
                                             const ClaimRules& rules) const {
  ClaimRefusal refusal;
  refusal.covered = cover.together;
  double most = -1;
  for (size_t i = 0; i < held_.size(); ++i) {
    const bool same = HorizontalDistance(held_[i].position, wanted.position) < rules.separation;
    refusal.same_place |= same;
    // A claim at the same place is a conflict, whatever share of the surface it covers.
    const double weight = (i < cover.by_claim.size() ? cover.by_claim[i] : 0) + (same ? 2 : 0);
    if (weight > most) {
      most = weight;
      refusal.by = i;
    }
  }
  if (held_.empty() || (!refusal.same_place && cover.together < rules.covered)) return std::nullopt;
  return refusal;
}

absl::Status Claims::Take(const ViewClaim& wanted, const ClaimCover& cover, absl::Time now,
                          const ClaimRules& rules) {
  if (!Due(now).empty()) {
    return absl::FailedPreconditionError("a claim is past its time and has not been ended");
  }
  if (!(wanted.expires > now)) {
    return absl::InvalidArgumentError("a claim must expire after it is taken");
  }
  if (Find(wanted.id) != nullptr) {
    return absl::AlreadyExistsError(absl::StrCat("claim ", wanted.id, " is held"));
  }
  const auto own = std::count_if(held_.begin(), held_.end(), [&](const ViewClaim& claim) {
    return claim.scanner == wanted.scanner;
  });
  if (static_cast<size_t>(own) >= rules.most_per_scanner) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the scanner holds ", own, " claims, the most it may; release one"));
  }
  if (const auto refusal = Conflict(wanted, cover, rules)) {
    return absl::AlreadyExistsError(
        refusal->same_place
            ? absl::StrFormat("within %.2f m of claim %s", rules.separation, held_[refusal->by].id)
            : absl::StrFormat("claims cover %.0f %% of its score, %s most of it",
                              refusal->covered * 100, held_[refusal->by].id));
  }
  held_.push_back(wanted);
  return absl::OkStatus();
}

absl::Status Claims::Renew(absl::string_view id, absl::Time until, absl::Time now) {
  const auto it = std::find_if(held_.begin(), held_.end(),
                               [&](const ViewClaim& claim) { return claim.id == id; });
  if (it == held_.end()) return absl::NotFoundError(absl::StrCat("claim ", id, " is not held"));
  if (!IsActive(*it, now)) {
    return absl::FailedPreconditionError(
        absl::StrCat("claim ", id, " has expired: claim the view again"));
  }
  if (!(until > now)) return absl::InvalidArgumentError("a claim must expire after it is renewed");
  it->expires = until;
  return absl::OkStatus();
}

absl::Status Claims::End(absl::string_view id, ClaimEnd how, absl::Time now) {
  const auto it = std::find_if(held_.begin(), held_.end(),
                               [&](const ViewClaim& claim) { return claim.id == id; });
  if (it == held_.end()) return absl::NotFoundError(absl::StrCat("claim ", id, " is not held"));
  if (how == ClaimEnd::kExpired && IsActive(*it, now)) {
    return absl::FailedPreconditionError(absl::StrCat("claim ", id, " has not expired"));
  }
  held_.erase(it);
  return absl::OkStatus();
}

const ViewClaim* Claims::FulfilledBy(absl::string_view scanner, const Eigen::Vector3d& position,
                                     const ClaimRules& rules, std::optional<double> heading) const {
  const ViewClaim* nearest = nullptr;
  for (const ViewClaim& claim : held_) {
    if (!scanner.empty() && claim.scanner != scanner) continue;
    const double apart = HorizontalDistance(claim.position, position);
    if (apart > rules.arrival_tolerance) continue;
    if (!ShowsSameSector(claim.heading, heading, claim.span)) continue;
    if (nearest == nullptr || apart < HorizontalDistance(nearest->position, position))
      nearest = &claim;
  }
  return nearest;
}

}  // namespace vantage::fleet
