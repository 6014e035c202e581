#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/picture_storey.h"
#include "client/cli/picture_walls.h"
#include "client/cli/scan_sending.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "client/picture/job_picture.h"
#include "client/simulated_job/plan_marks.h"

namespace vantage::cli {
namespace {

struct PictureArguments {
  std::string session;
  std::string output;
  std::string storey;
  bool json = false;
};

// Stations by the numbers that the page and the report give them; a scan in doubt where its last
// alignment put it.
void AddStations(const std::vector<v1::Scan>& scans, const PictureStorey& storey,
                 picture::JobPicture& picture) {
  for (size_t i = 0; i < scans.size(); ++i) {
    const v1::Scan& scan = scans[i];
    if (scan.state() == v1::SCAN_STATE_WITHDRAWN) continue;
    if (!scan.has_pose() && !scan.registration().has_pose()) continue;
    const v1::Vector3& at =
        (scan.has_pose() ? scan.pose() : scan.registration().pose()).translation();
    if (storey.storey.has_value() && !storey.HasStation(at.z())) continue;
    picture.stations.push_back({static_cast<int>(i) + 1, client::FromProto(at).head<2>(),
                                scan.state() == v1::SCAN_STATE_MERGED});
  }
}

std::string CoverageLine(const v1::Coverage& coverage) {
  return absl::StrFormat("Coverage at %.0f samples/m\u00b2: %s estimated, %.1f m\u00b2 at density",
                         coverage.required_density_per_m2(),
                         coverage.has_estimated_coverage()
                             ? absl::StrFormat("%.1f %%", coverage.estimated_coverage() * 100)
                             : "not yet",
                         coverage.area_at_density_m2());
}

absl::StatusOr<ExitCode> RunPicture(Environment& environment, const PictureArguments& arguments) {
  client::Client& client = environment.client();
  const std::string session = client::SessionName(arguments.session);
  v1::GetSessionRequest get_session;
  get_session.set_name(session);
  const auto got_session = client.Call(get_session);
  if (!got_session.ok()) return got_session.status();
  v1::GetCoverageRequest get_coverage;
  get_coverage.set_name(session);
  const auto coverage = client.Call(get_coverage);
  if (!coverage.ok()) return coverage.status();
  const auto listed = ScansOf(environment, arguments.session);
  if (!listed.ok()) return listed.status();
  const std::vector<v1::Scan>& scans = *listed;
  std::optional<double> last_z;
  for (const v1::Scan& scan : scans) {
    if (scan.state() == v1::SCAN_STATE_MERGED) last_z = scan.pose().translation().z();
  }
  const auto storey = ChooseStorey(coverage->storeys(), arguments.storey, last_z);
  if (!storey.ok()) return storey.status();
  const bool all = !storey->storey.has_value();

  auto surfaces = WallsOfStorey(client, session, *storey);
  if (!surfaces.ok()) return surfaces.status();

  const v1::Session& job = got_session->session();
  picture::JobPicture picture;
  picture.title = job.display_name().empty() ? client::IdOf(session) : job.display_name();
  if (!all) {
    absl::StrAppend(&picture.title, ": storey ", storey->storey->number(),
                    storey->storey->name().empty() ? "" : " ", storey->storey->name());
  }
  picture.voxel_size = job.model_config().voxel_size_m();
  picture.required_density = job.planning_config().required_density_per_m2();
  picture.surfaces = *std::move(surfaces);
  picture.figures.push_back(CoverageLine(coverage->coverage()));
  AddStations(scans, *storey, picture);
  if (coverage->plan().empty()) {
    picture.figures.push_back("No plan says where to go next");
  } else {
    auto plan = client.GetFullPlan(coverage->plan());
    if (!plan.ok()) return plan.status();
    simulated_job::AddPlanMarks(
        plan->result(), [&](const v1::Vector3& at) { return all || storey->HasStation(at.z()); },
        picture);
    const bool old = plan->result().model_version() != coverage->model_version();
    picture.figures.push_back(absl::StrCat(
        simulated_job::NextLine(plan->result()),
        old ? absl::StrCat(" (", client::IdOf(plan->name()), ", of the model before)") : ""));
  }
  const std::string output =
      arguments.output.empty() ? absl::StrCat(client::IdOf(session), ".png") : arguments.output;
  if (absl::Status written = picture::WriteJobPicture(picture, output); !written.ok()) {
    return written;
  }
  if (arguments.json) {
    Json told = {{"file", output}, {"stationCount", picture.stations.size()}};
    if (!all) told["storey"] = storey->storey->number();
    PrintJson(told);
    return ExitCode::kOk;
  }
  std::printf("%s: %d stations%s\n", output.c_str(), static_cast<int>(picture.stations.size()),
              all ? ""
                  : absl::StrCat(" of storey ", storey->storey->number(), " of ",
                                 coverage->storeys_size(), "; --storey draws another")
                        .c_str());
  return ExitCode::kOk;
}

}  // namespace

void AddPicture(CLI::App& parent, Environment& environment) {
  AddCommand<PictureArguments>(
      parent, environment, "picture",
      "Draw a job from above: what is measured and missing, scores, stations, where to go next "
      "(PNG)",
      "  vantage picture flat                      to flat.png\n"
      "  vantage picture house --storey 1 -o first-floor.png\n"
      "  vantage picture house --storey cellar",
      [](CLI::App& command, PictureArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("-o,--output", a.output, "File to write; SESSION.png if not given");
        command.add_option("--storey", a.storey,
                           "By number, 0 the lowest, or by name; if there are several and none is "
                           "given, that of the last scan");
        command.add_flag("--json", a.json, "Say what was written as JSON");
      },
      RunPicture);
}

}  // namespace vantage::cli
