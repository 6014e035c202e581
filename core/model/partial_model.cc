#include "core/model/partial_model.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/model/carve/carve.h"
#include "core/model/carve/scan_layer.h"
#include "core/model/merge/merge.h"
#include "core/model/merge/merge_all.h"
#include "core/model/merge/model_octree.h"
#include "core/model/merge/reflection_mask.h"
#include "core/model/merge/shared_reflections.h"
#include "core/model/merge/site_changes.h"
#include "core/model/snapshot/snapshot.h"
#include "core/model/view/algorithm_version.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/model_config.h"

namespace vantage::model {

struct PartialModel::State {
  explicit State(const ModelConfig& model_config)
      : config(model_config),
        octree(model_config.voxel_size),
        all_empty(MakeAllEmpty()),
        view(std::make_shared<const PlanningView>(
            model_config.voxel_size, 0, std::vector<BrickAt>{}, std::vector<Station>{})) {}

  ModelConfig config;
  ModelOctree octree;
  ModelLeaf all_empty;
  std::shared_ptr<const PlanningView> view;  // of the octree as it is
  std::map<std::string, std::unique_ptr<ScanLayer>> layers;
  SharedReflections shared_reflections;  // of the layers
  std::vector<Aperture> apertures;  // of all layers and of what they tell together, model frame
  std::vector<std::string> order;   // in which the scans came, for the stations only
  uint64_t version = 0;

  std::vector<const ScanLayer*> Layers() const {
    std::vector<const ScanLayer*> all;
    for (const auto& [id, layer] : layers) all.push_back(layer.get());
    return all;
  }

  std::vector<Station> Stations() const {
    std::vector<Station> stations;
    stations.reserve(order.size());
    for (const std::string& id : order) stations.push_back(layers.at(id)->station);
    return stations;
  }

  // Brings the model up to date after `touched` was added to the layers or taken out of them.
  void Merge(const ScanLayer& touched, LayerChange change, parallel::Parallel& parallel,
             MergeReport& report) {
    const std::vector<BrickKey> also = ApplyReflectionMasks(touched);
    const MergeResult merged = MergeAround(touched, change, also, Layers(), config.voxel_size,
                                           all_empty, parallel, octree);
    report.samples = touched.samples;
    report.empty_voxels = touched.empty_voxels;
    report.surface_voxels = touched.surface_voxels;
    report.recomputed_bricks = merged.recomputed;
    report.changed_bricks = merged.changed.size() + merged.emptied.size();
    report.version = ++version;
    view = std::make_shared<const PlanningView>(*view, version, merged.changed, Stations(),
                                                merged.emptied);
    report.copied_pages = view->copied_pages();
  }

  std::vector<Aperture> AllApertures() const {
    std::vector<Aperture> all = shared_reflections.Apertures();
    for (const auto& [id, layer] : layers) {
      for (const Reflector& reflector : layer->reflectors) {
        all.push_back(reflector.aperture.InFrame(layer->T_model_scan));
      }
    }
    return all;
  }

