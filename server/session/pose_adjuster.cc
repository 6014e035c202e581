#include "server/session/pose_adjuster.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/model/insert_estimate.h"
#include "core/registration/graph/weak_links.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/conversion/to_proto.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
namespace {

// The name of the work of moving scans, which is no scan's: to that of a version of the model, so
// that what was set aside is tried again once scans have come or gone.
std::string AdjustingWork(uint64_t model_version) { return absl::StrCat("poses-", model_version); }
constexpr std::chrono::seconds kAdjustAgainAfter(5);

// Whether a scan is where the chain has it, and says so.
bool IsThere(const v1::Scan& scan, const ChainedPose& pose) {
  if (scan.has_adjustment() != pose.adjusted) return false;
  if (scan.pose().SerializeAsString() != pose.pose.SerializeAsString()) return false;
  return !pose.adjusted ||
         scan.adjustment().SerializeAsString() == pose.adjustment.SerializeAsString();
}

bool Moves(const v1::Scan& scan, const ChainedPose& pose) {
  return scan.pose().SerializeAsString() != pose.pose.SerializeAsString();
}

double DistanceOf(const v1::Pose& a, const v1::Pose& b) {
  return (conversion::ReadOwnVector(a.translation()) - conversion::ReadOwnVector(b.translation()))
      .norm();
}

}  // namespace

PoseAdjuster::PoseAdjuster(SessionContext& context, ModelMemory& model, Preparation& preparation)
    : context_(context), model_(model), preparation_(preparation), work_(context) {}

void PoseAdjuster::AdjustWhenDue(parallel::Parallel& parallel) {
  if (context_.closed() || context_.draining()) return;  // it is due after the next start as well
  if (!context_.dependencies().algorithms.adjust_poses || !model_.CheckWhole().ok()) return;
  bool due = false;
  uint64_t version = 0;
  context_.journal().Read([&](const SessionState& state) {
    due = state.poses_due;
    version = state.model_version;
  });
  if (!due) return;
  const std::string work = AdjustingWork(version);
  const absl::Status done = contract::UnlessOutOfMemory([&] { return Adjust(work, parallel); });
  const bool set_aside = contract::ReasonOf(done) == "WORK_SET_ASIDE";
  if (!set_aside) work_.End(work);
  if (!done.ok()) RetryLater(done);
}

void PoseAdjuster::RetryLater(const absl::Status& why) {
  context_.dependencies().log.Warning("poses wait to be adjusted",
                                      {{"session", context_.id()}, {"error", why.ToString()}});
  if (contract::ReasonOf(why) == "WORK_SET_ASIDE") return;
  if (retries_.exchange(true)) return;
  context_.After(kAdjustAgainAfter, [this] {
    retries_ = false;
    const bool posted = context_.TryPost([this](parallel::Parallel& parallel) {
      if (model_.Load(parallel).ok()) AdjustWhenDue(parallel);
    });
    if (!posted && !context_.closed()) {
      RetryLater(absl::ResourceExhaustedError("the session's queue is full"));
    }
  });
}

absl::Status PoseAdjuster::Adjust(const std::string& work, parallel::Parallel& parallel) {
  ScanChain chain;
  std::map<std::string, v1::Scan> previews;
  context_.journal().Read([&](const SessionState& state) {
    chain = ReadChain(state, context_.origin());
    for (const v1::Scan& scan : chain.scans) {
      const ScanRecord& record = state.scans.at(scan.name());
      if (!record.preview_blob.empty()) previews[scan.name()] = record.preview;
    }
  });
  const ChainedPoses belong = ChainPoses(chain, context_.dependencies().algorithms);
  for (const std::string& failure : belong.failures) {
    context_.dependencies().log.Warning("poses cannot be adjusted",
                                        {{"session", context_.id()}, {"why", failure}});
  }
  std::vector<Move> moves;
  bool differs = false;
  for (size_t i = 0; i < chain.scans.size(); ++i) {
    differs = differs || !IsThere(chain.scans[i], belong.poses[i]);
    const auto preview = previews.find(chain.scans[i].name());
    moves.push_back(
        {preview == previews.end() ? chain.scans[i] : preview->second, belong.poses[i]});
  }
  if (!differs) return absl::OkStatus();

  if (absl::Status begun = work_.Begin(work); !begun.ok()) return begun;
  preparation_.Stop();
  const absl::Time started = absl::Now();
  if (absl::Status moved = MoveInModel(moves, parallel); !moved.ok()) return moved;
  const double seconds = absl::ToDoubleSeconds(absl::Now() - started);
  absl::Status logged = contract::UnlessOutOfMemory([&] { return Log(moves, seconds); });
  if (!logged.ok()) {
    model_.Forget();  // the log decides; the model follows it
    return logged;
  }
  telemetry::ObserveStage(context_.dependencies().metrics, "adjust poses", seconds);
  model_.Changed(static_cast<size_t>(std::count_if(
      moves.begin(), moves.end(), [](const Move& move) { return Moves(move.scan, move.to); })));
  preparation_.Begin();
  return absl::OkStatus();
}

