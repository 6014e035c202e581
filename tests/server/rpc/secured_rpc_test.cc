// Who may call what: a server with certificates, tokens, tenants and roles, over real connections.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "google/protobuf/dynamic_message.h"
#include "google/protobuf/util/json_util.h"
#include "server/main/credentials.h"
#include "server/rpc/call/rules.h"
#include "tests/server/fixture/certificates.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/jwt_signer.h"
#include "tests/server/fixture/secured_server.h"

namespace vantage::rpc {
namespace {

using fixture::SecuredServer;
using google::protobuf::DescriptorPool;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using grpc::StatusCode;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Every method of the contract, from its descriptors.
std::vector<const MethodDescriptor*> AllMethods() {
  std::vector<const MethodDescriptor*> methods;
  for (const std::string& name : Services::Names()) {
    const auto* service = DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int i = 0; i < service->method_count(); ++i) methods.push_back(service->method(i));
  }
  return methods;
}

const RpcRule* FindRule(const MethodDescriptor& method) {
  for (const RpcRule& rule : kRpcRules) {
    if (rule.service == method.service()->name() && rule.method == method.name()) return &rule;
  }
  return nullptr;
}

std::unique_ptr<Message> NewRequest(const MethodDescriptor& method) {
  const Message* prototype =
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(method.input_type());
  return std::unique_ptr<Message>(prototype->New());
}

// What a client sends besides its request.
using Metadata = std::multimap<std::string, std::string>;

struct Answer {
  grpc::Status status;
  std::multimap<std::string, std::string> trailers;
};

// Calls any method with one request, and reads one answer.
Answer Call(const std::shared_ptr<grpc::Channel>& channel, const MethodDescriptor& method,
            const Message& request, const Metadata& metadata = {}) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
  for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
  const grpc::Slice slice(request.SerializeAsString());
  const grpc::ByteBuffer sent(&slice, 1);
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(
      &context, absl::StrCat("/", method.service()->full_name(), "/", method.name()), &queue);
  const auto step = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  stream->StartCall(nullptr);
  step();
  stream->WriteLast(sent, grpc::WriteOptions(), nullptr);
  step();
  grpc::ByteBuffer received;
  stream->Read(&received, nullptr);
  // A stream that has begun to speak was let in.
  if (step() && method.server_streaming()) context.TryCancel();
  Answer answer;
  stream->Finish(&answer.status, nullptr);
  step();
  queue.Shutdown();
  step();
  for (const auto& [key, value] : context.GetServerTrailingMetadata()) {
    answer.trailers.emplace(std::string(key.data(), key.size()),
                            std::string(value.data(), value.size()));
  }
  return answer;
}

Metadata Bearer(const std::string& token) { return {{"authorization", "Bearer " + token}}; }

const MethodDescriptor& Method(const std::string& name) {
  const auto* method = DescriptorPool::generated_pool()->FindMethodByName("vantage.v1." + name);
  if (method == nullptr) std::abort();
  return *method;
}

Answer ListSessions(const std::shared_ptr<grpc::Channel>& channel, const Metadata& metadata = {}) {
  return Call(channel, Method("SessionService.ListSessions"), v1::ListSessionsRequest(), metadata);
}

std::string ReasonOf(const Answer& answer) {
  return answer.status.error_details().empty() ? "" : fixture::InfoOf(answer.status).reason();
}

grpc::Status OpenSession(const std::shared_ptr<grpc::Channel>& channel, const std::string& id,
                         const Metadata& metadata) {
  v1::CreateSessionRequest request;
  request.set_session_id(id);
  return Call(channel, Method("SessionService.CreateSession"), request, metadata).status;
}

