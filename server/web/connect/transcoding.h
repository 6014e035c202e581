// Messages from JSON and into it.
#ifndef VANTAGE_SERVER_WEB_CONNECT_TRANSCODING_H_
#define VANTAGE_SERVER_WEB_CONNECT_TRANSCODING_H_

#include <string>

#include "absl/status/statusor.h"
#include "google/protobuf/descriptor.h"

namespace vantage::web {

// A message of that type, serialized, from Protobuf's JSON. INVALID_ARGUMENT says what does not
// fit; names that the type does not have are refused, since they are mostly misspelt.
absl::StatusOr<std::string> BinaryOf(const google::protobuf::Descriptor& type,
                                     const std::string& json);

// The other way; fields that are not set are left out. `binary` is what this process wrote; of
// what is no message of that type it tells a part, or INTERNAL.
absl::StatusOr<std::string> JsonOf(const google::protobuf::Descriptor& type,
                                   const std::string& binary);

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_CONNECT_TRANSCODING_H_
