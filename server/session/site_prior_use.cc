#include "server/session/site_prior_use.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/compression.h"
#include "core/site_prior/prior_space.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

// Between looks of who waits whether it is still wanted.
constexpr std::chrono::milliseconds kLook{50};

bool IsPlan(v1::SitePriorFormat format) {
  return format == v1::SITE_PRIOR_FORMAT_DXF || format == v1::SITE_PRIOR_FORMAT_PICTURE;
}

// m, in the prior's frame (site_prior::PriorMesh).
Eigen::Vector3d InPriorFrame(const v1::SitePrior& prior, const Eigen::Vector3d& at, double unit) {
  if (prior.format() == v1::SITE_PRIOR_FORMAT_PICTURE) return {at.x() * unit, -at.y() * unit, 0};
  if (IsPlan(prior.format())) return {at.x() * unit, at.y() * unit, 0};
  if (prior.y_up()) return unit * Eigen::Vector3d(at.x(), -at.z(), at.y());
  return unit * at;
}

// m: of another session's model the triangles are about its origin, and points in its world.
Eigen::Vector3d SourceOrigin(const v1::SitePrior& prior) {
  if (prior.format() != v1::SITE_PRIOR_FORMAT_SESSION) return Eigen::Vector3d::Zero();
  return conversion::ReadOwnVector(prior.source_origin());
}

// Where what is stored will not be there the next time either.
bool IsLasting(const absl::Status& status) {
  return absl::IsNotFound(status) || absl::IsDataLoss(status) || absl::IsInvalidArgument(status) ||
         absl::IsResourceExhausted(status);
}

SitePriorUse::Use Unusable(const absl::Status& why) {
  SitePriorUse::Use use;
  use.standing.state = site_prior::PriorState::kUnusable;
  use.standing.message =
      absl::IsNotFound(why) || absl::IsDataLoss(why)
          ? absl::StrCat("the prior is not used: what was stored of it is lost (", why.message(),
                         "); set it again")
          : absl::StrCat("the prior is not used: ", why.message());
  return use;
}

int64_t BytesOf(const std::vector<site_prior::WallLine>& lines) {
  size_t bytes = lines.capacity() * sizeof(lines[0]);
  for (const site_prior::WallLine& line : lines) {
    bytes += line.corners.capacity() * sizeof(line.corners[0]);
  }
  return static_cast<int64_t>(bytes);
}

// A site, and its memory.
struct HeldSite {
  std::shared_ptr<const planning::ExpectedSite> site;
  MemoryAccount::Reservation memory;
};

}  // namespace

std::optional<SitePriorQuestion> SitePriorOf(const SessionState& state,
                                             const Eigen::Vector3d& origin, store::Store& store) {
  if (state.site_prior_blob.empty()) return std::nullopt;
  return SitePriorQuestion{state.site_prior, state.site_prior_blob, state.site_prior_set, origin,
                           &store};
}

absl::StatusOr<site_prior::PriorPose> ReadPlacement(const v1::SitePrior& prior, double unit,
                                                    const Eigen::Vector3d& origin) {
  if (prior.points_size() != 2) {
    return contract::InvalidField("site_prior.points",
                                  absl::StrCat("two are needed, not ", prior.points_size()));
  }
  std::array<site_prior::PlacedPoint, 2> points;
  for (int i = 0; i < 2; ++i) {
    const v1::SitePriorPoint& given = prior.points(i);
    points[static_cast<size_t>(i)] = {
        InPriorFrame(prior, conversion::ReadOwnVector(given.prior()) - SourceOrigin(prior), unit),
        conversion::ReadOwnVector(given.site()) - origin};
  }
  auto pose = site_prior::PlaceByPoints(points, prior.scale() > 0 ? prior.scale() : 1);
  if (!pose.ok()) return contract::InvalidField("site_prior.points", pose.status().message());
  return pose;
}

