#include "server/session/site_priors.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/compression.h"
#include "core/confinement/child.h"
#include "core/confinement/descriptor.h"
#include "core/site_prior/confined_prior.h"
#include "core/site_prior/prior_file.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/contract/resource_names.h"
#include "server/conversion/to_proto.h"
#include "server/session/site_prior_use.h"

namespace vantage::session {
namespace {

constexpr uint64_t kMostReaderBytes = uint64_t{3} << 30;

absl::StatusOr<std::string> Unfolded(const v1::SetSitePriorRequest& request) {
  if (request.compression() != v1::COMPRESSION_ZSTD) return request.file();
  auto bytes =
      bytes::ZstdDecompress(request.file(), static_cast<size_t>(request.uncompressed_size_bytes()));
  if (!bytes.ok()) return contract::InvalidField("file", bytes.status().message());
  return bytes;
}

// The bytes as a file that another process can be handed.
absl::StatusOr<confinement::Descriptor> AsFile(const std::string& bytes) {
  confinement::Descriptor file(memfd_create("site-prior", MFD_CLOEXEC));
  if (file.get() < 0) return absl::ErrnoToStatus(errno, "memfd_create");
  for (size_t at = 0; at < bytes.size();) {
    const ssize_t wrote = write(file.get(), bytes.data() + at, bytes.size() - at);
    if (wrote < 0) return absl::ErrnoToStatus(errno, "write");
    at += static_cast<size_t>(wrote);
  }
  return file;
}

v1::SitePriorFormat WriteFormat(site_prior::PriorFormat format) {
  switch (format) {
    case site_prior::PriorFormat::kPly:
      return v1::SITE_PRIOR_FORMAT_PLY;
    case site_prior::PriorFormat::kObj:
      return v1::SITE_PRIOR_FORMAT_OBJ;
    case site_prior::PriorFormat::kDxf:
      return v1::SITE_PRIOR_FORMAT_DXF;
    case site_prior::PriorFormat::kPicture:
      return v1::SITE_PRIOR_FORMAT_PICTURE;
  }
  return v1::SITE_PRIOR_FORMAT_UNSPECIFIED;
}

// Of what is wrong with the file.
absl::Status Refused(const absl::Status& status) {
  if (confinement::IsBeyondAllowance(status)) {
    return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "FILE_TOO_COSTLY",
                                     status.message());
  }
  if (absl::IsResourceExhausted(status)) {
    return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "FILE_TOO_LARGE",
                                     status.message());
  }
  if (absl::IsInvalidArgument(status) || absl::IsUnimplemented(status)) {
    return contract::InvalidField("file", status.message());
  }
  return status;
}

// Metres for a pixel, by how far apart the two points are; 0 where they don't tell.
double PixelOf(const v1::SitePrior& prior) {
  if (prior.points_size() != 2) return 0;
  const auto plan = [](const v1::Vector3& v) {
    return conversion::ReadOwnVector(v).head<2>().eval();
  };
  const double pixels = (plan(prior.points(1).prior()) - plan(prior.points(0).prior())).norm();
  const double metres = (plan(prior.points(1).site()) - plan(prior.points(0).site())).norm();
  return pixels > 1 ? metres / pixels : 0;
}

v1::SitePriorState WriteState(site_prior::PriorState state) {
  switch (state) {
    case site_prior::PriorState::kPlaced:
      return v1::SITE_PRIOR_STATE_PLACED;
    case site_prior::PriorState::kNotEnoughSeen:
      return v1::SITE_PRIOR_STATE_NOT_ENOUGH_SEEN;
    case site_prior::PriorState::kAligned:
      return v1::SITE_PRIOR_STATE_ALIGNED;
    case site_prior::PriorState::kNotAligned:
      return v1::SITE_PRIOR_STATE_NOT_ALIGNED;
    case site_prior::PriorState::kRefuted:
      return v1::SITE_PRIOR_STATE_REFUTED;
  }
  return v1::SITE_PRIOR_STATE_UNSPECIFIED;
}

