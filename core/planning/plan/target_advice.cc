#include "core/planning/plan/target_advice.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace vantage::planning {
namespace {

// 'a, b and c'
std::string Listed(const std::vector<std::string>& words) {
  std::string list;
  for (size_t i = 0; i < words.size(); ++i) {
    absl::StrAppend(&list, i == 0 ? "" : i + 1 == words.size() ? " and " : ", ", words[i]);
  }
  return list;
}

// 'sessions/job/scans/scan-2' is for programs.
std::string LastPart(const std::string& name) { return name.substr(name.rfind('/') + 1); }

}  // namespace

std::string TargetAdviceWords(const TargetAdvice& advice, const Eigen::Vector3d& origin) {
  std::vector<std::string> put_up;
  std::vector<std::string> known;
  for (const TargetPlace& place : advice.places) {
    const Eigen::Vector3d at = place.position + origin;
    const std::string where = absl::StrFormat("(%.2f, %.2f, %.2f)", at.x(), at.y(), at.z());
    if (place.target.empty()) {
      put_up.push_back(absl::StrFormat("on the wall at %s, %.1f m away", where, place.distance));
    } else {
      known.push_back(absl::StrFormat("'%s' at %s", place.target, where));
    }
  }
  std::string words;
  if (!known.empty()) {
    absl::StrAppend(&words, "scan target", known.size() == 1 ? " " : "s ", Listed(known), " too");
  }
  if (!put_up.empty()) {
    absl::StrAppendFormat(&words, "%sput up %d target%s: %s", words.empty() ? "" : ", and ",
                          put_up.size(), put_up.size() == 1 ? "" : "s", Listed(put_up));
    if (advice.first_view.has_value()) {
      absl::StrAppendFormat(&words, "; the scan from rank %d, which sees them, comes first",
                            *advice.first_view + 1);
    } else if (!advice.seen_from.empty()) {
      std::vector<std::string> from;
      for (const std::string& name : advice.seen_from) from.push_back(LastPart(name));
      absl::StrAppend(&words, "; seen from the station", from.size() == 1 ? " of " : "s of ",
                      Listed(from), ": scan ", from.size() == 1 ? "there" : "at one of them",
                      " again, coarsely, to measure them");
    }
  }
  absl::StrAppendFormat(&words, "; with %s the error bound is %.1f mm",
                        advice.places.size() == 1 ? "it" : "them", 1000 * advice.error_bound);
  return words;
}

}  // namespace vantage::planning
