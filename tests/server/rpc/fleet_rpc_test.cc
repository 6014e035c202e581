// CreateScanner, ListScanners, ClaimView, RenewClaim, ReleaseClaim, ListClaims; a plan for a fleet.
#include <gtest/gtest.h>

#include <string>

#include "tests/server/fixture/in_process.h"

namespace vantage::rpc {
namespace {

TEST(FleetRpc, AScannerClaimsRenewsAndGivesBack) {
  fixture::Script script;
  script.EndPlans();
  fixture::InProcess server(script.Make());
  const std::string session = server.OpenRoom("job");
  v1::CreateScannerRequest add;
  add.set_parent(session);
  add.set_scanner_id("red");
  add.mutable_scanner();
  for (const char* id : {"red", "blue"}) {
    grpc::ClientContext context;
    v1::CreateScannerResponse added;
    add.set_scanner_id(id);
    ASSERT_TRUE(server.fleet->CreateScanner(&context, add, &added).ok());
    EXPECT_EQ(added.scanner().name(), session + "/scanners/" + id);
  }
  std::string token;
  std::string names;
  do {
    grpc::ClientContext context;
    v1::ListScannersRequest request;
    request.set_parent(session);
    request.set_page_size(1);
    request.set_page_token(token);
    v1::ListScannersResponse page;
    ASSERT_TRUE(server.fleet->ListScanners(&context, request, &page).ok());
    for (const v1::Scanner& scanner : page.scanners()) names += scanner.name() + " ";
    token = page.next_page_token();
  } while (!token.empty());
  EXPECT_EQ(names, session + "/scanners/red " + session + "/scanners/blue ");

  v1::ClaimViewRequest claim;
  claim.set_parent(session);
  claim.set_scanner(session + "/scanners/red");
  claim.mutable_position()->set_z(1.5);
  v1::ClaimViewResponse claimed;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(server.fleet->ClaimView(&context, claim, &claimed).ok());
  }
  {
    grpc::ClientContext context;
    claim.set_scanner(session + "/scanners/blue");
    v1::ClaimViewResponse response;
    const grpc::Status refused = server.fleet->ClaimView(&context, claim, &response);
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::ALREADY_EXISTS);
    EXPECT_EQ(fixture::InfoOf(refused).reason(), "CLAIMED");
    EXPECT_EQ(fixture::InfoOf(refused).metadata().at("claim"), claimed.claim().name());
  }
  {
    grpc::ClientContext context;
    v1::RenewClaimRequest renew;
    renew.set_name(claimed.claim().name());
    renew.mutable_ttl()->set_seconds(7200);
    v1::RenewClaimResponse renewed;
    ASSERT_TRUE(server.fleet->RenewClaim(&context, renew, &renewed).ok());
    EXPECT_GT(renewed.claim().expire_time().seconds(), claimed.claim().expire_time().seconds());
  }
  const auto held = [&] {
    grpc::ClientContext context;
    v1::ListClaimsRequest request;
    request.set_parent(session);
    v1::ListClaimsResponse response;
    EXPECT_TRUE(server.fleet->ListClaims(&context, request, &response).ok());
    return response.claims_size();
  };
  EXPECT_EQ(held(), 1);
  {
    grpc::ClientContext context;
    v1::CreatePlanRequest request;
    request.set_parent(session);
    request.mutable_plan()->add_scanners(session + "/scanners/red");
    request.mutable_plan()->add_scanners(session + "/scanners/blue");
    v1::CreatePlanResponse created;
    ASSERT_TRUE(server.plans->CreatePlan(&context, request, &created).ok());
    EXPECT_EQ(created.plan().scanners_size(), 2);
  }
  {
    grpc::ClientContext context;
    v1::ReleaseClaimRequest release;
    release.set_name(claimed.claim().name());
    v1::ReleaseClaimResponse response;
    EXPECT_TRUE(server.fleet->ReleaseClaim(&context, release, &response).ok());
  }
  EXPECT_EQ(held(), 0);
  grpc::ClientContext context;
  v1::ReleaseClaimRequest nobody;
  nobody.set_name("sessions/none/claims/claim-1");
  v1::ReleaseClaimResponse response;
  EXPECT_EQ(server.fleet->ReleaseClaim(&context, nobody, &response).error_code(),
            grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace vantage::rpc
