// Messages as Protobuf's JSON mapping.
#ifndef VANTAGE_CLIENT_CLI_JSON_H_
#define VANTAGE_CLIENT_CLI_JSON_H_

#include <google/protobuf/message.h>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace vantage::cli {

// Of what is none of the contract's messages, in the order in which it is written; its keys are
// spelled as theirs.
using Json = nlohmann::ordered_json;

// To standard output, with a line end; `lines` puts every field on its own line.
void PrintJson(const Json& value, bool lines = true);
// The message where JSON was asked for, else the text, as it is.
void PrintAnswer(bool json, const google::protobuf::Message& message, const std::string& text);

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

// What --set is given, PATH=VALUE, apart. INVALID_ARGUMENT: it is not of that form.
absl::StatusOr<std::pair<std::string, std::string>> ParseAssignment(const std::string& assignment);
// Sets fields by such assignments, in their order.
absl::Status SetFields(google::protobuf::Message& message,
                       const std::vector<std::string>& assignments);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_JSON_H_
