// Messages as Protobuf's JSON mapping.
#ifndef VANTAGE_CLIENT_CLI_JSON_H_
#define VANTAGE_CLIENT_CLI_JSON_H_

#include <google/protobuf/message.h>

#include <string>

#include "absl/status/status.h"

namespace vantage::cli {

// With a final line end; `lines` puts every field on its own line.
std::string ToJson(const google::protobuf::Message& message, bool lines = true);

// INVALID_ARGUMENT names what is wrong and where (`what` says of which file or flag).
absl::Status FromJson(const std::string& text, const std::string& what,
                      google::protobuf::Message& message);

// Sets the field at a path such as 'planning_config.required_density_per_m2' from text as a person
// types it ('2500', 'true', '{x: 1 y: 2 z: 3}'). INVALID_ARGUMENT names the path and what it should
// be.
absl::Status SetField(google::protobuf::Message& message, const std::string& path,
                      const std::string& value);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_JSON_H_
