#include "server/web/connect/transcoding.h"

#include "absl/strings/str_cat.h"
#include "google/protobuf/util/json_util.h"
#include "google/protobuf/util/type_resolver_util.h"
#include "server/contract/whole_characters.h"

namespace vantage::web {
namespace {

namespace util = google::protobuf::util;

constexpr char kTypePrefix[] = "type.googleapis.com";
// Of what the library says, which quotes what was sent.
constexpr size_t kMaxWords = 400;

util::TypeResolver& Resolver() {
  static util::TypeResolver& resolver = *util::NewTypeResolverForDescriptorPool(
      kTypePrefix, google::protobuf::DescriptorPool::generated_pool());
  return resolver;
}

std::string UrlOf(const google::protobuf::Descriptor& type) {
  return absl::StrCat(kTypePrefix, "/", type.full_name());
}

}  // namespace

absl::StatusOr<std::string> BinaryOf(const google::protobuf::Descriptor& type,
                                     const std::string& json) {
  std::string binary;
  const auto status = util::JsonToBinaryString(&Resolver(), UrlOf(type), json, &binary);
  if (status.ok()) return binary;
  const std::string words(status.message().data(), status.message().size());
  return absl::InvalidArgumentError(absl::StrCat(
      "the request is no ", type.name(),
      " in JSON: ", contract::WholeCharacters(words, std::min(words.size(), kMaxWords))));
}

absl::StatusOr<std::string> JsonOf(const google::protobuf::Descriptor& type,
                                   const std::string& binary) {
  std::string json;
  const auto status = util::BinaryToJsonString(&Resolver(), UrlOf(type), binary, &json);
  if (status.ok()) return json;
  return absl::InternalError(absl::StrCat("a ", type.name(), " cannot be told in JSON"));
}

}  // namespace vantage::web
