#include "server/session/site_priors.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "core/bytes/compression.h"
#include "core/confinement/child.h"
#include "core/confinement/descriptor.h"
#include "core/site_prior/confined_prior.h"
#include "core/site_prior/prior_file.h"
#include "core/site_prior/prior_space.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/contract/resource_names.h"
#include "server/conversion/to_proto.h"
#include "server/session/asked_evaluation.h"
#include "server/session/either_stop.h"
#include "server/session/file_allowance.h"
#include "server/session/site_prior_use.h"

namespace vantage::session {
namespace {

constexpr absl::Duration kRetryPriorAfter = absl::Seconds(2);
// What reading a file takes here and in the reader, bytes: in any case; times the file, of OBJ and
// of PLY; and of a plan what is drawn (core/site_prior/confined_prior.cc, 'Measured').
constexpr int64_t kBytesBesideFile = int64_t{64} << 20;
constexpr int64_t kTimesObj = 32;
constexpr int64_t kTimesPly = 8;
constexpr int64_t kBytesOfPlan = int64_t{600} << 20;
constexpr size_t kBytesOfVoxelAsMesh = 4 * 12 + 2 * 12;  // of a model's surface
// The least that two points of a picture are apart to tell its scale: a hand is then 2 %.
constexpr double kLeastForScale = 5;    // m
constexpr double kLeastOfPicture = 50;  // pixels

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

int64_t ReadingBytes(site_prior::PriorFormat format, size_t size) {
  const auto bytes = static_cast<int64_t>(size);
  switch (format) {
    case site_prior::PriorFormat::kObj:
      return kBytesBesideFile + kTimesObj * bytes;
    case site_prior::PriorFormat::kPly:
      return kBytesBesideFile + kTimesPly * bytes;
    case site_prior::PriorFormat::kDxf:
    case site_prior::PriorFormat::kPicture:
      return kBytesBesideFile + kBytesOfPlan + 2 * bytes;
  }
  return kBytesBesideFile;
}

// Of what is wrong with the file, or with the model that it is.
absl::Status Refused(const absl::Status& status, const std::string& field) {
  if (confinement::IsBeyondAllowance(status)) {
    return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "FILE_TOO_COSTLY",
                                     absl::StrCat(field, ": ", status.message()));
  }
  if (absl::IsResourceExhausted(status)) {
    return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "FILE_TOO_LARGE",
                                     absl::StrCat(field, ": ", status.message()));
  }
  if (absl::IsInvalidArgument(status) || absl::IsUnimplemented(status)) {
    return contract::InvalidField(field, status.message());
  }
  return status;
}

// Metres for a pixel, by how far apart the two points are. INVALID_ARGUMENT: they don't tell.
absl::StatusOr<double> PixelOf(const v1::SitePrior& prior) {
  double pixels = 0;
  double metres = 0;
  if (prior.points_size() == 2) {
    const auto plan = [](const v1::Vector3& v) {
      return conversion::ReadOwnVector(v).head<2>().eval();
    };
    pixels = (plan(prior.points(1).prior()) - plan(prior.points(0).prior())).norm();
    metres = (plan(prior.points(1).site()) - plan(prior.points(0).site())).norm();
  }
  if (!(pixels >= kLeastOfPicture && metres >= kLeastForScale)) {
    return contract::InvalidField(
        "site_prior.unit_m",
        absl::StrFormat("a picture needs its scale: give metres for a pixel, or two points at "
                        "least %.0f m and %.0f pixels apart; these are %.1f m and %.0f pixels",
                        kLeastForScale, kLeastOfPicture, metres, pixels));
  }
  return metres / pixels / (prior.scale() > 0 ? prior.scale() : 1);
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
    case site_prior::PriorState::kUnusable:
      return v1::SITE_PRIOR_STATE_UNUSABLE;
  }
  return v1::SITE_PRIOR_STATE_UNSPECIFIED;
}

