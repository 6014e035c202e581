#include "client/cli/json.h"

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/json_util.h>

#include <cstdio>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace vantage::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

class SilentErrors final : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int /*line*/, int /*column*/, const std::string& /*message*/) override {}
};

std::string FieldNames(const google::protobuf::Descriptor& type) {
  std::vector<std::string> names;
  names.reserve(static_cast<size_t>(type.field_count()));
  for (int i = 0; i < type.field_count(); ++i) names.push_back(type.field(i)->name());
  return absl::StrJoin(names, ", ");
}

}  // namespace

std::string ToJson(const Message& message, bool lines) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = lines;
  options.always_print_primitive_fields = true;
  std::string out;
  if (!google::protobuf::util::MessageToJsonString(message, &out, options).ok()) return "{}\n";
  if (out.empty() || out.back() != '\n') out += '\n';
  return out;
}

void PrintJson(const Json& value, bool lines) {
  // Names of files need not be UTF-8.
  const std::string text = value.dump(lines ? 1 : -1, ' ', false, Json::error_handler_t::replace);
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

void PrintAnswer(bool json, const Message& message, const std::string& text) {
  std::fputs(json ? ToJson(message).c_str() : text.c_str(), stdout);
}

absl::Status FromJson(const std::string& text, const std::string& what, Message& message) {
  const auto status = google::protobuf::util::JsonStringToMessage(text, &message);
  if (status.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(what, " is not a ", message.GetDescriptor()->name(),
                   " in Protobuf's JSON form: ", std::string(status.message())));
}

absl::Status SetField(Message& message, const std::string& path, const std::string& value) {
  const std::vector<std::string> parts = absl::StrSplit(path, '.');
  Message* at = &message;
  for (size_t i = 0; i < parts.size(); ++i) {
    const FieldDescriptor* field = at->GetDescriptor()->FindFieldByName(parts[i]);
    if (field == nullptr) {
      return absl::InvalidArgumentError(absl::StrCat("'", path, "': there is no '", parts[i],
                                                     "'; there are ",
                                                     FieldNames(*at->GetDescriptor())));
    }
    if (i + 1 < parts.size()) {
      if (field->is_repeated() || field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
        return absl::InvalidArgumentError(
            absl::StrCat("'", path, "': '", parts[i], "' has no parts"));
      }
      at = at->GetReflection()->MutableMessage(at, field);
      continue;
    }
    const bool quoted = field->cpp_type() == FieldDescriptor::CPPTYPE_STRING &&
                        (value.empty() || (value.front() != '"' && value.front() != '\''));
    const std::string text = quoted ? absl::StrCat("\"", absl::CEscape(value), "\"") : value;
    if (field->is_repeated()) at->GetReflection()->ClearField(at, field);
    google::protobuf::TextFormat::Parser parser;
    SilentErrors silent;  // the error is reported below
    parser.RecordErrorsTo(&silent);
    if (!parser.ParseFieldValueFromString(text, field, at)) {
      return absl::InvalidArgumentError(
          absl::StrCat("'", path, "' cannot be '", value, "': it is a ", field->type_name()));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::pair<std::string, std::string>> ParseAssignment(const std::string& assignment) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("--set '", assignment, "' is not of the form PATH=VALUE"));
  }
  return std::pair(assignment.substr(0, equals), assignment.substr(equals + 1));
}

absl::Status SetFields(Message& message, const std::vector<std::string>& assignments) {
  for (const std::string& assignment : assignments) {
    const auto parsed = ParseAssignment(assignment);
    if (!parsed.ok()) return parsed.status();
    if (absl::Status set = SetField(message, parsed->first, parsed->second); !set.ok()) return set;
  }
  return absl::OkStatus();
}

}  // namespace vantage::cli
