#include "server/web/connect/error.h"

#include <iterator>
#include <utility>

#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "absl/strings/strip.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/util/json_util.h"
#include "google/protobuf/util/type_resolver_util.h"
#include "google/rpc/status.pb.h"
#include "server/rpc/call/status.h"
#include "server/web/connect/transcoding.h"

namespace vantage::web {
namespace {

using Json = nlohmann::ordered_json;

struct CodeRow {
  absl::string_view name;
  int http_status;
};

// By number: https://connectrpc.com/docs/protocol, 'Error codes'.
constexpr CodeRow kCodes[] = {
    {"ok", 200},
    {"canceled", 499},
    {"unknown", 500},
    {"invalid_argument", 400},
    {"deadline_exceeded", 504},
    {"not_found", 404},
    {"already_exists", 409},
    {"permission_denied", 403},
    {"resource_exhausted", 429},
    {"failed_precondition", 400},
    {"aborted", 409},
    {"out_of_range", 400},
    {"unimplemented", 501},
    {"internal", 500},
    {"unavailable", 503},
    {"data_loss", 500},
    {"unauthenticated", 401},
};

const CodeRow& RowOf(grpc::StatusCode code) {
  const auto number = static_cast<size_t>(code);
  // 0 is no error; whoever asks for its name as one has not looked.
  return number == 0 || number >= std::size(kCodes) ? kCodes[grpc::StatusCode::UNKNOWN]
                                                    : kCodes[number];
}

Json DetailJson(const google::protobuf::Any& detail) {
  absl::string_view type = detail.type_url();
  absl::ConsumePrefix(&type, "type.googleapis.com/");
  // Base64 without padding, as the protocol asks for.
  std::string value = absl::Base64Escape(detail.value());
  value.erase(value.find_last_not_of('=') + 1);
  Json json{{"type", std::string(type)}, {"value", value}};
  const auto* known =
      google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(std::string(type));
  if (known == nullptr) return json;
  const absl::StatusOr<std::string> words = JsonOf(*known, detail.value());
  if (!words.ok()) return json;
  Json debug = Json::parse(*words, nullptr, false);
  if (!debug.is_discarded()) json["debug"] = std::move(debug);
  return json;
}

Json AsJson(const grpc::Status& status) {
  Json json{{"code", std::string(CodeName(status.error_code()))},
            {"message", status.error_message()}};
  google::rpc::Status with_details;
  if (status.error_details().empty() || !with_details.ParseFromString(status.error_details())) {
    return json;
  }
  for (const google::protobuf::Any& detail : with_details.details()) {
    json["details"].push_back(DetailJson(detail));
  }
  return json;
}

std::string TextOf(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

absl::string_view CodeName(grpc::StatusCode code) { return RowOf(code).name; }

int HttpStatusOf(grpc::StatusCode code) { return RowOf(code).http_status; }

std::string ErrorJson(const grpc::Status& status) { return TextOf(AsJson(status)); }

std::string EndOfStreamJson(const grpc::Status& status) {
  if (status.ok()) return "{}";
  return TextOf({{"error", AsJson(status)}});
}

grpc::Status OwnError(const absl::Status& status) { return rpc::WithDetails(status).status; }

}  // namespace vantage::web
