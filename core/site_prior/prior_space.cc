#include "core/site_prior/prior_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "core/model/view/brick_key.h"
#include "core/site_prior/mesh_samples.h"

namespace vantage::site_prior {
namespace {

constexpr double kHeadroom = 1.8;       // m over floor of a room
constexpr double kLeastFloor = 2.0;     // m2 of floor with headroom: a wardrobe has less
constexpr double kOpenAbove = 2.5;      // m over the floor, where no ceiling is
constexpr double kOpenFurniture = 1.5;  // m over the floor that such space begins at most
// m: of the squares, three by three of which say whether rooms have ceilings there. A room is as
// wide as that; eaves, and strips that a survey left out, are not.
constexpr double kRoofSquare = 1.0;
constexpr double kFacesUp = 0.7;        // |cosine| of surface that something stands on
constexpr size_t kBetweenLooks = 4096;  // samples or columns between looks whether it is wanted
// Of a voxel with surface while rooms are made: samples, runs, and what bricks have of it. Of a
// brick.
constexpr double kBytesOfSurface = 260;
constexpr double kBytesOfBrick = 700;
// Voxels along an axis that KeyOf() tells apart, on either side, with room for those around.
constexpr double kFarthestVoxel = (1 << 20) - 64;

// The surface in a voxel.
struct Surface {
  model::VoxelIndex at;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // sums over samples
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  uint32_t samples = 0;

  bool Level() const { return std::abs(normal.z()) > kFacesUp * normal.norm(); }
};

// Layers [low, high) of a column of voxels with no surface in them, over some surface.
struct Run {
  int x = 0;
  int y = 0;
  int low = 0;
  int high = 0;
  bool on_level = false;  // over surface that one can stand on
};

using Column = std::pair<int, int>;

class Rooms {
 public:
  Rooms(const PriorMesh& mesh, const PriorPose& pose, double voxel,
        const parallel::Cancellation& cancelled)
      : voxel_(voxel), cancelled_(cancelled) {
    absl::flat_hash_map<model::BrickKey, size_t> found;
    ForEachMeshSample(mesh, pose, voxel / 2, [&](const Eigen::Vector3d& p, const auto& normal) {
      if (Stopped() || too_large_) return;
      const model::VoxelIndex at = (p / voxel).array().floor().template cast<int>();
      const auto [it, added] = found.try_emplace(model::KeyOf(at), surface_.size());
      if (added) surface_.push_back({at});
      too_large_ = static_cast<double>(surface_.size()) > kMostSurfaceVoxels;
      Surface& own = surface_[it->second];
      const Eigen::Vector3f n = normal.template cast<float>();
      own.normal += own.normal.dot(n) < 0 ? Eigen::Vector3f(-n) : n;
      own.centre += p.cast<float>();
      ++own.samples;
    });
    std::sort(surface_.begin(), surface_.end(), [](const Surface& a, const Surface& b) {
      return std::tuple(a.at.y(), a.at.x(), a.at.z()) < std::tuple(b.at.y(), b.at.x(), b.at.z());
    });
  }

  // True when there is a room.
  bool Find() {
    FindRuns();
    return !Stopped() && Connect();
  }
  // After each of the steps: whether it was ended before its end, and why.
  absl::Status Ended() const {
    if (stopped_) return absl::CancelledError("site prior");
    if (!too_large_) return absl::OkStatus();
    return absl::ResourceExhaustedError(absl::StrFormat(
        "the prior has more than %.0f m2 of surface or %.0f m3 of rooms, in voxels of %.2f m: give "
        "the part that is to be scanned",
        kMostSurfaceVoxels * voxel_ * voxel_,
        static_cast<double>(kMostPriorBricks) * std::pow(voxel_ * model::Brick::kSide, 3), voxel_));
  }
  std::vector<model::BrickAt> Bricks();

