// The real server, killed at random moments of a job: what it acknowledged is there again, and the
// job ends as it would have without.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "core/bytes/checksum.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"
#include "vantage/v1/model_service.grpc.pb.h"
#include "vantage/v1/plan_service.grpc.pb.h"
#include "vantage/v1/scan_service.grpc.pb.h"
#include "vantage/v1/session_service.grpc.pb.h"

namespace vantage::integration {
namespace {

constexpr char kSession[] = "sessions/job";
constexpr int kScans = 4;
constexpr size_t kPieceBytes = 16 << 10;
constexpr auto kPatience = std::chrono::seconds(120);

// The data that the server acknowledged to a client.
struct Acknowledged {
  std::vector<std::string> events;        // serialised, in order
  std::vector<v1::Upload> uploads;        // by scan, the newest answer
  std::vector<std::string> plan_answers;  // by scan: serialised ranking of the plan that ended
};

std::string ScanBytes(int number) {
  return fixture::EncodedRoom({1.2 + 0.8 * number, 1.5 + 0.3 * number, 1.4}, 2.0);
}

// One connection to one run of the server.
class JobClient {
 public:
  explicit JobClient(const std::string& address)
      : channel_(grpc::CreateChannel(address, grpc::InsecureChannelCredentials())),
        sessions_(v1::SessionService::NewStub(channel_)),
        scans_(v1::ScanService::NewStub(channel_)),
        plans_(v1::PlanService::NewStub(channel_)),
        models_(v1::ModelService::NewStub(channel_)) {}

  // The error of the last call that failed.
  const std::string& refusal() const { return refusal_; }

  // Goes through the whole job, repeating what was done before; false when the server went away.
  bool Run(Acknowledged& known) {
    v1::CreateSessionRequest open;
    open.set_session_id("job");
    open.set_request_id("open");
    v1::CreateSessionResponse opened;
    if (!Call(*sessions_, &v1::SessionService::Stub::CreateSession, open, opened)) return false;
    for (int i = 0; i < kScans; ++i) {
      if (!SendScan(i, known) || !MakePlan(i, known)) return false;
    }
    return true;
  }

  // What was acknowledged is there.
  void Check(Acknowledged& known) {
    ReadEvents(known, true);
    for (const v1::Upload& upload : known.uploads) {
      v1::GetUploadRequest request;
      request.set_name(upload.name());
      v1::GetUploadResponse response;
      ASSERT_TRUE(Call(*scans_, &v1::ScanService::Stub::GetUpload, request, response));
      EXPECT_GE(response.upload().next_offset(), upload.next_offset()) << upload.name();
      if (upload.state() == v1::UPLOAD_STATE_COMMITTED) {
        EXPECT_EQ(response.upload().scan(), upload.scan());
      }
    }
  }

  // Every event so far; those that were read before must be the same. `all`: nobody kills the
  // server meanwhile.
  void ReadEvents(Acknowledged& known, bool all) {
    v1::GetSessionRequest get;
    get.set_name(kSession);
    v1::GetSessionResponse session;
    if (!Call(*sessions_, &v1::SessionService::Stub::GetSession, get, session)) return;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    v1::WatchSessionRequest watch;
    watch.set_name(kSession);
    const auto stream = sessions_->WatchSession(&context, watch);
    v1::WatchSessionResponse step;
    size_t count = 0;
    while (count < session.session().last_sequence() && stream->Read(&step)) {
      if (!step.has_event()) continue;
      const std::string event = step.event().SerializeAsString();
      if (count < known.events.size()) {
        EXPECT_EQ(event, known.events[count]) << "event " << count + 1;
      } else {
        known.events.push_back(event);
      }
      ++count;
    }
    context.TryCancel();
    if (all) {
      EXPECT_GE(count, known.events.size()) << "events are gone";
    }
  }

