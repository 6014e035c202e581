#include "tests/faults/claim_storm.h"

#include <grpcpp/create_channel.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/library/client.h"
#include "client/library/error.h"
#include "client/library/geometry.h"
#include "tests/faults/faulty_proxy.h"
#include "tests/server/fixture/room_scan.h"
#include "vantage/v1/session_service.grpc.pb.h"

namespace vantage::faults {
namespace {

using Clock = std::chrono::steady_clock;
using Eigen::Vector3d;

constexpr char kSession[] = "sessions/storm";
constexpr double kDegrees = 3;    // of a scan: 10 kB
constexpr int kShortestTtl = 10;  // s, the least that the service takes
constexpr int kLongestTtl = 14;   // s
constexpr double kPatience = 30;  // s, for the last claim to expire and be heard of
constexpr uint64_t kPlanRays = 100'000;
constexpr uint64_t kMostBytesBetweenBreaks = 40'000;
const Vector3d kFirstPlace{2.0, 1.5, 1.4};  // m, in the room

double Now() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

double Seconds(const google::protobuf::Timestamp& time) {
  return static_cast<double>(time.seconds()) + 1e-9 * time.nanos();
}

std::vector<LinkFault> Faults(const ClaimStorm& storm) {
  std::mt19937_64 random(storm.seed);
  std::vector<LinkFault> faults;
  for (int i = 0; i < storm.breaks; ++i) {
    // Silence takes both ends 15 s to notice, so it is rare.
    const auto kind = i % 10 == 9 ? LinkFault::Kind::kHalfOpen : LinkFault::Kind::kCut;
    faults.push_back({kind, static_cast<int64_t>(1000 + random() % kMostBytesBetweenBreaks)});
  }
  return faults;
}

// What clients and listeners find, together.
class Findings {
 public:
  void Broken(const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (broken_.size() < 100) broken_.push_back(what);
  }
  std::vector<std::string> broken() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return broken_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> broken_;
};

// As the client library makes them: with retries of gRPC's own (1.51) a call whose link breaks can
// outlive its deadline for ever.
std::shared_ptr<grpc::Channel> ChannelTo(const std::string& server) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  return grpc::CreateCustomChannel(server, grpc::InsecureChannelCredentials(), arguments);
}

// Reads the session's events as they are sent, without the client library, which would leave out
// what comes twice. `on_event` returns false to end it. `seconds`: how long the stream may last.
bool Listen(v1::SessionService::Stub& stub, uint64_t after, double seconds,
            const std::function<bool(const v1::SessionEvent&)>& on_event) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() +
                       std::chrono::microseconds(static_cast<int64_t>(seconds * 1e6)));
  v1::WatchSessionRequest request;
  request.set_name(kSession);
  request.set_after_sequence(after);
  const auto stream = stub.WatchSession(&context, request);
  v1::WatchSessionResponse response;
  bool wanted = true;
  while (stream->Read(&response)) {
    if (!wanted || !response.has_event()) continue;
    wanted = on_event(response.event());
    if (!wanted) context.TryCancel();
  }
  const grpc::Status ended = stream->Finish();
  return !wanted || ended.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
}

// Listens from the first event to the last and checks each as it comes.
class Checker {
 public:
  explicit Checker(const std::string& server)
      : stub_(v1::SessionService::NewStub(ChannelTo(server))), thread_([this] { Run(); }) {}
  ~Checker() { Stop(); }

  // Waits until nothing is held and all up to `last` was heard.
  bool WaitForRest(uint64_t last) {
    std::unique_lock<std::mutex> lock(mutex_);
    return heard_.wait_for(lock, std::chrono::duration<double>(kPatience),
                           [&] { return log_.last() >= last && log_.held() == 0; });
  }
  void Stop() {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
  }
  // After Stop().
  const ClaimLog& log() const { return log_; }
  const std::vector<std::string>& events() const { return events_; }

 private:
  void Run() {
    while (!stopped_) {
      // Half a second at a time only so that it can be stopped between events.
      Listen(*stub_, log_.last(), 0.5, [&](const v1::SessionEvent& event) {
        const std::lock_guard<std::mutex> lock(mutex_);
        log_.Take(event);
        events_.push_back(event.SerializeAsString());
        heard_.notify_all();
        return true;
      });
    }
  }

  const std::unique_ptr<v1::SessionService::Stub> stub_;
  std::mutex mutex_;
  std::condition_variable heard_;
  ClaimLog log_;
  std::vector<std::string> events_;
  std::atomic<bool> stopped_{false};
  std::thread thread_;
};

// Listens for a moment, breaks off wherever it is, and comes back for what follows.
class Visitor {
 public:
  Visitor(const std::string& server, uint64_t seed, Findings& findings)
      : server_(server), random_(seed), findings_(findings), thread_([this] { Run(); }) {}
  ~Visitor() { Finish(0); }