v1::SitePriorStanding WriteStanding(const site_prior::PriorStanding& standing,
                                    const SitePriorQuestion& question, uint64_t version) {
  v1::SitePriorStanding out;
  out.set_state(WriteState(standing.state));
  out.set_message(standing.message);
  out.set_model_version(version);
  out.set_wall_area_m2(standing.alignment.wall_area);
  out.set_agreeing_share(standing.alignment.agreeing);
  out.set_refuted_share(standing.refuted_share);
  out.set_residual_m(standing.alignment.residual);
  out.set_scale(standing.alignment.pose.scale);
  *out.mutable_pose() =
      conversion::WritePose(WorldPoseOf(question.prior, standing.alignment.pose), question.origin);
  out.set_new_area_m2(standing.new_area);
  return out;
}

// As the contract has it of where it is known not to lie.
bool LiesThere(site_prior::PriorState state) {
  return state == site_prior::PriorState::kPlaced ||
         state == site_prior::PriorState::kNotEnoughSeen ||
         state == site_prior::PriorState::kAligned;
}

void AddWalls(const SitePriorUse::Use& use, const Eigen::Vector3d& origin,
              v1::GetSitePriorResponse& response) {
  if (use.walls == nullptr || !LiesThere(use.standing.state)) return;
  for (const site_prior::WallLine& line : *use.walls) {
    v1::SitePriorWall& wall = *response.add_walls();
    for (const Eigen::Vector2f& corner : line.corners) {
      const Eigen::Vector3d in_prior(static_cast<double>(corner.x()),
                                     static_cast<double>(corner.y()),
                                     static_cast<double>(line.floor));
      *wall.add_corners() =
          conversion::WriteVector(use.standing.alignment.pose.ToModel(in_prior) + origin);
    }
  }
}

absl::Status ReadingTooLarge(int64_t bytes, int64_t most) {
  return absl::ResourceExhaustedError(
      absl::StrCat("reading it takes some ", bytes >> 20, " MiB, and the server has ", most >> 20,
                   " MiB for all models and plans: give a smaller file, or a mesh instead of a "
                   "plan, or have the "
                   "server's operator give it more (--memory-mib)"));
}

absl::Status NoPrior(const SessionContext& context) {
  return contract::ResourceNotFound("vantage/SitePrior",
                                    absl::StrCat(context.name(), "/sitePrior"));
}

absl::Status TooMany() {
  return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                             "as much of this session is being evaluated as may be",
                             kRetryPriorAfter);
}

}  // namespace

// A prior on its way in.
class SitePriors::Setting {
 public:
  Setting(SitePriors& priors, const v1::SetSitePriorRequest& given, PriorSource of,
          std::shared_ptr<Evaluation> evaluation,
          AskedEvaluation<v1::SetSitePriorResponse>::Done done)
      : request(given),
        source(std::move(of)),
        key(RequestKey::Of(given.request_id(), "SetSitePrior", given)),
        prior(given.site_prior()),
        keep(priors.context_.shared_from_this()),
        asked(priors.context_, std::move(evaluation), std::move(done)) {
    prior.clear_name();
    prior.clear_format();
    prior.clear_file_size_bytes();
    prior.clear_triangle_count();
    prior.clear_create_time();
    prior.clear_source_origin();
  }

  const char* field() const {
    return source.view != nullptr ? "site_prior.source_session" : "file";
  }
  // Of the request and the mesh, as they are.
  void Hold() { held.Set(static_cast<int64_t>(request.SpaceUsedLong()) + BytesOf(mesh)); }
  // Who is answered finds its memory given back.
  template <typename Work>
  void Answer(Work&& work) {
    asked.Answer([&]() -> absl::StatusOr<v1::SetSitePriorResponse> {
      absl::StatusOr<v1::SetSitePriorResponse> response = work();
      mesh = site_prior::PriorMesh();
      held.Release();
      return response;
    });
  }

  const v1::SetSitePriorRequest request;
  PriorSource source;
  const RequestKey key;
  v1::SitePrior prior;  // without what only a server says, until it is known
  site_prior::PriorMesh mesh;
  MemoryAccount::Reservation held;             // what it keeps while it waits for its turn
  const std::shared_ptr<SessionContext> keep;  // longer than what follows
  AskedEvaluation<v1::SetSitePriorResponse> asked;
};

