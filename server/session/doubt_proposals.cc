#include "server/session/doubt_proposals.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "core/bytes/checksum.h"
#include "core/registration/graph/settled_doubt.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/conversion/to_proto.h"
#include "server/session/scan_alignment.h"
#include "server/session/scan_links.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
namespace {

// m: a pose that is proposed and moves by less is not told again.
constexpr double kSameProposal = 0.001;

// Whether a scan waits for a person since its alignment left its pose open; not so where it has the
// samples of another one, was too large, or ended the server.
bool IsInDoubt(const v1::Scan& scan) {
  if (scan.state() != v1::SCAN_STATE_DOUBTFUL && scan.state() != v1::SCAN_STATE_FAILED)
    return false;
  if (!scan.has_registration()) return false;
  return scan.has_pose_proposal() || scan.state_message() == DoubtWords(scan.registration());
}

bool TellsTheSame(const v1::PoseProposal& before, const v1::PoseProposal& now) {
  if (before.has_rival_pose() != now.has_rival_pose() || before.rival_pose() != now.rival_pose()) {
    return false;
  }
  const Eigen::Vector3d moved =
      conversion::ReadOwnVector(before.registration().pose().translation()) -
      conversion::ReadOwnVector(now.registration().pose().translation());
  if (moved.norm() > kSameProposal) return false;
  // Who is named has to be there still; more that agree are no news.
  return std::all_of(
      before.agreeing_scans().begin(), before.agreeing_scans().end(), [&](const std::string& scan) {
        return std::find(now.agreeing_scans().begin(), now.agreeing_scans().end(), scan) !=
               now.agreeing_scans().end();
      });
}

}  // namespace

std::string DoubtWords(const v1::Registration& registration) {
  const v1::RegistrationVerdict& verdict = registration.verdict();
  return absl::StrCat(verdict.message(),
                      verdict.remedy().empty() ? "" : "; remedy: ", verdict.remedy());
}

std::string EtagOfDoubt(const v1::Scan& scan) {
  const bool waits =
      scan.state() == v1::SCAN_STATE_DOUBTFUL || scan.state() == v1::SCAN_STATE_FAILED;
  if (!waits || !scan.has_registration()) return "";
  std::string chosen_among = absl::StrCat(scan.state(), scan.sha256());
  const v1::Registration& registration = scan.registration();
  absl::StrAppend(&chosen_among, registration.pose().SerializeAsString());
  for (const v1::RivalPose& rival : registration.rival_poses()) {
    absl::StrAppend(&chosen_among, rival.pose().SerializeAsString());
  }
  if (scan.has_pose_proposal()) {
    absl::StrAppend(&chosen_among, "proposed",
                    scan.pose_proposal().registration().pose().SerializeAsString());
  }
  return absl::StrFormat("%08x", bytes::Crc32c(chosen_among));
}

void DoubtProposals::PostWhenDue() {
  if (!context_.dependencies().algorithms.try_doubts_again || posted_) return;
  if (context_.closed() || context_.draining() || !model_.loaded()) return;
  if (NextDue().empty()) return;
  // A queue that is full has scans in it, which come back here.
  posted_ = context_.TryPost([this](parallel::Parallel& parallel) {
    posted_ = false;
    TryNext(parallel);
  });
}

std::string DoubtProposals::NextDue() const {
  std::string next;
  uint64_t oldest = std::numeric_limits<uint64_t>::max();
  context_.journal().Read([&](const SessionState& state) {
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (record.in_model || !IsInDoubt(record.scan)) continue;
      // Nothing has changed since it was judged.
      const bool fresh = !record.scan.has_pose_proposal() &&
                         record.scan.registration().model_version() == state.model_version;
      const auto tried = tried_.find(name);
      const uint64_t at = tried == tried_.end() ? 0 : tried->second;
      if (fresh || at == state.model_version || at >= oldest) continue;
      oldest = at;
      next = name;
    }
  });
  return next;
}

void DoubtProposals::TryNext(parallel::Parallel& parallel) {
  if (context_.closed() || context_.draining() || context_.halted()) return;
  if (!model_.loaded() || !model_.CheckWhole().ok()) return;
  const std::string name = NextDue();
  if (name.empty()) return;
  uint64_t version = 0;
  context_.journal().Read([&](const SessionState& state) { version = state.model_version; });
  const absl::Status done = contract::UnlessOutOfMemory([&] { return Try(name, parallel); });
  // Also where it could not be: it is tried again when the model has changed once more.
  tried_[name] = version;
  if (!done.ok()) {
    context_.dependencies().log.Info(
        "a scan in doubt was not tried again",
        {{"session", context_.id()}, {"scan", name}, {"why", done.ToString()}});
  }
  PostWhenDue();
}