 private:
  template <typename Fn>
  void ForEachColumn(Fn&& fn) const {  // fn(begin, end) of surface_
    for (size_t begin = 0; begin < surface_.size();) {
      size_t end = begin;
      while (end < surface_.size() && surface_[end].at.head<2>() == surface_[begin].at.head<2>()) {
        ++end;
      }
      fn(begin, end);
      begin = end;
    }
  }
  // Looks now and then.
  bool Stopped() {
    if (!stopped_ && ++since_look_ >= kBetweenLooks) {
      since_look_ = 0;
      stopped_ = cancelled_.Requested();
    }
    return stopped_;
  }
  int Layers(double metres) const { return static_cast<int>(std::lround(metres / voxel_)); }

  void FindRuns() {
    const int headroom = Layers(kHeadroom);
    // Of columns over floor, by squares: with a ceiling, and without.
    absl::flat_hash_map<Column, std::pair<size_t, size_t>> roofs;
    const int side = std::max(1, Layers(kRoofSquare));
    const auto square_of = [&](int x, int y) {
      const auto down = [&](int at) { return at >= 0 ? at / side : -((-at - 1) / side) - 1; };
      return Column(down(x), down(y));
    };
    std::vector<Run> without_ceiling;
    ForEachColumn([&](size_t begin, size_t end) {
      bool roofed = false;
      for (size_t i = begin; i + 1 < end; ++i) {
        const Run run{surface_[i].at.x(), surface_[i].at.y(), surface_[i].at.z() + 1,
                      surface_[i + 1].at.z(), surface_[i].Level()};
        if (run.high <= run.low) continue;
        runs_.push_back(run);
        roofed |= run.on_level && run.high - run.low >= headroom;
      }
      if (!surface_[begin].Level()) return;
      std::pair<size_t, size_t>& roof =
          roofs[square_of(surface_[begin].at.x(), surface_[begin].at.y())];
      ++(roofed ? roof.first : roof.second);
      const Surface& top = surface_[end - 1];
      if (Stopped()) return;
      if (roofed || (top.at.z() - surface_[begin].at.z()) > Layers(kOpenFurniture)) return;
      without_ceiling.push_back({top.at.x(), top.at.y(), top.at.z() + 1,
                                 surface_[begin].at.z() + Layers(kOpenAbove), top.Level()});
    });
    // Eaves and terraces are no rooms; where a mesh was looked into from above a whole room has no
    // ceiling.
    for (const Run& run : without_ceiling) {
      const Column square = square_of(run.x, run.y);
      size_t closed = 0;
      size_t open = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const auto roof = roofs.find({square.first + dx, square.second + dy});
          if (roof == roofs.end()) continue;
          closed += roof->second.first;
          open += roof->second.second;
        }
      }
      if (open > closed) runs_.push_back(run);
    }
    std::sort(runs_.begin(), runs_.end(), [](const Run& a, const Run& b) {
      return std::tuple(a.y, a.x, a.low) < std::tuple(b.y, b.x, b.low);
    });
  }

  size_t RootOf(size_t run) {
    while (parent_[run] != run) run = parent_[run] = parent_[parent_[run]];
    return run;
  }

  // Which runs hang together with floor of a room. False when there is none.
  bool Connect() {
    constexpr int kLeastOverlap = 2;  // layers
    absl::flat_hash_map<Column, std::pair<size_t, size_t>> by_column;
    for (size_t begin = 0; begin < runs_.size();) {
      size_t end = begin;
      while (end < runs_.size() && runs_[end].x == runs_[begin].x &&
             runs_[end].y == runs_[begin].y) {
        ++end;
      }
      by_column[{runs_[begin].x, runs_[begin].y}] = {begin, end};
      begin = end;
    }
    parent_.resize(runs_.size());
    std::iota(parent_.begin(), parent_.end(), size_t{0});
    for (size_t i = 0; i < runs_.size(); ++i) {
      if (Stopped()) return false;
      for (const Column& side : {Column(1, 0), Column(0, 1)}) {
        const auto it = by_column.find({runs_[i].x + side.first, runs_[i].y + side.second});
        if (it == by_column.end()) continue;
        for (size_t k = it->second.first; k < it->second.second; ++k) {
          const int common =
              std::min(runs_[i].high, runs_[k].high) - std::max(runs_[i].low, runs_[k].low);
          if (common >= kLeastOverlap) parent_[RootOf(i)] = RootOf(k);
        }
      }
    }
    std::vector<double> area(runs_.size(), 0);
    for (size_t i = 0; i < runs_.size(); ++i) {
      if (runs_[i].on_level && runs_[i].high - runs_[i].low >= Layers(kHeadroom)) {
        area[RootOf(i)] += voxel_ * voxel_;
      }
    }
    room_.assign(runs_.size(), 0);
    for (size_t i = 0; i < runs_.size(); ++i) room_[i] = area[RootOf(i)] >= kLeastFloor;
    return std::find(room_.begin(), room_.end(), 1) != room_.end();
  }