  // Once it has heard everything up to `last`.
  void Finish(uint64_t last) {
    until_ = last;
    if (thread_.joinable()) thread_.join();
  }
  // After Finish().
  const std::vector<std::string>& events() const { return events_; }
  int watches() const { return watches_; }

 private:
  void Run() {
    const auto stub = v1::SessionService::NewStub(ChannelTo(server_));
    while (events_.size() < until_) {
      std::uniform_real_distribution<double> seconds(0.05, 2);
      std::uniform_int_distribution<int> events(1, 60);
      int left = events(random_);
      ++watches_;
      Listen(*stub, events_.size(), seconds(random_), [&](const v1::SessionEvent& event) {
        if (event.sequence() != events_.size() + 1) {
          findings_.Broken(absl::StrCat("who came back after event ", events_.size(), " was told ",
                                        event.sequence()));
        }
        events_.push_back(event.SerializeAsString());
        return --left > 0;
      });
    }
  }

  const std::string server_;
  std::mt19937_64 random_;
  Findings& findings_;
  std::vector<std::string> events_;
  int watches_ = 0;
  std::atomic<uint64_t> until_{UINT64_MAX};
  std::thread thread_;
};

// One client, and what it was told.
class Rover {
 public:
  Rover(const ClaimStorm& storm, const std::string& server, int number,
        const Eigen::Isometry3d& T_world_room, Findings& findings)
      : storm_(storm),
        client_(OptionsFor(server)),
        scanner_(absl::StrCat(kSession, "/scanners/rover-", number)),
        T_world_room_(T_world_room),
        random_(storm.seed * 1000 + static_cast<uint64_t>(number)),
        findings_(findings) {}

  void RunUntil(Clock::time_point end) {
    std::uniform_real_distribution<double> pause(0, 2 * storm_.pause);
    while (Clock::now() < end) {
      Act();
      std::this_thread::sleep_for(std::chrono::duration<double>(pause(random_)));
    }
  }

  // What it was told must be in the log.
  void Compare(const ClaimLog& log) const {
    for (const auto& [name, position] : taken_) {
      const auto it = log.taken().find(name);
      if (it == log.taken().end()) {
        findings_.Broken(absl::StrCat(name, " was granted and is not in the log"));
      } else if (it->second.scanner() != scanner_ ||
                 (client::FromProto(it->second.position()) - position).norm() > 1e-9) {
        findings_.Broken(absl::StrCat(name, " was granted and is another's in the log"));
      }
    }
    for (const std::string& name : released_) {
      if (log.ended().count(name) == 0) findings_.Broken(name + " was released and is held");
    }
    for (const std::string& name : pushed_) {
      if (log.merged().count(name) == 0) findings_.Broken(name + " is merged and not in the log");
    }
    for (const auto& [name, position] : refused_by_) {
      const auto it = log.taken().find(name);
      if (it == log.taken().end()) {
        findings_.Broken(absl::StrCat("refused for ", name, ", which nobody took"));
      } else if (position &&
                 (client::FromProto(it->second.position()) - *position).head<2>().norm() >=
                     ClaimLog::kSeparation) {
        findings_.Broken(absl::StrCat("refused as the same place as ", name, ", which it is not"));
      }
    }
    for (const std::string& name : planned_around_) {
      const auto it = log.taken().find(name);
      if (it == log.taken().end() || it->second.scanner() == scanner_) {
        findings_.Broken(absl::StrCat("planned around ", name, ", nobody's or its own"));
      }
    }
  }

  void AddTo(ClaimStormResult& result) const {
    result.calls += calls_;
    result.refused += refused_by_.size();
    result.pushed += pushed_.size();
    result.planned += planned_;
    result.unknown += unknown_;
  }

 private:
  static client::ClientOptions OptionsFor(const std::string& server) {
    client::ClientOptions options;
    options.server = server;
    return options;
  }

  int Draw(int below) { return std::uniform_int_distribution<int>(0, below - 1)(random_); }

  // Few enough places that several want the same at a time.
  Vector3d Place() {
    const Vector3d in_room(0.7 + 0.4 * Draw(10) + 0.01 * Draw(5), 0.7 + 0.4 * Draw(7), 1.4);
    return T_world_room_ * in_room;
  }

