#include <sqlite3.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <random>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/contract/error.h"
#include "server/execution/steadied_clock.h"
#include "server/store/disk_store.h"
#include "tests/faults/fault_figures.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::faults {
namespace {

namespace fs = std::filesystem;

constexpr char kDamagedJob[] = "job";
constexpr char kOtherJob[] = "other";
constexpr double kStepDegrees = 6;
constexpr uint64_t kJumpSeed = 5;

// A server on a folder, and what can be said against what it does.
class Host {
 public:
  // The model that it makes has no snapshot to begin with unless `snapshots`.
  Host(const std::string& folder, bool snapshots, std::vector<std::string>& faults)
      : faults_(faults) {
    script_.EndPlans();
    auto opened = store::DiskStore::Open(folder);
    status_ = opened.status();
    if (!opened.ok()) return;
    store_ = *std::move(opened);
    contract::Limits limits;
    if (!snapshots) limits.snapshots_per_session = 0;
    host_ = std::make_unique<fixture::SessionHost>(*store_, script_.Make(), limits);
    status_ = host_->registry.LoadAll();
    if (status_.ok()) host_->registry.WaitUntilIdle(std::chrono::minutes(1));
  }
  const absl::Status& status() const { return status_; }
  session::SessionRegistry& registry() { return host_->registry; }

  void Say(const std::string& fault) { faults_.push_back(fault); }

  // Everything that was acknowledged is there, and can be read.
  void CheckAll(const std::string& when, const std::string& id) {
    if (!status_.ok()) return Say(absl::StrCat(when, ": no start: ", status_.ToString()));
    const auto session = registry().Find(id);
    if (!session.ok()) return Say(absl::StrCat(when, ": ", session.status().ToString()));
    bool more = false;
    const auto scans = (*session)->scans().List("", 100, more);
    if (!scans.ok() || scans->size() != 2) return Say(when + ": scans are missing");
    for (const v1::Scan& scan : *scans) {
      if (!(*session)->scans().LoadImage(scan.name()).ok()) Say(when + ": a scan is lost");
    }
    const auto upload =
        (*session)->uploads().Get(absl::StrCat("sessions/", id, "/uploads/upload-3"));
    if (!upload.ok() || upload->state() != v1::UPLOAD_STATE_OPEN || upload->next_offset() != 500) {
      Say(when + ": what came of an upload is lost");
    }
    const auto coverage = (*session)->MeasureCoverage();
    if (!coverage.ok() || coverage->model_version() != 2) Say(when + ": the model is another");
  }