  const double voxel_;
  const parallel::Cancellation& cancelled_;
  size_t since_look_ = 0;
  bool stopped_ = false;
  bool too_large_ = false;
  std::vector<Surface> surface_;  // by y, x, z
  std::vector<Run> runs_;         // by y, x, low
  std::vector<size_t> parent_;    // of runs, towards one of those that hang together
  std::vector<uint8_t> room_;     // by run: it is space of a room
};

constexpr std::array<std::array<int, 3>, 6> kFaces = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

struct Building {
  model::Brick brick;
  std::vector<std::pair<int, model::SurfaceVoxel>> surface;  // by place
};

std::vector<model::BrickAt> Rooms::Bricks() {
  absl::flat_hash_map<model::BrickKey, std::unique_ptr<Building>> building;
  const auto brick_of = [&](const model::VoxelIndex& v) -> Building& {
    std::unique_ptr<Building>& own = building[model::KeyOf(model::Brick::Of(v))];
    if (own == nullptr) own = std::make_unique<Building>();
    too_large_ |= building.size() > kMostPriorBricks;
    return *own;
  };
  for (size_t i = 0; i < runs_.size(); ++i) {
    if (room_[i] == 0) continue;
    for (int z = runs_[i].low; z < runs_[i].high; ++z) {
      if (Stopped() || too_large_) return {};
      const model::VoxelIndex v(runs_[i].x, runs_[i].y, z);
      brick_of(v).brick.state[static_cast<size_t>(model::Brick::LocalOf(v))] =
          model::VoxelState::kEmpty;
    }
  }
  const auto free = [&](const model::VoxelIndex& v) {
    const auto it = building.find(model::KeyOf(model::Brick::Of(v)));
    return it != building.end() &&
           it->second->brick.state[static_cast<size_t>(model::Brick::LocalOf(v))] ==
               model::VoxelState::kEmpty;
  };
  for (const Surface& own : surface_) {
    if (Stopped() || too_large_) return {};
    Eigen::Vector3f towards = Eigen::Vector3f::Zero();
    int sides = 0;
    for (const std::array<int, 3>& face : kFaces) {
      const Eigen::Vector3i offset(face[0], face[1], face[2]);
      if (!free(own.at + offset)) continue;
      towards += offset.cast<float>();
      ++sides;
    }
    if (sides == 0) continue;
    model::SurfaceVoxel surface;
    surface.normal = own.normal.normalized();
    if (!surface.normal.allFinite() || own.normal.norm() == 0) surface.normal = {0, 0, 1};
    if (surface.normal.dot(towards) < 0) surface.normal = -surface.normal;
    surface.ambiguous = towards.isZero();
    surface.centroid = own.centre / static_cast<float>(own.samples);
    const Eigen::Vector3f low = own.at.cast<float>() * static_cast<float>(voxel_);
    const auto edge = static_cast<float>(voxel_);
    surface.centroid = surface.centroid.cwiseMax(low + Eigen::Vector3f::Constant(0.01F * edge))
                           .cwiseMin(low + Eigen::Vector3f::Constant(0.99F * edge));
    surface.area = static_cast<float>(voxel_ * voxel_) / surface.normal.cwiseAbs().sum();
    Building& to = brick_of(own.at);
    const int local = model::Brick::LocalOf(own.at);
    to.brick.state[static_cast<size_t>(local)] = model::VoxelState::kTrueSurface;
    to.surface.emplace_back(local, surface);
  }
  std::vector<model::BrickAt> bricks;
  bricks.reserve(building.size());
  for (auto& [key, own] : building) {
    std::sort(own->surface.begin(), own->surface.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [local, surface] : own->surface) {
      own->brick.surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
      own->brick.surface.push_back(surface);
    }
    bricks.push_back({model::BrickOf(key), std::make_shared<model::Brick>(std::move(own->brick))});
  }
  std::sort(bricks.begin(), bricks.end(), [](const auto& a, const auto& b) {
    return model::KeyOf(a.brick) < model::KeyOf(b.brick);
  });
  return bricks;
}

}  // namespace