std::vector<std::string> SessionsSeen(const std::shared_ptr<grpc::Channel>& channel,
                                      const Metadata& metadata) {
  grpc::ClientContext context;
  for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
  v1::ListSessionsResponse response;
  const grpc::Status status = v1::SessionService::NewStub(channel)->ListSessions(
      &context, v1::ListSessionsRequest(), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  std::vector<std::string> names;
  for (const v1::Session& session : response.sessions()) names.push_back(session.name());
  return names;
}

// ---- Every RPC ---------------------------------------------------------------------------------

TEST(Rules, AreOneForEachMethodOfTheContract) {
  const std::vector<const MethodDescriptor*> methods = AllMethods();
  EXPECT_EQ(methods.size(), std::size(kRpcRules));
  for (const MethodDescriptor* method : methods) {
    EXPECT_NE(FindRule(*method), nullptr) << method->full_name();
  }
}

// What only looks has a name that says so, and the other way round.
TEST(Rules, ReadersChangeNothing) {
  for (const RpcRule& rule : kRpcRules) {
    const std::string name(rule.method);
    const bool looks = name.rfind("Get", 0) == 0 || name.rfind("List", 0) == 0 ||
                       name.rfind("Watch", 0) == 0 || name.rfind("Export", 0) == 0 ||
                       name.rfind("Evaluate", 0) == 0 || name.rfind("Compare", 0) == 0 ||
                       name == "CreateTour";  // which nobody keeps
    EXPECT_EQ(rule.mutates, !looks) << name;
    EXPECT_FALSE(rule.needs == auth::Role::kRead && rule.mutates) << name;
  }
}

TEST(Authorizer, NoMethodAnswersAStranger) {
  SecuredServer secured;
  secured.AddToken("tablet museum administer");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  for (const MethodDescriptor* method : AllMethods()) {
    const Answer answer = Call(channel, *method, *NewRequest(*method));
    // The twentieth failure in a row has to wait; either way it is not let in.
    EXPECT_TRUE(answer.status.error_code() == StatusCode::UNAUTHENTICATED ||
                ReasonOf(answer) == "RATE_LIMITED")
        << method->full_name() << ": " << answer.status.error_message();
  }
}

TEST(Authorizer, EachMethodNeedsItsRole) {
  for (const auth::Role role :
       {auth::Role::kRead, auth::Role::kSubmit, auth::Role::kPlan, auth::Role::kAdminister}) {
    SecuredServer secured;
    const std::string token =
        secured.AddToken(absl::StrCat("tablet museum ", auth::RoleName(role)));
    secured.Start(secured.WithCallers());
    const auto channel = secured.Plain();
    for (const MethodDescriptor* method : AllMethods()) {
      const Answer answer = Call(channel, *method, *NewRequest(*method), Bearer(token));
      EXPECT_NE(answer.status.error_code(), StatusCode::UNAUTHENTICATED) << method->full_name();
      EXPECT_EQ(ReasonOf(answer) == "ROLE_MISSING",
                !auth::Roles().With(role).Allow(FindRule(*method)->needs))
          << method->full_name() << " as " << auth::RoleName(role) << ": "
          << answer.status.error_message();
    }
  }
}

// Sets whatever names a resource, in the request or in what it holds; false when nothing does.
bool Name(Message& request, const std::string& session) {
  const std::map<std::string, std::string> children = {
      {"GetUploadRequest", "/uploads/upload-1"},    {"UploadScanRequest", "/uploads/upload-1"},
      {"UploadPieceRequest", "/uploads/upload-1"},  {"GetScanRequest", "/scans/scan-1"},
      {"AcceptScanRequest", "/scans/scan-1"},       {"SetScanPoseRequest", "/scans/scan-1"},
      {"CompareScanPosesRequest", "/scans/scan-1"}, {"WithdrawScanRequest", "/scans/scan-1"},
      {"WatchPlanRequest", "/plans/plan-1"},        {"CancelPlanRequest", "/plans/plan-1"},
      {"GetPlanRequest", "/plans/plan-1"},          {"ReleaseClaimRequest", "/claims/claim-1"},
      {"RenewClaimRequest", "/claims/claim-1"},
  };
  const std::string& type = request.GetDescriptor()->name();
  const auto child = children.find(type);
  const std::string name = session + (child == children.end() ? "" : child->second);
  for (const char* field_name : {"name", "upload", "parent"}) {
    const auto* field = request.GetDescriptor()->FindFieldByName(field_name);
    if (field == nullptr ||
        field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_STRING) {
      continue;
    }
    request.GetReflection()->SetString(&request, field, name);
    return true;
  }
  if (auto* update = dynamic_cast<v1::UpdateSessionRequest*>(&request)) {
    update->mutable_session()->set_name(name);
    return true;
  }
  if (auto* update = dynamic_cast<v1::UpdateScannerRequest*>(&request)) {
    update->mutable_scanner()->set_name(session + "/scanners/red");
    return true;
  }
  return false;
}

// What an error says besides its message, whichever of the two sessions it is about; in no order.
std::multiset<std::string> DetailsOf(const Answer& answer) {
  std::multiset<std::string> details;
  for (const google::protobuf::Any& any : fixture::Details(answer.status)) {
    details.insert(
        absl::StrReplaceAll(any.SerializeAsString(), {{"sessions/job", "sessions/not"}}));
  }
  return details;
}

// To the letter the same answer as for a session that is not there.
TEST(Authorizer, AnotherTenantsSessionIsNotThere) {
  SecuredServer secured;
  const std::string owner = secured.AddToken("tablet museum administer");
  const std::string stranger = secured.AddToken("tablet-2 castle administer");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  ASSERT_TRUE(OpenSession(channel, "job", Bearer(owner)).ok());
  int named = 0;
  for (const MethodDescriptor* method : AllMethods()) {
    const auto request = NewRequest(*method);
    if (!Name(*request, "sessions/job")) continue;
    ++named;
    const Answer there = Call(channel, *method, *request, Bearer(stranger));
    Name(*request, "sessions/not");
    const Answer not_there = Call(channel, *method, *request, Bearer(stranger));
    EXPECT_EQ(there.status.error_code(), not_there.status.error_code()) << method->full_name();
    EXPECT_EQ(absl::StrReplaceAll(there.status.error_message(), {{"sessions/job", "sessions/not"}}),
              not_there.status.error_message());
    EXPECT_EQ(DetailsOf(there), DetailsOf(not_there)) << method->full_name();
    EXPECT_FALSE(there.status.ok()) << method->full_name();
  }
  EXPECT_EQ(named, static_cast<int>(AllMethods().size()) -
                       3);  // all but Create-, Import- and ListSessions
  EXPECT_THAT(SessionsSeen(channel, Bearer(stranger)), IsEmpty());
  EXPECT_THAT(SessionsSeen(channel, Bearer(owner)), ElementsAre("sessions/job"));
}

// Of one tenant, too: who took a claim has it, and administrators may help out.
TEST(Authorizer, AClaimIsItsCallers) {
  SecuredServer secured;
  const std::string red = secured.AddToken("red museum submit,plan,read");
  const std::string blue = secured.AddToken("blue museum submit,plan,read");
  const std::string office = secured.AddToken("office museum administer");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  ASSERT_TRUE(OpenSession(channel, "job", Bearer(red)).ok());
  v1::CreateScannerRequest scanner;
  scanner.set_parent("sessions/job");
  scanner.set_scanner_id("one");
  scanner.mutable_scanner();
  ASSERT_TRUE(
      Call(channel, Method("FleetService.CreateScanner"), scanner, Bearer(red)).status.ok());
  v1::ClaimViewRequest take;
  take.set_parent("sessions/job");
  take.set_scanner("sessions/job/scanners/one");
  take.mutable_position()->set_z(1.5);
  v1::RenewClaimRequest renew;
  v1::ReleaseClaimRequest release;
  const auto take_as = [&](const std::string& token, double x) {
    take.mutable_position()->set_x(x);
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + token);
    v1::ClaimViewResponse response;
    const grpc::Status taken =
        v1::FleetService::NewStub(channel)->ClaimView(&context, take, &response);
    EXPECT_TRUE(taken.ok()) << taken.error_message();
    renew.set_name(response.claim().name());
    release.set_name(response.claim().name());
  };
  const auto renew_as = [&](const std::string& token) {
    return Call(channel, Method("FleetService.RenewClaim"), renew, Bearer(token));
  };
  const auto release_as = [&](const std::string& token) {
    return Call(channel, Method("FleetService.ReleaseClaim"), release, Bearer(token));
  };
  take_as(red, 1);
  for (const Answer& refused : {renew_as(blue), release_as(blue)}) {
    EXPECT_EQ(refused.status.error_code(), StatusCode::PERMISSION_DENIED);
    EXPECT_EQ(ReasonOf(refused), "CLAIM_OF_ANOTHER");
    EXPECT_THAT(refused.status.error_message(), HasSubstr("'red'"));
  }
  EXPECT_TRUE(renew_as(red).status.ok());
  EXPECT_TRUE(renew_as(office).status.ok());
  EXPECT_TRUE(release_as(red).status.ok());
  take_as(red, 5);
  EXPECT_EQ(ReasonOf(release_as(blue)), "CLAIM_OF_ANOTHER");
  EXPECT_TRUE(release_as(office).status.ok());
}