v1::SitePriorStanding WriteStanding(const site_prior::PriorStanding& standing,
                                    const Eigen::Vector3d& origin, uint64_t version) {
  v1::SitePriorStanding out;
  out.set_state(WriteState(standing.state));
  out.set_message(standing.message);
  out.set_model_version(version);
  out.set_wall_area_m2(standing.alignment.wall_area);
  out.set_agreeing_share(standing.alignment.agreeing);
  out.set_refuted_share(standing.refuted_share);
  out.set_residual_m(standing.alignment.residual);
  out.set_scale(standing.alignment.pose.scale);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::AngleAxisd(standing.alignment.pose.yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = standing.alignment.pose.translation;
  *out.mutable_pose() = conversion::WritePose(pose, origin);
  out.set_new_area_m2(standing.new_area);
  return out;
}

absl::Status NoPrior(const SessionContext& context) {
  return contract::ResourceNotFound("vantage/SitePrior",
                                    absl::StrCat(context.name(), "/sitePrior"));
}

}  // namespace

SitePriors::SitePriors(SessionContext& context, ModelMemory& model, Preparation& preparation)
    : context_(context), model_(model), preparation_(preparation) {
  for (const std::string& blob : Blobs()) {
    context_.account()->Add(context_.dependencies().store.BlobSize(blob).value_or(0));
  }
}

void SitePriors::Set(const v1::SetSitePriorRequest& request,
                     std::shared_ptr<const model::PlanningView> source,
                     std::function<void(absl::StatusOr<v1::SetSitePriorResponse>)> done) {
  const auto set = [this, request, source = std::move(source),
                    done = std::move(done)](parallel::Parallel&) {
    done(contract::UnlessOutOfMemory([&] { return SetNow(request, source.get()); }));
  };
  context_.RunInteractive(set);
}

absl::StatusOr<v1::SetSitePriorResponse> SitePriors::SetNow(const v1::SetSitePriorRequest& request,
                                                            const model::PlanningView* source) {
  const RequestKey key = RequestKey::Of(request.request_id(), "SetSitePrior", request);
  v1::SetSitePriorResponse response;
  const auto as_it_is = [&] {
    context_.journal().Read(
        [&](const SessionState& state) { *response.mutable_site_prior() = state.site_prior; });
    return response;
  };
  if (context_.journal().Knows(key)) {
    absl::Status same = context_.journal().CheckRequest(key);
    if (!same.ok()) return same;
    return as_it_is();
  }
  v1::SitePrior prior = request.site_prior();
  site_prior::PriorMesh mesh;
  if (source != nullptr) {
    mesh = site_prior::MeshOfModel(*source);
    prior.set_format(v1::SITE_PRIOR_FORMAT_SESSION);
    prior.set_unit_m(1);
  } else {
    const absl::StatusOr<std::string> bytes = Unfolded(request);
    if (!bytes.ok()) return bytes.status();
    const auto format = site_prior::FindPriorFormat(*bytes);
    if (!format.ok()) return Refused(format.status());
    prior.set_format(WriteFormat(*format));
    prior.set_file_size_bytes(static_cast<int64_t>(bytes->size()));
    site_prior::PriorReading reading;
    reading.unit = prior.unit_m();
    if (prior.format() == v1::SITE_PRIOR_FORMAT_PICTURE && reading.unit == 0) {
      reading.unit = PixelOf(prior);
    }
    if (prior.wall_height_m() > 0) reading.wall_height = prior.wall_height_m();
    if (prior.darkest() > 0) reading.darkest = prior.darkest();
    reading.y_up = prior.y_up() ? 1 : 0;
    const auto file = AsFile(*bytes);
    if (!file.ok()) return file.status();
    confinement::AllowanceSettings allowance;
    allowance.most_memory_bytes = kMostReaderBytes;
    allowance.given_up = [this] { return context_.closed() || context_.halted(); };
    allowance.memory_option = "--memory-mib";
    allowance.seconds_option = "--file-seconds";
    auto read = site_prior::ReadPriorConfined(file->get(), bytes->size(), reading, allowance);
    if (!read.ok()) return Refused(read.status());
    mesh = *std::move(read);
    prior.set_unit_m(mesh.unit);
  }
  const auto pose = ReadPlacement(prior, prior.unit_m(), context_.origin());
  if (!pose.ok()) return pose.status();
  const double accuracy =
      prior.accuracy_m() > 0 ? prior.accuracy_m() : site_prior::kDefaultAccuracy;
  prior.set_accuracy_m(accuracy);
  prior.set_triangle_count(static_cast<int64_t>(mesh.triangles.size()));
  // Whether there is a room in it is said now.
  auto made = site_prior::SitePrior::Create(std::move(mesh), *pose, accuracy);
  if (!made.ok()) return Refused(made.status());
  if (absl::Status room = context_.CheckLog(); !room.ok()) return room;
  const absl::StatusOr<std::string> blob = context_.PutOwnBlob(WritePriorBlob((*made)->mesh()));
  if (!blob.ok()) return blob.status();
  std::string before;
  prior.set_name(absl::StrCat(context_.name(), "/sitePrior"));
  const auto written =
      context_.journal().Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        before = state.site_prior_blob;
        Draft draft;
        *prior.mutable_create_time() = conversion::WriteTime(context_.journal().Now());
        *draft.event.mutable_site_prior_set()->mutable_site_prior() = prior;
        draft.blob = *blob;
        return draft;
      });
  if (!written.ok()) {
    context_.ReleaseOwnBlob(*blob);
    return written.status();
  }
  if (!before.empty()) context_.ReleaseOwnBlob(before);
  preparation_.Stop();
  preparation_.Begin();
  return as_it_is();
}

