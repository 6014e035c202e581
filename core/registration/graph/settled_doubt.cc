#include "core/registration/graph/settled_doubt.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/bound/basis.h"

namespace vantage::registration {
namespace {

// Of either's surface within the other's sight, in space that this one saw to be empty: what was
// moved between two scans is less (LinkScans() calls a link with more doubtful).
constexpr double kContradictsPose = 0.15;
// As bound/rivals: of the samples, by so much more that contradict at one pose than at another this
// one is refuted.
constexpr double kRefutesPose = 0.03;
constexpr size_t kMostNamedScans = 3;

enum class PairSays { kNeither, kTies, kContradicts };

PairSays SaysOf(const LinkOutcome& outcome) {
  if (outcome.link.has_value() && !outcome.link->in_doubt) return PairSays::kTies;
  return outcome.contradiction_share > kContradictsPose ? PairSays::kContradicts
                                                        : PairSays::kNeither;
}

size_t CountOf(std::span<const PairAtPose> pairs, PairSays what) {
  return static_cast<size_t>(std::count_if(pairs.begin(), pairs.end(), [&](const PairAtPose& pair) {
    return SaysOf(pair.outcome) == what;
  }));
}

// Scans that tie it there, less those that contradict it.
ptrdiff_t NetOf(std::span<const PairAtPose> pairs) {
  return static_cast<ptrdiff_t>(CountOf(pairs, PairSays::kTies)) -
         static_cast<ptrdiff_t>(CountOf(pairs, PairSays::kContradicts));
}

bool IsOnePose(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() < kSettledShift &&
         Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() < kSettledTurn;
}

std::optional<size_t> NearestPose(const Eigen::Isometry3d& at,
                                  std::span<const DoubtfulPose> poses) {
  std::optional<size_t> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < poses.size(); ++i) {
    if (!IsOnePose(at, poses[i].T_world_scan)) continue;
    const double apart = (at.translation() - poses[i].T_world_scan.translation()).norm();
    if (apart >= least) continue;
    least = apart;
    nearest = i;
  }
  return nearest;
}

// The last part of a resource name, which is what people call it.
std::string IdOfScan(const std::string& name) { return name.substr(name.rfind('/') + 1); }

// 'scan-3, scan-7 and 2 more'.
std::string ListOf(const std::vector<std::string>& scans) {
  std::string out;
  const size_t named = std::min(scans.size(), kMostNamedScans);
  for (size_t i = 0; i < named; ++i) {
    const bool last = i + 1 == scans.size();
    absl::StrAppend(&out, i == 0 ? "" : (last ? " and " : ", "), IdOfScan(scans[i]));
  }
  if (scans.size() > named) absl::StrAppend(&out, " and ", scans.size() - named, " more");
  return out;
}

std::string Ordinal(size_t index) {
  constexpr std::array<const char*, 5> kWords = {"first", "second", "third", "fourth", "fifth"};
  return index < kWords.size() ? kWords[index] : absl::StrCat(index + 1, "th");
}

bool RestsOnTargets(const RegistrationVerdict& verdict) {
  return std::find(verdict.bases.begin(), verdict.bases.end(), RegistrationBasis::kTargets) !=
         verdict.bases.end();
}

// What decides, of all that may.
struct Deciding {
  std::vector<std::string> contradicting;  // of the scans that came since
  std::vector<std::string> ties;           // of the same
};

std::string WordsOf(const RegistrationResult& anew, const SettledDoubt& settled,
                    const Deciding& since, size_t poses) {
  const char* other = poses > 2 ? "others" : "the other";
  std::string words;
  if (RestsOnTargets(anew.verdict)) {
    words = "by its targets";
  } else if (!since.contradicting.empty()) {
    words =
        absl::StrCat("by ", ListOf(since.contradicting), ", which ",
                     since.contradicting.size() == 1 ? "contradicts " : "contradict ", other, ",");
  } else if (!since.ties.empty()) {
    words = absl::StrCat(since.ties.size() == 1 ? "by the link to " : "by the links to ",
                         ListOf(since.ties));
  } else {
    words = "by the model as it is now";
  }
  if (poses > 1) {
    absl::StrAppend(&words, " the ", Ordinal(*settled.pose), " of its ", poses, " poses is right");
  } else if (settled.pose.has_value()) {
    absl::StrAppend(&words, " the pose that was found is right");
  } else {
    const Eigen::Vector3d at = anew.T_world_scan.translation();
    absl::StrAppendFormat(&words, " it was not made there, but %.2f m off",
                          (at - settled.first_pose).norm());
  }
  absl::StrAppendFormat(&words, ": it registers %s to %.1f mm, and nowhere else",
                        poses > 1 || settled.pose.has_value() ? "there" : "so",
                        1000 * anew.verdict.error_bound);
  return words;
}

}  // namespace

std::optional<SettledDoubt> SettleDoubt(const RegistrationResult& anew,
                                        std::span<const PairAtPose> at_last,
                                        std::span<const DoubtfulPose> poses) {
  if (!anew.verdict.registered() || poses.empty()) return std::nullopt;
  SettledDoubt settled;
  settled.pose = NearestPose(anew.T_world_scan, poses);
  if (!settled.pose.has_value() && poses.size() > 1) return std::nullopt;

  const size_t ties = CountOf(at_last, PairSays::kTies);
  if (ties == 0 && !RestsOnTargets(anew.verdict)) return std::nullopt;
  if (NetOf(at_last) < 0) return std::nullopt;
  settled.first_pose = poses.front().T_world_scan.translation();
  Deciding since;
  for (const PairAtPose& pair : at_last) {
    if (SaysOf(pair.outcome) != PairSays::kTies) continue;
    settled.agreeing.push_back(pair.scan);
    if (pair.came_since) since.ties.push_back(pair.scan);
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    if (i == settled.pose || poses.size() == 1) continue;
    // Targets tell poses apart at which all surfaces are the same.
    const bool better = NetOf(poses[i].pairs) > NetOf(at_last);
    if (better && !RestsOnTargets(anew.verdict)) return std::nullopt;
  }
  for (size_t k = 0; k < at_last.size() && poses.size() > 1; ++k) {
    const bool contradicts = [&] {
      for (size_t i = 0; i < poses.size(); ++i) {
        if (i == settled.pose || k >= poses[i].pairs.size()) continue;
        const double there = poses[i].pairs[k].outcome.contradiction_share;
        if (there > at_last[k].outcome.contradiction_share + kRefutesPose) return true;
      }
      return false;
    }();
    if (!contradicts) continue;
    settled.contradicting.push_back(at_last[k].scan);
    if (at_last[k].came_since) since.contradicting.push_back(at_last[k].scan);
  }
  settled.words = WordsOf(anew, settled, since, poses.size());
  return settled;
}

}  // namespace vantage::registration