TEST(Authorizer, AnotherTenantsRequestIdMeansNothing) {
  SecuredServer secured;
  const std::string owner = secured.AddToken("tablet museum administer");
  const std::string stranger = secured.AddToken("tablet-2 castle administer");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  v1::CreateSessionRequest request;
  request.set_request_id("same-for-both");
  for (const std::string& token : {owner, stranger}) {
    EXPECT_TRUE(
        Call(channel, Method("SessionService.CreateSession"), request, Bearer(token)).status.ok());
  }
  const std::vector<std::string> first = SessionsSeen(channel, Bearer(owner));
  const std::vector<std::string> second = SessionsSeen(channel, Bearer(stranger));
  ASSERT_EQ(first.size(), 1U);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_NE(first, second);
}

// Ids that are paths, and worse, name nothing.
TEST(Authorizer, IdsThatArePathsAreRefused) {
  SecuredServer secured;
  secured.Start({});
  const auto channel = secured.Plain();
  for (const std::string& id :
       {std::string("../../etc/passwd"), std::string("a/../b"), std::string("/etc"),
        std::string("a\0b", 3), std::string("A"), std::string("a b"), std::string("."),
        std::string(".."), std::string("-a"), std::string("a-"), std::string(64, 'a'),
        std::string("%2e%2e"), std::string("a\nb"), std::string(100'000, 'x')}) {
    v1::CreateSessionRequest create;
    create.set_session_id(id);
    EXPECT_EQ(Call(channel, Method("SessionService.CreateSession"), create).status.error_code(),
              StatusCode::INVALID_ARGUMENT);
    v1::GetScanRequest get;
    get.set_name("sessions/" + id + "/scans/" + id);
    EXPECT_EQ(Call(channel, Method("ScanService.GetScan"), get).status.error_code(),
              StatusCode::INVALID_ARGUMENT);
  }
}

// ---- Tokens ------------------------------------------------------------------------------------

TEST(Tokens, WrongOnesAreRefusedWithTheReason) {
  SecuredServer secured;
  const std::string good = secured.AddToken("tablet museum read");
  const std::string late = secured.AddToken("old museum read", "2020-01-01T00:00:00Z");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  EXPECT_TRUE(ListSessions(channel, Bearer(good)).status.ok());
  EXPECT_TRUE(ListSessions(channel, {{"authorization", "bearer " + good}}).status.ok());
  const std::vector<std::pair<Metadata, std::string>> wrong = {
      {{}, "CREDENTIALS_MISSING"},
      {Bearer(late), "TOKEN_EXPIRED"},
      {Bearer(auth::MakeToken().token), "TOKEN_UNKNOWN"},
      {Bearer(good + "x"), "TOKEN_UNKNOWN"},
      {Bearer(good.substr(1)), "TOKEN_UNKNOWN"},
      {Bearer(""), "TOKEN_UNKNOWN"},
      {{{"authorization", good}}, "TOKEN_UNKNOWN"},
      {{{"authorization", "Basic " + good}}, "TOKEN_UNKNOWN"},
      {{{"authorization", "Bearer " + good}, {"authorization", "Bearer " + good}}, "TOKEN_UNKNOWN"},
  };
  for (const auto& [metadata, reason] : wrong) {
    const Answer answer = ListSessions(channel, metadata);
    EXPECT_EQ(answer.status.error_code(), StatusCode::UNAUTHENTICATED) << reason;
    EXPECT_EQ(ReasonOf(answer), reason);
    EXPECT_THAT(answer.status.error_message(), Not(HasSubstr(good)));
  }
  for (const std::string& line : secured.Lines("call failed"))
    EXPECT_THAT(line, Not(HasSubstr(good)));
}

TEST(Tokens, TakenBackWhileTheServerRuns) {
  SecuredServer secured;
  const std::string token = secured.AddToken("tablet museum read");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  ASSERT_TRUE(ListSessions(channel, Bearer(token)).status.ok());
  secured.WriteCallers("# nobody\n");
  secured.server().RefreshCallers();
  EXPECT_EQ(ReasonOf(ListSessions(channel, Bearer(token))), "TOKEN_UNKNOWN");
  secured.WriteCallers();
  secured.server().RefreshCallers();
  EXPECT_TRUE(ListSessions(channel, Bearer(token)).status.ok());
  // A slip of the pen locks nobody out and lets nobody in; it is said once.
  secured.WriteCallers("nonsense\n");
  secured.server().RefreshCallers();
  secured.server().RefreshCallers();
  EXPECT_TRUE(ListSessions(channel, Bearer(token)).status.ok());
  EXPECT_EQ(secured.Lines("the callers file cannot be used").size(), 1U);
}

// Streams outlast what was shown when they began.
TEST(Tokens, TakenBackWhileAStreamIsOpen) {
  SecuredServer secured;
  const std::string owner = secured.AddToken("office museum administer");
  const std::string tablet = secured.AddToken("tablet museum read");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  ASSERT_TRUE(OpenSession(channel, "job", Bearer(owner)).ok());
  const auto sessions = v1::SessionService::NewStub(channel);
  grpc::ClientContext context;
  for (const auto& [key, value] : Bearer(tablet)) context.AddMetadata(key, value);
  v1::WatchSessionRequest watch;
  watch.set_name("sessions/job");
  const auto stream = sessions->WatchSession(&context, watch);
  v1::WatchSessionResponse step;
  ASSERT_TRUE(stream->Read(&step));
  secured.WriteCallersBut("tablet");
  secured.server().RefreshCallers();
  grpc::ClientContext updating;
  for (const auto& [key, value] : Bearer(owner)) updating.AddMetadata(key, value);
  v1::UpdateSessionRequest update;
  update.mutable_session()->set_name("sessions/job");
  update.mutable_session()->set_display_name("renamed");
  update.mutable_update_mask()->add_paths("display_name");
  v1::UpdateSessionResponse updated;
  const grpc::Status done = sessions->UpdateSession(&updating, update, &updated);
  ASSERT_TRUE(done.ok()) << done.error_message();
  EXPECT_FALSE(stream->Read(&step)) << "what happened since is told: " << step.DebugString();
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::UNAUTHENTICATED);
}

// An upload that sends nothing is told the time now and then, and has to end there.
TEST(Tokens, TakenBackWhileAnUploadRests) {
  SecuredServer secured;
  const std::string tablet = secured.AddToken("tablet museum submit");
  server::ServerOptions options = secured.WithCallers();
  options.heartbeat = std::chrono::milliseconds(20);
  secured.Start(options);
  const auto scans = v1::ScanService::NewStub(secured.Plain());
  grpc::ClientContext context;
  for (const auto& [key, value] : Bearer(tablet)) context.AddMetadata(key, value);
  const auto stream = scans->UploadScan(&context);
  v1::UploadScanResponse told;
  ASSERT_TRUE(stream->Read(&told));
  secured.WriteCallersBut("tablet");
  secured.server().RefreshCallers();
  // One that goes on is cut off here.
  constexpr int kBeats = 100;
  for (int beats = 0; stream->Read(&told); ++beats) {
    if (beats == kBeats) context.TryCancel();
  }
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(fixture::InfoOf(status).reason(), "CREDENTIALS_WITHDRAWN");
}

// It is noticed without being told.
TEST(Tokens, TheFileIsWatched) {
  SecuredServer secured;
  const std::string token = secured.AddToken("tablet museum read");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  secured.WriteCallers("# nobody\n");
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (ListSessions(channel, Bearer(token)).status.ok()) {
    ASSERT_LT(std::chrono::steady_clock::now(), until);
  }
}

// ---- JWTs --------------------------------------------------------------------------------------

std::string JwtClaims(const std::string& subject, const std::string& tenant,
                      const std::string& roles, absl::Duration left = absl::Hours(1)) {
  return absl::StrCat(R"({"iss":"https://login.example","aud":"vantage","sub":")", subject,
                      R"(","tenant":")", tenant, R"(","roles":")", roles, R"(","exp":)",
                      absl::ToUnixSeconds(absl::Now() + left), "}");
}