absl::Status DoubtProposals::Try(const std::string& name, parallel::Parallel& parallel) {
  v1::Scan scan;
  context_.journal().Read([&](const SessionState& state) { scan = state.scans.at(name).scan; });
  const ModelSnapshot model = model_.Current();
  std::optional<v1::PoseProposal> proposal;
  if (model.view != nullptr) {
    const std::string work = absl::StrCat(name, "-doubt-", model.version);
    if (absl::Status begun = work_.Begin(work); !begun.ok()) return begun;
    absl::StatusOr<std::optional<v1::PoseProposal>> found = Find(scan, model, parallel);
    work_.End(work);
    if (!found.ok()) return found.status();
    proposal = *std::move(found);
  }
  const bool had = scan.has_pose_proposal();
  if (!had && !proposal.has_value()) return absl::OkStatus();
  if (had && proposal.has_value() && TellsTheSame(scan.pose_proposal(), *proposal)) {
    return absl::OkStatus();
  }
  return Log(scan, proposal);
}

absl::StatusOr<std::optional<v1::PoseProposal>> DoubtProposals::Find(const v1::Scan& scan,
                                                                     const ModelSnapshot& model,
                                                                     parallel::Parallel& parallel) {
  absl::StatusOr<MemoryAccount::Reservation> reservation =
      model_.Reserve(ModelMemory::EstimateAlignment(scan));
  if (!reservation.ok()) return reservation.status();
  absl::StatusOr<sensor::Scan> data = LoadScan(context_, scan);
  if (!data.ok()) return data.status();
  absl::Status room = model_.Enlarge(
      *reservation, ModelMemory::DecodedBytes(*data) + ModelMemory::EstimateAlignment(scan));
  if (!room.ok()) return room;
  const absl::Time started = absl::Now();
  const absl::StatusOr<registration::RegistrationResult> result =
      AlignToModel(context_, *model.view, scan, *data, parallel);
  if (!result.ok()) return result.status();
  telemetry::ObserveStage(context_.dependencies().metrics, "try a doubt again",
                          absl::ToDoubleSeconds(absl::Now() - started));
  // Links cannot make it register, only speak against it: without them is enough to know.
  if (!result->verdict.registered()) return std::nullopt;

  const v1::Registration& before = scan.registration();
  std::vector<Eigen::Isometry3d> at = {result->T_world_scan};
  at.push_back(conversion::ReadOwnPose(before.pose(), context_.origin()));
  for (const v1::RivalPose& rival : before.rival_poses()) {
    at.push_back(conversion::ReadOwnPose(rival.pose(), context_.origin()));
  }
  const std::vector<std::vector<registration::PairAtPose>> pairs =
      PairsAtPoses(context_, model_, scan, *data, at, before.model_version(), parallel);
  std::vector<registration::DoubtfulPose> poses;
  for (size_t i = 1; i < at.size(); ++i) poses.push_back({at[i], pairs[i]});
  const std::optional<registration::SettledDoubt> settled =
      registration::SettleDoubt(*result, pairs[0], poses);
  if (!settled.has_value()) return std::nullopt;
  v1::PoseProposal proposal;
  if (settled->pose.has_value()) proposal.set_rival_pose(static_cast<int32_t>(*settled->pose));
  *proposal.mutable_registration() =
      conversion::WriteRegistration(*result, model.version, context_.origin());
  *proposal.mutable_pose_reference() = NearestInModel(context_, scan, result->T_world_scan);
  *proposal.mutable_agreeing_scans() = {settled->agreeing.begin(), settled->agreeing.end()};
  *proposal.mutable_contradicting_scans() = {settled->contradicting.begin(),
                                             settled->contradicting.end()};
  proposal.set_message(settled->words);
  return proposal;
}

absl::Status DoubtProposals::Log(const v1::Scan& as_read,
                                 const std::optional<v1::PoseProposal>& proposal) {
  absl::Status logged =
      context_.journal()
          .Execute({},
                   [&](const SessionState& state) -> absl::StatusOr<Draft> {
                     const auto it = state.scans.find(as_read.name());
                     const bool same =
                         it != state.scans.end() &&
                         it->second.scan.SerializeAsString() == as_read.SerializeAsString();
                     if (!same) return absl::AbortedError("the scan changed meanwhile");
                     Draft draft;
                     v1::Scan& next = *draft.event.mutable_scan_refused()->mutable_scan();
                     next = it->second.scan;
                     next.set_state_message(DoubtWords(next.registration()));
                     next.clear_pose_proposal();
                     if (proposal.has_value()) {
                       *next.mutable_pose_proposal() = *proposal;
                       next.set_state_message(
                           absl::StrCat(proposal->message(),
                                        "; remedy: accept what is proposed, if nothing else "
                                        "speaks against it (at first: ",
                                        DoubtWords(next.registration()), ")"));
                     }
                     next.set_etag(EtagOfDoubt(next));
                     *next.mutable_update_time() = conversion::WriteTime(context_.journal().Now());
                     return draft;
                   })
          .status();
  // A person has decided about it.
  if (absl::IsAborted(logged)) return absl::OkStatus();
  if (logged.ok()) {
    context_.dependencies().log.Info(
        proposal.has_value() ? "a pose is proposed" : "a pose is proposed no more",
        {{"session", context_.id()},
         {"scan", as_read.name()},
         {"why", proposal.has_value() ? proposal->message() : std::string()}});
  }
  return logged;
}

}  // namespace vantage::session
