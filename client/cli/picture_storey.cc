#include "client/cli/picture_storey.h"

#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace vantage::cli {
namespace {

std::string NameOrNumber(const v1::Storey& storey) {
  return storey.name().empty() ? absl::StrCat(storey.number())
                               : absl::StrCat(storey.number(), " (", storey.name(), ")");
}

}  // namespace

absl::StatusOr<PictureStorey> ChooseStorey(
    const google::protobuf::RepeatedPtrField<v1::Storey>& storeys, const std::string& wanted,
    std::optional<double> station_z) {
  std::vector<PictureStorey> known;
  std::vector<std::string> names;
  for (const v1::Storey& storey : storeys) {
    names.push_back(NameOrNumber(storey));
    PictureStorey band;
    band.storey = storey;
    if (storey.has_floor_z_m()) {
      band.floor = storey.floor_z_m();
      if (!known.empty()) known.back().next_floor = storey.floor_z_m();
    }
    known.push_back(band);
  }
  // All that lies below belongs to the lowest, as far as one asks for it.
  if (wanted.empty()) {
    if (known.size() <= 1 || !station_z.has_value()) return PictureStorey();
    for (const PictureStorey& band : known) {
      if (band.HasStation(*station_z)) return band;
    }
    return known.front();
  }
  for (const PictureStorey& band : known) {
    if (wanted == absl::StrCat(band.storey->number()) || wanted == band.storey->name()) {
      return band;
    }
  }
  return absl::NotFoundError(
      known.empty() ? absl::StrCat("there is no storey '", wanted, "': no scan is in the model yet")
                    : absl::StrCat("there is no storey '", wanted,
                                   "'; those that are known: ", absl::StrJoin(names, ", ")));
}

}  // namespace vantage::cli
