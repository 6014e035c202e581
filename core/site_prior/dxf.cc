#include "core/site_prior/dxf.h"

#include <dxflib/dl_creationadapter.h>
#include <dxflib/dl_dxf.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/site_prior/building_units.h"

namespace vantage::site_prior {
namespace {

constexpr double kDxfCell = 0.02;      // m
constexpr double kCoarsestCell = 0.1;  // m
constexpr size_t kMostCells = 16'000'000;
constexpr size_t kMostLines = 2'000'000;
constexpr int kBulgePieces = 8;  // an arc of a polyline becomes so many lines
// What plans have besides walls, in the languages of those who draw them here.
constexpr std::array<const char*, 16> kNoWalls = {
    "door", "tuer", "tür",   "furn",    "moebel", "möbel", "möb",  "dim",
    "bema", "text", "hatch", "schraff", "annot",  "axis",  "achs", "sanit"};

struct Line {
  Eigen::Vector2d a;
  Eigen::Vector2d b;
};

struct Insert {
  std::string block;
  Eigen::Affine2d pose;
};

bool IsWallName(const std::string& name) {
  const std::string lower = absl::AsciiStrToLower(name);
  return std::none_of(kNoWalls.begin(), kNoWalls.end(),
                      [&](const char* word) { return absl::StrContains(lower, word); });
}

// What AutoCAD's $INSUNITS mean, m; 0 for those that buildings are not drawn in.
double UnitOf(int insunits) {
  for (const BuildingUnit& unit : kBuildingUnits) {
    if (unit.insunits == insunits) return unit.metres;
  }
  return 0;
}

class Gathering final : public DL_CreationAdapter {
 public:
  void addBlock(const DL_BlockData& data) override {
    EndPolyline();
    block_ = data.name;
    blocks_[block_].base = {data.bpx, data.bpy};
    in_block_ = true;
  }
  void endBlock() override {
    EndPolyline();
    in_block_ = false;
  }
  void addLine(const DL_LineData& data) override {
    EndPolyline();
    if (Wanted()) Add({data.x1, data.y1}, {data.x2, data.y2});
  }
  void addPolyline(const DL_PolylineData& data) override {
    EndPolyline();
    closed_ = (data.flags & 1) != 0;
    wanted_ = Wanted();
  }
  void addVertex(const DL_VertexData& data) override {
    if (wanted_) polyline_.push_back({{data.x, data.y}, data.bulge});
  }
  void endSequence() override { EndPolyline(); }
  void addInsert(const DL_InsertData& data) override {
    EndPolyline();
    if (in_block_ || !Wanted() || !IsWallName(data.name)) return;
    Eigen::Affine2d pose = Eigen::Affine2d::Identity();
    pose.translate(Eigen::Vector2d(data.ipx, data.ipy));
    pose.rotate(data.angle * std::numbers::pi / 180);
    pose.scale(Eigen::Vector2d(data.sx == 0 ? 1 : data.sx, data.sy == 0 ? 1 : data.sy));
    inserts_.push_back({data.name, pose});
  }
  void setVariableInt(const std::string& key, int value, int /*code*/) override {
    if (key == "$INSUNITS") insunits_ = value;
  }

  double unit() const { return UnitOf(insunits_); }
  // All lines, those of inserted blocks too; blocks within blocks are left out.
  std::vector<Line> Lines() {
    EndPolyline();
    std::vector<Line> all = std::move(lines_);
    for (const Insert& insert : inserts_) {
      const auto found = blocks_.find(insert.block);
      if (found == blocks_.end()) continue;
      for (const Line& line : found->second.lines) {
        if (all.size() >= kMostLines) return all;
        all.push_back({insert.pose * (line.a - found->second.base),
                       insert.pose * (line.b - found->second.base)});
      }
    }
    return all;
  }

 private:
  struct Vertex {
    Eigen::Vector2d at;
    double bulge = 0;  // tangent of a quarter of the angle of the arc to the next
  };
  struct Block {
    Eigen::Vector2d base = Eigen::Vector2d::Zero();
    std::vector<Line> lines;
  };