TEST(Jwts, WrongOnesAreRefusedWithTheReasonAndNeverShown) {
  SecuredServer secured;
  const fixture::JwtSigner signer("P-256", "k");
  const fixture::JwtSigner forger("P-256", "k");
  secured.Start(secured.WithJwts(signer.KeySet()));
  const auto channel = secured.Plain();
  const std::string claims = JwtClaims("anna", "museum", "read");
  const std::string good = signer.Token(claims);
  EXPECT_TRUE(ListSessions(channel, Bearer(good)).status.ok());
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {forger.Token(claims), "TOKEN_UNKNOWN"},
      {good.substr(0, good.rfind('.') + 1), "TOKEN_UNKNOWN"},
      {signer.Token(JwtClaims("anna", "museum", "read", -absl::Minutes(1))), "TOKEN_EXPIRED"},
      {signer.Token(absl::StrReplaceAll(claims, {{"vantage", "wiki"}})), "TOKEN_UNFIT"},
      {signer.Token(JwtClaims("anna", "*", "administer")), "TOKEN_UNFIT"},
  };
  for (const auto& [token, reason] : wrong) {
    const Answer answer = ListSessions(channel, Bearer(token));
    EXPECT_EQ(answer.status.error_code(), StatusCode::UNAUTHENTICATED) << reason;
    EXPECT_EQ(ReasonOf(answer), reason);
    EXPECT_THAT(answer.status.error_message(), Not(HasSubstr(token.substr(0, 20))));
  }
  const auto denied = OpenSession(channel, "job", Bearer(good));
  EXPECT_EQ(denied.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(denied.error_message(), HasSubstr("'jwt:anna'"));
  EXPECT_EQ(secured.Lines("call failed").size(), wrong.size() + 1);
  for (const std::string& line : secured.Lines("{")) {
    EXPECT_THAT(line, Not(HasSubstr(good.substr(0, 20))));
  }
}