SitePriors::SitePriors(SessionContext& context, ModelMemory& model, Preparation& preparation)
    : context_(context), model_(model), preparation_(preparation) {
  for (const std::string& blob : Blobs()) {
    context_.account()->Add(context_.dependencies().store.BlobSize(blob).value_or(0));
  }
}

absl::StatusOr<MemoryAccount::Reservation> SitePriors::Take(
    int64_t bytes, int64_t beside, const std::string& field,
    absl::FunctionRef<absl::Status(int64_t bytes, int64_t most)> too_large) const {
  const std::optional<int64_t> most = model_.memory().Most();
  if (most.has_value() && bytes + beside > *most) {
    return Refused(too_large(bytes + beside, *most), field);
  }
  return model_.Reserve(bytes);
}

absl::StatusOr<v1::SetSitePriorResponse> SitePriors::Again(const RequestKey& key) const {
  if (absl::Status same = context_.journal().CheckRequest(key); !same.ok()) return same;
  v1::SetSitePriorResponse response;
  bool own = false;
  context_.journal().Read([&](const SessionState& state) {
    const auto made = state.requests.find(key.id);
    own = made != state.requests.end() && made->second.sequence == state.site_prior_set;
    if (own) *response.mutable_site_prior() = state.site_prior;
  });
  if (own) return response;
  return contract::ErrorWithReason(
      absl::StatusCode::kAborted, "SITE_PRIOR_REPLACED",
      "the prior of this request was set, and replaced or taken out since; look which there is "
      "(GetSitePrior), and set it again under another request_id where it is still wanted");
}

void SitePriors::Set(const v1::SetSitePriorRequest& request, PriorSource source,
                     std::function<void(absl::StatusOr<v1::SetSitePriorResponse>)> done) {
  std::shared_ptr<Evaluation> evaluation = model_.BeginEvaluation();
  if (evaluation == nullptr) return done(TooMany());
  const auto setting = std::make_shared<Setting>(*this, request, std::move(source),
                                                 std::move(evaluation), std::move(done));
  // A request that is known is answered without its file.
  if (context_.journal().Knows(setting->key)) {
    return setting->Answer([&] { return Again(setting->key); });
  }
  auto held = model_.Reserve(static_cast<int64_t>(setting->request.SpaceUsedLong()));
  if (!held.ok()) return setting->Answer([&] { return held.status(); });
  setting->held = *std::move(held);
  const auto make = [this, setting](parallel::Parallel&) {
    setting->Answer([&] { return SetNow(*setting); });
  };
  if (setting->source.view != nullptr) return context_.RunInteractive(make);
  // Beside the tenant's scans, which may take an hour, and one at a time.
  context_.dependencies().files->Post(
      absl::StrCat(ReaderOf(context_), " prior"), context_.id(),
      [this, setting, make](const FileReadings::GivenUp& given_up) {
        absl::Status read = contract::UnlessOutOfMemory([&]() -> absl::Status {
          absl::Status taken = Read(*setting, given_up);
          if (taken.ok()) context_.RunInteractive(make);
          return absl::IsCancelled(taken) ? context_.Dropped() : taken;
        });
        if (!read.ok()) setting->Answer([&] { return std::move(read); });
        return std::chrono::milliseconds(0);
      });
}