absl::Status PoseAdjuster::MoveInModel(const std::vector<Move>& moves,
                                       parallel::Parallel& parallel) {
  std::vector<ModelMemory::PosedScan> scans;
  const v1::Scan* largest = nullptr;
  for (const Move& move : moves) {
    if (!Moves(move.scan, move.to)) continue;
    scans.push_back({move.scan, conversion::ReadOwnPose(move.to.pose, context_.origin())});
    if (largest == nullptr || move.scan.encoded_size_bytes() > largest->encoded_size_bytes()) {
      largest = &move.scan;
    }
  }
  if (scans.empty()) return absl::OkStatus();
  // What the largest takes, for each thread where there is room for so many; the layers that come
  // take the room of those that go.
  size_t at_once = std::min(scans.size(), static_cast<size_t>(std::max(1, parallel.width())));
  absl::StatusOr<MemoryAccount::Reservation> reservation =
      model_.Reserve(ModelMemory::EstimateAlignment(*largest));
  if (!reservation.ok()) return reservation.status();
  {
    const absl::StatusOr<sensor::Scan> data = LoadScan(context_, *largest);
    if (!data.ok()) return data.status();
    const model::InsertSize size(*data, model_.config());
    const int64_t each = ModelMemory::DecodedBytes(*data) + size.PeakBytes();
    absl::Status room = model_.Enlarge(*reservation, static_cast<int64_t>(at_once) * each);
    if (!room.ok() && at_once > 1) {
      at_once = 1;
      room = model_.Enlarge(*reservation, each);
    }
    if (!room.ok()) return room;
  }
  absl::Status moved =
      contract::UnlessOutOfMemory([&] { return model_.Move(scans, parallel, at_once).status(); });
  if (!moved.ok()) model_.Forget();
  return moved;
}

absl::Status PoseAdjuster::Log(const std::vector<Move>& moves, double seconds) {
  ModelSnapshot next{model_.Publish(), 0};
  return context_.journal()
      .Execute(
          {},
          [&](const SessionState& state) -> absl::StatusOr<Draft> {
            next.version = state.model_version + 1;
            Draft draft;
            v1::PosesAdjustedEvent& event = *draft.event.mutable_poses_adjusted();
            event.set_model_version(next.version);
            *event.mutable_merge_duration() = conversion::WriteDuration(seconds);
            for (const Move& move : moves) {
              const v1::Scan& scan = state.scans.at(move.scan.name()).scan;
              // A person has given it another pose meanwhile, and it is about to leave the model.
              if (Moves(scan, {move.scan.pose(), {}, false})) continue;
              v1::AdjustedPose& adjusted = *event.add_poses();
              adjusted.set_scan(scan.name());
              *adjusted.mutable_old_pose() = scan.pose();
              *adjusted.mutable_pose() = move.to.pose;
              if (move.to.adjusted) *adjusted.mutable_adjustment() = move.to.adjustment;
              if (!Moves(scan, move.to)) continue;
              event.set_moved_count(event.moved_count() + 1);
              const double distance = DistanceOf(scan.pose(), move.to.pose);
              if (event.most_moved_scan().empty() || distance > event.largest_move_m()) {
                event.set_largest_move_m(distance);
                event.set_most_moved_scan(scan.name());
              }
            }
            return draft;
          },
          [&] { model_.Show(next); })
      .status();
}