  // True where there is an answer to go by. What may be refused at any time is no fault.
  template <typename Response>
  bool Answered(const absl::StatusOr<Response>& response, const char* what) {
    ++calls_;
    if (response.ok()) return true;
    const absl::Status& status = response.status();
    if (absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status)) {
      ++unknown_;
    } else if (!absl::IsResourceExhausted(status)) {
      findings_.Broken(absl::StrCat(what, ": ", status.ToString()));
    }
    return false;
  }

  void Act() {
    const int draw = Draw(100);
    if (draw < 45) return Claim();
    if (draw < 58) return Renew();
    if (draw < 75) return Release();
    if (draw < 90) return List();
    if (draw < 97) return Plan();
    Push();
  }

  void Claim() {
    v1::ClaimViewRequest request;
    request.set_parent(kSession);
    request.set_scanner(scanner_);
    const Vector3d position = Place();
    *request.mutable_position() = client::ToProto(position);
    request.mutable_ttl()->set_seconds(kShortestTtl + Draw(kLongestTtl - kShortestTtl + 1));
    const auto claimed = client_.Call(request);
    const client::Explanation why =
        client::Explain(claimed.ok() ? absl::OkStatus() : claimed.status());
    if (why.reason == "CLAIMED") {
      ++calls_;
      const bool same_place = why.claim_conflict && why.claim_conflict->same_place();
      refused_by_.emplace_back(why.claim_conflict ? why.claim_conflict->claim() : "",
                               same_place ? std::optional<Vector3d>(position) : std::nullopt);
      return;
    }
    if (!Answered(claimed, "claim")) return;
    taken_.emplace_back(claimed->claim().name(), position);
  }

  // Any that it ever took: most have ended, which is said.
  const std::string& Some() {
    const int recent = std::min<int>(static_cast<int>(taken_.size()), 4);
    return taken_[taken_.size() - 1 - static_cast<size_t>(Draw(recent))].first;
  }

  void Renew() {
    if (taken_.empty()) return;
    v1::RenewClaimRequest request;
    request.set_name(Some());
    request.mutable_ttl()->set_seconds(kShortestTtl);
    const double before = Now();
    const auto renewed = client_.Call(request);
    if (!renewed.ok() && client::Explain(renewed.status()).reason == "CLAIM_ENDED") return;
    if (!Answered(renewed, "renew")) return;
    if (Seconds(renewed->claim().expire_time()) < before + kShortestTtl - 30) {
      findings_.Broken(request.name() + " was renewed into the past");
    }
  }

  void Release() {
    if (taken_.empty()) return;
    v1::ReleaseClaimRequest request;
    request.set_name(Some());
    const auto released = client_.Call(request);
    if (!released.ok() && client::Explain(released.status()).reason == "CLAIM_ENDED") return;
    if (Answered(released, "release")) released_.push_back(request.name());
  }

  void List() {
    v1::ListClaimsRequest request;
    request.set_parent(kSession);
    request.set_page_size(1000);
    const double before = Now();
    const auto listed = client_.Call(request);
    if (!Answered(listed, "list")) return;
    for (int i = 0; i < listed->claims_size(); ++i) {
      const v1::Claim& claim = listed->claims(i);
      if (Seconds(claim.expire_time()) < before) {
        findings_.Broken(absl::StrCat(claim.name(), " is listed after its time"));
      }
      for (int j = 0; j < i; ++j) {
        const double apart =
            (client::FromProto(claim.position()) - client::FromProto(listed->claims(j).position()))
                .head<2>()
                .norm();
        if (apart < ClaimLog::kSeparation) {
          findings_.Broken(absl::StrCat(claim.name(), " and ", listed->claims(j).name(),
                                        " are listed together, ", apart, " m apart"));
        }
      }
    }
  }

  void Plan() {
    v1::CreatePlanRequest request;
    request.set_parent(kSession);
    request.mutable_plan()->add_scanners(scanner_);
    request.mutable_plan()->set_work_limit_rays(kPlanRays);
    const auto created = client_.Call(request);
    if (!Answered(created, "plan")) return;
    const auto plan = client_.WatchPlan(created->plan().name(), [](const v1::Plan&) {});
    if (!Answered(plan, "watch plan")) return;
    ++planned_;
    for (const std::string& claim : plan->result().joint().claims()) {
      planned_around_.push_back(claim);
    }
  }

  void Push() {
    const Vector3d place =
        taken_.empty() ? Place() : Vector3d(taken_.back().second + Vector3d(0.03, -0.02, 0));
    const Vector3d in_room = T_world_room_.inverse() * place;
    v1::Upload upload;
    upload.set_scanner(scanner_);
    sensor::PosePrior prior;
    prior.T_world_scan.linear() = T_world_room_.linear();
    prior.T_world_scan.translation() = place;
    *upload.mutable_prior() = client::ToProto(prior);
    const sensor::RangeImage image =
        fixture::NoisyRoom(in_room, kDegrees, static_cast<uint32_t>(random_()));
    const auto pushed =
        client_.Upload(kSession, upload, image, [](const client::UploadProgress&) {});
    if (!Answered(pushed, "push")) return;
    const auto scan = client_.WaitForScan(*pushed, [](const v1::Scan&) {});
    if (!Answered(scan, "wait for scan")) return;
    if (scan->state() == v1::SCAN_STATE_MERGED) pushed_.push_back(*pushed);
  }

  const ClaimStorm& storm_;
  client::Client client_;
  const std::string scanner_;  // resource name
  const Eigen::Isometry3d T_world_room_;
  std::mt19937_64 random_;
  Findings& findings_;
  std::vector<std::pair<std::string, Vector3d>> taken_;  // m, world
  std::vector<std::string> released_;
  std::vector<std::string> pushed_;
  std::vector<std::pair<std::string, std::optional<Vector3d>>> refused_by_;
  std::vector<std::string> planned_around_;
  size_t calls_ = 0;
  size_t planned_ = 0;
  size_t unknown_ = 0;
};

