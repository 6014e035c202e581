#include "client/simulated_job/cycle_picture.h"

#include "absl/strings/str_format.h"
#include "client/simulated_job/measured_surface.h"
#include "client/simulated_job/plan_marks.h"

namespace vantage::simulated_job {
absl::Status WriteCyclePicture(client::Client& client, const std::string& session, const Site& site,
                               const Cycle& cycle,
                               const std::vector<picture::JobPicture::Station>& stations,
                               const std::string& path) {
  auto surfaces = MeasuredSurfaceOf(client, session);
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
  picture.surfaces = *std::move(surfaces);
  picture.stations = stations;
  AddPlanMarks(
      result, [](const v1::Vector3&) { return true; }, picture);
  v1::GetSessionRequest get;
  get.set_name(session);
  const auto got = client.Call(get);
  if (!got.ok()) return got.status();
  picture.voxel_size = got->session().model_config().voxel_size_m();
  return picture::WriteJobPicture(picture, path);
}

}  // namespace vantage::simulated_job
