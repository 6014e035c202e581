#include "tests/faults/scripted_job.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/store/disk_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::faults {
namespace {

constexpr size_t kPieces = 3;
constexpr double kDegrees = 5;
constexpr char kJob[] = "job";
constexpr char kOther[] = "other";

absl::Status Lost(absl::string_view what) { return absl::DataLossError(what); }

class Job {
 public:
  Job(session::SessionRegistry& registry, Told known, const std::function<void(const Told&)>& told)
      : registry_(registry), known_(std::move(known)), told_(told) {}

  absl::Status CheckKnown() {
    const auto session = registry_.Find(kJob);
    if (!session.ok() && !known_.events.empty()) return Lost("the session is gone");
    if (session.ok()) {
      (*session)->WaitUntilIdle();
      const auto events = Events(**session);
      if (!events.ok()) return events.status();
      if (events->size() < known_.events.size() ||
          !std::equal(known_.events.begin(), known_.events.end(), events->begin())) {
        return Lost("events are gone");
      }
      for (const auto& [name, bytes] : known_.uploads) {
        const auto upload = (*session)->uploads().Get(name);
        if (!upload.ok()) return Lost(absl::StrCat(name, " is gone"));
        if (upload->state() == v1::UPLOAD_STATE_OPEN && upload->next_offset() < bytes) {
          return Lost(absl::StrCat(name, " has ", upload->next_offset(), " bytes of ", bytes));
        }
        if (upload->state() == v1::UPLOAD_STATE_FAILED) return Lost(name + " has failed");
      }
    }
    if (known_.deleted && registry_.Find(kOther).ok()) return Lost("what was deleted is back");
    return absl::OkStatus();
  }

  absl::StatusOr<JobEnding> Run() {
    v1::CreateSessionRequest create;
    create.set_session_id(kJob);
    create.set_request_id("open");
    create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
    absl::StatusOr<std::shared_ptr<session::Session>> session = registry_.Create(create);
    if (!session.ok()) return session.status();
    Tell(**session);
    absl::Status done = SendScan(**session, 1, {2.0, 1.5, 1.4});
    if (done.ok()) done = MakeOther();
    if (done.ok()) done = SendScan(**session, 2, {3.0, 2.5, 1.4});
    if (done.ok()) done = Withdraw(**session, "sessions/job/scans/scan-1");
    if (done.ok()) done = SendScan(**session, 3, {1.0, 2.0, 1.4});
    if (done.ok()) done = DeleteOther();
    if (!done.ok()) return done;
    return End(**session);
  }

