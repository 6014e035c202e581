// Pages of lists, the same for all of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "server/rpc/handlers/lookup.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::rpc {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::IsEmpty;

struct ListedPage {
  grpc::Status status;
  std::vector<std::string> names;
  std::string next;
};

// A list that has entries.
struct FilledList {
  std::string prefix;  // of its tokens
  std::vector<std::string> names;
  std::function<ListedPage(int size, const std::string& token)> page;
};

class Paging : public testing::Test {
 protected:
  template <typename Request, typename Response, typename Stub, typename Call, typename Entries>
  static ListedPage PageOf(Request request, int size, const std::string& token, Stub& stub,
                           Call call, Entries entries) {
    grpc::ClientContext context;
    request.set_page_size(size);
    request.set_page_token(token);
    Response response;
    ListedPage page;
    page.status = (stub.*call)(&context, request, &response);
    for (const auto& entry : entries(response)) page.names.push_back(entry.name());
    page.next = response.next_page_token();
    return page;
  }

  std::vector<FilledList> Fill() {
    const std::string session = server_.OpenRoom("job");
    std::vector<FilledList> lists(8);
    lists[0].prefix = "sessions";
    lists[0].names = {session, server_.OpenSession("b"), server_.OpenSession("a")};
    lists[0].page = [this](int size, const std::string& token) {
      return PageOf<v1::ListSessionsRequest, v1::ListSessionsResponse>(
          {}, size, token, *server_.sessions, &v1::SessionService::Stub::ListSessions,
          [](const auto& response) { return response.sessions(); });
    };
    lists[1].prefix = session + "/scans";
    lists[1].names = {session + "/scans/scan-1"};
    for (int i = 0; i < 2; ++i) {
      lists[1].names.push_back(server_.Send(session, fixture::EncodedRoom()).scan());
    }
    lists[1].page = [this, session](int size, const std::string& token) {
      v1::ListScansRequest request;
      request.set_parent(session);
      return PageOf<v1::ListScansRequest, v1::ListScansResponse>(
          request, size, token, *server_.scans, &v1::ScanService::Stub::ListScans,
          [](const auto& response) { return response.scans(); });
    };
    lists[2].prefix = session + "/plans";
    for (int i = 0; i < 3; ++i) {
      grpc::ClientContext context;
      v1::CreatePlanRequest request;
      request.set_parent(session);
      v1::CreatePlanResponse created;
      EXPECT_TRUE(server_.plans->CreatePlan(&context, request, &created).ok());
      lists[2].names.push_back(created.plan().name());
    }
    lists[2].page = [this, session](int size, const std::string& token) {
      v1::ListPlansRequest request;
      request.set_parent(session);
      return PageOf<v1::ListPlansRequest, v1::ListPlansResponse>(
          request, size, token, *server_.plans, &v1::PlanService::Stub::ListPlans,
          [](const auto& response) { return response.plans(); });
    };
    lists[3].prefix = session + "/scanners";
    for (const char* id : {"red", "blue", "green"}) {
      grpc::ClientContext context;
      v1::CreateScannerRequest request;
      request.set_parent(session);
      request.set_scanner_id(id);
      request.mutable_scanner();
      v1::CreateScannerResponse created;
      EXPECT_TRUE(server_.fleet->CreateScanner(&context, request, &created).ok());
      lists[3].names.push_back(created.scanner().name());
    }
    lists[3].page = [this, session](int size, const std::string& token) {
      v1::ListScannersRequest request;
      request.set_parent(session);
      return PageOf<v1::ListScannersRequest, v1::ListScannersResponse>(
          request, size, token, *server_.fleet, &v1::FleetService::Stub::ListScanners,
          [](const auto& response) { return response.scanners(); });
    };
    lists[4].prefix = session + "/claims";
    for (int i = 0; i < 3; ++i) {
      grpc::ClientContext context;
      v1::ClaimViewRequest request;
      request.set_parent(session);
      request.set_scanner(session + "/scanners/red");
      request.mutable_position()->set_x(5 * i);  // far enough from the others
      v1::ClaimViewResponse claimed;
      EXPECT_TRUE(server_.fleet->ClaimView(&context, request, &claimed).ok());
      lists[4].names.push_back(claimed.claim().name());
    }
    lists[4].page = [this, session](int size, const std::string& token) {
      v1::ListClaimsRequest request;
      request.set_parent(session);
      return PageOf<v1::ListClaimsRequest, v1::ListClaimsResponse>(
          request, size, token, *server_.fleet, &v1::FleetService::Stub::ListClaims,
          [](const auto& response) { return response.claims(); });
    };
    lists[5].prefix = session + "/stations";
    for (int i = 0; i < 3; ++i) {
      grpc::ClientContext context;
      v1::CreateStationRequest request;
      request.set_parent(session);
      request.mutable_station()->mutable_position()->set_x(i);
      v1::CreateStationResponse created;
      EXPECT_TRUE(server_.fleet->CreateStation(&context, request, &created).ok());
      lists[5].names.push_back(created.station().name());
    }
    lists[5].page = [this, session](int size, const std::string& token) {
      v1::ListStationsRequest request;
      request.set_parent(session);
      return PageOf<v1::ListStationsRequest, v1::ListStationsResponse>(
          request, size, token, *server_.fleet, &v1::FleetService::Stub::ListStations,
          [](const auto& response) { return response.stations(); });
    };
    lists[6].prefix = session + "/uploads";  // of the scans
    for (int i = 1; i <= 3; ++i) {
      lists[6].names.push_back(absl::StrCat(session, "/uploads/upload-", i));
    }
    lists[6].page = [this, session](int size, const std::string& token) {
      v1::ListUploadsRequest request;
      request.set_parent(session);
      return PageOf<v1::ListUploadsRequest, v1::ListUploadsResponse>(
          request, size, token, *server_.scans, &v1::ScanService::Stub::ListUploads,
          [](const auto& response) { return response.uploads(); });
    };
    lists[7].prefix = session + "/rejections";
    for (int i = 0; i < 3; ++i) {
      grpc::ClientContext context;
      v1::RejectViewRequest request;
      request.set_parent(session);
      request.mutable_position()->set_x(i);
      v1::RejectViewResponse rejected;
      EXPECT_TRUE(server_.plans->RejectView(&context, request, &rejected).ok());
      lists[7].names.push_back(rejected.rejection().name());
    }
    lists[7].page = [this, session](int size, const std::string& token) {
      v1::ListRejectionsRequest request;
      request.set_parent(session);
      return PageOf<v1::ListRejectionsRequest, v1::ListRejectionsResponse>(
          request, size, token, *server_.plans, &v1::PlanService::Stub::ListRejections,
          [](const auto& response) { return response.rejections(); });
    };
    return lists;
  }

