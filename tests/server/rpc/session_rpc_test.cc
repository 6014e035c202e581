// CreateSession, GetSession, ListSessions, UpdateSession, DeleteSession, WatchSession.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::rpc {
namespace {

using testing::Contains;

class SessionRpc : public testing::Test {
 protected:
  fixture::Script script_;
  fixture::InProcess server_{script_.Make()};

  grpc::Status Create(const v1::CreateSessionRequest& request, v1::Session& session) {
    grpc::ClientContext context;
    v1::CreateSessionResponse response;
    grpc::Status status = server_.sessions->CreateSession(&context, request, &response);
    session = response.session();
    return status;
  }
  grpc::Status Get(const std::string& name, v1::Session& session) {
    grpc::ClientContext context;
    v1::GetSessionRequest request;
    request.set_name(name);
    v1::GetSessionResponse response;
    grpc::Status status = server_.sessions->GetSession(&context, request, &response);
    session = response.session();
    return status;
  }
  grpc::Status Update(const v1::UpdateSessionRequest& request, v1::Session& session) {
    grpc::ClientContext context;
    v1::UpdateSessionResponse response;
    grpc::Status status = server_.sessions->UpdateSession(&context, request, &response);
    session = response.session();
    return status;
  }
};

TEST(SessionHeartbeats, AWatchOfASilentSessionSaysThatItIsAlive) {
  fixture::Script script;
  server::ServerOptions options;
  options.heartbeat = std::chrono::milliseconds(20);
  fixture::InProcess server(script.Make(), options);
  grpc::ClientContext context;
  v1::WatchSessionRequest request;
  request.set_name(server.OpenSession("job"));
  const auto stream = server.sessions->WatchSession(&context, request);
  v1::WatchSessionResponse step;
  ASSERT_TRUE(stream->Read(&step));
  EXPECT_EQ(step.event().sequence(), 1U);
  for (int beats = 0; beats < 3; ++beats) {
    ASSERT_TRUE(stream->Read(&step));
    EXPECT_GT(step.heartbeat().time().seconds(), 0);
  }
  context.TryCancel();
  while (stream->Read(&step)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

// Who authenticates the callers says whose session it is; nobody else does.
TEST(Tenants, AreNamedByTheMetadataThatTheOperatorTrusts) {
  for (const bool trusted : {true, false}) {
    SCOPED_TRACE(trusted);
    server::ServerOptions options;
    options.limits.tenant_bytes = 1000;
    if (trusted) options.access.tenant_metadata = "x-tenant";
    fixture::Script script;
    fixture::InProcess server(script.Make(), options);
    grpc::ClientContext context;
    context.AddMetadata("x-tenant", "museum");
    v1::CreateSessionRequest create;
    create.set_session_id("job");
    v1::CreateSessionResponse created;
    ASSERT_TRUE(server.sessions->CreateSession(&context, create, &created).ok());
    grpc::ClientContext begin;
    begin.AddMetadata("x-tenant", "museum");
    v1::CreateUploadRequest announce;
    announce.set_parent("sessions/job");
    announce.mutable_upload()->mutable_total()->set_encoded_size_bytes(1001);
    announce.mutable_upload()->mutable_total()->set_sha256(std::string(32, 's'));
    v1::CreateUploadResponse announced;
    const grpc::Status refused = server.scans->CreateUpload(&begin, announce, &announced);
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(fixture::InfoOf(refused).reason(), "QUOTA_EXCEEDED");
    EXPECT_EQ(refused.error_message().find("'museum'") != std::string::npos, trusted)
        << refused.error_message();
  }
}

TEST_F(SessionRpc, CreatedWithEveryFieldFilledInAndReadBack) {
  v1::CreateSessionRequest request;
  request.set_session_id("flat-12");
  request.mutable_session()->set_display_name("Flat 12");
  v1::Session made;
  ASSERT_TRUE(Create(request, made).ok());
  EXPECT_EQ(made.name(), "sessions/flat-12");
  EXPECT_EQ(made.scanner_models_size(), 1);
  EXPECT_EQ(made.planning_config().required_density_per_m2(), 2500);
  EXPECT_EQ(made.model_config().voxel_size_m(), 0.05);
  EXPECT_EQ(made.last_sequence(), 1U);
  EXPECT_FALSE(made.etag().empty());
  v1::Session read;
  ASSERT_TRUE(Get("sessions/flat-12", read).ok());
  EXPECT_EQ(read.SerializeAsString(), made.SerializeAsString());
}

TEST_F(SessionRpc, TheSameRequestTwiceIsOneSession) {
  v1::CreateSessionRequest request;
  request.set_request_id("once");
  v1::Session first;
  v1::Session second;
  ASSERT_TRUE(Create(request, first).ok());
  ASSERT_TRUE(Create(request, second).ok());
  EXPECT_EQ(first.name(), second.name());
  request.mutable_session()->set_display_name("another");
  const grpc::Status reused = Create(request, second);
  EXPECT_EQ(reused.error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(fixture::InfoOf(reused).reason(), "REQUEST_ID_REUSED");
  request.set_request_id("");
  request.set_session_id(first.name().substr(9));
  EXPECT_EQ(fixture::InfoOf(Create(request, second)).reason(), "SESSION_EXISTS");
}

TEST_F(SessionRpc, AnImpossibleConfigurationNamesEveryField) {
  v1::CreateSessionRequest request;
  request.set_session_id("Bad Id");
  request.set_request_id("has space");
  request.mutable_session()->mutable_planning_config()->set_required_density_per_m2(1e9);
  request.mutable_session()->mutable_model_config()->set_voxel_size_m(7);
  v1::Session made;
  const grpc::Status status = Create(request, made);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  const auto fields = fixture::ViolatedFields(status);
  for (const char* field : {"session_id", "request_id", "session.model_config.voxel_size_m",
                            "session.planning_config.required_density_per_m2"}) {
    EXPECT_THAT(fields, Contains(field));
  }
  EXPECT_EQ(fixture::InfoOf(status).domain(), "vantage");
}

TEST_F(SessionRpc, UnknownNamesAreNotFoundWithResourceInfo) {
  v1::Session session;
  const grpc::Status status = Get("sessions/nobody", session);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  bool found = false;
  for (const auto& any : fixture::Details(status)) {
    google::rpc::ResourceInfo info;
    if (!any.UnpackTo(&info)) continue;
    found = true;
    EXPECT_EQ(info.resource_type(), "vantage/Session");
    EXPECT_EQ(info.resource_name(), "sessions/nobody");
  }
  EXPECT_TRUE(found);
  EXPECT_EQ(Get("../etc/passwd", session).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(SessionRpc, ListsInOrderByPages) {
  for (const char* id : {"c", "a", "b", "e", "d"}) server_.OpenSession(id);
  std::string order;
  std::string token;
  do {
    grpc::ClientContext context;
    v1::ListSessionsRequest request;
    request.set_page_size(2);
    request.set_page_token(token);
    v1::ListSessionsResponse response;
    ASSERT_TRUE(server_.sessions->ListSessions(&context, request, &response).ok());
    EXPECT_LE(response.sessions_size(), 2);
    for (const v1::Session& session : response.sessions()) order += session.name().substr(9);
    token = response.next_page_token();
  } while (!token.empty());
  EXPECT_EQ(order, "cabed");

  grpc::ClientContext context;
  v1::ListSessionsRequest request;
  request.set_page_size(-1);
  request.set_page_token("nonsense");
  v1::ListSessionsResponse response;
  const grpc::Status status = server_.sessions->ListSessions(&context, request, &response);
  EXPECT_THAT(fixture::ViolatedFields(status),
              testing::UnorderedElementsAre("page_size", "page_token"));
}

TEST_F(SessionRpc, APageBeginsAfterTheOneBeforeWhateverWasDeleted) {
  for (const char* id : {"c", "a", "b", "e", "d"}) server_.OpenSession(id);
  v1::ListSessionsRequest request;
  request.set_page_size(2);
  v1::ListSessionsResponse first;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(server_.sessions->ListSessions(&context, request, &first).ok());
  }
  for (const v1::Session& session : first.sessions()) {
    grpc::ClientContext context;
    v1::DeleteSessionRequest gone;
    gone.set_name(session.name());
    v1::DeleteSessionResponse done;
    ASSERT_TRUE(server_.sessions->DeleteSession(&context, gone, &done).ok());
  }
  request.set_page_token(first.next_page_token());
  request.set_page_size(5000);  // more than there may be: as many as there may
  v1::ListSessionsResponse rest;
  grpc::ClientContext context;
  ASSERT_TRUE(server_.sessions->ListSessions(&context, request, &rest).ok());
  std::string order;
  for (const v1::Session& session : rest.sessions()) order += session.name().substr(9);
  EXPECT_EQ(order, "bed");
  EXPECT_EQ(rest.next_page_token(), "");
  // Of another list it is none.
  grpc::ClientContext other;
  v1::ListScansRequest scans;
  scans.set_parent("sessions/b");
  scans.set_page_token(first.next_page_token());
  v1::ListScansResponse none;
  EXPECT_THAT(fixture::ViolatedFields(server_.scans->ListScans(&other, scans, &none)),
              testing::UnorderedElementsAre("page_token"));
}

TEST_F(SessionRpc, UpdatesWhatTheMaskNamesAndOnlyAsAWhole) {
  const std::string name = server_.OpenSession("job");
  v1::UpdateSessionRequest request;
  request.mutable_session()->set_name(name);
  v1::Box& box = *request.mutable_session()->mutable_site_rules()->add_keep_out();
  box.mutable_min()->set_x(0);
  box.mutable_max()->set_x(1);
  box.mutable_max()->set_y(1);
  box.mutable_max()->set_z(1);
  request.mutable_session()->mutable_planning_config()->set_max_view_count(4);
  request.mutable_session()->set_display_name("not in the mask");
  request.mutable_update_mask()->add_paths("site_rules");
  request.mutable_update_mask()->add_paths("planning_config.max_view_count");
  v1::Session session;
  ASSERT_TRUE(Update(request, session).ok());
  EXPECT_EQ(session.site_rules().keep_out_size(), 1);
  EXPECT_EQ(session.planning_config().max_view_count(), 4);
  EXPECT_EQ(session.planning_config().required_density_per_m2(), 2500);
  EXPECT_EQ(session.display_name(), "");

  // Impossible: stays as it was.
  request.mutable_session()->mutable_planning_config()->set_max_view_count(4000);
  v1::Session unused;
  EXPECT_THAT(fixture::ViolatedFields(Update(request, unused)),
              Contains("session.planning_config.max_view_count"));
  request.mutable_update_mask()->add_paths("model_config");
  EXPECT_THAT(fixture::ViolatedFields(Update(request, unused)), Contains("update_mask"));
  v1::Session after;
  ASSERT_TRUE(Get(name, after).ok());
  EXPECT_EQ(after.SerializeAsString(), session.SerializeAsString());

  // A stale etag.
  request.mutable_update_mask()->Clear();
  request.mutable_update_mask()->add_paths("display_name");
  request.mutable_session()->set_etag("stale");
  EXPECT_EQ(Update(request, unused).error_code(), grpc::StatusCode::ABORTED);
  request.mutable_session()->set_etag(after.etag());
  EXPECT_TRUE(Update(request, unused).ok());
}

TEST_F(SessionRpc, DeletedWithEverythingAndRepeatable) {
  const std::string name = server_.OpenRoom("job");
  EXPECT_GT(server_.store().used(), 0U);
  for (int i = 0; i < 2; ++i) {
    grpc::ClientContext context;
    v1::DeleteSessionRequest request;
    request.set_name(name);
    request.set_request_id("delete-1");
    v1::DeleteSessionResponse response;
    EXPECT_TRUE(server_.sessions->DeleteSession(&context, request, &response).ok());
  }
  v1::Session session;
  EXPECT_EQ(Get(name, session).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(server_.store().used(), 0U);
}

// Nothing is said of backups unless the server was told how long they are kept. Sent again, the
// request gets the answer that it got before.
TEST(DeleteSession, SaysWhenBackupsForget) {
  for (const int days : {0, 90}) {
    fixture::Script script;
    server::ServerOptions options;
    options.limits.keep_backups = absl::Hours(24) * days;
    fixture::InProcess server(script.Make(), options);
    v1::DeleteSessionRequest request;
    request.set_name(server.OpenSession("job"));
    request.set_request_id("delete-1");
    v1::DeleteSessionResponse first;
    const absl::Time before = absl::Now();
    for (const bool again : {false, true}) {
      grpc::ClientContext context;
      v1::DeleteSessionResponse response;
      ASSERT_TRUE(server.sessions->DeleteSession(&context, request, &response).ok());
      EXPECT_EQ(response.has_backups_forget_time(), days > 0);
      if (!again) first = response;
      EXPECT_EQ(response.SerializeAsString(), first.SerializeAsString());
    }
    if (days == 0) continue;
    const absl::Time deleted =
        absl::FromUnixSeconds(first.backups_forget_time().seconds()) - absl::Hours(24 * 90);
    EXPECT_GE(deleted, before - absl::Seconds(1));
    EXPECT_LE(deleted, absl::Now());
  }
}

// A watcher that comes back with the last number that it saw misses nothing and sees nothing twice,
// wherever it was cut off.
// Three scans of a room, each a centimetre farther off than the one before, of which the third
// sees that the first is elsewhere: who watches is told who moved, and again when it is withdrawn.
TEST(AdjustedPoses, AreSeenByWhoWatches) {
  const auto scan_named = [](int i) { return absl::StrCat("sessions/job/scans/scan-", i); };
  fixture::Script script;
  const Eigen::Vector3d step(0.4, 0, 0);
  const Eigen::Vector3d drift(0.012, 0, 0);
  fixture::Script::Ties ties;
  ties[{scan_named(1), scan_named(2)}] = Eigen::Translation3d(step + drift);
  ties[{scan_named(2), scan_named(3)}] = Eigen::Translation3d(step + drift);
  ties[{scan_named(1), scan_named(3)}] = Eigen::Translation3d(2 * step);
  script.TieScans(ties);
  fixture::InProcess server(script.Make());
  const std::string session = server.OpenSession("job");
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d truth = Eigen::Vector3d(1.5, 1.5, 1.4) + i * step;
    const Eigen::Vector3d at = truth + i * drift;
    const v1::PosePrior prior = fixture::PriorAt(at.x(), at.y(), at.z());
    const v1::Upload upload = server.Send(session, fixture::EncodedRoom(truth, 4), &prior);
    server.WaitFor(session, upload.scan(), v1::SCAN_STATE_MERGED);
  }
  grpc::ClientContext context;
  v1::WatchSessionRequest request;
  request.set_name(session);
  const auto stream = server.sessions->WatchSession(&context, request);
  v1::WatchSessionResponse step_of_stream;
  const auto next_adjustment = [&] {
    while (stream->Read(&step_of_stream)) {
      if (step_of_stream.event().has_poses_adjusted()) {
        return step_of_stream.event().poses_adjusted();
      }
    }
    return v1::PosesAdjustedEvent();
  };
  const v1::PosesAdjustedEvent closed = next_adjustment();
  ASSERT_EQ(closed.poses_size(), 3);
  EXPECT_EQ(closed.moved_count(), 2);
  EXPECT_EQ(closed.most_moved_scan(), scan_named(3));
  EXPECT_NEAR(closed.largest_move_m(), 0.016, 0.002) << "two thirds of what did not close";
  EXPECT_TRUE(closed.poses(2).has_adjustment());
  v1::WithdrawScanRequest withdraw;
  withdraw.set_name(scan_named(3));
  grpc::ClientContext other;
  v1::WithdrawScanResponse withdrawn;
  ASSERT_TRUE(server.scans->WithdrawScan(&other, withdraw, &withdrawn).ok());
  const v1::PosesAdjustedEvent back = next_adjustment();
  ASSERT_EQ(back.poses_size(), 2);
  EXPECT_EQ(back.moved_count(), 1);
  EXPECT_FALSE(back.poses(1).has_adjustment());
  EXPECT_NEAR(back.poses(1).pose().translation().x(), 1.5 + 0.412, 1e-9);
  context.TryCancel();
}

TEST_F(SessionRpc, WatchResumesWithoutLossOrRepetition) {
  const std::string name = server_.OpenRoom("job");
  v1::Session session;
  ASSERT_TRUE(Get(name, session).ok());
  const uint64_t last = session.last_sequence();
  ASSERT_GE(last, 5U);  // created, upload, received, registered, merged
  for (uint64_t cut = 0; cut <= last; ++cut) {
    uint64_t seen = 0;
    std::set<int> kinds;
    for (int half = 0; half < 2; ++half) {
      grpc::ClientContext context;
      v1::WatchSessionRequest request;
      request.set_name(name);
      request.set_after_sequence(seen);
      const auto stream = server_.sessions->WatchSession(&context, request);
      const uint64_t until = half == 0 ? cut : last;
      v1::WatchSessionResponse step;
      while (seen < until && stream->Read(&step)) {
        if (!step.has_event()) continue;
        EXPECT_EQ(step.event().sequence(), seen + 1);
        seen = step.event().sequence();
        kinds.insert(step.event().event_case());
      }
      context.TryCancel();
    }
    EXPECT_EQ(seen, last);
    EXPECT_EQ(kinds.size(), last);
  }
  grpc::ClientContext context;
  v1::WatchSessionRequest request;
  request.set_name(name);
  request.set_after_sequence(last + 1);
  v1::WatchSessionResponse step;
  const auto stream = server_.sessions->WatchSession(&context, request);
  EXPECT_FALSE(stream->Read(&step));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::OUT_OF_RANGE);
}

TEST_F(SessionRpc, WatchEndsWhenTheSessionIsDeleted) {
  const std::string name = server_.OpenSession("job");
  grpc::ClientContext context;
  v1::WatchSessionRequest request;
  request.set_name(name);
  const auto stream = server_.sessions->WatchSession(&context, request);
  v1::WatchSessionResponse step;
  ASSERT_TRUE(stream->Read(&step));
  grpc::ClientContext other;
  v1::DeleteSessionRequest remove;
  remove.set_name(name);
  v1::DeleteSessionResponse response;
  ASSERT_TRUE(server_.sessions->DeleteSession(&other, remove, &response).ok());
  while (stream->Read(&step)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace vantage::rpc