 private:
  std::vector<std::string>& faults_;
  absl::Status status_;
  fixture::Script script_;
  std::unique_ptr<store::DiskStore> store_;
  std::unique_ptr<fixture::SessionHost> host_;
};

absl::Status Begin(session::Session& session, const std::string& bytes) {
  const absl::StatusOr<v1::Upload> upload = session.uploads().Create({});
  if (!upload.ok()) return upload.status();
  v1::Piece piece;
  piece.set_data(bytes.substr(0, 500));
  piece.set_crc32c(bytes::Crc32c(piece.data()));
  return session.uploads().Add(upload->name(), &piece, nullptr).status();
}

// Two sessions of the same two scans, without snapshots, and an upload under way in each.
absl::Status Fill(const std::string& folder, std::vector<std::string>& faults) {
  Host host(folder, false, faults);
  if (!host.status().ok()) return host.status();
  for (const char* id : {kDamagedJob, kOtherJob}) {
    const auto session = fixture::OpenSession(host.registry(), id);
    for (const double x : {1.5, 3.0}) {
      const v1::PosePrior prior = fixture::PriorAt(x, 1.5, 1.4);
      const auto sent =
          fixture::SendScan(*session, fixture::EncodedRoom({x, 1.5, 1.4}, kStepDegrees), &prior);
      if (!sent.ok()) return sent.status();
      session->WaitUntilIdle();
    }
    absl::Status begun = Begin(*session, fixture::EncodedRoom({2.0, 2.5, 1.4}, kStepDegrees));
    if (!begun.ok()) return begun;
  }
  return absl::OkStatus();
}

// The checksum beside an entry no longer fits it; with -1 it does again.
bool Rot(const std::string& folder, int sequence, int by) {
  sqlite3* database = nullptr;
  const std::string sql =
      absl::StrCat("UPDATE log SET crc32c = crc32c + ", by, " WHERE session = '", kDamagedJob,
                   "' AND sequence = ", sequence);
  const bool done = sqlite3_open((folder + "/logs.sqlite").c_str(), &database) == SQLITE_OK &&
                    sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK &&
                    sqlite3_changes(database) == 1;
  sqlite3_close(database);
  return done;
}

// What whoever does not know of the damage may do meanwhile.
void MeddleWith(Host& host) {
  v1::CreateSessionRequest create;
  create.set_session_id(kDamagedJob);
  for (int again = 0; again < 2; ++again) {
    if (!absl::IsAlreadyExists(host.registry().Create(create).status())) {
      host.Say("the id of a damaged session was given away");
    }
  }
  if (!host.registry().Delete(kOtherJob).ok()) host.Say("a sound session was not served");
  host.registry().Collect();
}

int RotEntries(const std::string& scratch, const std::string& folder,
               std::vector<std::string>& faults) {
  const std::string copy = scratch + "/rotten";
  int sequence = 1;
  for (;; ++sequence) {
    fs::remove_all(copy);
    fs::copy(folder, copy, fs::copy_options::recursive);
    if (!Rot(copy, sequence, 1)) break;
    for (const bool first : {true, false}) {
      Host host(copy, false, faults);
      if (host.status().ok() && first) MeddleWith(host);
    }
    const std::string when = absl::StrCat("entry ", sequence, " damaged and repaired");
    if (!Rot(copy, sequence, -1)) faults.push_back(when + ": it is gone");
    Host host(copy, false, faults);
    host.CheckAll(when, kDamagedJob);
  }
  return sequence - 1;
}

int RemoveFiles(const std::string& scratch, const std::string& folder,
                std::vector<std::string>& faults) {
  const std::string copy = scratch + "/lacking";
  const std::string aside = scratch + "/aside";
  int files = 0;
  for (const auto& file : fs::recursive_directory_iterator(folder)) {
    const std::string name = fs::relative(file.path(), folder).string();
    // What SQLite makes anew is no loss, nor is the lock; of an upload, its sender has the rest.
    const bool log = name == "logs.sqlite";
    if (!file.is_regular_file() || (!log && !absl::StartsWith(name, "blobs/"))) continue;
    ++files;
    fs::remove_all(copy);
    fs::copy(folder, copy, fs::copy_options::recursive);
    fs::rename(copy + "/" + name, aside);
    for (int start = 0; start < 2; ++start) {
      Host host(copy, false, faults);
      if (log) {
        if (host.status().ok()) host.Say("a server started without logs");
        continue;
      }
      const auto session = host.registry().Find(kDamagedJob);
      if (!session.ok()) {
        host.Say(name + ": its session is not served");
        continue;
      }
      absl::Status said = absl::UnavailableError("");
      while (absl::IsUnavailable(said)) {
        said = (*session)->MeasureCoverage().status();
        (*session)->WaitUntilIdle();
      }
      if (contract::ReasonOf(said) != "DATA_LOST") {
        host.Say(absl::StrCat(name, ": a model without it was shown: ", said.ToString()));
      }
      if ((*session)->Describe().lost_scans_size() != 1) host.Say(name + ": nobody is told");
      host.registry().Collect();
    }
    fs::rename(aside, copy + "/" + name);
    for (const char* id : {kDamagedJob, kOtherJob}) {
      Host host(copy, false, faults);
      host.CheckAll(name + " put back", id);
    }
  }
  return files;
}

}  // namespace

