// Which storey of a job a picture shows.
#ifndef VANTAGE_CLIENT_CLI_PICTURE_STOREY_H_
#define VANTAGE_CLIENT_CLI_PICTURE_STOREY_H_

#include <limits>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "google/protobuf/repeated_ptr_field.h"
#include "vantage/v1/site.pb.h"

namespace vantage::cli {

// What of a job is shown: all, or a storey.
struct PictureStorey {
  std::optional<v1::Storey> storey;  // nothing: the job is drawn as a whole
  // Of the storey's floor, and of the next one's, m, world.
  double floor = -std::numeric_limits<double>::infinity();
  double next_floor = std::numeric_limits<double>::infinity();

  // Of surface, from the floor to the ceiling.
  bool HasSurface(double z) const { return z >= floor - 0.1 && z < next_floor - 0.1; }
  // Of scanners.
  bool HasStation(double z) const { return z >= floor + 0.3 && z < next_floor + 0.3; }
};

// The storey by its number or its name; where neither is given (empty), all of a job that has one,
// and else that in which a scanner at `station_z` stands, m. NOT_FOUND: there is no such storey;
// the message names those that there are.
absl::StatusOr<PictureStorey> ChooseStorey(
    const google::protobuf::RepeatedPtrField<v1::Storey>& storeys, const std::string& wanted,
    std::optional<double> station_z);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_PICTURE_STOREY_H_