absl::Status SitePriors::Read(Setting& setting, const std::function<bool()>& given_up) {
  const auto ended = [&] {
    return given_up() || stop_.stop_requested() || context_.closed() || context_.halted();
  };
  const v1::SetSitePriorRequest& request = setting.request;
  v1::SitePrior& prior = setting.prior;
  const auto take = [&](int64_t amount, int64_t beside) {
    return Take(amount, beside + setting.held.bytes(), setting.field(), ReadingTooLarge);
  };
  const auto unfolding = take(request.uncompressed_size_bytes() + kBytesBesideFile, 0);
  if (!unfolding.ok()) return unfolding.status();
  const absl::StatusOr<std::string> bytes = Unfolded(request);
  if (!bytes.ok()) return bytes.status();
  const auto format = site_prior::FindPriorFormat(*bytes);
  if (!format.ok()) return Refused(format.status(), setting.field());
  prior.set_format(WriteFormat(*format));
  prior.set_file_size_bytes(static_cast<int64_t>(bytes->size()));
  site_prior::PriorReading reading;
  reading.unit = prior.unit_m();
  if (prior.format() == v1::SITE_PRIOR_FORMAT_PICTURE && reading.unit == 0) {
    const absl::StatusOr<double> pixel = PixelOf(prior);
    if (!pixel.ok()) return pixel.status();
    reading.unit = *pixel;
  }
  if (prior.wall_height_m() > 0) reading.wall_height = prior.wall_height_m();
  if (prior.darkest() > 0) reading.darkest = prior.darkest();
  reading.y_up = prior.y_up() ? 1 : 0;
  const auto memory = take(ReadingBytes(*format, bytes->size()), unfolding->bytes());
  if (!memory.ok()) return memory.status();
  const auto file = AsFile(*bytes);
  if (!file.ok()) return file.status();
  auto read = site_prior::ReadPriorConfined(file->get(), bytes->size(), reading,
                                            FileAllowance(context_.dependencies(), ended));
  if (!read.ok()) return Refused(read.status(), setting.field());
  setting.mesh = *std::move(read);
  setting.Hold();
  prior.set_unit_m(setting.mesh.unit);
  return absl::OkStatus();
}

absl::StatusOr<v1::SetSitePriorResponse> SitePriors::SetNow(Setting& setting) {
  if (context_.journal().Knows(setting.key)) return Again(setting.key);
  v1::SitePrior& prior = setting.prior;
  if (setting.source.view != nullptr) {
    const auto room =
        Take(static_cast<int64_t>(setting.source.view->SurfaceCount() * kBytesOfVoxelAsMesh),
             setting.held.bytes(), setting.field(), PriorTooLarge);
    if (!room.ok()) return room.status();
    auto mesh = site_prior::MeshOfModel(*setting.source.view);
    if (!mesh.ok()) return Refused(mesh.status(), setting.field());
    setting.mesh = *std::move(mesh);
    setting.Hold();
    prior.set_format(v1::SITE_PRIOR_FORMAT_SESSION);
    prior.set_unit_m(1);
    *prior.mutable_source_origin() = conversion::WriteVector(setting.source.origin);
    setting.source.view = nullptr;
  }
  const std::string field =
      prior.format() == v1::SITE_PRIOR_FORMAT_SESSION ? "site_prior.source_session" : "file";
  const double voxel = model_.config().voxel_size;
  const auto pose = ReadPlacement(prior, prior.unit_m(), context_.origin());
  if (!pose.ok()) return pose.status();
  if (absl::Status near = site_prior::CheckPlace(setting.mesh, *pose, voxel); !near.ok()) {
    return contract::InvalidField(
        "site_prior.points",
        absl::StrCat(near.message(), "; in a national grid, state session.origin"));
  }
  const double accuracy =
      prior.accuracy_m() > 0 ? prior.accuracy_m() : site_prior::kDefaultAccuracy;
  prior.set_accuracy_m(accuracy);
  prior.set_triangle_count(static_cast<int64_t>(setting.mesh.triangles.size()));
  // Encoded, and compressed.
  auto folded = Take(2 * BytesOf(setting.mesh), setting.held.bytes(), field, PriorTooLarge);
  if (!folded.ok()) return folded.status();
  const std::string stored = WritePriorBlob(setting.mesh);
  folded->Set(static_cast<int64_t>(stored.capacity()));
  const auto memory =
      Take(static_cast<int64_t>(site_prior::EstimateMemory(setting.mesh, *pose, voxel)),
           setting.held.bytes() + folded->bytes(), field, PriorTooLarge);
  if (!memory.ok()) return memory.status();
  // Whether there is a room in it, also in the model's voxels, is said now.
  const parallel::Cancellation cancelled(stop_.get_token());
  auto made = site_prior::SitePrior::Create(std::move(setting.mesh), *pose, accuracy, cancelled);
  if (absl::IsCancelled(made.status())) return context_.Dropped();
  if (!made.ok()) return Refused(made.status(), field);
  const absl::Status usable = site_prior::CheckUsable(**made, voxel, cancelled);
  if (absl::IsCancelled(usable)) return context_.Dropped();
  if (!usable.ok()) {
    return Refused(absl::Status(usable.code(), absl::StrCat(usable.message(),
                                                            "; or set it in a session whose "
                                                            "model_config.voxel_size_m is larger")),
                   field);
  }
  if (absl::Status fits = CheckComparable(**made); !fits.ok()) return Refused(fits, field);
  if (absl::Status room = context_.CheckLog(); !room.ok()) return room;
  const absl::StatusOr<std::string> blob = context_.PutGivenBlob(stored);
  if (!blob.ok()) return blob.status();
  std::string before;
  bool drafted = false;
  prior.set_name(absl::StrCat(context_.name(), "/sitePrior"));
  const auto written = context_.journal().Execute(
      setting.key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        before = state.site_prior_blob;
        drafted = true;
        Draft draft;
        *prior.mutable_create_time() = conversion::WriteTime(context_.journal().Now());
        *draft.event.mutable_site_prior_set()->mutable_site_prior() = prior;
        draft.blob = *blob;
        return draft;
      });
  // The same request, sent twice at a time, was the other's.
  if (!written.ok() || !drafted) context_.ReleaseOwnBlob(*blob);
  if (!written.ok()) return written.status();
  if (!drafted) return Again(setting.key);
  if (!before.empty()) context_.ReleaseOwnBlob(before);
  model_.site_prior().Forget();
  preparation_.Stop();
  preparation_.Begin();
  v1::SetSitePriorResponse response;
  *response.mutable_site_prior() = prior;
  return response;
}

