#include "client/study/place_file.h"

#include <cmath>
#include <fstream>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client/library/error.h"
#include "client/study/job_store.h"

namespace vantage::study {
namespace {

constexpr char kHeading[] = "x_m,y_m,z_m";

}  // namespace

absl::StatusOr<std::vector<Eigen::Vector3d>> ReadPlaces(const std::string& path) {
  std::ifstream file(path);
  if (!file) return absl::NotFoundError(absl::StrCat("cannot read ", path));
  const auto wrong = [&](int line, absl::string_view what) {
    return client::WithFix(
        absl::InvalidArgumentError(absl::StrCat(path, ", line ", line, ": ", what)),
        absl::StrCat("a line '", kHeading, "', then a place a line, such as 1.50,-2.00,1.50"));
  };
  std::vector<Eigen::Vector3d> places;
  bool headed = false;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    const absl::string_view text =
        absl::StripAsciiWhitespace(absl::string_view(line).substr(0, line.find('#')));
    if (text.empty()) continue;
    if (!headed) {
      if (text != kHeading) return wrong(number, "another heading");
      headed = true;
      continue;
    }
    const std::vector<absl::string_view> words = absl::StrSplit(text, ',');
    Eigen::Vector3d place;
    bool right = words.size() == 3;
    for (size_t axis = 0; right && axis < 3; ++axis) {
      double& value = place[static_cast<Eigen::Index>(axis)];
      right = absl::SimpleAtod(words[axis], &value) && std::isfinite(value);
    }
    if (!right) return wrong(number, "no place");
    places.push_back(place);
  }
  if (places.empty()) return wrong(number + 1, "there is no place in it");
  return places;
}

absl::Status WritePlaces(const std::string& path, const std::vector<Eigen::Vector3d>& places) {
  std::string text = absl::StrCat(kHeading, "\n");
  for (const Eigen::Vector3d& place : places) {
    absl::StrAppendFormat(&text, "%.4f,%.4f,%.4f\n", place.x(), place.y(), place.z());
  }
  return WriteWhole(path, text);
}

}  // namespace vantage::study
