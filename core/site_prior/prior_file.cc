#include "core/site_prior/prior_file.h"

#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/bytes/ply_mesh.h"
#include "core/site_prior/dxf.h"
#include "core/site_prior/floor_plan.h"
#include "core/site_prior/obj.h"
#include "core/site_prior/plan_picture.h"

namespace vantage::site_prior {
namespace {

constexpr absl::string_view kPng("\x89PNG\r\n\x1a\n", 8);

absl::StatusOr<PriorMesh> ParsePly(absl::string_view bytes) {
  absl::StatusOr<bytes::PlyMesh> read = bytes::ParsePlyMesh(bytes);
  if (!read.ok()) return read.status();
  PriorMesh mesh;
  mesh.vertices.reserve(read->vertices.size());
  for (const std::array<float, 3>& vertex : read->vertices) {
    mesh.vertices.emplace_back(vertex[0], vertex[1], vertex[2]);
  }
  mesh.triangles = std::move(read->triangles);
  return mesh;
}

// Whether a line is SECTION, and the one before it 0, as of a group in a DXF file: in a comment of
// an OBJ file the word tells nothing.
bool HasSection(absl::string_view head) {
  absl::string_view before;
  for (absl::string_view line : absl::StrSplit(head, '\n')) {
    line = absl::StripAsciiWhitespace(line);
    if (line == "SECTION" && before == "0") return true;
    before = line;
  }
  return false;
}

absl::Status CheckReading(const PriorReading& reading) {
  if (!(reading.unit >= 0 && reading.unit < 1e4)) {
    return absl::InvalidArgumentError("unit: metres for 1 of the file's coordinates, above 0");
  }
  if (!(reading.wall_height > 0.5 && reading.wall_height <= 50)) {
    return absl::InvalidArgumentError("wall_height_m: in (0.5, 50]");
  }
  if (!(reading.darkest > 0 && reading.darkest < 1)) {
    return absl::InvalidArgumentError("darkest: in (0, 1), 0 being black");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PriorFormat> FindPriorFormat(absl::string_view bytes) {
  if (bytes.empty()) return absl::InvalidArgumentError("the file is empty");
  if (absl::StartsWith(bytes, kPng)) return PriorFormat::kPicture;
  if (absl::StartsWith(bytes, "ply")) return PriorFormat::kPly;
  const absl::string_view head = bytes.substr(0, 1 << 16);
  if (HasSection(head)) return PriorFormat::kDxf;
  if (absl::StartsWith(head, "v ") || absl::StrContains(head, "\nv ")) return PriorFormat::kObj;
  if (absl::StartsWith(head, "AutoCAD Binary DXF") || absl::StartsWith(head, "AC10")) {
    return absl::InvalidArgumentError(
        "the file is a DWG or a binary DXF: save it as DXF in text (ASCII)");
  }
  return absl::InvalidArgumentError(
      "the file is no prior that is read: a mesh as PLY or OBJ, or a floor plan as DXF or PNG");
}

absl::StatusOr<PriorMesh> ParsePrior(absl::string_view bytes, const PriorReading& reading) {
  if (bytes.size() > kMostPriorFileBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the file is ", bytes.size() >> 20, " MiB large, more than ",
                     kMostPriorFileBytes >> 20, " MiB: simplify the mesh, centimetres do"));
  }
  if (absl::Status fine = CheckReading(reading); !fine.ok()) return fine;
  const absl::StatusOr<PriorFormat> format = FindPriorFormat(bytes);
  if (!format.ok()) return format.status();
  if (*format == PriorFormat::kPicture || *format == PriorFormat::kDxf) {
    if (*format == PriorFormat::kPicture && reading.unit == 0) {
      return absl::InvalidArgumentError(
          "unit: a picture needs its scale, metres for a pixel, or the distance of two points");
    }
    const absl::StatusOr<PlanRaster> plan =
        *format == PriorFormat::kPicture ? ReadPlanPicture(bytes, reading.unit, reading.darkest)
                                         : ReadDxf(bytes, reading.unit);
    if (!plan.ok()) return plan.status();
    const double widest = std::max(plan->width, plan->height) * plan->cell;
    if (widest > kWidestPrior || widest < 1) {
      return absl::InvalidArgumentError(
          absl::StrCat("the plan is ", widest, " m wide: check its scale"));
    }
    absl::StatusOr<PriorMesh> mesh = ExtrudePlan(*plan, 0, reading.wall_height);
    if (!mesh.ok()) return mesh.status();
    mesh->unit = reading.unit > 0 ? reading.unit : plan->unit;
    if (absl::Status fine = CheckPrior(*mesh); !fine.ok()) return fine;
    return mesh;
  }
  absl::StatusOr<PriorMesh> mesh = *format == PriorFormat::kPly ? ParsePly(bytes) : ParseObj(bytes);
  if (!mesh.ok()) return mesh.status();
  const float unit = reading.unit == 0 ? 1 : static_cast<float>(reading.unit);
  for (Eigen::Vector3f& vertex : mesh->vertices) {
    vertex *= unit;
    if (reading.y_up != 0) vertex = Eigen::Vector3f(vertex.x(), -vertex.z(), vertex.y());
  }
  mesh->unit = reading.unit == 0 ? 1 : reading.unit;
  if (absl::Status fine = CheckPrior(*mesh); !fine.ok()) return fine;
  return mesh;
}

}  // namespace vantage::site_prior