Eigen::Isometry3d WorldPoseOf(const v1::SitePrior& prior, const site_prior::PriorPose& pose) {
  Eigen::Isometry3d world = Eigen::Isometry3d::Identity();
  world.linear() = Eigen::AngleAxisd(pose.yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  world.translation() = pose.ToModel(-SourceOrigin(prior));
  return world;
}

std::string WritePriorBlob(const site_prior::PriorMesh& mesh) {
  const std::string bytes = site_prior::EncodePrior(mesh);
  const std::array<uint64_t, 1> size = {bytes.size()};
  return absl::StrCat(absl::string_view(reinterpret_cast<const char*>(size.data()), sizeof(size)),
                      bytes::ZstdCompress(bytes));
}

absl::StatusOr<site_prior::PriorMesh> ReadPriorBlob(const std::string& bytes) {
  std::array<uint64_t, 1> size{};
  if (bytes.size() < sizeof(size)) return absl::DataLossError("the prior is cut off");
  std::memcpy(size.data(), bytes.data(), sizeof(size));
  if (size[0] > site_prior::kMostPriorBytes) {
    return absl::DataLossError("the prior is larger than one may be");
  }
  const auto whole = bytes::ZstdDecompress(absl::string_view(bytes).substr(sizeof(size)), size[0]);
  if (!whole.ok()) return absl::DataLossError(whole.status().message());
  auto mesh = site_prior::DecodePrior(*whole);
  if (!mesh.ok()) return absl::DataLossError(mesh.status().message());
  return mesh;
}

int64_t UnfoldingBytes(const std::string& bytes) {
  uint64_t size = 0;
  if (bytes.size() < sizeof(size)) return 0;
  std::memcpy(&size, bytes.data(), sizeof(size));
  return static_cast<int64_t>(2 * std::min<uint64_t>(size, site_prior::kMostPriorBytes));
}

int64_t BytesOf(const site_prior::PriorMesh& mesh) {
  return static_cast<int64_t>(mesh.vertices.capacity() * sizeof(mesh.vertices[0]) +
                              mesh.triangles.capacity() * sizeof(mesh.triangles[0]));
}

absl::Status PriorTooLarge(int64_t bytes, int64_t most) {
  return absl::ResourceExhaustedError(absl::StrCat(
      "with what it is compared with it takes some ", bytes >> 20, " MiB, and the server has ",
      most >> 20,
      " MiB for all models and plans: give the part that is to be scanned, or set it in a session "
      "whose model_config.voxel_size_m is larger, or have the server's operator give it more "
      "(--memory-mib)"));
}

absl::StatusOr<MemoryAccount::Reservation> SitePriorUse::Take(Making& making, int64_t bytes,
                                                              int64_t beside) const {
  const int64_t all = bytes + beside + beside_();
  if (const auto most = memory_.Most(); most.has_value() && all > *most) {
    return making.lasting = PriorTooLarge(all, *most);
  }
  if (const auto most = memory_.Most(); most.has_value() && all + making.asker.held > *most) {
    return contract::ErrorWithReason(
        absl::StatusCode::kResourceExhausted, "PLAN_TOO_LARGE",
        absl::StrCat("the plan and the prior of the site take some ",
                     (all + making.asker.held) >> 20, " MiB, and the server has ", *most >> 20,
                     " MiB for all models and plans: use larger viewcells, or a prior of the part "
                     "that is to be scanned, or have its operator give it more (--memory-mib)"));
  }
  if (making.asker.wanted == Wanted::kAsked) return memory_.Reserve(bytes);
  std::optional<MemoryAccount::Reservation> spare = memory_.ReserveSpare(bytes);
  if (!spare.has_value()) return MemoryShort(bytes);
  return *std::move(spare);
}

absl::StatusOr<std::shared_ptr<const SitePriorUse::Loaded>> SitePriorUse::Load(Making& making) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (loaded_ != nullptr && loaded_->key == making.key) return loaded_;
  }
  const SitePriorQuestion& question = making.question;
  const absl::StatusOr<int64_t> stored = question.store->BlobSize(question.blob);
  // What is wrong with it is told when it is read.
  auto reading = Take(making, stored.value_or(0), 0);
  if (!reading.ok()) return reading.status();
  absl::StatusOr<std::string> bytes = question.store->GetBlob(question.blob);
  if (!bytes.ok()) {
    // What a store is short of may pass.
    if (!absl::IsResourceExhausted(bytes.status())) making.lasting = bytes.status();
    return bytes.status();
  }
  auto unfolding = Take(making, UnfoldingBytes(*bytes), reading->bytes());
  if (!unfolding.ok()) return unfolding.status();
  auto mesh = ReadPriorBlob(*bytes);
  if (!mesh.ok()) return making.lasting = mesh.status();
  bytes->clear();
  bytes->shrink_to_fit();
  reading->Release();
  const int64_t own = BytesOf(*mesh);
  unfolding->Set(own);
  const auto pose = ReadPlacement(question.prior, question.prior.unit_m(), question.origin);
  if (!pose.ok()) return making.lasting = pose.status();
  const auto work =
      static_cast<int64_t>(site_prior::EstimateMemory(*mesh, *pose, making.view->voxel_size()) +
                           site_prior::kBytesOfWallLines);
  auto memory = Take(making, work, own);
  if (!memory.ok()) return memory.status();
  const double accuracy = question.prior.accuracy_m() > 0
                              ? std::min(question.prior.accuracy_m(), site_prior::kMostAccuracy)
                              : site_prior::kDefaultAccuracy;
  auto walls = std::make_shared<const std::vector<site_prior::WallLine>>(
      site_prior::WallLinesOf(*mesh, pose->scale));
  auto prior = site_prior::SitePrior::Create(*std::move(mesh), *pose, accuracy, making.cancelled);
  if (!prior.ok()) return making.lasting = prior.status();
  memory->Set(static_cast<int64_t>((*prior)->Bytes()) + BytesOf(*walls));
  auto loaded = std::make_shared<const Loaded>(
      Loaded{making.key, *std::move(prior), std::move(walls), *std::move(memory)});
  std::shared_ptr<const Loaded> before = loaded;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (forgotten_ == making.forgotten) loaded_.swap(before);
  }
  return loaded;  // what was held before goes without the lock
}