absl::Status SitePriors::CheckComparable(const site_prior::SitePrior& prior) const {
  const std::optional<int64_t> most = model_.memory().Most();
  if (!most.has_value()) return absl::OkStatus();
  std::shared_ptr<const model::PlanningView> view = model_.Current().view;
  if (view == nullptr) view = EmptyView();
  const auto all =
      static_cast<int64_t>(site_prior::EstimateJudgeMemory(*view, prior) + prior.Bytes()) +
      model_.Estimate();
  return all > *most ? PriorTooLarge(all, *most) : absl::OkStatus();
}

std::shared_ptr<const model::PlanningView> SitePriors::EmptyView() const {
  return std::make_shared<model::PlanningView>(
      model_.config().voxel_size, 0, std::vector<model::BrickAt>(), std::vector<model::Station>());
}

void SitePriors::Describe(const v1::GetSitePriorRequest& request,
                          std::function<void(absl::StatusOr<v1::GetSitePriorResponse>)> done,
                          const std::stop_token& gone) {
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
    model.view = EmptyView();
  }
  std::shared_ptr<Evaluation> evaluation = model_.BeginEvaluation();
  if (evaluation == nullptr) return done(TooMany());
  const auto compare = [this, question = *std::move(question), model, gone,
                        with_walls = request.with_walls()](
                           parallel::Parallel&) -> absl::StatusOr<v1::GetSitePriorResponse> {
    const EitherStop stop(gone, stop_.get_token());
    const auto use =
        model_.site_prior().Of(question, model.view, {}, parallel::Cancellation(stop.token()));
    if (absl::IsCancelled(use.status())) return context_.Dropped();
    if (!use.ok()) return use.status();
    v1::GetSitePriorResponse response;
    *response.mutable_site_prior() = question.prior;
    *response.mutable_standing() = WriteStanding((*use)->standing, question, model.version);
    if (with_walls) AddWalls(**use, question.origin, response);
    return response;
  };
  RunAsked<v1::GetSitePriorResponse>(context_, std::move(evaluation), std::move(done), compare);
}

absl::Status SitePriors::Clear(const v1::ClearSitePriorRequest& request) {
  std::string blob;
  const auto cleared = context_.journal().Execute(
      RequestKey::Of(request.request_id(), "ClearSitePrior", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (state.site_prior.name().empty() && state.site_prior_blob.empty()) {
          return NoPrior(context_);
        }
        blob = state.site_prior_blob;
        Draft draft;
        *draft.event.mutable_site_prior_cleared()->mutable_site_prior() = state.site_prior;
        return draft;
      });
  if (!cleared.ok()) return cleared.status();
  if (!blob.empty()) context_.ReleaseOwnBlob(blob);
  model_.site_prior().Forget();
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