bool MeasureDamage(bench::Figures& figures) {
  const integration::ScratchFolder scratch;
  const std::string folder = scratch.File("data");
  std::vector<std::string> faults;
  const absl::Status filled = Fill(folder, faults);
  if (!filled.ok()) {
    std::cerr << "damage: " << filled << "\n";
    return false;
  }
  const int entries = RotEntries(scratch.path(), folder, faults);
  const int files = RemoveFiles(scratch.path(), folder, faults);
  figures.Add({"damage.entries", static_cast<double>(entries), "", "",
               "each entry of a log damaged in turn; its id asked for, what it shares deleted, "
               "restarted, repaired"});
  figures.Add({"damage.files", static_cast<double>(files), "", "",
               "the database and each scan taken away in turn, two starts, put back"});
  figures.Add({"damage.lost", static_cast<double>(faults.size()), "", "0",
               "something was gone afterwards, or was not said meanwhile"});
  for (const std::string& fault : faults) std::cerr << "LOST: " << fault << "\n";
  return faults.empty();
}

bool MeasureClock(bench::Figures& figures) {
  constexpr int kJumps = 300;
  const integration::ScratchFolder scratch;
  std::vector<std::string> faults;
  absl::Duration passed = absl::Hours(1);  // really
  absl::Duration wrong;                    // of the clock
  const auto store = store::DiskStore::Open(scratch.File("data"));
  if (!store.ok()) {
    std::cerr << "clock: " << store.status() << "\n";
    return false;
  }
  int told = 0;
  execution::SteadiedClock clock(
      [&] { return fixture::FixtureTime() + passed + wrong; }, [&] { return passed; },
      [&](absl::Duration by, bool) { told += by != absl::ZeroDuration(); });
  contract::Limits limits;
  limits.keep_sessions = absl::Hours(24);
  fixture::Script script;
  fixture::SessionHost host(
      **store, script.Make(), limits, [&clock] { return clock.Now(); }, 2,
      std::make_shared<execution::SeenTime>([&passed] { return passed; }));
  const auto session = fixture::OpenSession(host.registry, kDamagedJob);
  const absl::Status begun = Begin(*session, fixture::EncodedRoom({2.0, 2.5, 1.4}, kStepDegrees));
  if (!begun.ok()) faults.push_back(begun.ToString());
  std::mt19937_64 random(kJumpSeed);
  for (int jump = 0; jump < kJumps; ++jump) {
    // From seconds to years, either way; some are corrected at once, some stay. All of it together
    // takes less than a day.
    const double exponent = std::uniform_real_distribution<>(1, 8)(random);
    wrong = (random() % 2 == 0 ? 1 : -1) * absl::Seconds(std::pow(10, exponent));
    passed += absl::Seconds(1 + random() % 120);
    host.registry.Collect();
    if (random() % 2 == 0) wrong = absl::ZeroDuration();
    passed += absl::Seconds(1 + random() % 120);
    host.registry.Collect();
  }
  const auto upload = session->uploads().Get("sessions/job/uploads/upload-1");
  if (!upload.ok() || upload->state() != v1::UPLOAD_STATE_OPEN) faults.push_back("an upload ended");
  if (!host.registry.Find(kDamagedJob).ok()) faults.push_back("a session is gone");
  if (told < kJumps / 2) faults.push_back("jumps were not told");
  passed += absl::Hours(26);
  host.registry.Collect();
  passed += absl::Hours(26);
  host.registry.Collect();
  passed += limits.second_look;
  host.registry.Collect();
  if (host.registry.Find(kDamagedJob).ok()) faults.push_back("what is past its time stays");
  figures.Add({"clock.jumps", kJumps, "", "",
               absl::StrCat("of the wall clock, by seconds to years, while an upload and a session "
                            "wait; seed ",
                            kJumpSeed)});
  figures.Add({"clock.lost", static_cast<double>(faults.size()), "", "0",
               "something ended by a clock that was wrong, or a jump was not told"});
  for (const std::string& fault : faults) std::cerr << "LOST: " << fault << "\n";
  return faults.empty();
}

}  // namespace vantage::faults
