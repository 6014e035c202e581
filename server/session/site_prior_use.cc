#include "server/session/site_prior_use.h"

#include <array>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/compression.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

constexpr uint64_t kMostPriorBytes = uint64_t{1} << 30;

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

bool SameModel(const model::PlanningView& a, const model::PlanningView& b) {
  return &a == &b || (a.stations().empty() && b.stations().empty());
}

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
        InPriorFrame(prior, conversion::ReadOwnVector(given.prior()), unit),
        conversion::ReadOwnVector(given.site()) - origin};
  }
  auto pose = site_prior::PlaceByPoints(points, prior.scale() > 0 ? prior.scale() : 1);
  if (!pose.ok()) return contract::InvalidField("site_prior.points", pose.status().message());
  return pose;
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
  if (size[0] > kMostPriorBytes) return absl::DataLossError("the prior is larger than one may be");
  const auto whole = bytes::ZstdDecompress(absl::string_view(bytes).substr(sizeof(size)), size[0]);
  if (!whole.ok()) return absl::DataLossError(whole.status().message());
  auto mesh = site_prior::DecodePrior(*whole);
  if (!mesh.ok()) return absl::DataLossError(mesh.status().message());
  return mesh;
}

absl::StatusOr<std::shared_ptr<const site_prior::SitePrior>> SitePriorUse::Load(
    const SitePriorQuestion& question) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (loaded_ == question.set) return prior_;
  }
  const absl::StatusOr<std::string> bytes = question.store->GetBlob(question.blob);
  if (!bytes.ok()) return bytes.status();
  auto mesh = ReadPriorBlob(*bytes);
  if (!mesh.ok()) return mesh.status();
  const auto pose = ReadPlacement(question.prior, question.prior.unit_m(), question.origin);
  if (!pose.ok()) return pose.status();
  auto prior = site_prior::SitePrior::Create(
      *std::move(mesh), *pose,
      question.prior.accuracy_m() > 0 ? question.prior.accuracy_m() : site_prior::kDefaultAccuracy);
  if (!prior.ok()) return prior.status();
  std::lock_guard<std::mutex> lock(mutex_);
  loaded_ = question.set;
  prior_ = *prior;
  return prior;
}

std::shared_ptr<const SitePriorUse::Use> SitePriorUse::Last(
    const SitePriorQuestion& question) const {
  std::lock_guard<std::mutex> lock(mutex_);
  return used_ == question.set ? use_ : nullptr;
}

absl::StatusOr<std::shared_ptr<const SitePriorUse::Use>> SitePriorUse::Of(
    const SitePriorQuestion& question, const std::shared_ptr<const model::PlanningView>& view,
    const parallel::Cancellation& cancelled) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (use_ != nullptr && used_ == question.set && SameModel(*view_, *view)) return use_;
  }
  const auto prior = Load(question);
  if (!prior.ok()) return prior.status();
  auto standing = site_prior::Judge(*view, **prior, cancelled);
  if (!standing.ok()) return standing.status();
  Use use;
  if (standing->space.has_value()) {
    auto site = planning::ExpectedSite::Of(*std::move(standing->space), cancelled);
    if (!site.ok()) return site.status();
    use.site = *std::move(site);
    standing->space.reset();
  }
  use.standing = *std::move(standing);
  auto made = std::make_shared<const Use>(std::move(use));
  std::lock_guard<std::mutex> lock(mutex_);
  used_ = question.set;
  view_ = view;
  use_ = made;
  return made;
}

}  // namespace vantage::session