// A tenant's sessions are its own whoever vouches for its callers; a claim is its subject's, also
// with a new token, and no name of the callers file can be such a subject.
TEST(Jwts, NameTenantsAndCallersLikeTheCallersFile) {
  SecuredServer secured;
  const fixture::JwtSigner signer("Ed25519", "k");
  const std::string tablet = secured.AddToken("anna museum submit,plan,read");
  server::ServerOptions options = secured.WithJwts(signer.KeySet());
  options.access.callers_file = secured.WithCallers().access.callers_file;
  secured.Start(options);
  const auto channel = secured.Plain();
  const std::string anna = signer.Token(JwtClaims("anna", "museum", "submit plan read"));
  ASSERT_TRUE(OpenSession(channel, "job", Bearer(anna)).ok());
  EXPECT_THAT(SessionsSeen(channel, Bearer(tablet)), ElementsAre("sessions/job"));
  const std::string stranger = signer.Token(JwtClaims("anna", "castle", "administer"));
  EXPECT_THAT(SessionsSeen(channel, Bearer(stranger)), IsEmpty());

  v1::CreateScannerRequest scanner;
  scanner.set_parent("sessions/job");
  scanner.set_scanner_id("one");
  scanner.mutable_scanner();
  ASSERT_TRUE(
      Call(channel, Method("FleetService.CreateScanner"), scanner, Bearer(anna)).status.ok());
  v1::ClaimViewRequest take;
  take.set_parent("sessions/job");
  take.set_scanner("sessions/job/scanners/one");
  take.mutable_position()->set_z(1.5);
  ASSERT_TRUE(Call(channel, Method("FleetService.ClaimView"), take, Bearer(anna)).status.ok());
  v1::RenewClaimRequest renew;
  renew.set_name("sessions/job/claims/claim-1");
  const auto renew_as = [&](const std::string& token) {
    return ReasonOf(Call(channel, Method("FleetService.RenewClaim"), renew, Bearer(token)));
  };
  EXPECT_EQ(renew_as(tablet), "CLAIM_OF_ANOTHER");
  EXPECT_EQ(renew_as(signer.Token(JwtClaims("ben", "museum", "plan"))), "CLAIM_OF_ANOTHER");
  EXPECT_EQ(renew_as(signer.Token(JwtClaims("anna", "museum", "plan", absl::Hours(2)))), "");
  EXPECT_THAT(secured.Lines("\"method\":\"ClaimView\"")[0], HasSubstr("\"caller\":\"jwt:anna\""));
}

