#include "server/web/connect/error.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/contract/error.h"

namespace vantage::web {
namespace {

using nlohmann::json;

// As the protocol's page has them: https://connectrpc.com/docs/protocol, 'Error codes'.
const std::map<std::string, int> kStatusByCode = {
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

TEST(ConnectError, EveryCodeHasItsNameAndItsStatus) {
  std::set<std::string> seen;
  for (int code = 1; code <= 16; ++code) {
    const std::string name(CodeName(static_cast<grpc::StatusCode>(code)));
    ASSERT_TRUE(kStatusByCode.contains(name)) << name;
    EXPECT_EQ(HttpStatusOf(static_cast<grpc::StatusCode>(code)), kStatusByCode.at(name)) << name;
    seen.insert(name);
  }
  EXPECT_EQ(seen.size(), 16);
  // As absl names them, but for one, which the protocol spells in American.
  EXPECT_EQ(CodeName(grpc::StatusCode::DATA_LOSS), "data_loss");
  EXPECT_EQ(CodeName(grpc::StatusCode::CANCELLED), "canceled");
  EXPECT_EQ(CodeName(static_cast<grpc::StatusCode>(17)), "unknown");
  EXPECT_EQ(CodeName(static_cast<grpc::StatusCode>(-1)), "unknown");
}

TEST(ConnectError, DetailsAreSentAsTheyAreAndInWords) {
  absl::Status status = contract::ResourceNotFound("vantage/Scan", "sessions/a/scans/b");
  const json sent = json::parse(ErrorJson(OwnError(status)));
  EXPECT_EQ(sent["code"], "not_found");
  std::map<std::string, json> details;
  for (const json& detail : sent["details"]) details[detail["type"]] = detail;
  ASSERT_TRUE(details.contains("google.rpc.ResourceInfo"));
  const json& resource = details["google.rpc.ResourceInfo"];
  EXPECT_EQ(resource["debug"]["resourceName"], "sessions/a/scans/b");
  std::string bytes;
  const std::string value = resource["value"];
  EXPECT_EQ(value.find('='), std::string::npos) << "unpadded";
  ASSERT_TRUE(absl::Base64Unescape(value, &bytes));
  google::rpc::ResourceInfo info;
  ASSERT_TRUE(info.ParseFromString(bytes));
  EXPECT_EQ(info.resource_name(), "sessions/a/scans/b");
  EXPECT_TRUE(details.contains("google.rpc.ErrorInfo"));
}

TEST(ConnectError, WhatIsNoTextOrOfNoKnownTypeDoesNoHarm) {
  google::rpc::Status with_details;
  google::protobuf::Any& unknown = *with_details.add_details();
  unknown.set_type_url("type.googleapis.com/nobody.knows.This");
  unknown.set_value("\xff\xfe");
  google::protobuf::Any& damaged = *with_details.add_details();
  damaged.set_type_url("type.googleapis.com/google.rpc.ErrorInfo");
  damaged.set_value("\xff\xff\xff");
  const grpc::Status status(grpc::StatusCode::INTERNAL, "half a character: \xc3",
                            with_details.SerializeAsString());
  const json sent = json::parse(ErrorJson(status));
  ASSERT_EQ(sent["details"].size(), 2);
  EXPECT_EQ(sent["details"][0]["type"], "nobody.knows.This");
  EXPECT_EQ(sent["details"][0]["value"], "//4");
  EXPECT_EQ(sent["details"][1]["value"], "////");
  const grpc::Status garbled(grpc::StatusCode::INTERNAL, "m", "no message at all");
  EXPECT_EQ(json::parse(ErrorJson(garbled))["code"], "internal");
}

TEST(ConnectError, AStreamEndsWithItsErrorOrNone) {
  EXPECT_EQ(EndOfStreamJson(grpc::Status::OK), "{}");
  const json end = json::parse(EndOfStreamJson({grpc::StatusCode::UNAVAILABLE, "later"}));
  EXPECT_EQ(end["error"]["code"], "unavailable");
  EXPECT_EQ(end["error"]["message"], "later");
}

}  // namespace
}  // namespace vantage::web
