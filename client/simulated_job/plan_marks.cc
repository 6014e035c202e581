#include "client/simulated_job/plan_marks.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/geometry.h"

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

}  // namespace

std::string NextLine(const v1::PlanResult& result) {
  if (result.termination().suggested()) {
    return absl::StrCat("No further scan: ", result.termination().message());
  }
  if (result.views().empty()) return absl::StrCat("No next position: ", result.message());
  const v1::RankedView& next = result.views(0);
  const std::string storey =
      result.storeys_size() > 1 ? absl::StrFormat(", storey %d", next.storey().number()) : "";
  // Where no floor is known below, there is no height over it.
  const std::string tripod = std::isfinite(next.height_over_floor_m())
                                 ? absl::StrFormat(", tripod %.2f m", next.height_over_floor_m())
                                 : "";
  return absl::StrFormat(
      "Next: (%.2f, %.2f)%s%s, brings %.1f m\u00b2 to density, will register: "
      "overlap %.0f %%, error bound %.1f mm",
      next.position().x(), next.position().y(), storey, tripod, next.model_gain_m2(),
      next.verdict().overlap_share() * 100, next.verdict().error_bound_m() * 1000);
}

void AddPlanMarks(const v1::PlanResult& result, absl::FunctionRef<bool(const v1::Vector3&)> shows,
                  picture::JobPicture& picture) {
  picture.required_density = result.config().required_density_per_m2();
  if (result.config().has_candidate_separation_m())
    picture.separation = result.config().candidate_separation_m();
  const v1::ScoreMap& map = result.score_map();
  if (map.viewcell_size_m() > 0) picture.viewcell_size = map.viewcell_size_m();
  const Eigen::Vector3d origin = client::FromProto(map.origin());
  picture.scores.reserve(static_cast<size_t>(map.x_size()));
  for (int i = 0; i < map.x_size(); ++i) {
    const Eigen::Vector3d at = origin + Eigen::Vector3d(map.x(i), map.y(i), map.z(i));
    if (!shows(client::ToProto(at))) continue;
    picture.scores.push_back({at.cast<float>(), map.score(i)});
  }
  if (result.termination().suggested()) return;
  for (const v1::RankedView& view : result.views()) {
    if (shows(view.position())) picture.candidates.push_back(CandidateOf(view));
  }
  for (const v1::RankedView& view : result.refused()) {
    if (shows(view.position())) {
      picture.refused.emplace_back(client::FromProto(view.position()).head<2>());
    }
  }
}

}  // namespace vantage::simulated_job
