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
  EXPECT_EQ(claims.FulfilledBy("", {1, 1, 1.5 + 2.8}, rules), nullptr) << "on the next storey";
  // Twice, or after the claim has ended: a scan like any other.
  ASSERT_TRUE(claims.End("a", ClaimEnd::kScanArrived, kStart).ok());
  EXPECT_EQ(claims.FulfilledBy("red", {1, 1, 1.5}, rules), nullptr);
}

// On a line every metre of which is surface: a view at x covers [x - 2, x + 2], so that what is
// covered is known in closed form.
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

TEST(ClaimsTest, InvariantsHoldWhateverHappens) {
  for (const unsigned seed : {11u, 12u, 13u}) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto draw = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    Claims claims;
    ClaimRules rules;
    rules.most_per_scanner = 3;
    absl::Time now = kStart;
    std::map<std::string, ViewClaim> expected;  // an independent record of what holds
    int taken = 0;
    int refused = 0;
    int expired = 0;
    int arrived = 0;
    for (int step = 0; step < 5000; ++step) {
      now += absl::Seconds(draw(20));
      for (const std::string& id : claims.Due(now)) {
        ASSERT_LE(expected.at(id).expires, now);
        ASSERT_TRUE(claims.End(id, ClaimEnd::kExpired, now).ok());
        expected.erase(id);
        ++expired;
      }
      const std::string scanner = absl::StrCat("s", draw(8));
      const std::string some = absl::StrCat("c", std::max(0, step - draw(60)));
      switch (draw(5)) {
        case 0:
        case 1: {
          const ViewClaim wanted{absl::StrCat("c", step), scanner, Vector3d(0.1 * draw(400), 0, 1),
                                 now, now + absl::Seconds(10 + draw(300))};
          const ClaimCover cover = CoverOnTheLine(claims, wanted.position);
          const auto own = std::count_if(expected.begin(), expected.end(), [&](const auto& e) {
            return e.second.scanner == scanner;
          });
          const bool same = std::any_of(expected.begin(), expected.end(), [&](const auto& e) {
            return std::abs(e.second.position.x() - wanted.position.x()) < rules.separation;
          });
          const bool may = own < 3 && !same && cover.together < rules.covered;
          ASSERT_EQ(claims.Take(wanted, cover, now, rules).ok(), may);
          if (may) expected[wanted.id] = wanted;
          (may ? taken : refused)++;
          break;
        }
        case 2: {
          const absl::Time until = now + absl::Seconds(10 + draw(100));
          ASSERT_EQ(claims.Renew(some, until, now).ok(), expected.count(some) == 1);
          if (expected.count(some) == 1) expected[some].expires = until;
          break;
        }
        case 3:
          ASSERT_EQ(claims.End(some, ClaimEnd::kReleased, now).ok(), expected.erase(some) == 1);
          break;
        default: {
          Vector3d at(0.1 * draw(400), 0.2, 1.3);
          if (draw(2) == 0 && !expected.empty()) {
            at.x() = expected.begin()->second.position.x() + 0.1 * draw(8);
          }
          const ViewClaim* match = claims.FulfilledBy(scanner, at, rules);
          for (const auto& entry : expected) {
            if (entry.second.scanner != scanner) continue;
            const double apart = (entry.second.position - at).head<2>().norm();
            if (match == nullptr) {
              ASSERT_GT(apart, rules.arrival_tolerance);
            } else {
              ASSERT_GE(apart, (match->position - at).head<2>().norm());
            }
          }
          if (match == nullptr) break;
          const std::string id = match->id;
          ASSERT_TRUE(claims.End(id, ClaimEnd::kScanArrived, now).ok());
          ASSERT_EQ(expected.erase(id), 1u);
          ++arrived;
        }
      }
      ASSERT_EQ(claims.held().size(), expected.size());
      for (const ViewClaim& claim : claims.held()) {
        ASSERT_EQ(expected.at(claim.id).expires, claim.expires);
        ASSERT_TRUE(claims.IsActive(claim, now));
        for (const ViewClaim& other : claims.held()) {
          if (&claim == &other) continue;
          ASSERT_GE((claim.position - other.position).norm(), rules.separation);
          ASSERT_LT(Overlap(claim.position, other.position), rules.covered + 0.01);
        }
      }
    }
    // All of it happened.
    EXPECT_GT(taken, 100);
    EXPECT_GT(refused, 100);
    EXPECT_GT(expired, 20);
    EXPECT_GT(arrived, 20);
  }
}

}  // namespace
}  // namespace vantage::fleet