  fixture::Script script_;
  fixture::InProcess server_{script_.Make()};
};

TEST_F(Paging, EveryListComesInPagesAndRefusesWhatItDidNotGive) {
  script_.EndPlans();
  const std::vector<FilledList> lists = Fill();
  for (const FilledList& list : lists) {
    SCOPED_TRACE(list.prefix);
    std::vector<std::string> names;
    std::string token;
    do {
      const ListedPage page = list.page(1, token);
      ASSERT_TRUE(page.status.ok()) << page.status.error_message();
      ASSERT_EQ(page.names.size(), 1U);
      names.push_back(page.names[0]);
      token = page.next;
    } while (!token.empty());
    EXPECT_THAT(names, ElementsAreArray(list.names));
    // More than there may be is as many as there may.
    const ListedPage all = list.page(1'000'000, "");
    EXPECT_THAT(all.names, ElementsAreArray(list.names));
    EXPECT_EQ(all.next, "");
    EXPECT_THAT(fixture::ViolatedFields(list.page(-1, "").status), ElementsAre("page_size"));
    // Tokens of others, of an entry that there never was, and nonsense.
    std::vector<std::string> refused = {"nonsense", NextPageToken(list.prefix, "nobody"),
                                        NextPageToken(list.prefix, list.prefix + "/claim-99")};
    for (const FilledList& other : lists) {
      if (other.prefix != list.prefix) refused.push_back(other.page(1, "").next);
    }
    for (const std::string& bad : refused) {
      const ListedPage page = list.page(1, bad);
      EXPECT_THAT(fixture::ViolatedFields(page.status), ElementsAre("page_token")) << bad;
      EXPECT_THAT(page.names, IsEmpty());
    }
  }
}

TEST_F(Paging, GoesOnBehindAClaimThatHasEnded) {
  script_.EndPlans();
  const FilledList claims = Fill()[4];
  const ListedPage first = claims.page(1, "");
  grpc::ClientContext context;
  v1::ReleaseClaimRequest release;
  release.set_name(first.names.at(0));
  v1::ReleaseClaimResponse released;
  ASSERT_TRUE(server_.fleet->ReleaseClaim(&context, release, &released).ok());
  EXPECT_THAT(claims.page(5, first.next).names, ElementsAre(claims.names[1], claims.names[2]));
  // A claim that has ended names the value of its end, for programs.
  grpc::ClientContext again;
  const grpc::Status ended = server_.fleet->ReleaseClaim(&again, release, &released);
  EXPECT_EQ(fixture::InfoOf(ended).reason(), "CLAIM_ENDED");
  EXPECT_EQ(fixture::InfoOf(ended).metadata().at("ended"), "CLAIM_END_REASON_RELEASED");
}