uint64_t EstimateSpaceMemory(const PriorMesh& mesh, double scale, double voxel) {
  // A plane that lies askew passes through three voxels for each face of one.
  const double of_area =
      3 * AreaOf(mesh) * scale * scale / (voxel * voxel) + static_cast<double>(kBetweenLooks);
  const double surface =
      std::min({MostMeshSamples(mesh, scale, voxel / 2),
                of_area + static_cast<double>(mesh.triangles.size()), kMostSurfaceVoxels});
  const double side = voxel * model::Brick::kSide;
  const Eigen::Array3d size = mesh.Bounds().sizes().cast<double>().array() * scale / side + 2;
  // It may be turned in plan.
  const double bricks = std::min(2 * size.prod(), static_cast<double>(kMostPriorBricks));
  return static_cast<uint64_t>(surface * kBytesOfSurface + bricks * kBytesOfBrick);
}

uint64_t BytesOf(const model::PlanningView& space) {
  constexpr double kOfHeap = 1.2;  // with what the heap adds to small pieces (prior_memory_test)
  return static_cast<uint64_t>(
      kOfHeap * (static_cast<double>(space.bricks().size()) * kBytesOfBrick +
                 static_cast<double>(space.SurfaceCount() * sizeof(model::SurfaceVoxel))));
}

absl::Status CheckPlace(const PriorMesh& mesh, const PriorPose& pose, double voxel) {
  const Eigen::AlignedBox3d box = mesh.Bounds().cast<double>();
  for (int corner = 0; corner < 8; ++corner) {
    const double farthest =
        pose.ToModel(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)))
            .lpNorm<Eigen::Infinity>();
    if (farthest <= kFarthestVoxel * voxel) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "the prior lies %.0f km from the session's origin, more than %.0f km: compare its two "
        "points with the site",
        farthest / 1000, kFarthestVoxel * voxel / 1000));
  }
  return absl::OkStatus();
}

absl::StatusOr<model::PlanningView> SpaceOf(const PriorMesh& mesh, const PriorPose& pose,
                                            double voxel, const parallel::Cancellation& cancelled) {
  if (absl::Status near = CheckPlace(mesh, pose, voxel); !near.ok()) return near;
  const double samples = MostMeshSamples(mesh, pose.scale, voxel / 2);
  if (!(samples <= kMostPriorSamples)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the prior takes %.1e points %.3f m apart on its triangles, more than %.0e: simplify it, "
        "without long slivers, or give the part that is to be scanned",
        samples, voxel / 2, kMostPriorSamples));
  }
  Rooms rooms(mesh, pose, voxel, cancelled);
  if (absl::Status ended = rooms.Ended(); !ended.ok()) return ended;
  const bool any = rooms.Find();
  if (absl::Status ended = rooms.Ended(); !ended.ok()) return ended;
  if (!any) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the prior has no room: nowhere %.0f m2 of floor with %.1f m of space over it; does its z "
        "axis point up, and is its floor there?",
        kLeastFloor, kHeadroom));
  }
  std::vector<model::BrickAt> bricks = rooms.Bricks();
  if (absl::Status ended = rooms.Ended(); !ended.ok()) return ended;
  return model::PlanningView(voxel, 0, std::move(bricks), {});
}

}  // namespace vantage::site_prior