// A small job: one coarse room that a scan all but finishes. One claim would otherwise cover all
// that is left to gain, and there would be no other. The way from the room's frame into the job's.
absl::StatusOr<Eigen::Isometry3d> Open(client::Client& client, int scanners) {
  v1::CreateSessionRequest create;
  create.set_session_id("storm");
  create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
  v1::PlanningConfig& planning = *create.mutable_session()->mutable_planning_config();
  planning.set_required_density_per_m2(4);
  planning.set_viewcell_size_m(0.4);
  planning.set_max_view_count(3);
  planning.set_max_checked_view_count(5);
  if (const auto created = client.Call(create); !created.ok()) return created.status();
  for (int i = 0; i < scanners; ++i) {
    v1::CreateScannerRequest add;
    add.set_parent(kSession);
    add.set_scanner_id(absl::StrCat("rover-", i));
    add.mutable_scanner();
    if (const auto added = client.Call(add); !added.ok()) return added.status();
  }
  const auto pushed = client.Upload(kSession, {}, fixture::NoisyRoom(kFirstPlace, kDegrees),
                                    [](const client::UploadProgress&) {});
  if (!pushed.ok()) return pushed.status();
  const auto scan = client.WaitForScan(*pushed, [](const v1::Scan&) {});
  if (!scan.ok()) return scan.status();
  if (scan->state() != v1::SCAN_STATE_MERGED) return absl::InternalError(scan->state_message());
  Eigen::Isometry3d T_room_scan = Eigen::Isometry3d::Identity();
  T_room_scan.translation() = kFirstPlace;
  return client::FromProto(scan->pose()) * T_room_scan.inverse();
}

}  // namespace

ClaimStormResult RunClaimStorm(const ClaimStorm& storm) {
  ClaimStormResult result;
  Findings findings;
  client::ClientOptions direct;
  direct.server = storm.server;
  client::Client client(direct);
  const auto T_world_room = Open(client, storm.clients);
  if (!T_world_room.ok()) {
    result.broken = {absl::StrCat("the job cannot be set up: ", T_world_room.status().ToString())};
    return result;
  }
  FaultyProxy link(storm.server, Faults(storm));
  Checker checker(storm.server);
  Visitor visitor(link.address(), storm.seed, findings);
  std::vector<std::unique_ptr<Rover>> rovers;
  std::vector<std::thread> threads;
  const auto clients = static_cast<size_t>(storm.clients);
  rovers.reserve(clients);
  threads.reserve(clients);
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(storm.seconds));
  for (int i = 0; i < storm.clients; ++i) {
    rovers.push_back(std::make_unique<Rover>(storm, link.address(), i, *T_world_room, findings));
  }
  for (const auto& rover : rovers) threads.emplace_back([&, r = rover.get()] { r->RunUntil(end); });
  for (std::thread& thread : threads) thread.join();

  v1::GetSessionRequest get;
  get.set_name(kSession);
  const auto session = client.Call(get);
  if (!session.ok()) findings.Broken(session.status().ToString());
  if (!checker.WaitForRest(session.ok() ? session->session().last_sequence() : 0)) {
    findings.Broken("claims stand, or events are missing, long after everybody has left");
  }
  checker.Stop();
  visitor.Finish(checker.events().size());

  // Told again from the first, it is the same to the byte.
  std::vector<std::string> replayed;
  const auto stub = v1::SessionService::NewStub(ChannelTo(storm.server));
  Listen(*stub, 0, kPatience, [&](const v1::SessionEvent& event) {
    replayed.push_back(event.SerializeAsString());
    return replayed.size() < checker.events().size();
  });
  if (replayed != checker.events()) findings.Broken("told again, the log is another");
  if (visitor.events() != checker.events()) {
    findings.Broken("who came and went heard something else than who stayed");
  }
  for (const auto& rover : rovers) {
    rover->Compare(checker.log());
    rover->AddTo(result);
  }
  result.counts = checker.log().counts();
  result.breaks = link.faults();
  result.watches = visitor.watches();
  result.broken = checker.log().broken();
  for (const std::string& what : findings.broken()) result.broken.push_back(what);
  return result;
}

}  // namespace vantage::faults