  // After `touched` came or went: takes reflections out of it, and out of all layers where it has
  // changed what is known of reflectors. Returns the bricks, beside its own, for which that may
  // matter.
  std::vector<BrickKey> ApplyReflectionMasks(const ScanLayer& touched) {
    const std::vector<Aperture> before = std::exchange(apertures, AllApertures());
    std::vector<Aperture> differ;
    const auto add_missing = [&differ](const std::vector<Aperture>& from,
                                       const std::vector<Aperture>& in) {
      for (const Aperture& aperture : from) {
        if (std::find(in.begin(), in.end(), aperture) == in.end()) differ.push_back(aperture);
      }
    };
    add_missing(before, apertures);
    add_missing(apertures, before);
    std::vector<BrickKey> changed;
    for (const auto& [id, layer] : layers) {
      if (layer.get() != &touched && differ.empty()) continue;
      const std::vector<BrickKey> keys = ApplyReflectionMask(apertures, config.voxel_size, *layer);
      changed.insert(changed.end(), keys.begin(), keys.end());
    }
    // Where a layer looks through a reflector that came or went, the reason why space is unknown
    // has changed, too.
    const double side = Brick::kSide * config.voxel_size;
    for (const Aperture& aperture : differ) {
      octree.ForEach([&](const VoxelIndex& brick, const ModelLeaf&) {
        const Eigen::Vector3d middle = (brick.cast<double>().array() + 0.5) * side;
        const bool shadowed = std::any_of(layers.begin(), layers.end(), [&](const auto& entry) {
          return aperture.MayHide(entry.second->T_model_scan.translation(), middle, 2 * side);
        });
        if (shadowed) changed.push_back(KeyOf(brick));
      });
    }
    return changed;
  }
};

namespace {

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool IsRigid(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d R = pose.linear();
  return pose.matrix().allFinite() && (R * R.transpose()).isIdentity(1e-6) && R.determinant() > 0;
}

absl::Status CheckInput(const sensor::Scan& scan, const Eigen::Isometry3d& T_model_scan,
                        const ModelConfig& config) {
  if (absl::Status status = scan.image.Validate(); !status.ok()) return status;
  if (absl::Status status = scan.scanner.Validate(); !status.ok()) return status;
  if (!IsRigid(T_model_scan)) {
    return absl::InvalidArgumentError("pose: must be a rigid transform of finite numbers");
  }
  const Eigen::Vector3d stands = T_model_scan.translation();
  if ((stands.cwiseAbs().array() > config.max_half_extent.array()).any()) {
    return absl::OutOfRangeError(absl::StrCat(
        "the scanner stands at (", stands.x(), ", ", stands.y(), ", ", stands.z(),
        ") m, outside the site, whose limit is ", config.max_half_extent.x(), " x ",
        config.max_half_extent.y(), " x ", config.max_half_extent.z(), " m from the origin"));
  }
  return absl::OkStatus();
}

// Of the scans in the model, the share above which moved ones are merged together: each of them,
// merged alone, has what it touched and touches recomputed, and a place is seen by some four scans.
constexpr size_t kShareMovedAlone = 8;

}  // namespace

PartialModel::PartialModel(std::unique_ptr<State> state) : state_(std::move(state)) {}
PartialModel::~PartialModel() = default;

absl::StatusOr<std::unique_ptr<PartialModel>> PartialModel::Create(const ModelConfig& config) {
  if (absl::Status status = config.Validate(); !status.ok()) return status;
  return std::unique_ptr<PartialModel>(new PartialModel(std::make_unique<State>(config)));
}

absl::StatusOr<MergeReport> PartialModel::Insert(absl::string_view id, const sensor::Scan& scan,
                                                 const Eigen::Isometry3d& T_model_scan,
                                                 parallel::Parallel& parallel,
                                                 int64_t memory_limit) {
  State& state = *state_;
  if (state.layers.contains(std::string(id))) {
    return absl::AlreadyExistsError(absl::StrCat("scan '", id, "' is in the model already"));
  }
  if (absl::Status status = CheckInput(scan, T_model_scan, state.config); !status.ok()) {
    return status;
  }

  MergeReport report;
  const auto start = std::chrono::steady_clock::now();
  absl::StatusOr<std::unique_ptr<ScanLayer>> carved =
      CarveWithin(memory_limit, scan, T_model_scan, state.config, parallel);
  if (!carved.ok()) return carved.status();
  std::unique_ptr<ScanLayer> layer = *std::move(carved);
  report.carve_seconds = SecondsSince(start);
  report.beyond_range = layer->cut.beyond_range;
  report.beyond_site = layer->cut.beyond_site;
  report.sky_rays = layer->sky_rays;

  const auto merge_start = std::chrono::steady_clock::now();
  const ScanLayer& touched = *layer;
  state.layers.emplace(id, std::move(layer));
  state.order.emplace_back(id);
  state.shared_reflections.Add(std::string(id), state.layers, parallel);
  const std::shared_ptr<const PlanningView> before = state.view;
  state.Merge(touched, LayerChange::kAdded, parallel, report);
  report.changes = FindSiteChanges(*before, std::string(id), state.layers, state.order);
  report.merge_seconds = SecondsSince(merge_start);
  return report;
}

absl::StatusOr<MergeReport> PartialModel::Withdraw(absl::string_view id,
                                                   parallel::Parallel& parallel) {
  State& state = *state_;
  const auto it = state.layers.find(std::string(id));
  if (it == state.layers.end()) {
    return absl::NotFoundError(absl::StrCat("scan '", id, "' is not in the model"));
  }
  const auto start = std::chrono::steady_clock::now();
  const std::unique_ptr<ScanLayer> layer = std::move(it->second);
  state.layers.erase(it);
  std::erase(state.order, std::string(id));
  state.shared_reflections.Remove(std::string(id), state.layers, parallel);
  MergeReport report;
  state.Merge(*layer, LayerChange::kRemoved, parallel, report);
  report.merge_seconds = SecondsSince(start);
  return report;
}

absl::StatusOr<MergeReport> PartialModel::Replace(absl::string_view old, absl::string_view id,
                                                  const sensor::Scan& scan,
                                                  const Eigen::Isometry3d& T_model_scan,
                                                  parallel::Parallel& parallel,
                                                  int64_t memory_limit) {
  std::vector<std::string>& order = state_->order;
  const auto place = std::find(order.begin(), order.end(), old) - order.begin();
  if (static_cast<size_t>(place) == order.size()) {
    return absl::NotFoundError(absl::StrCat("scan '", old, "' is not in the model"));
  }
  absl::StatusOr<MergeReport> inserted = Insert(id, scan, T_model_scan, parallel, memory_limit);
  if (!inserted.ok()) return inserted;
  order.pop_back();
  order[static_cast<size_t>(place)] = std::string(id);
  absl::StatusOr<MergeReport> withdrawn = Withdraw(old, parallel);
  if (!withdrawn.ok()) return withdrawn;
  inserted->version = withdrawn->version;
  inserted->recomputed_bricks += withdrawn->recomputed_bricks;
  inserted->changed_bricks += withdrawn->changed_bricks;
  inserted->copied_pages += withdrawn->copied_pages;
  inserted->merge_seconds += withdrawn->merge_seconds;
  return inserted;
}

absl::StatusOr<MergeReport> PartialModel::Move(
    std::span<const ScanMove> moves,
    absl::FunctionRef<absl::StatusOr<sensor::Scan>(absl::string_view id)> load,
    parallel::Parallel& parallel, int64_t memory_limit, size_t at_once) {
  for (const ScanMove& move : moves) {
    if (state_->layers.contains(move.id)) continue;
    return absl::NotFoundError(absl::StrCat("scan '", move.id, "' is not in the model"));
  }
  return moves.size() * kShareMovedAlone <= state_->layers.size()
             ? MoveEach(moves, load, parallel, memory_limit)
             : MoveTogether(moves, load, parallel, memory_limit, at_once);
}

absl::StatusOr<MergeReport> PartialModel::MoveEach(
    std::span<const ScanMove> moves,
    absl::FunctionRef<absl::StatusOr<sensor::Scan>(absl::string_view id)> load,
    parallel::Parallel& parallel, int64_t memory_limit) {
  State& state = *state_;
  const std::vector<std::string> order = state.order;
  MergeReport sum;
  for (const ScanMove& move : moves) {
    const absl::StatusOr<sensor::Scan> scan = load(move.id);
    if (!scan.ok()) return scan.status();
    const absl::StatusOr<MergeReport> out = Withdraw(move.id, parallel);
    if (!out.ok()) return out.status();
    const absl::StatusOr<MergeReport> in =
        Insert(move.id, *scan, move.T_model_scan, parallel, memory_limit);
    if (!in.ok()) return in.status();
    for (const MergeReport* report : {&*out, &*in}) {
      sum.recomputed_bricks += report->recomputed_bricks;
      sum.changed_bricks += report->changed_bricks;
      sum.copied_pages += report->copied_pages;
      sum.carve_seconds += report->carve_seconds;
      sum.merge_seconds += report->merge_seconds;
    }
    sum.samples += in->samples;
    sum.empty_voxels += in->empty_voxels;
    sum.surface_voxels += in->surface_voxels;
  }
  state.order = order;
  sum.version = ++state.version;
  state.view = std::make_shared<const PlanningView>(*state.view, sum.version,
                                                    std::span<const BrickAt>(), state.Stations());
  return sum;
}

absl::StatusOr<MergeReport> PartialModel::MoveTogether(
    std::span<const ScanMove> moves,
    absl::FunctionRef<absl::StatusOr<sensor::Scan>(absl::string_view id)> load,
    parallel::Parallel& parallel, int64_t memory_limit, size_t at_once) {
  State& state = *state_;
  MergeReport report;
  const auto carve_start = std::chrono::steady_clock::now();
  const auto carve = [&](const ScanMove& move) -> absl::Status {
    const absl::StatusOr<sensor::Scan> scan = load(move.id);
    if (!scan.ok()) return scan.status();
    absl::Status valid = CheckInput(*scan, move.T_model_scan, state.config);
    if (!valid.ok()) return valid;
    std::unique_ptr<ScanLayer>& layer = state.layers.at(move.id);
    layer.reset();  // its room is for what comes in its place
    absl::StatusOr<std::unique_ptr<ScanLayer>> carved =
        CarveWithin(memory_limit, *scan, move.T_model_scan, state.config, parallel);
    if (!carved.ok()) return carved.status();
    layer = *std::move(carved);
    return absl::OkStatus();
  };
  // A thread of its own for each of those at once; who has none left helps the others inside.
  const size_t lanes = std::clamp<size_t>(
      at_once, 1, std::min(moves.size(), static_cast<size_t>(std::max(1, parallel.width()))));
  std::vector<absl::Status> outcomes(lanes);
  std::atomic<bool> failed{false};
  parallel.For(lanes, [&](size_t lane) {
    for (size_t i = lane; i < moves.size() && !failed; i += lanes) {
      outcomes[lane] = carve(moves[i]);
      if (!outcomes[lane].ok()) failed = true;
    }
  });
  for (const absl::Status& outcome : outcomes) {
    if (!outcome.ok()) return outcome;
  }
  report.carve_seconds = SecondsSince(carve_start);
  for (const ScanMove& move : moves) {
    const ScanLayer& layer = *state.layers.at(move.id);
    report.samples += layer.samples;
    report.empty_voxels += layer.empty_voxels;
    report.surface_voxels += layer.surface_voxels;
  }

  const auto start = std::chrono::steady_clock::now();
  // Each is asked about those before it and they about it: every pair once.
  SharedReflections::Layers layers = std::exchange(state.layers, {});
  state.shared_reflections = SharedReflections();
  for (auto& [id, layer] : layers) {
    state.layers.emplace(id, std::move(layer));
    state.shared_reflections.Add(id, state.layers, parallel);
  }
  state.apertures = state.AllApertures();
  for (const auto& [id, layer] : state.layers) {
    ApplyReflectionMask(state.apertures, state.config.voxel_size, *layer);
  }
  const MergeResult merged =
      MergeAll(state.Layers(), state.config.voxel_size, state.all_empty, parallel, state.octree);
  report.recomputed_bricks = merged.recomputed;
  report.changed_bricks = merged.changed.size() + merged.emptied.size();
  report.version = ++state.version;
  state.view = std::make_shared<const PlanningView>(*state.view, report.version, merged.changed,
                                                    state.Stations(), merged.emptied);
  report.copied_pages = state.view->copied_pages();
  report.merge_seconds = SecondsSince(start);
  return report;
}

absl::Status PartialModel::Reorder(std::vector<std::string> ids) {
  State& state = *state_;
  if (!std::is_permutation(ids.begin(), ids.end(), state.order.begin(), state.order.end())) {
    return absl::InvalidArgumentError("an order of other scans than those in the model");
  }
  if (ids == state.order) return absl::OkStatus();
  state.order = std::move(ids);
  state.view = std::make_shared<const PlanningView>(*state.view, state.version,
                                                    std::span<const BrickAt>(), state.Stations());
  return absl::OkStatus();
}

std::string PartialModel::Save(parallel::Parallel& parallel) const {
  const BrickRange bricks = state_->view->bricks();
  return EncodeSnapshot({state_->config, state_->version, algorithm_version()}, state_->order,
                        state_->layers, std::vector<BrickAt>(bricks.begin(), bricks.end()),
                        state_->all_empty, parallel);
}

absl::StatusOr<std::unique_ptr<PartialModel>> PartialModel::Load(absl::string_view snapshot,
                                                                 size_t max_bytes,
                                                                 parallel::Parallel& parallel) {
  const ModelLeaf all_empty = MakeAllEmpty();
  absl::StatusOr<ModelParts> parts = DecodeSnapshot(snapshot, max_bytes, all_empty, parallel);
  if (!parts.ok()) return parts.status();
  auto state = std::make_unique<State>(parts->site.config);
  state->all_empty = all_empty;
  state->version = parts->site.version;
  state->order = std::move(parts->order);
  // Each is asked about those before it and they about it: every pair once.
  for (auto& [id, layer] : parts->layers) {
    state->layers.emplace(id, std::move(layer));
    state->shared_reflections.Add(id, state->layers, parallel);
  }
  state->apertures = state->AllApertures();
  for (const auto& [id, layer] : state->layers) {
    layer->site = state->config.max_half_extent;
    ApplyReflectionMask(state->apertures, state->config.voxel_size, *layer);
  }
  for (const BrickAt& at : parts->bricks) state->octree.Set(at.brick, at.contents);
  state->view = std::make_shared<const PlanningView>(state->config.voxel_size, state->version,
                                                     std::move(parts->bricks), state->Stations());
  return std::unique_ptr<PartialModel>(new PartialModel(std::move(state)));
}

std::shared_ptr<const PlanningView> PartialModel::Publish() const { return state_->view; }

int64_t PartialModel::Bytes() const {
  constexpr size_t kHeap = 16;  // that the allocator adds to each piece
  // Of a brick with contents of its own: the counted pointer's block, its places in the octree and
  // in its page.
  constexpr size_t kPlaces = kHeap + 16 + sizeof(ModelNode) + kHeap + 16 + sizeof(BrickMask);
  size_t bytes = sizeof(State);
  for (const auto& [id, layer] : state_->layers) bytes += layer->Bytes();
  const PlanningView& view = *state_->view;
  bytes += view.pages() * (sizeof(BrickPage) + 8 * sizeof(ModelNode));
  for (const BrickAt& at : view.bricks()) {
    if (at.contents == state_->all_empty) continue;
    bytes += sizeof(Brick) + kPlaces + at.contents->surface.bytes() + kHeap +
             at.contents->dropouts.capacity() * sizeof(Dropout);
  }
  return static_cast<int64_t>(bytes);
}

uint64_t PartialModel::Digest() const {
  // FNV-1a over what planners see.
  uint64_t digest = 14695981039346656037u;
  const auto mix = [&digest](uint64_t value) { digest = (digest ^ value) * 1099511628211u; };
  const auto mix_float = [&mix](float value) { mix(std::bit_cast<uint32_t>(value)); };
  for (const BrickAt& at : state_->view->bricks()) {
    mix(KeyOf(at.brick));
    for (const VoxelState voxel : at.contents->state) mix(static_cast<uint64_t>(voxel));
    for (const SurfaceVoxel& surface : at.contents->surface) {
      for (int i = 0; i < 3; ++i) mix_float(surface.centroid[i]);
      for (int i = 0; i < 3; ++i) mix_float(surface.normal[i]);
      mix_float(surface.area);
      mix_float(surface.density);
      mix(surface.samples);
      mix(surface.missed + 256u * surface.spread);
      mix((surface.ambiguous ? 1 : 0) + (surface.given_up ? 2 : 0));
    }
    for (const Dropout& dropout : at.contents->dropouts) {
      mix(dropout.local);
      for (int i = 0; i < 3; ++i) mix_float(dropout.from[i]);
    }
  }
  return digest;
}

const ModelConfig& PartialModel::config() const { return state_->config; }
uint64_t PartialModel::version() const { return state_->version; }

uint32_t PartialModel::algorithm_version() const {
  uint32_t oldest = kModelAlgorithmVersion;
  for (const auto& [id, layer] : state_->layers) {
    oldest = std::min(oldest, layer->algorithm_version);
  }
  return oldest;
}

std::vector<std::string> PartialModel::scans() const {
  std::vector<std::string> ids;
  for (const auto& [id, layer] : state_->layers) ids.push_back(id);
  return ids;
}

std::optional<Eigen::Isometry3d> PartialModel::PoseOf(absl::string_view id) const {
  const auto it = state_->layers.find(std::string(id));
  if (it == state_->layers.end()) return std::nullopt;
  return it->second->T_model_scan;
}

}  // namespace vantage::model
