#include "core/fleet/claims.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "absl/strings/str_cat.h"

namespace vantage::fleet {
namespace {

using Eigen::Vector3d;

const absl::Time kStart = absl::FromUnixSeconds(1'700'000'000);

ViewClaim At(const std::string& id, const std::string& scanner, const Vector3d& p,
             absl::Duration ttl = absl::Minutes(30)) {
  return {id, scanner, p, kStart, kStart + ttl};
}

ClaimCover Covers(std::vector<double> by, double together) { return {std::move(by), together}; }

TEST(ClaimsTest, OneOfTwoForTheSameSurfaceWins) {
  Claims claims;
  const ClaimRules rules;
  ASSERT_TRUE(claims.Take(At("a", "red", {1, 1, 1.5}), {}, kStart, rules).ok());
  const absl::Status second =
      claims.Take(At("b", "blue", {4, 1, 1.5}), Covers({0.7}, 0.7), kStart, rules);
  EXPECT_EQ(second.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_NE(second.ToString().find("70 %"), std::string::npos) << second;
  // Less than half covered: there is enough left.
  EXPECT_TRUE(claims.Take(At("b", "blue", {4, 1, 1.5}), Covers({0.4}, 0.4), kStart, rules).ok());
  // Two that cover little each may cover most together.
  const auto both = claims.Conflict(At("c", "green", {8, 1, 1.5}), Covers({0.3, 0.4}, 0.6), rules);
  ASSERT_TRUE(both.has_value());
  EXPECT_EQ(both->by, 1u);
  EXPECT_FALSE(both->same_place);
}

TEST(ClaimsTest, TheSamePlaceIsTakenWhateverItGains) {
  Claims claims;
  const ClaimRules rules;
  ASSERT_TRUE(claims.Take(At("a", "red", {1, 1, 1.5}), {}, kStart, rules).ok());
  const auto near = claims.Conflict(At("b", "blue", {1.5, 1, 1.2}), Covers({0}, 0), rules);
  ASSERT_TRUE(near.has_value());
  EXPECT_TRUE(near->same_place);
  EXPECT_FALSE(claims.Conflict(At("b", "blue", {1.7, 1, 1.2}), Covers({0}, 0), rules).has_value());
}

TEST(ClaimsTest, ExpiryIsWrittenDownBeforeAnythingFollowsFromIt) {
  Claims claims;
  const ClaimRules rules;
  ASSERT_TRUE(claims.Take(At("a", "red", {1, 1, 1.5}, absl::Minutes(1)), {}, kStart, rules).ok());
  const absl::Time later = kStart + absl::Minutes(1);
  EXPECT_TRUE(claims.Due(later - absl::Nanoseconds(1)).empty());
  EXPECT_EQ(claims.End("a", ClaimEnd::kExpired, later - absl::Seconds(1)).code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(claims.Due(later), std::vector<std::string>{"a"});
  const ViewClaim wanted = At("b", "blue", {1, 1, 1.5});
  EXPECT_EQ(claims.Take(wanted, Covers({1}, 1), later, rules).code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(claims.Renew("a", later + absl::Minutes(1), later).code(),
            absl::StatusCode::kFailedPrecondition);
  ASSERT_TRUE(claims.End("a", ClaimEnd::kExpired, later).ok());
  EXPECT_TRUE(claims.Take(wanted, {}, later, rules).ok());
}

TEST(ClaimsTest, RenewalProlongs) {
  Claims claims;
  ASSERT_TRUE(
      claims.Take(At("a", "red", {1, 1, 1}, absl::Minutes(1)), {}, kStart, ClaimRules()).ok());
  const absl::Time until = kStart + absl::Minutes(10);
  EXPECT_EQ(claims.Renew("b", until, kStart).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(claims.Renew("a", kStart, kStart).code(), absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(claims.Renew("a", until, kStart).ok());
  EXPECT_TRUE(claims.Due(until - absl::Seconds(1)).empty());
  EXPECT_FALSE(claims.Due(until).empty());
}

TEST(ClaimsTest, AScanFulfilsTheNearestClaimOfItsScanner) {
  Claims claims;
  const ClaimRules rules;
  ASSERT_TRUE(claims.Take(At("a", "red", {1, 1, 1.5}), {}, kStart, rules).ok());
  ASSERT_TRUE(claims.Take(At("b", "blue", {1.7, 1, 1.5}), Covers({0}, 0), kStart, rules).ok());
  EXPECT_EQ(claims.FulfilledBy("", {1.3, 1, 1.2}, rules)->id, "a");
  EXPECT_EQ(claims.FulfilledBy("", {1.4, 1, 1.2}, rules)->id, "b");
  EXPECT_EQ(claims.FulfilledBy("red", {1.4, 1, 1.2}, rules)->id, "a");
  EXPECT_EQ(claims.FulfilledBy("red", {1.7, 1, 1.2}, rules), nullptr);
  EXPECT_EQ(claims.FulfilledBy("green", {1, 1, 1.5}, rules), nullptr);
  EXPECT_EQ(claims.FulfilledBy("", {1, 2, 1.5}, rules), nullptr);
  // A scan that is turned away from what was claimed does not fulfil it.
  ViewClaim sector = At("c", "red", {5, 1, 1.5});
  sector.heading = 3;
  sector.span = 2;
  ASSERT_TRUE(claims.Take(sector, Covers({0, 0}, 0), kStart, rules).ok());
  EXPECT_EQ(claims.FulfilledBy("red", {5, 1, 1.5}, rules, 3.4)->id, "c");
  EXPECT_EQ(claims.FulfilledBy("red", {5, 1, 1.5}, rules, -2.9)->id, "c") << "the other way round";
  EXPECT_EQ(claims.FulfilledBy("red", {5, 1, 1.5}, rules, 2.3), nullptr);
  EXPECT_EQ(claims.FulfilledBy("red", {5, 1, 1.5}, rules)->id, "c") << "turned nobody knows where";
  EXPECT_EQ(claims.FulfilledBy("", {1, 1, 1.5 + 2.8}, rules), nullptr) << "on the next storey";
  // Twice, or after the claim has ended: a scan like any other.
  ASSERT_TRUE(claims.End("a", ClaimEnd::kScanArrived, kStart).ok());
  EXPECT_EQ(claims.FulfilledBy("red", {1, 1, 1.5}, rules), nullptr);
}

// The surface is a line, of which a view at x covers [x - 2, x + 2]; so the covered share is known
// in closed form.
double Overlap(const Vector3d& a, const Vector3d& b) {
  return std::max(0.0, 4 - std::abs(a.x() - b.x())) / 4;
}

ClaimCover CoverOnTheLine(const Claims& claims, const Vector3d& at) {
  ClaimCover cover;
  for (const ViewClaim& claim : claims.held()) {
    cover.by_claim.push_back(Overlap(claim.position, at));
  }
  constexpr int kSteps = 400;
  int covered = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double x = at.x() - 2 + 4 * (k + 0.5) / kSteps;
    covered += std::any_of(claims.held().begin(), claims.held().end(), [&](const ViewClaim& claim) {
      return std::abs(claim.position.x() - x) <= 2;
    });
  }
  cover.together = static_cast<double>(covered) / kSteps;
  return cover;
}

// Claims at random, beside an independent record of what holds.
class RandomClaims {
 public:
  explicit RandomClaims(unsigned seed) : random_(seed) { rules_.most_per_scanner = 3; }

  // Time passes, and one thing happens.
  void Step() {
    now_ += absl::Seconds(Below(20));
    ++step_;
    Expire();
    switch (Below(5)) {
      case 0:
      case 1:
        return Take();
      case 2:
        return Renew();
      case 3:
        return Release();
      default:
        return Arrive();
    }
  }

  // Those of the record, and no two at a place.
  void ExpectInvariants() const {
    ASSERT_EQ(claims_.held().size(), record_.size());
    for (const ViewClaim& claim : claims_.held()) {
      ASSERT_EQ(record_.at(claim.id).expires, claim.expires);
      ASSERT_TRUE(claims_.IsActive(claim, now_));
      for (const ViewClaim& other : claims_.held()) {
        if (&claim == &other) continue;
        ASSERT_GE((claim.position - other.position).norm(), rules_.separation);
        ASSERT_LT(Overlap(claim.position, other.position), rules_.covered + 0.01);
      }
    }
  }

  int taken = 0;
  int refused = 0;
  int expired = 0;
  int renewed = 0;
  int released = 0;
  int arrived = 0;

 private:
  int Below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  std::string SomeScanner() { return absl::StrCat("s", Below(8)); }
  std::string SomeClaim() { return absl::StrCat("c", std::max(0, step_ - Below(60))); }

  void Expire() {
    for (const auto& [id, claim] : record_) {
      ASSERT_EQ(claim.expires <= now_, IsDue(id)) << id;
    }
    for (const std::string& id : claims_.Due(now_)) {
      ASSERT_TRUE(claims_.End(id, ClaimEnd::kExpired, now_).ok());
      ASSERT_EQ(record_.erase(id), 1u);
      ++expired;
    }
  }
  bool IsDue(const std::string& id) const {
    const auto due = claims_.Due(now_);
    return std::find(due.begin(), due.end(), id) != due.end();
  }

  void Take() {
    const ViewClaim wanted{absl::StrCat("c", step_), SomeScanner(),
                           Vector3d(0.1 * Below(400), 0, 1), now_,
                           now_ + absl::Seconds(10 + Below(300))};
    const ClaimCover cover = CoverOnTheLine(claims_, wanted.position);
    const auto own = std::count_if(record_.begin(), record_.end(), [&](const auto& entry) {
      return entry.second.scanner == wanted.scanner;
    });
    const bool same = std::any_of(record_.begin(), record_.end(), [&](const auto& entry) {
      return std::abs(entry.second.position.x() - wanted.position.x()) < rules_.separation;
    });
    const bool may = own < 3 && !same && cover.together < rules_.covered;
    ASSERT_EQ(claims_.Take(wanted, cover, now_, rules_).ok(), may);
    if (may) record_[wanted.id] = wanted;
    ++(may ? taken : refused);
  }

  void Renew() {
    const std::string id = SomeClaim();
    const absl::Time until = now_ + absl::Seconds(10 + Below(100));
    const auto held = record_.find(id);
    ASSERT_EQ(claims_.Renew(id, until, now_).ok(), held != record_.end());
    if (held == record_.end()) return;
    held->second.expires = until;
    ++renewed;
  }

  void Release() {
    const std::string id = SomeClaim();
    const bool held = record_.erase(id) == 1;
    ASSERT_EQ(claims_.End(id, ClaimEnd::kReleased, now_).ok(), held);
    released += held ? 1 : 0;
  }

  // A scan arrives: it fulfils the nearest claim of its scanner, or there is none near.
  void Arrive() {
    const std::string scanner = SomeScanner();
    Vector3d at(0.1 * Below(400), 0.2, 1.3);
    if (Below(2) == 0 && !record_.empty()) {
      at.x() = record_.begin()->second.position.x() + 0.1 * Below(8);
    }
    const auto apart = [&](const ViewClaim& claim) {
      return (claim.position - at).head<2>().norm();
    };
    const ViewClaim* match = claims_.FulfilledBy(scanner, at, rules_);
    for (const auto& [id, claim] : record_) {
      if (claim.scanner != scanner) continue;
      ASSERT_GE(apart(claim), match == nullptr ? rules_.arrival_tolerance : apart(*match));
    }
    if (match == nullptr) return;
    ASSERT_EQ(match->scanner, scanner);
    ASSERT_LE(apart(*match), rules_.arrival_tolerance);
    const std::string id = match->id;
    ASSERT_TRUE(claims_.End(id, ClaimEnd::kScanArrived, now_).ok());
    ASSERT_EQ(record_.erase(id), 1u);
    ++arrived;
  }

  std::mt19937 random_;
  Claims claims_;
  ClaimRules rules_;
  absl::Time now_ = kStart;
  int step_ = -1;
  std::map<std::string, ViewClaim> record_;
};

TEST(ClaimsTest, InvariantsHoldWhateverHappens) {
  for (const unsigned seed : {11u, 12u, 13u}) {
    SCOPED_TRACE(seed);
    RandomClaims claims(seed);
    for (int step = 0; step < 5000 && !testing::Test::HasFatalFailure(); ++step) {
      claims.Step();
      claims.ExpectInvariants();
    }
    // All of it happened.
    EXPECT_GT(claims.taken, 100);
    EXPECT_GT(claims.refused, 100);
    EXPECT_GT(claims.expired, 20);
    EXPECT_GT(claims.renewed, 20);
    EXPECT_GT(claims.released, 20);
    EXPECT_GT(claims.arrived, 20);
  }
}

}  // namespace
}  // namespace vantage::fleet