// An id that was deleted and used again is another session: what lies between is not left out.
TEST_F(Paging, GoesOnBehindASessionWhoseIdIsAnothersNow) {
  for (const char* id : {"c", "a", "d"}) server_.OpenSession(id);
  v1::ListSessionsRequest request;
  request.set_page_size(1);
  v1::ListSessionsResponse first;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(server_.sessions->ListSessions(&context, request, &first).ok());
  }
  {
    grpc::ClientContext context;
    v1::DeleteSessionRequest gone;
    gone.set_name("sessions/c");
    v1::DeleteSessionResponse done;
    ASSERT_TRUE(server_.sessions->DeleteSession(&context, gone, &done).ok());
  }
  server_.OpenSession("c");
  request.set_page_size(10);
  request.set_page_token(first.next_page_token());
  v1::ListSessionsResponse rest;
  grpc::ClientContext context;
  ASSERT_TRUE(server_.sessions->ListSessions(&context, request, &rest).ok());
  std::vector<std::string> names;
  for (const v1::Session& session : rest.sessions()) names.push_back(session.name());
  EXPECT_THAT(names, ElementsAre("sessions/a", "sessions/d", "sessions/c"));
}

// Two tenants' sessions, in turns: neither sees, or skips, anything for the other's.
class PagingOfTenants : public testing::Test {
 protected:
  static server::ServerOptions TwoTenants() {
    server::ServerOptions options;
    options.access.tenant_metadata = "x-tenant";
    return options;
  }
  static void NameTenant(const std::string& tenant, grpc::ClientContext& context) {
    context.AddMetadata("x-tenant", tenant);
  }
  void Open(const std::string& tenant, const std::string& id) {
    grpc::ClientContext context;
    NameTenant(tenant, context);
    v1::CreateSessionRequest request;
    request.set_session_id(id);
    v1::CreateSessionResponse response;
    ASSERT_TRUE(server_.sessions->CreateSession(&context, request, &response).ok());
  }
  void Delete(const std::string& tenant, const std::string& id) {
    grpc::ClientContext context;
    NameTenant(tenant, context);
    v1::DeleteSessionRequest request;
    request.set_name("sessions/" + id);
    v1::DeleteSessionResponse response;
    ASSERT_TRUE(server_.sessions->DeleteSession(&context, request, &response).ok());
  }
  v1::ListSessionsResponse Page(const std::string& tenant, int size, const std::string& token) {
    grpc::ClientContext context;
    NameTenant(tenant, context);
    v1::ListSessionsRequest request;
    request.set_page_size(size);
    request.set_page_token(token);
    v1::ListSessionsResponse response;
    const grpc::Status status = server_.sessions->ListSessions(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
  // Names from a place on, page by page; "|" where a page ends and another one follows.
  std::vector<std::string> Pages(const std::string& tenant, int size, std::string token = "") {
    std::vector<std::string> names;
    do {
      const v1::ListSessionsResponse page = Page(tenant, size, token);
      for (const v1::Session& session : page.sessions()) names.push_back(session.name());
      token = page.next_page_token();
      if (!token.empty()) names.emplace_back("|");
    } while (!token.empty() && names.size() < 100);
    return names;
  }

  fixture::Script script_;
  fixture::InProcess server_{script_.Make(), TwoTenants()};
};

TEST_F(PagingOfTenants, EachSeesItsOwnSessionsInOrderOfCreation) {
  for (const char* n : {"3", "1", "2"}) {
    Open("museum", std::string("m") + n);
    Open("bank", std::string("b") + n);
  }
  EXPECT_THAT(Pages("museum", 1),
              ElementsAre("sessions/m3", "|", "sessions/m1", "|", "sessions/m2"));
  EXPECT_THAT(Pages("bank", 2), ElementsAre("sessions/b3", "sessions/b1", "|", "sessions/b2"));
  // A page that is full to the last has none after it, whatever others have.
  EXPECT_THAT(Pages("museum", 3), ElementsAre("sessions/m3", "sessions/m1", "sessions/m2"));
  EXPECT_THAT(Pages("nobody", 2), IsEmpty());
}

TEST_F(PagingOfTenants, GoesOnBehindOnesOwnThatIsGone) {
  for (const char* n : {"1", "2", "3"}) {
    Open("museum", std::string("m") + n);
    Open("bank", std::string("b") + n);
  }
  const std::string token = Page("museum", 1, "").next_page_token();
  Delete("museum", "m1");
  EXPECT_THAT(Pages("museum", 5, token), ElementsAre("sessions/m2", "sessions/m3"));
  // Its id is another tenant's now.
  Open("bank", "m1");
  EXPECT_THAT(Pages("museum", 5, token), ElementsAre("sessions/m2", "sessions/m3"));
  EXPECT_THAT(Pages("bank", 2),
              ElementsAre("sessions/b1", "sessions/b2", "|", "sessions/b3", "sessions/m1"));
}

TEST_F(PagingOfTenants, AnothersTokenShowsNothingOfTheirs) {
  for (const char* n : {"1", "2", "3"}) {
    Open("museum", std::string("m") + n);
    Open("bank", std::string("b") + n);
  }
  const std::string token = Page("museum", 2, "").next_page_token();
  EXPECT_THAT(Pages("bank", 1, token), ElementsAre("sessions/b2", "|", "sessions/b3"));
}

TEST(ReadPage, CoercesASizeThatIsTooLarge) {
  const auto limit = [](int size) {
    return ReadPage(size, "", "list", 50, 1000, "page_size", "page_token")->limit;
  };
  EXPECT_EQ(limit(0), 50U);
  EXPECT_EQ(limit(7), 7U);
  EXPECT_EQ(limit(1000), 1000U);
  EXPECT_EQ(limit(1001), 1000U);
}

// However many entries were asked for.
TEST(PageTest, EndsWhereItWouldBeTooLarge) {
  const auto make = [](size_t count, size_t bytes) {
    std::vector<v1::Scan> scans(count);
    for (v1::Scan& scan : scans) scan.set_display_name(std::string(bytes, 'x'));
    return scans;
  };
  v1::ListScansResponse response;
  EXPECT_FALSE(FillPage(make(100, 100), *response.mutable_scans()));
  EXPECT_EQ(response.scans_size(), 100);
  response.Clear();
  EXPECT_TRUE(FillPage(make(10, 1 << 20), *response.mutable_scans()));
  EXPECT_EQ(response.scans_size(), 2);
  response.Clear();
  EXPECT_TRUE(FillPage(make(2, 5 << 20), *response.mutable_scans()));
  EXPECT_EQ(response.scans_size(), 1);
}

TEST_F(Paging, AFilterLeavesOutWhatItDoesNotName) {
  script_.EndPlans();
  const std::string session = server_.OpenRoom("hall-north");
  server_.OpenSession("office");
  {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    request.set_session_id("b2");
    request.mutable_session()->set_display_name("The Northern HALL, upstairs");
    v1::CreateSessionResponse created;
    ASSERT_TRUE(server_.sessions->CreateSession(&context, request, &created).ok());
  }
  const auto sessions = [&](v1::ListSessionsRequest request) {
    std::vector<std::string> names;
    do {
      const ListedPage page = PageOf<v1::ListSessionsRequest, v1::ListSessionsResponse>(
          request, 1, request.page_token(), *server_.sessions,
          &v1::SessionService::Stub::ListSessions,
          [](const auto& response) { return response.sessions(); });
      EXPECT_TRUE(page.status.ok()) << page.status.error_message();
      names.insert(names.end(), page.names.begin(), page.names.end());
      request.set_page_token(page.next);
    } while (!request.page_token().empty());
    return names;
  };
  v1::ListSessionsRequest wanted;
  wanted.set_text("HaLL");
  EXPECT_THAT(sessions(wanted), ElementsAre(session, "sessions/b2"));
  wanted.set_text("attic");
  EXPECT_THAT(sessions(wanted), IsEmpty());
  wanted.clear_text();
  wanted.mutable_updated_after()->set_seconds(4'000'000'000);
  EXPECT_THAT(sessions(wanted), IsEmpty());
  wanted.mutable_updated_after()->set_seconds(1);
  EXPECT_EQ(sessions(wanted).size(), 3U);

  v1::ListScansRequest scans;
  scans.set_parent(session);
  const auto listed = [&] {
    return PageOf<v1::ListScansRequest, v1::ListScansResponse>(
        scans, 9, "", *server_.scans, &v1::ScanService::Stub::ListScans,
        [](const auto& response) { return response.scans(); });
  };
  EXPECT_EQ(listed().names.size(), 1U);
  scans.add_states(v1::SCAN_STATE_MERGED);
  EXPECT_EQ(listed().names.size(), 1U);
  scans.set_states(0, v1::SCAN_STATE_DOUBTFUL);
  EXPECT_THAT(listed().names, IsEmpty());
  scans.clear_states();
  scans.set_scanner(session + "/scanners/red");
  EXPECT_THAT(listed().names, IsEmpty());
  scans.add_states(v1::SCAN_STATE_UNSPECIFIED);
  EXPECT_THAT(fixture::ViolatedFields(listed().status), ElementsAre("states[0]"));
}

}  // namespace
}  // namespace vantage::rpc