absl::StatusOr<SitePriorUse::Used> SitePriorUse::Make(Making& making) {
  Used used{making.key, making.view, making.view->stations().empty(), nullptr, 0};
  const auto lasting = [&] { return !making.lasting.ok() && IsLasting(making.lasting); };
  const auto unusable = [&] {
    used.use = std::make_shared<const Use>(Unusable(making.lasting));
    return used;
  };
  const auto loaded = Load(making);
  if (lasting()) return unusable();
  if (!loaded.ok()) return loaded.status();
  const site_prior::SitePrior& prior = *(*loaded)->prior;
  auto memory =
      Take(making, static_cast<int64_t>(site_prior::EstimateJudgeMemory(*making.view, prior)),
           (*loaded)->memory.bytes());
  if (lasting()) return unusable();
  if (!memory.ok()) return memory.status();
  auto standing = site_prior::Judge(*making.view, prior, making.cancelled);
  if (!standing.ok()) return standing.status();
  Use use;
  use.walls = (*loaded)->walls;
  if (standing->space.has_value()) {
    const uint64_t space = site_prior::BytesOf(*standing->space);
    auto site = planning::ExpectedSite::Of(*std::move(standing->space), making.cancelled);
    if (!site.ok()) return site.status();
    standing->space.reset();
    used.bytes = static_cast<int64_t>(space + (*site)->floors().size_bytes());
    memory->Set(used.bytes);
    const auto held =
        std::make_shared<const HeldSite>(HeldSite{*std::move(site), *std::move(memory)});
    use.site = std::shared_ptr<const planning::ExpectedSite>(held, held->site.get());
  }
  use.standing = *std::move(standing);
  used.use = std::make_shared<const Use>(std::move(use));
  return used;
}

std::shared_ptr<const SitePriorUse::Use> SitePriorUse::Last(
    const SitePriorQuestion& question) const {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!used_.has_value() || !(used_->key == Key{question.set, question.origin})) return nullptr;
  return used_->use;
}

absl::StatusOr<std::shared_ptr<const SitePriorUse::Use>> SitePriorUse::Of(
    const SitePriorQuestion& question, const std::shared_ptr<const model::PlanningView>& view,
    const Asker& asker, const parallel::Cancellation& cancelled) {
  const Key key{question.set, question.origin};
  uint64_t forgotten = 0;
  {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      if (used_.has_value() && used_->key == key &&
          ((used_->nothing_scanned && view->stations().empty()) || used_->view.lock() == view)) {
        return used_->use;
      }
      if (!making_) break;
      if (cancelled.Requested()) return absl::CancelledError("site prior");
      ended_.wait_for(lock, kLook);
    }
    making_ = true;
    forgotten = forgotten_;
  }
  // However it ends, also by an exception, others go on.
  struct End {
    SitePriorUse& own;
    ~End() {
      std::lock_guard<std::mutex> lock(own.mutex_);
      own.making_ = false;
      own.ended_.notify_all();
    }
  } const end{*this};
  Making making{key, question, view, asker, forgotten, cancelled, absl::OkStatus()};
  absl::StatusOr<Used> made = Make(making);
  if (!made.ok()) return made.status();
  const std::shared_ptr<const Use> use = made->use;
  std::optional<Used> before = *std::move(made);
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (forgotten_ == forgotten) used_.swap(before);
  }
  return use;  // what was held before goes without the lock
}

int64_t SitePriorUse::Forget() {
  std::shared_ptr<const Loaded> loaded;
  std::optional<Used> used;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    loaded.swap(loaded_);
    used.swap(used_);
    ++forgotten_;
  }
  int64_t bytes = 0;
  if (loaded != nullptr && loaded.use_count() == 1) bytes += loaded->memory.bytes();
  const bool alone =
      used.has_value() && used->use.use_count() == 1 && used->use->site.use_count() == 1;
  return bytes + (alone ? used->bytes : 0);
}

}  // namespace vantage::session