absl::StatusOr<v1::PoseGraph> PoseAdjuster::Describe() const {
  v1::PoseGraph out;
  ScanChain chain;
  double farthest = 0;
  context_.journal().Read([&](const SessionState& state) {
    chain = ReadChain(state, context_.origin());
    out.set_model_version(state.model_version);
  });
  out.set_variance_factor(1);
  if (chain.scans.empty() || !context_.dependencies().algorithms.adjust_poses) return out;
  std::vector<Eigen::Isometry3d> poses;
  for (const v1::Scan& scan : chain.scans) {
    poses.push_back(conversion::ReadOwnPose(scan.pose(), context_.origin()));
    farthest = std::max(farthest, scan.scanner_model().max_range_m() / 2);
  }
  const absl::StatusOr<registration::PoseGraph> graph =
      GraphOf(chain, poses.size(), poses, RegistrationsOf(chain, poses));
  if (!graph.ok()) return graph.status();
  const absl::StatusOr<registration::Adjustment> adjustment =
      context_.dependencies().algorithms.adjust_poses(*graph);
  if (!adjustment.ok()) return adjustment.status();
  out.set_variance_factor(adjustment->variance_factor);
  for (const v1::Scan& scan : chain.scans) {
    const size_t node = graph->IndexOf(scan.name());
    const registration::AdjustedScan& adjusted = adjustment->scans[node];
    v1::LinkedScan& linked = *out.add_scans();
    linked.set_scan(scan.name());
    *linked.mutable_pose() = scan.pose();
    for (int i = 0; i < 36; ++i) linked.add_covariance(adjusted.covariance(i / 6, i % 6));
    linked.set_position_sigma_m(adjusted.position_sigma);
    linked.set_held(adjusted.held);
    linked.set_piece_index(static_cast<int32_t>(adjusted.component));
    if (auto worst = WorstLink(*graph, *adjustment, node)) *linked.mutable_worst_link() = *worst;
  }
  std::map<std::pair<std::string, std::string>, size_t> places;
  for (size_t l = 0; l < graph->links().size(); ++l) {
    if (graph->links()[l].origin == registration::LinkOrigin::kModel) continue;
    places[{graph->links()[l].a, graph->links()[l].b}] = l;
  }
  for (const v1::ScanLink& link : chain.links) {
    *out.add_links() = link;
    out.mutable_links()->rbegin()->clear_information();
    out.add_link_test_ratios(
        TestRatio(*adjustment, places.at({link.first_scan(), link.second_scan()})));
  }
  const absl::StatusOr<registration::WeakLinks> weak =
      registration::FindWeakLinks(*graph, *adjustment, farthest);
  if (!weak.ok()) return weak.status();
  std::vector<int32_t> place_of(graph->links().size(), -1);  // in the answer, of the graph's links
  for (int i = 0; i < out.links_size(); ++i) {
    const size_t link = places.at({out.links(i).first_scan(), out.links(i).second_scan()});
    place_of[link] = i;
    out.add_link_sigmas_m(weak->sigmas[link]);
  }
  v1::Connectivity& all = *out.mutable_connectivity();
  all.set_piece_count(static_cast<int32_t>(weak->connectivity.pieces));
  all.set_tied_pair_count(static_cast<int64_t>(weak->connectivity.tied_pairs));
  all.set_mean_path_sigma_m(weak->connectivity.mean_path_sigma);
  all.set_longest_path_sigma_m(weak->connectivity.longest_path_sigma);
  for (const connectivity::CutStation& cut : weak->connectivity.cuts) {
    v1::CutScan& to = *all.add_cut_scans();
    to.set_scan(graph->nodes()[cut.station].id);
    to.set_cut_off_scan_count(static_cast<int32_t>(cut.cut_off));
  }
  for (const connectivity::Bridge& bridge : weak->connectivity.bridges) {
    if (place_of[bridge.link] >= 0) all.add_bridge_indexes(place_of[bridge.link]);
  }
  for (const registration::WeakLink& link : weak->links) {
    v1::WeakLink& to = *out.add_weak_links();
    to.set_first_scan(graph->links()[link.link].a);
    to.set_second_scan(graph->links()[link.link].b);
    to.set_bridge(link.bridge);
    to.set_relative_sigma_m(link.relative_sigma);
    to.set_hanging_scan_count(static_cast<int32_t>(link.hangs_on));
  }
  for (const registration::TieAdvice& advice : weak->advice) {
    v1::TieAdvice& to = *out.add_advice();
    to.set_first_scan(graph->nodes()[advice.a].id);
    to.set_second_scan(graph->nodes()[advice.b].id);
    to.set_distance_m(advice.distance);
    to.set_worst_sigma_before_m(advice.worst_before);
    to.set_worst_sigma_after_m(advice.worst_after);
    to.set_message(advice.words);
  }
  out.set_worst_scan(graph->nodes()[weak->worst_scan].id);
  out.set_worst_sigma_m(weak->worst_sigma);
  return out;
}

}  // namespace vantage::session