 private:
  static absl::StatusOr<std::vector<std::string>> Events(const session::Session& session) {
    const auto events = const_cast<session::Session&>(session).journal().Events(0, 10'000);
    if (!events.ok()) return events.status();
    std::vector<std::string> serialised;
    for (const v1::SessionEvent& event : *events) serialised.push_back(event.SerializeAsString());
    return serialised;
  }

  void Tell(const session::Session& session) {
    const auto events = Events(session);
    if (events.ok()) known_.events = *events;
    told_(known_);
  }

  absl::Status SendScan(session::Session& session, int number, const Eigen::Vector3d& position) {
    const std::string bytes = fixture::EncodedRoom(position, kDegrees);
    v1::CreateUploadRequest request;
    request.set_request_id(absl::StrCat("upload-", number));
    *request.mutable_upload()->mutable_prior() =
        fixture::PriorAt(position.x(), position.y(), position.z());
    const auto created = session.uploads().Create(request);
    if (!created.ok()) return created.status();
    Tell(session);
    v1::UploadTotal total;
    total.set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
    total.set_sha256(bytes::Sha256::Of(bytes));
    v1::Upload upload = *created;
    while (upload.state() == v1::UPLOAD_STATE_OPEN) {
      v1::Piece piece;
      piece.set_sequence(upload.next_sequence());
      piece.set_offset(upload.next_offset());
      piece.set_data(
          bytes.substr(static_cast<size_t>(upload.next_offset()), bytes.size() / kPieces + 1));
      piece.set_crc32c(bytes::Crc32c(piece.data()));
      const bool more = !piece.data().empty();
      const auto now = session.uploads().Add(upload.name(), more ? &piece : nullptr, &total);
      if (!now.ok()) return now.status();
      upload = *now;
      known_.uploads[upload.name()] = upload.state() == v1::UPLOAD_STATE_OPEN
                                          ? upload.next_offset()
                                          : static_cast<int64_t>(bytes.size());
      Tell(session);
    }
    if (upload.state() != v1::UPLOAD_STATE_COMMITTED) {
      return Lost(absl::StrCat(upload.name(), ": ", upload.state_message()));
    }
    WaitUntilDecided(session, upload.scan());
    session.WaitUntilIdle();
    const auto scan = session.scans().Get(upload.scan());
    if (!scan.ok()) return scan.status();
    const bool withdrawn = scan->state() == v1::SCAN_STATE_WITHDRAWN && number == 1;
    if (scan->state() != v1::SCAN_STATE_MERGED && !withdrawn) {
      return absl::UnavailableError(
          absl::StrCat(upload.scan(), " is still ", v1::ScanState_Name(scan->state())));
    }
    Tell(session);
    return absl::OkStatus();
  }

  // A step that could not be logged is tried again by itself some seconds later.
  static void WaitUntilDecided(session::Session& session, const std::string& scan) {
    std::mutex mutex;
    std::condition_variable changed;
    const session::Journal::WatchId watch = session.journal().Watch([&] {
      const std::lock_guard<std::mutex> lock(mutex);
      changed.notify_all();
    });
    const auto decided = [&] {
      const auto now = session.scans().Get(scan);
      return !now.ok() ||
             (now->state() != v1::SCAN_STATE_RECEIVED &&
              now->state() != v1::SCAN_STATE_REGISTERING && now->state() != v1::SCAN_STATE_MERGING);
    };
    {
      std::unique_lock<std::mutex> lock(mutex);
      changed.wait_for(lock, std::chrono::seconds(8), decided);
    }
    session.journal().Unwatch(watch);
    // What still calls the watcher ends with the operation that it is in.
    session.WaitUntilIdle();
  }

  absl::Status Withdraw(session::Session& session, const std::string& scan) {
    const auto done = session.scans().Withdraw(scan, {"withdraw", "WithdrawScan", scan});
    if (!done.ok()) return done.status();
    Tell(session);
    session.WaitUntilIdle();
    Tell(session);
    return absl::OkStatus();
  }

  // A session whose scan is one of the job's, too: its bytes are shared.
  absl::Status MakeOther() {
    if (known_.deleted || registry_.Find(kOther).ok()) return absl::OkStatus();
    v1::CreateSessionRequest create;
    create.set_session_id(kOther);
    create.set_request_id("other");
    create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
    return registry_.Create(create).status();
  }

  absl::Status DeleteOther() {
    absl::Status done = registry_.Delete(kOther).status();
    if (!done.ok() && !absl::IsNotFound(done)) return done;
    known_.deleted = true;
    told_(known_);
    return absl::OkStatus();
  }

  absl::StatusOr<JobEnding> End(session::Session& session) {
    JobEnding ending;
    for (int attempt = 0; ending.plan.empty(); ++attempt) {
      v1::CreatePlanRequest request;
      request.set_request_id(absl::StrCat("plan-", attempt));
      request.mutable_plan()->set_work_limit_rays(100'000);
      request.mutable_plan()->set_seed(7);
      auto plan = session.plans().Create(request);
      if (!plan.ok()) return plan.status();
      Tell(session);
      if (!registry_.WaitUntilIdle(std::chrono::seconds(60))) return Lost("a plan never ends");
      plan = session.plans().Get(plan->name());
      if (!plan.ok()) return plan.status();
      Tell(session);
      // One that was under way when the server stopped has failed, and says so.
      if (plan->state() != v1::PLAN_STATE_SUCCEEDED) {
        if (attempt > 3) return Lost(absl::StrCat("no plan succeeds: ", plan->state_message()));
        continue;
      }
      v1::PlanResult ranking;
      *ranking.mutable_views() = plan->result().views();
      ending.plan = ranking.SerializeAsString();
    }
    bool more = false;
    std::vector<v1::Scan> scans = session.scans().List("", 100, more).value();
    for (v1::Scan& scan : scans) {
      scan.mutable_merge()->clear_carve_duration();
      scan.mutable_merge()->clear_merge_duration();
      // A plan that a crash ended is asked for again, under the next name.
      if (scan.merge().has_promise()) scan.mutable_merge()->mutable_promise()->clear_plan();
      scan.mutable_registration()->clear_duration();
      ending.scans.push_back(scan.DebugString());
    }
    const session::ModelSnapshot model = session.model().Current();
    if (model.view == nullptr) return Lost("there is no model");
    if (!scans.back().has_adjustment()) return Lost("the last scan is where it was registered");
    for (const model::BrickAt& at : model.view->bricks()) {
      for (int i = 0; i < 3; ++i) absl::StrAppend(&ending.model, at.brick[i], " ");
      for (const model::VoxelState state : at.contents->state) {
        ending.model += static_cast<char>('0' + static_cast<int>(state));
      }
      for (const model::SurfaceVoxel& voxel : at.contents->surface) {
        const std::string floats(reinterpret_cast<const char*>(&voxel.centroid), sizeof(float) * 6);
        absl::StrAppend(&ending.model, floats, voxel.samples, " ", voxel.area, voxel.density);
      }
    }
    for (const model::Station& station : model.view->stations()) {
      absl::StrAppend(&ending.model, station.position.x(), ",", station.position.y(), ";");
    }
    return ending;
  }

  session::SessionRegistry& registry_;
  Told known_;
  const std::function<void(const Told&)>& told_;
};

}  // namespace

absl::StatusOr<JobEnding> RunScriptedJob(const std::string& folder, const Told& known,
                                         const std::function<void(const Told&)>& told,
                                         const std::function<bool(const absl::Status&)>& mend) {
  absl::StatusOr<std::unique_ptr<store::DiskStore>> store = store::DiskStore::Open(folder);
  if (!store.ok()) return store.status();
  fixture::Script script;
  // Poses are adjusted when the second scan comes, when the first one goes, and when the third one
  // comes.
  const auto apart = [](double x, double y) {
    return Eigen::Isometry3d(Eigen::Translation3d(x, y, 0));
  };
  script.TieScans({{{"sessions/job/scans/scan-1", "sessions/job/scans/scan-2"}, apart(1.03, 1)},
                   {{"sessions/job/scans/scan-2", "sessions/job/scans/scan-3"}, apart(-2, -0.54)}});
  session::Algorithms algorithms = script.Make();
  algorithms.make_plan = session::Algorithms::Core().make_plan;
  fixture::SessionHost around(**store, std::move(algorithms));
  absl::Status loaded = around.registry.LoadAll();
  if (!loaded.ok()) return loaded;
  Job job(around.registry, known, told);
  absl::Status kept = job.CheckKnown();
  if (!kept.ok()) return kept;
  absl::StatusOr<JobEnding> ending = job.Run();
  while (!ending.ok() && mend(ending.status())) {
    kept = job.CheckKnown();
    if (!kept.ok()) return kept;
    ending = job.Run();
  }
  around.registry.WaitUntilIdle(std::chrono::seconds(60));
  return ending;
}

}  // namespace vantage::faults