  std::string Export() {
    v1::ExportModelRequest request;
    request.set_name(kSession);
    request.set_format(v1::EXPORT_FORMAT_SURFACE_PLY);
    for (int attempt = 0; attempt < 600; ++attempt) {
      grpc::ClientContext context;
      const auto stream = models_->ExportModel(&context, request);
      v1::ExportModelResponse part;
      std::string bytes;
      while (stream->Read(&part)) bytes += part.data();
      const grpc::Status status = stream->Finish();
      if (status.ok()) return bytes;
      EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    ADD_FAILURE() << "the model never came";
    return "";
  }

  std::vector<v1::Scan> Scans() {
    v1::ListScansRequest request;
    request.set_parent(kSession);
    v1::ListScansResponse response;
    EXPECT_TRUE(Call(*scans_, &v1::ScanService::Stub::ListScans, request, response));
    return {response.scans().begin(), response.scans().end()};
  }

 private:
  template <typename Stub, typename Request, typename Response>
  bool Call(Stub& stub,
            grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
            const Request& request, Response& response) {
    for (int attempt = 0;; ++attempt) {
      grpc::ClientContext context;
      context.set_deadline(std::chrono::system_clock::now() + kPatience);
      const grpc::Status status = (stub.*method)(&context, request, &response);
      if (status.ok()) return true;
      const bool loading = fixture::InfoOf(status).reason() == "MODEL_LOADING";
      if (!loading || attempt > 600) {
        EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
        refusal_ = status.error_message();
        return false;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  bool SendScan(int number, Acknowledged& known) {
    const std::string bytes = ScanBytes(number);
    v1::CreateUploadRequest create;
    create.set_parent(kSession);
    create.set_request_id("upload-" + std::to_string(number));
    v1::UploadTotal& total = *create.mutable_upload()->mutable_total();
    total.set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
    total.set_sha256(bytes::Sha256::Of(bytes));
    *create.mutable_upload()->mutable_prior() =
        fixture::PriorAt(1.2 + 0.8 * number, 1.5 + 0.3 * number, 1.4);
    v1::CreateUploadResponse created;
    if (!Call(*scans_, &v1::ScanService::Stub::CreateUpload, create, created)) return false;
    const auto at = static_cast<size_t>(number);
    if (known.uploads.size() <= at) known.uploads.resize(at + 1);
    known.uploads[at] = created.upload();
    while (known.uploads[at].state() == v1::UPLOAD_STATE_OPEN) {
      const v1::Upload& upload = known.uploads[at];
      v1::UploadPieceRequest request;
      request.set_upload(upload.name());
      v1::Piece& piece = *request.mutable_piece();
      piece.set_sequence(upload.next_sequence());
      piece.set_offset(upload.next_offset());
      piece.set_data(bytes.substr(static_cast<size_t>(upload.next_offset()), kPieceBytes));
      if (piece.data().empty()) {
        // All of it is there: the server commits it when it has loaded its sessions.
        v1::GetUploadRequest get;
        get.set_name(upload.name());
        v1::GetUploadResponse now;
        if (!Call(*scans_, &v1::ScanService::Stub::GetUpload, get, now)) return false;
        known.uploads[at] = now.upload();
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        continue;
      }
      piece.set_crc32c(bytes::Crc32c(piece.data()));
      v1::UploadPieceResponse response;
      if (!Call(*scans_, &v1::ScanService::Stub::UploadPiece, request, response)) return false;
      known.uploads[at] = response.upload();
    }
    EXPECT_EQ(known.uploads[at].state(), v1::UPLOAD_STATE_COMMITTED);
    return WaitUntilDecided(known.uploads[at].scan());
  }

  bool WaitUntilDecided(const std::string& scan) {
    v1::GetScanRequest request;
    request.set_name(scan);
    v1::GetScanResponse response;
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < deadline) {
      if (!Call(*scans_, &v1::ScanService::Stub::GetScan, request, response)) return false;
      const v1::ScanState state = response.scan().state();
      if (state != v1::SCAN_STATE_RECEIVED && state != v1::SCAN_STATE_REGISTERING &&
          state != v1::SCAN_STATE_MERGING) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ADD_FAILURE() << scan << " is never decided";
    return false;
  }

  // A plan that the server stopped in the middle of has failed, and is made anew.
  bool MakePlan(int number, Acknowledged& known) {
    const auto at = static_cast<size_t>(number);
    if (known.plan_answers.size() > at) return true;
    for (int attempt = 0; attempt < 100; ++attempt) {
      v1::CreatePlanRequest create;
      create.set_parent(kSession);
      create.set_request_id("plan-" + std::to_string(number) + "-" + std::to_string(attempt));
      create.mutable_plan()->set_work_limit_rays(300'000);
      create.mutable_plan()->set_seed(7);
      v1::CreatePlanResponse created;
      if (!Call(*plans_, &v1::PlanService::Stub::CreatePlan, create, created)) return false;
      v1::GetPlanRequest get;
      get.set_name(created.plan().name());
      v1::GetPlanResponse now;
      do {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        if (!Call(*plans_, &v1::PlanService::Stub::GetPlan, get, now)) return false;
      } while (now.plan().state() == v1::PLAN_STATE_QUEUED ||
               now.plan().state() == v1::PLAN_STATE_RUNNING);
      if (now.plan().state() != v1::PLAN_STATE_SUCCEEDED) continue;
      v1::PlanResult ranking;
      *ranking.mutable_views() = now.plan().result().views();
      known.plan_answers.push_back(ranking.SerializeAsString());
      return true;
    }
    ADD_FAILURE() << "no plan succeeds";
    return false;
  }

  std::string refusal_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  std::unique_ptr<v1::ScanService::Stub> scans_;
  std::unique_ptr<v1::PlanService::Stub> plans_;
  std::unique_ptr<v1::ModelService::Stub> models_;
};

// How a job ended, without its times.
struct Ending {
  std::vector<std::string> scans;
  std::vector<std::string> plans;
  std::string model;
};

Ending EndingOf(JobClient& client, const Acknowledged& known) {
  Ending ending;
  for (v1::Scan scan : client.Scans()) {
    scan.clear_create_time();
    scan.clear_update_time();
    scan.mutable_registration()->clear_duration();
    scan.mutable_merge()->clear_carve_duration();
    scan.mutable_merge()->clear_merge_duration();
    // A plan that a kill ended is asked for again, under the next name.
    if (scan.merge().has_promise()) scan.mutable_merge()->mutable_promise()->clear_plan();
    ending.scans.push_back(scan.DebugString());
  }
  ending.plans = known.plan_answers;
  ending.model = client.Export();
  return ending;
}

TEST(Durability, KilledAtRandomMomentsAJobEndsAsItWould) {
  Ending undisturbed;
  {
    ServerProcess server;
    ASSERT_FALSE(server.address().empty());
    JobClient client(server.address());
    Acknowledged known;
    ASSERT_TRUE(client.Run(known));
    undisturbed = EndingOf(client, known);
  }
  ASSERT_EQ(undisturbed.scans.size(), static_cast<size_t>(kScans));
  ASSERT_FALSE(undisturbed.model.empty());

  const char* asked = std::getenv("VANTAGE_KILLS");
  const int kills = asked == nullptr ? 15 : std::atoi(asked);
  constexpr uint32_t kSeed = 5;
  std::mt19937 random(kSeed);
  int done = 0;
  int jobs = 0;
  while (done < kills) {
    ++jobs;
    const ScratchFolder folder;
    Acknowledged known;
    // The server is killed until the job is complete, and runs once more without being killed.
    for (bool through = false, compared = false; !compared;) {
      // Killed again and again at work that is not to blame, which is not to be set aside.
      ServerProcess server(folder.File("data"), "127.0.0.1", {"--tries", "0"});
      ASSERT_FALSE(server.address().empty());
      JobClient client(server.address());
      SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", job " << jobs << ", kill " << done);
      if (!known.events.empty()) client.Check(known);
      std::thread killer;
      if (!through && done < kills) {
        const auto wait = std::chrono::milliseconds(random() % 400);
        killer = std::thread([&server, wait] {
          std::this_thread::sleep_for(wait);
          server.Stop(SIGKILL);
        });
      }
      through = client.Run(known);
      if (killer.joinable()) {
        client.ReadEvents(known, false);
        killer.join();
        ++done;
      } else {
        ASSERT_TRUE(through) << client.refusal() << "\n" << server.Log();
        const Ending ending = EndingOf(client, known);
        EXPECT_EQ(ending.scans, undisturbed.scans);
        EXPECT_EQ(ending.plans, undisturbed.plans);
        EXPECT_TRUE(ending.model == undisturbed.model) << "the models differ";
        compared = true;
      }
      if (HasFailure()) return;
    }
  }
  RecordProperty("jobs", jobs);
  RecordProperty("kills", done);
}

TEST(Durability, TwoServersNeverShareAFolder) {
  const ScratchFolder folder;
  ServerProcess server(folder.File("data"), "127.0.0.1", {"--tries", "0"});
  ASSERT_FALSE(server.address().empty());
  const Finished second =
      RunProgram({VANTAGED_BINARY, "--listen", "127.0.0.1:0", "--data", folder.File("data")});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.error.find("another server uses the data"), std::string::npos) << second.error;
}

}  // namespace
}  // namespace vantage::integration
