#include "client/simulated_job/cycle_picture.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/geometry.h"
#include "client/picture/surface_ply.h"

namespace vantage::simulated_job {
namespace {

picture::JobPicture::Candidate CandidateOf(const v1::RankedView& view) {
  picture::JobPicture::Candidate candidate;
  candidate.position = client::FromProto(view.position()).head<2>();
  if (view.has_region() && view.region().viewcell_count() > 1) {
    candidate.region = Eigen::AlignedBox2d(
        Eigen::Vector2d(client::FromProto(view.region().box().min()).head<2>()),
        Eigen::Vector2d(client::FromProto(view.region().box().max()).head<2>()));
  }
  return candidate;
}

std::string NextLine(const v1::PlanResult& result) {
  if (result.termination().suggested()) {
    return absl::StrCat("No further scan: ", result.termination().message());
  }
  if (result.views().empty()) return absl::StrCat("No next position: ", result.message());
  const v1::RankedView& next = result.views(0);
  const std::string storey =
      result.storeys_size() > 1 ? absl::StrFormat(", storey %d", next.storey().number()) : "";
  return absl::StrFormat(
      "Next: (%.2f, %.2f)%s, tripod %.2f m, brings %.1f m\u00b2 to density, will register: "
      "overlap %.0f %%, error bound %.1f mm",
      next.position().x(), next.position().y(), storey, next.height_over_floor_m(),
      next.model_gain_m2(), next.verdict().overlap_share() * 100,
      next.verdict().error_bound_m() * 1000);
}

void AddScores(const v1::ScoreMap& map, picture::JobPicture& picture) {
  if (map.viewcell_size_m() > 0) picture.viewcell_size = map.viewcell_size_m();
  const Eigen::Vector3d origin = client::FromProto(map.origin());
  picture.scores.reserve(static_cast<size_t>(map.x_size()));
  for (int i = 0; i < map.x_size(); ++i) {
    picture.scores.push_back(
        {(origin + Eigen::Vector3d(map.x(i), map.y(i), map.z(i))).cast<float>(), map.score(i)});
  }
}

}  // namespace

absl::Status WriteCyclePicture(client::Client& client, const std::string& session, const Site& site,
                               const Cycle& cycle,
                               const std::vector<picture::JobPicture::Station>& stations,
                               const std::string& path) {
  v1::ExportModelRequest request;
  request.set_name(session);
  request.set_format(v1::EXPORT_FORMAT_SURFACE_PLY);
  const auto bytes = client.ExportBytes(request);
  if (!bytes.ok()) return bytes.status();
  auto surfaces = picture::ParseSurfacePly(*bytes);
  if (!surfaces.ok()) return surfaces.status();

  const v1::PlanResult& result = cycle.plan.result();
  picture::JobPicture picture;
  picture.title = absl::StrFormat("%s: after scan %d", site.name, cycle.number);
  const std::string estimated =
      result.coverage().has_estimated_coverage()
          ? absl::StrFormat("%.1f %%", result.coverage().estimated_coverage() * 100)
          : "not yet";
  picture.figures = {
      absl::StrFormat("Coverage at %.0f samples/m\u00b2: %s estimated, %.1f %% true (%.1f %% "
                      "of the attainable surface seen at all)",
                      result.config().required_density_per_m2(), estimated,
                      cycle.truth.at_density_share() * 100, cycle.truth.seen_share() * 100),
      NextLine(result)};
  picture.required_density = result.config().required_density_per_m2();
  picture.surfaces = *std::move(surfaces);
  picture.stations = stations;
  if (result.config().has_candidate_separation_m())
    picture.separation = result.config().candidate_separation_m();
  AddScores(result.score_map(), picture);
  if (!result.termination().suggested()) {
    for (const v1::RankedView& view : result.views()) {
      picture.candidates.push_back(CandidateOf(view));
    }
    for (const v1::RankedView& view : result.refused()) {
      picture.refused.emplace_back(client::FromProto(view.position()).head<2>());
    }
  }
  v1::GetSessionRequest get;
  get.set_name(session);
  const auto got = client.Call(get);
  if (!got.ok()) return got.status();
  picture.voxel_size = got->session().model_config().voxel_size_m();
  return picture::WriteJobPicture(picture, path);
}

}  // namespace vantage::simulated_job
