#include "client/cli/target_file.h"

#include <cmath>
#include <set>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "client/cli/file.h"
#include "client/library/error.h"

namespace vantage::cli {

absl::StatusOr<std::vector<std::pair<std::string, v1::TargetSighting>>> ParseTargets(
    const std::string& text, const std::string& what) {
  std::vector<std::pair<std::string, v1::TargetSighting>> sightings;
  int number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    line = line.substr(0, line.find('#'));
    const std::vector<std::string> words =
        absl::StrSplit(line, absl::ByAnyChar(" \t\r,;"), absl::SkipEmpty());
    if (words.empty()) continue;
    const auto bad = [&](const std::string& why) {
      return client::WithFix(
          absl::InvalidArgumentError(absl::StrCat(what, ":", number, ": ", why)),
          "a line is a scan's name, a target's name, its x y z in the scanner's frame and, where a "
          "control network has it, its x y z in the world, in m");
    };
    if (words.size() != 5 && words.size() != 8) {
      return bad(absl::StrCat(words.size(), " words instead of 5 or 8"));
    }
    std::vector<double> numbers(words.size() - 2);
    for (size_t i = 0; i < numbers.size(); ++i) {
      if (!absl::SimpleAtod(words[i + 2], &numbers[i]) || !std::isfinite(numbers[i])) {
        return bad(absl::StrCat("'", words[i + 2], "' is not a number"));
      }
    }
    v1::TargetSighting sighting;
    sighting.set_name(words[1]);
    const auto set = [&](size_t first, v1::Vector3& to) {
      to.set_x(numbers[first]);
      to.set_y(numbers[first + 1]);
      to.set_z(numbers[first + 2]);
    };
    set(0, *sighting.mutable_in_scan());
    if (numbers.size() == 6) set(3, *sighting.mutable_in_world());
    sightings.emplace_back(words[0], std::move(sighting));
  }
  return sightings;
}

absl::StatusOr<std::vector<v1::TargetSighting>> ReadTargets(const std::string& file,
                                                            const std::string& scan_name) {
  const auto text = ReadFile(file);
  if (!text.ok()) return text.status();
  const auto all = ParseTargets(*text, file);
  if (!all.ok()) return all.status();
  std::vector<v1::TargetSighting> targets;
  std::set<std::string> scans;
  for (const auto& [scan, sighting] : *all) {
    scans.insert(scan);
    if (scan == scan_name) targets.push_back(sighting);
  }
  if (targets.empty()) {
    return client::WithFix(
        absl::InvalidArgumentError(absl::StrCat(file, " has no targets for '", scan_name, "'")),
        absl::StrCat("it has some for ", absl::StrJoin(scans, ", "),
                     "; --name chooses which scan is meant"));
  }
  return targets;
}

}  // namespace vantage::cli
