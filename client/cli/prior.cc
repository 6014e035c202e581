#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client/cli/command.h"
#include "client/cli/file.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/error.h"
#include "client/library/resource_names.h"
#include "core/bytes/compression.h"
#include "core/site_prior/building_units.h"

namespace vantage::cli {
namespace {

struct PriorSetArguments {
  std::string session;
  std::string file;
  std::string from_session;
  std::vector<std::string> at;
  std::string unit;
  bool y_up = false;
  double height = 0;
  double scale = 0;
  double accuracy = 0;
  double darkest = 0;
  bool json = false;
};

// X,Y or X,Y,Z.
absl::StatusOr<v1::Vector3> PlaceOf(absl::string_view text, absl::string_view whole) {
  const std::vector<std::string> parts = absl::StrSplit(text, ',');
  std::array<double, 3> numbers{};
  bool fine = parts.size() == 2 || parts.size() == 3;
  for (size_t i = 0; fine && i < parts.size(); ++i) fine = absl::SimpleAtod(parts[i], &numbers[i]);
  if (!fine) {
    return client::WithFix(
        absl::InvalidArgumentError(absl::StrCat("--at: '", whole, "' is no pair of places")),
        "write X,Y=X,Y,Z: a place in the file, and the same at the site in metres");
  }
  v1::Vector3 place;
  place.set_x(numbers[0]);
  place.set_y(numbers[1]);
  place.set_z(numbers[2]);
  return place;
}

// m for 1 of the file's coordinates; 0: not given.
absl::StatusOr<double> UnitOfText(const std::string& text) {
  if (text.empty()) return 0;
  for (const site_prior::BuildingUnit& unit : site_prior::kBuildingUnits) {
    if (text == unit.name) return unit.metres;
  }
  double metres = 0;
  if (absl::SimpleAtod(text, &metres) && metres > 0) return metres;
  return client::WithFix(absl::InvalidArgumentError(absl::StrCat("--unit: '", text, "' is none")),
                         "mm, cm, m, in, ft, or metres for 1 of the file's coordinates or pixels");
}

absl::StatusOr<v1::SetSitePriorRequest> RequestOf(const PriorSetArguments& arguments) {
  v1::SetSitePriorRequest request;
  request.set_parent(client::SessionName(arguments.session));
  v1::SitePrior& prior = *request.mutable_site_prior();
  const absl::StatusOr<double> unit = UnitOfText(arguments.unit);
  if (!unit.ok()) return unit.status();
  prior.set_unit_m(*unit);
  prior.set_y_up(arguments.y_up);
  prior.set_wall_height_m(arguments.height);
  prior.set_scale(arguments.scale);
  prior.set_accuracy_m(arguments.accuracy);
  prior.set_darkest(arguments.darkest);
  for (const std::string& at : arguments.at) {
    const std::vector<std::string> sides = absl::StrSplit(at, '=');
    const auto in_prior = PlaceOf(sides.front(), at);
    if (!in_prior.ok()) return in_prior.status();
    const auto at_site = PlaceOf(sides.size() == 2 ? sides[1] : "", at);
    if (!at_site.ok()) return at_site.status();
    v1::SitePriorPoint& point = *prior.add_points();
    *point.mutable_prior() = *in_prior;
    *point.mutable_site() = *at_site;
  }
  if (!arguments.from_session.empty()) {
    prior.set_source_session(client::SessionName(arguments.from_session));
    prior.set_display_name(arguments.from_session);
    return request;
  }
  absl::StatusOr<std::string> bytes = ReadFile(arguments.file);
  if (!bytes.ok()) return bytes.status();
  prior.set_display_name(arguments.file.substr(arguments.file.rfind('/') + 1));
  request.set_uncompressed_size_bytes(static_cast<int64_t>(bytes->size()));
  request.set_compression(v1::COMPRESSION_ZSTD);
  request.set_file(bytes::ZstdCompress(*bytes, 12));
  return request;
}

absl::StatusOr<ExitCode> RunPriorSet(Environment& environment, const PriorSetArguments& arguments) {
  if (arguments.file.empty() == arguments.from_session.empty()) {
    return client::WithFix(absl::InvalidArgumentError("a prior is a file or another job"),
                           "give FILE, or --from JOB");
  }
  const auto request = RequestOf(arguments);
  if (!request.ok()) return request.status();
  const auto set = environment.client().Call(*request);
  if (!set.ok()) return set.status();
  if (arguments.json) {
    std::fputs(ToJson(*set).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("the prior is set: %lld triangles; 'vantage prior show %s' says whether it is used\n",
              static_cast<long long>(set->site_prior().triangle_count()),
              arguments.session.c_str());
  return ExitCode::kOk;
}

struct PriorArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunPriorShow(Environment& environment, const PriorArguments& arguments) {
  v1::GetSitePriorRequest request;
  request.set_parent(client::SessionName(arguments.session));
  const auto got = environment.client().Call(request);
  if (!got.ok()) return got.status();
  if (arguments.json) {
    std::fputs(ToJson(*got).c_str(), stdout);
    return ExitCode::kOk;
  }
  const v1::SitePrior& prior = got->site_prior();
  const v1::SitePriorStanding& standing = got->standing();
  std::printf("%s  %lld triangles, accuracy %s\n  %s\n", prior.display_name().c_str(),
              static_cast<long long>(prior.triangle_count()), Length(prior.accuracy_m()).c_str(),
              standing.message().c_str());
  return ExitCode::kOk;
}

absl::StatusOr<ExitCode> RunPriorClear(Environment& environment, const PriorArguments& arguments) {
  v1::ClearSitePriorRequest request;
  request.set_parent(client::SessionName(arguments.session));
  const auto cleared = environment.client().Call(request);
  if (!cleared.ok()) return cleared.status();
  if (arguments.json) {
    std::fputs(ToJson(*cleared).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::puts("the prior is out: plans go by the scans alone");
  return ExitCode::kOk;
}

void PriorOptions(CLI::App& command, PriorArguments& a) {
  command.add_option("SESSION", a.session, "The job")->required();
  command.add_flag("--json", a.json, "Print the answer as JSON");
}

}  // namespace

void AddPriorSet(CLI::App& parent, Environment& environment) {
  AddCommand<PriorSetArguments>(
      parent, environment, "set",
      "Give a mesh (PLY, OBJ), a floor plan (DXF, PNG) or another job's model, for plans to expect",
      "  vantage prior set flat plan.png --unit 0.02 --at 120,40=0.5,1,-1.5 --at "
      "480,40=7.7,1,-1.5\n"
      "  vantage prior set flat tablet.obj --y-up --at 0,0,0=1,2,0 --at 5,0,0=6,2,0\n"
      "  vantage prior set flat --from flat-2019 --at 0,0=0,0 --at 5,0=5,0",
      [](CLI::App& command, PriorSetArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("FILE", a.file, "PLY, OBJ, DXF or PNG");
        command.add_option("--from", a.from_session, "The job whose model it is");
        command
            .add_option(
                "--at", a.at,
                "PLACE=PLACE, twice: a place in the file (of a picture in pixels, x from its "
                "left, y down from its top) and the same at the site, m; a metre off is fine. "
                "The second z is the floor's height of a plan")
            ->expected(1)
            ->take_all()
            ->required();
        command.add_option("--unit", a.unit,
                           "mm, cm, m, in, ft, or metres for a pixel [m; what a DXF says; of a "
                           "picture by the two places]");
        command.add_flag("--y-up", a.y_up, "The mesh's y axis points up");
        command.add_option("--height", a.height, "Of a plan's walls, m [2.5]");
        command.add_option("--scale", a.scale, "Where it is known not to be 1");
        command.add_option("--accuracy", a.accuracy, "How far its surface is off, m [0.1]");
        command.add_option("--darkest", a.darkest,
                           "Of a picture: what is darker is wall, 0 black, 1 white [0.5]");
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunPriorSet);
}

void AddPriorShow(CLI::App& parent, Environment& environment) {
  AddCommand<PriorArguments>(
      parent, environment, "show", "Say whether the job's prior is used, and why not",
      "  vantage prior show flat\n  vantage prior show flat --json", PriorOptions, RunPriorShow);
}

void AddPriorClear(CLI::App& parent, Environment& environment) {
  AddCommand<PriorArguments>(parent, environment, "clear", "Take the job's prior out",
                             "  vantage prior clear flat", PriorOptions, RunPriorClear);
}

}  // namespace vantage::cli