TEST(Jwts, AStreamEndsWithItsTokenOrItsKey) {
  for (const bool key_leaves : {false, true}) {
    SecuredServer secured;
    const fixture::JwtSigner signer("P-384", "k");
    const fixture::JwtSigner watchers("P-256", "watchers");
    const std::string both = absl::StrCat("{\"keys\":[", signer.Jwk(), ",", watchers.Jwk(), "]}");
    secured.Start(secured.WithJwts(both));
    const auto channel = secured.Plain();
    const Metadata owner = Bearer(signer.Token(JwtClaims("anna", "museum", "administer")));
    ASSERT_TRUE(OpenSession(channel, "job", owner).ok());
    const absl::Time end = absl::Now() + absl::Seconds(3);
    grpc::ClientContext context;
    for (const auto& [key, value] : Bearer(watchers.Token(
             JwtClaims("ben", "museum", "read", key_leaves ? absl::Hours(1) : absl::Seconds(3))))) {
      context.AddMetadata(key, value);
    }
    v1::WatchSessionRequest watch;
    watch.set_name("sessions/job");
    const auto stream = v1::SessionService::NewStub(channel)->WatchSession(&context, watch);
    v1::WatchSessionResponse step;
    ASSERT_TRUE(stream->Read(&step));
    if (key_leaves) {
      secured.WriteJwtKeys("nonsense");
      secured.server().RefreshJwtKeys();
      secured.server().RefreshJwtKeys();
      EXPECT_EQ(secured.Lines("the JWT keys cannot be used").size(), 1U);
      secured.WriteJwtKeys(signer.KeySet());
      secured.server().RefreshJwtKeys();
    } else {
      absl::SleepFor(end - absl::Now());
    }
    v1::UpdateSessionRequest update;
    update.mutable_session()->set_name("sessions/job");
    update.mutable_session()->set_display_name("renamed");
    update.mutable_update_mask()->add_paths("display_name");
    ASSERT_TRUE(Call(channel, Method("SessionService.UpdateSession"), update, owner).status.ok());
    EXPECT_FALSE(stream->Read(&step)) << step.DebugString();
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(status.error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(fixture::InfoOf(status).reason(),
              key_leaves ? "CREDENTIALS_WITHDRAWN" : "TOKEN_EXPIRED");
  }
}

// ---- Certificates ------------------------------------------------------------------------------

TEST(Certificates, SayWhoCalls) {
  SecuredServer secured;
  secured.AddLine("office museum administer certificate:office.example");
  secured.AddLine("by-name castle read certificate:Tablet-7");
  server::ServerOptions options = secured.WithCallers();
  secured.Encrypt(options, true);
  secured.Start(options);
  const fixture::CertifiedKey office = secured.authority().Issue("whatever", "DNS:office.example");
  const fixture::CertifiedKey named = secured.authority().Issue("Tablet-7");
  const fixture::CertifiedKey unknown =
      secured.authority().Issue("Tablet-8", "DNS:office.example.evil");
  EXPECT_TRUE(OpenSession(secured.Encrypted(&office), "job", {}).ok());
  EXPECT_THAT(SessionsSeen(secured.Encrypted(&named), {}), IsEmpty());
  EXPECT_EQ(OpenSession(secured.Encrypted(&named), "other", {}).error_code(),
            StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ReasonOf(ListSessions(secured.Encrypted(&unknown))), "CERTIFICATE_UNKNOWN");

  // Those that nobody signed, that others signed, that are past their time, or that are not there
  // don't get as far as a call.
  const fixture::TestAuthority others("test authority");
  const fixture::CertifiedKey forged = others.Issue("whatever", "DNS:office.example");
  const fixture::CertifiedKey late =
      secured.authority().Issue("whatever", "DNS:office.example", -absl::Minutes(1));
  for (const fixture::CertifiedKey* bad :
       {&forged, &late, static_cast<const fixture::CertifiedKey*>(nullptr)}) {
    EXPECT_EQ(ListSessions(secured.Encrypted(bad)).status.error_code(), StatusCode::UNAVAILABLE);
  }
  EXPECT_EQ(ListSessions(secured.Plain()).status.error_code(), StatusCode::UNAVAILABLE);
}

TEST(Certificates, AloneLetInWhoeverTheAuthoritySigned) {
  SecuredServer secured;
  server::ServerOptions options;
  secured.Encrypt(options, true);
  secured.Start(options);
  const fixture::CertifiedKey one = secured.authority().Issue("one");
  EXPECT_TRUE(OpenSession(secured.Encrypted(&one), "job", {}).ok());
  EXPECT_EQ(ListSessions(secured.Encrypted()).status.error_code(), StatusCode::UNAVAILABLE);
}

TEST(Certificates, OrTokensWhereThatIsAllowed) {
  SecuredServer secured;
  const std::string token = secured.AddToken("tablet museum read");
  secured.AddLine("office museum administer certificate:office.example");
  server::ServerOptions options = secured.WithCallers();
  secured.Encrypt(options, true);
  options.access.tls_optional_client_certificates = true;
  secured.Start(options);
  const fixture::CertifiedKey office = secured.authority().Issue("whatever", "DNS:office.example");
  EXPECT_TRUE(OpenSession(secured.Encrypted(&office), "job", {}).ok());
  EXPECT_TRUE(ListSessions(secured.Encrypted(), Bearer(token)).status.ok());
  EXPECT_EQ(ReasonOf(ListSessions(secured.Encrypted())), "CREDENTIALS_MISSING");
  const fixture::TestAuthority others("test authority");
  const fixture::CertifiedKey forged = others.Issue("whatever", "DNS:office.example");
  EXPECT_FALSE(OpenSession(secured.Encrypted(&forged), "forged", {}).ok());
  // Whoever shows both is who the token says.
  EXPECT_EQ(OpenSession(secured.Encrypted(&office), "both", Bearer(token)).error_code(),
            StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ReasonOf(ListSessions(secured.Encrypted(&office), Bearer("made up"))), "TOKEN_UNKNOWN");
}

// Replaced on disk, new connections see the new one; the server did not stop, nor did it take a new
// certificate with the old key.
TEST(Certificates, AreReadAgain) {
  SecuredServer secured;
  const std::string token = secured.AddToken("tablet museum read");
  server::ServerOptions options = secured.WithCallers();
  secured.Encrypt(options, false);
  secured.Start(options);
  ASSERT_TRUE(ListSessions(secured.Encrypted(), Bearer(token)).status.ok());
  // Signed by another authority, which a client has to trust to get through.
  const fixture::TestAuthority next("next authority");
  const fixture::CertifiedKey own = next.Issue("server", "IP:127.0.0.1");
  fixture::WriteTestFile(secured.File("cert.pem"), own.certificate);
  const auto both_seen = std::chrono::steady_clock::now() + std::chrono::seconds(8);
  while (std::chrono::steady_clock::now() < both_seen) {
    ASSERT_TRUE(ListSessions(secured.Encrypted(), Bearer(token)).status.ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_EQ(secured.Lines("the certificates on disk cannot be used").size(), 1);
  fixture::WriteTestFile(secured.File("key.pem"), own.key);
  grpc::SslCredentialsOptions tls;
  tls.pem_root_certs = next.certificate();
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (true) {
    grpc::ChannelArguments fresh;
    fresh.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto channel = grpc::CreateCustomChannel(
        absl::StrCat("127.0.0.1:", secured.server().port()), grpc::SslCredentials(tls), fresh);
    if (ListSessions(channel, Bearer(token)).status.ok()) break;
    ASSERT_LT(std::chrono::steady_clock::now(), until);
  }
  EXPECT_EQ(ListSessions(secured.Encrypted(), Bearer(token)).status.error_code(),
            StatusCode::UNAVAILABLE);
}

// ---- Tenants named by a proxy ------------------------------------------------------------------

TEST(Proxy, NamesTheTenantOfEachCall) {
  SecuredServer secured;
  const std::string proxy = secured.AddToken("proxy * administer");
  const std::string tablet = secured.AddToken("tablet museum administer");
  server::ServerOptions options = secured.WithCallers();
  options.access.tenant_metadata = "x-tenant";
  secured.Start(options);
  const auto channel = secured.Plain();
  const auto as = [](const std::string& token, const std::string& tenant) {
    Metadata metadata = Bearer(token);
    metadata.emplace("x-tenant", tenant);
    return metadata;
  };
  ASSERT_TRUE(OpenSession(channel, "museum-job", as(proxy, "museum")).ok());
  ASSERT_TRUE(OpenSession(channel, "castle-job", as(proxy, "castle")).ok());
  EXPECT_THAT(SessionsSeen(channel, as(proxy, "castle")), ElementsAre("sessions/castle-job"));
  // Nobody else can.
  EXPECT_THAT(SessionsSeen(channel, as(tablet, "castle")), ElementsAre("sessions/museum-job"));
  // Not naming one is no way to see them all, nor is naming two.
  EXPECT_EQ(ReasonOf(ListSessions(channel, Bearer(proxy))), "TENANT_MISSING");
  EXPECT_EQ(ReasonOf(ListSessions(channel, as(proxy, ""))), "TENANT_MISSING");
  Metadata two = as(proxy, "museum");
  two.emplace("x-tenant", "castle");
  EXPECT_EQ(ReasonOf(ListSessions(channel, two)), "TENANT_AMBIGUOUS");
}

TEST(Proxy, IsHeededOnlyWhereTheOperatorSaidSo) {
  SecuredServer secured;
  const std::string proxy = secured.AddToken("proxy * administer");
  secured.Start(secured.WithCallers());
  Metadata metadata = Bearer(proxy);
  metadata.emplace("x-tenant", "museum");
  EXPECT_EQ(ReasonOf(ListSessions(secured.Plain(), metadata)), "TENANT_MISSING");
}

// ---- Limits, audit, addresses ------------------------------------------------------------------

TEST(RateLimit, TellsWhoCallsTooOftenWhenToComeBack) {
  SecuredServer secured;
  const std::string greedy = secured.AddToken("greedy museum read");
  const std::string modest = secured.AddToken("modest museum read");
  server::ServerOptions options = secured.WithCallers();
  options.access.calls_per_second = 0.01;
  options.access.calls_at_once = 3;
  secured.Start(options);
  const auto channel = secured.Plain();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(ListSessions(channel, Bearer(greedy)).status.ok());
  const Answer refused = ListSessions(channel, Bearer(greedy));
  EXPECT_EQ(refused.status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(refused), "RATE_LIMITED");
  bool has_delay = false;
  for (const google::protobuf::Any& any : fixture::Details(refused.status)) {
    google::rpc::RetryInfo retry;
    if (!any.UnpackTo(&retry)) continue;
    has_delay = true;
    EXPECT_GT(retry.retry_delay().seconds(), 50);
    EXPECT_LE(retry.retry_delay().seconds(), 100);
  }
  EXPECT_TRUE(has_delay);
  EXPECT_EQ(refused.trailers.count("grpc-retry-pushback-ms"), 1U);
  EXPECT_TRUE(ListSessions(channel, Bearer(modest)).status.ok());
}

TEST(RateLimit, StrangersFillNoLog) {
  SecuredServer secured;
  const std::string good = secured.AddToken("tablet museum read");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  for (int i = 0; i < 200; ++i) {
    EXPECT_FALSE(ListSessions(channel, Bearer("made up")).status.ok());
  }
  EXPECT_LT(secured.Lines("call failed").size(), 100U);
  // From the same address, who is known is not held up by them.
  EXPECT_TRUE(ListSessions(channel, Bearer(good)).status.ok());
}

TEST(AuditLog, HasALineForEveryMutationTriedAndNoneForReads) {
  SecuredServer secured;
  const std::string token = secured.AddToken("tablet museum read,submit");
  secured.Start(secured.WithCallers());
  const auto channel = secured.Plain();
  for (const MethodDescriptor* method : AllMethods()) {
    const auto request = NewRequest(*method);
    // Where nothing is named, what was made is.
    const bool named =
        Name(*request, "sessions/job-of-nobody") || method->name() == "CreateSession";
    Metadata metadata = Bearer(token);
    metadata.emplace("traceparent", "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01");
    Call(channel, *method, *request, metadata);
    std::vector<std::string> lines = secured.Lines("\"message\":\"audit\"");
    std::erase_if(lines, [&](const std::string& line) {
      return line.find(absl::StrCat("\"method\":\"", method->name(), "\"")) == std::string::npos;
    });
    EXPECT_EQ(lines.size(), FindRule(*method)->mutates ? 1U : 0U) << method->full_name();
    for (const std::string& line : lines) {
      EXPECT_THAT(line, HasSubstr("\"caller\":\"tablet\",\"tenant\":\"museum\""));
      EXPECT_THAT(line, HasSubstr("\"peer\":\"ipv4:127.0.0.1:"));
      EXPECT_THAT(line, HasSubstr("\"trace_id\":\"0af7651916cd43dd8448eb211c80319c\""));
      EXPECT_THAT(line, HasSubstr(named ? "\"resource\":\"sessions/" : "\"resource\":\"\""));
      EXPECT_THAT(line, HasSubstr("\"code\":\""));
    }
  }
}

// Who deletes is on record with what that leaves behind.
TEST(AuditLog, SaysWhenBackupsForgetWhatWasDeleted) {
  SecuredServer secured;
  const std::string token = secured.AddToken("office museum administer");
  server::ServerOptions options = secured.WithCallers();
  options.limits.keep_backups = absl::Hours(24 * 90);
  secured.Start(options);
  const auto channel = secured.Plain();
  ASSERT_TRUE(OpenSession(channel, "job", Bearer(token)).ok());
  v1::DeleteSessionRequest request;
  request.set_name("sessions/job");
  const std::string day =
      absl::FormatTime("%Y-%m-%d", absl::Now() + absl::Hours(24 * 90), absl::UTCTimeZone());
  ASSERT_TRUE(
      Call(channel, Method("SessionService.DeleteSession"), request, Bearer(token)).status.ok());
  const std::vector<std::string> deleted = secured.Lines("\"method\":\"DeleteSession\"");
  ASSERT_EQ(deleted.size(), 1U);
  EXPECT_THAT(deleted[0], HasSubstr("\"backups_forget_time\":\"" + day));
  EXPECT_THAT(secured.Lines("\"method\":\"CreateSession\"")[0], Not(HasSubstr("backups_forget")));
}

TEST(AuditLog, CutsLongNamesWhereACharacterEnds) {
  SecuredServer secured;
  const std::string token = secured.AddToken("tablet museum read,submit");
  secured.Start(secured.WithCallers());
  v1::DeleteSessionRequest request;
  std::string umlauts;
  for (int i = 0; i < 200; ++i) umlauts += "\xC3\xBC";
  request.set_name("sessions/" + umlauts);
  const auto stub = v1::SessionService::NewStub(secured.Plain());
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + token);
  v1::DeleteSessionResponse response;
  EXPECT_FALSE(stub->DeleteSession(&context, request, &response).ok());
  const std::vector<std::string> lines = secured.Lines("\"message\":\"audit\"");
  ASSERT_EQ(lines.size(), 1U);
  // 200 bytes end within the 96th.
  EXPECT_THAT(lines[0], HasSubstr("\"resource\":\"sessions/" + umlauts.substr(0, 2 * 95) + "\""));
}

TEST(Addresses, OthersThanLoopbackNeedEncryptionAndCallers) {
  SecuredServer secured;
  secured.AddToken("tablet museum read");
  server::ServerOptions callers = secured.WithCallers();
  const auto refusal = [](const auth::AccessOptions& access) {
    return std::string(server::MakeCredentials(access, {"0.0.0.0:7464"}).status().message());
  };
  EXPECT_THAT(refusal({}), HasSubstr("nothing would be encrypted"));
  EXPECT_THAT(refusal(callers.access), HasSubstr("nothing would be encrypted"));
  server::ServerOptions encrypted;
  secured.Encrypt(encrypted, false);
  EXPECT_THAT(refusal(encrypted.access), HasSubstr("anyone could call"));
  encrypted.access.tenant_metadata = "x-tenant";  // which anyone can send
  EXPECT_THAT(refusal(encrypted.access), HasSubstr("anyone could call"));
  encrypted.access.tenant_metadata.clear();
  encrypted.access.callers_file = callers.access.callers_file;
  EXPECT_TRUE(server::MakeCredentials(encrypted.access, {"0.0.0.0:7464"}).ok());
  encrypted.access.callers_file.clear();
  encrypted.access.jwt = secured.WithJwts("").access.jwt;
  EXPECT_TRUE(server::MakeCredentials(encrypted.access, {"0.0.0.0:7464"}).ok());
  for (std::string auth::JwtOptions::*needed :
       {&auth::JwtOptions::keys_file, &auth::JwtOptions::issuer, &auth::JwtOptions::audience}) {
    auth::AccessOptions lacking = encrypted.access;
    (lacking.jwt.*needed).clear();
    EXPECT_THAT(refusal(lacking), HasSubstr("--jwt-audience need one another"));
  }
  encrypted.access.jwt = {};
  encrypted.access.tls_client_ca = secured.File("ca.pem");
  EXPECT_TRUE(server::MakeCredentials(encrypted.access, {"0.0.0.0:7464"}).ok());
  auth::AccessOptions out_loud;
  out_loud.allow_insecure_remote = true;
  EXPECT_TRUE(server::MakeCredentials(out_loud, {"0.0.0.0:7464"}).ok());
}

TEST(Addresses, FilesThatCannotServeAreNamedAtTheStart) {
  SecuredServer secured;
  server::ServerOptions options;
  secured.Encrypt(options, true);
  const auto refusal = [&](const std::string& file, const std::string& text) {
    secured.Encrypt(options, true);
    fixture::WriteTestFile(secured.File(file), text);
    const absl::Status status = server::MakeCredentials(options.access, {"127.0.0.1:0"}).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    return std::string(status.message());
  };
  const fixture::CertifiedKey other = secured.authority().Issue("other");
  EXPECT_THAT(refusal("cert.pem", "nonsense"), HasSubstr("cert.pem holds no certificate"));
  EXPECT_THAT(refusal("key.pem", ""), HasSubstr("key.pem holds no key"));
  EXPECT_THAT(refusal("key.pem", other.key), HasSubstr("is not the key of the certificate"));
  EXPECT_THAT(refusal("ca.pem", other.key), HasSubstr("ca.pem holds no certificate"));
  const fixture::CertifiedKey late = secured.authority().Issue("server", "", -absl::Minutes(1));
  fixture::WriteTestFile(secured.File("key.pem"), late.key);
  fixture::WriteTestFile(secured.File("ca.pem"), secured.authority().certificate());
  fixture::WriteTestFile(secured.File("cert.pem"), late.certificate);
  EXPECT_THAT(
      std::string(server::MakeCredentials(options.access, {"127.0.0.1:0"}).status().message()),
      HasSubstr("cert.pem has expired"));
  options.access.tls_key.clear();
  EXPECT_FALSE(server::MakeCredentials(options.access, {"127.0.0.1:0"}).ok());
}

}  // namespace
}  // namespace vantage::rpc