void SitePriors::Describe(std::function<void(absl::StatusOr<v1::GetSitePriorResponse>)> done) {
  std::optional<SitePriorQuestion> question;
  bool any = false;
  context_.journal().Read([&](const SessionState& state) {
    question = SitePriorOf(state, context_.origin(), context_.dependencies().store);
    any = state.AnyInModel();
  });
  if (!question.has_value()) return done(NoPrior(context_));
  ModelSnapshot model = model_.Current();
  if (model.view == nullptr) {
    if (any) return done(model_.WhyNone());
    model.view = std::make_shared<model::PlanningView>(model_.config().voxel_size, 0,
                                                       std::vector<model::BrickAt>(),
                                                       std::vector<model::Station>());
  }
  context_.RunInteractive([this, question = *std::move(question), model,
                           done = std::move(done)](parallel::Parallel&) {
    const auto use = contract::UnlessOutOfMemory(
        [&] { return model_.site_prior().Of(question, model.view, {}); });
    if (!use.ok()) return done(use.status());
    v1::GetSitePriorResponse response;
    *response.mutable_site_prior() = question.prior;
    *response.mutable_standing() = WriteStanding((*use)->standing, question.origin, model.version);
    done(std::move(response));
  });
}

absl::Status SitePriors::Clear(const v1::ClearSitePriorRequest& request) {
  std::string blob;
  const auto cleared = context_.journal().Execute(
      RequestKey::Of(request.request_id(), "ClearSitePrior", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (state.site_prior.name().empty()) return NoPrior(context_);
        blob = state.site_prior_blob;
        Draft draft;
        *draft.event.mutable_site_prior_cleared()->mutable_site_prior() = state.site_prior;
        return draft;
      });
  if (!cleared.ok()) return cleared.status();
  if (!blob.empty()) context_.ReleaseOwnBlob(blob);
  preparation_.Stop();
  preparation_.Begin();
  return absl::OkStatus();
}

std::vector<std::string> SitePriors::Blobs() const {
  std::vector<std::string> blobs;
  context_.journal().Read([&](const SessionState& state) {
    if (!state.site_prior_blob.empty()) blobs.push_back(state.site_prior_blob);
  });
  return blobs;
}

}  // namespace vantage::session