  bool Wanted() { return IsWallName(getAttributes().getLayer()); }
  void Add(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    std::vector<Line>& to = in_block_ ? blocks_[block_].lines : lines_;
    if (to.size() < kMostLines && a.allFinite() && b.allFinite()) to.push_back({a, b});
  }
  void AddArc(const Vertex& from, const Eigen::Vector2d& to) {
    if (std::abs(from.bulge) < 1e-6) {
      Add(from.at, to);
      return;
    }
    // The circle through both ends whose arc from one to the other has that bulge.
    const double angle = 4 * std::atan(from.bulge);
    const Eigen::Vector2d chord = to - from.at;
    const Eigen::Vector2d left(-chord.y(), chord.x());
    const Eigen::Vector2d centre = from.at + chord / 2 + left * ((1 / std::tan(angle / 2)) / 2);
    Eigen::Vector2d before = from.at;
    for (int i = 1; i <= kBulgePieces; ++i) {
      const Eigen::Vector2d next =
          centre + Eigen::Rotation2Dd(angle * i / kBulgePieces) * (from.at - centre);
      Add(before, next);
      before = next;
    }
  }
  void EndPolyline() {
    for (size_t i = 1; i < polyline_.size(); ++i) AddArc(polyline_[i - 1], polyline_[i].at);
    if (closed_ && polyline_.size() > 2) AddArc(polyline_.back(), polyline_.front().at);
    polyline_.clear();
    closed_ = false;
    wanted_ = false;
  }

  std::vector<Line> lines_;
  std::map<std::string, Block> blocks_;
  std::string block_;
  bool in_block_ = false;
  std::vector<Insert> inserts_;
  std::vector<Vertex> polyline_;
  bool closed_ = false;
  bool wanted_ = false;
  int insunits_ = 0;
};

absl::StatusOr<PlanRaster> Draw(std::vector<Line> lines, double unit) {
  Eigen::AlignedBox2d box;
  for (Line& line : lines) {
    line.a *= unit;
    line.b *= unit;
    box.extend(line.a);
    box.extend(line.b);
  }
  const Eigen::Vector2d size = box.sizes();
  if (size.maxCoeff() > kWidestPrior || size.maxCoeff() < 1) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the plan is %.3f m wide with a unit of %g m: give the unit that it is drawn in, such as "
        "mm, and draw one plan a file",
        size.maxCoeff(), unit));
  }
  PlanRaster plan;
  plan.cell = kDxfCell;
  while ((size.x() / plan.cell + 3) * (size.y() / plan.cell + 3) >
         static_cast<double>(kMostCells)) {
    plan.cell *= 1.25;
  }
  if (plan.cell > kCoarsestCell) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the plan is %.0f m by %.0f m: draw one building a file", size.x(), size.y()));
  }
  plan.origin = box.min() - Eigen::Vector2d::Constant(plan.cell);
  plan.width = static_cast<int>(size.x() / plan.cell) + 3;
  plan.height = static_cast<int>(size.y() / plan.cell) + 3;
  plan.wall.assign(static_cast<size_t>(plan.width) * static_cast<size_t>(plan.height), 0);
  for (const Line& line : lines) {
    const int steps = static_cast<int>(std::ceil((line.b - line.a).norm() / (0.5 * plan.cell))) + 1;
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector2d p = line.a + (line.b - line.a) * (static_cast<double>(i) / steps);
      const Eigen::Vector2i at = ((p - plan.origin) / plan.cell).array().floor().cast<int>();
      plan.At(at.x(), at.y()) = 1;
    }
  }
  return plan;
}

}  // namespace

absl::StatusOr<PlanRaster> ReadDxf(absl::string_view bytes, double unit) {
  Gathering gathering;
  try {
    std::istringstream stream{std::string(bytes)};
    DL_Dxf dxf;
    if (!dxf.in(stream, &gathering)) return absl::InvalidArgumentError("DXF: it cannot be read");
  } catch (const std::exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("DXF: ", e.what()));
  }
  std::vector<Line> lines = gathering.Lines();
  if (lines.empty()) {
    return absl::InvalidArgumentError(
        "the plan is empty: it has no line or polyline that is a wall; layers and blocks that are "
        "named for doors, furniture, dimensions or texts are left out");
  }
  if (unit == 0) unit = gathering.unit() > 0 ? gathering.unit() : 1;
  absl::StatusOr<PlanRaster> plan = Draw(std::move(lines), unit);
  if (plan.ok()) plan->unit = unit;
  return plan;
}

}  // namespace vantage::site_prior
