#include <algorithm>
#include <cmath>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/conversion/to_proto.h"
#include "server/report/plan_sheet.h"
#include "server/report/png.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

// Of a plan's raster: 1,000 x 1,000 cells are more than a sheet shows.
constexpr size_t kMostCells = 1'000'000;
// What a sheet of A4 has room for beside heading and legend, mm.
const Eigen::Vector2d kSheet(180, 178);

// Told apart by colour-blind people, and by their darkness on a printer without colour.
constexpr PngColour kPalette[] = {
    {255, 255, 255, 0},  // nothing
    {236, 236, 236},     // floor
    {250, 224, 160},     // floor below density
    {176, 176, 176},     // furniture
    {40, 40, 40},        // wall
    {230, 159, 0},       // missing: too thin
    {208, 52, 28},       // hidden
    {204, 121, 167},     // no echo
    {0, 114, 178},       // outside the view
};
constexpr size_t kMissingFrom = 5;

std::string Hex(const PngColour& colour) {
  return absl::StrFormat("#%02x%02x%02x", colour.red, colour.green, colour.blue);
}

// Whether a kind's hatching covers a pixel, so that nothing is told by colour alone: too thin is
// dotted, hidden slants, no echo is chequered, outside the view lies level.
bool Hatched(model::SurfaceKind kind, int x, int y) {
  switch (kind) {
    case model::SurfaceKind::kTrue:
      return x % 4 < 2 && y % 4 < 2;
    case model::SurfaceKind::kOcclusion:
      return (x + y) % 4 < 2;
    case model::SurfaceKind::kHole:
      return (x / 2 + y / 2) % 2 == 0;
    default:
      return y % 4 < 2;
  }
}

// Pixels to a cell's edge: as many as hatching needs, where memory has room.
int FinenessOf(const model::FloorPlan& plan) { return plan.cells.size() <= kMostCells / 4 ? 4 : 2; }

std::string PlanPng(const model::FloorPlan& plan) {
  const int fine = FinenessOf(plan);
  PaletteImage image{fine * plan.columns, fine * plan.rows, {}};
  image.pixels.reserve(static_cast<size_t>(image.width) * image.height);
  for (int y = image.height - 1; y >= 0; --y) {
    for (int x = 0; x < image.width; ++x) {
      const size_t at = plan.At(x / fine, y / fine);
      const std::optional<model::SurfaceKind> missing =
          plan.cells[at] == model::PlanCell::kWall ? std::nullopt : plan.missing[at];
      image.pixels.push_back(
          missing.has_value() && Hatched(*missing, x, y)
              ? static_cast<uint8_t>(kMissingFrom + static_cast<size_t>(*missing))
              : static_cast<uint8_t>(plan.cells[at]));
    }
  }
  return EncodePng(image, kPalette);
}

// A storey's drawing, mark by mark, in mm on the sheet.
class Drawing {
 public:
  Drawing(const JobRecord& job, const std::vector<ReportStorey>& storeys, size_t storey,
          const Words& say)
      : job_(job),
        storeys_(storeys),
        storey_(storey),
        say_(say),
        scans_(NumberedScans(job)),
        plan_(model::DrawFloorPlan(
            *job.view,
            {storeys[storey].band.floor - job.origin.z(),
             storeys[storey].band.top - job.origin.z()},
            [&job](const Eigen::Vector3d& place) -> std::optional<double> {
              const std::optional<planning::Requirement> required = job.config.RequiredAt(place);
              return required.has_value() ? std::optional(required->density) : std::nullopt;
            },
            kMostCells)),
        sheet_(plan_, Stations(), kSheet) {}

  const PlanSheet& sheet() const { return sheet_; }

  std::string Svg() {
    const Eigen::Vector2d size = sheet_.size();
    const std::string title = say_(Text::kPlanAlt, StoreyTitle(storeys_[storey_], say_),
                                   sheet_.scale(), Stations().size());
    svg_ = absl::StrFormat(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"%.1fmm\" height=\"%.1fmm\" "
        "viewBox=\"0 0 %.2f %.2f\"><title>%s</title>\n<clipPath id=\"sheet-%d\"><rect "
        "width=\"%.2f\" "
        "height=\"%.2f\"/></clipPath>\n",
        size.x(), size.y() + kFoot, size.x(), size.y() + kFoot, Escaped(title), storey_, size.x(),
        size.y());
    absl::StrAppendFormat(&svg_, "<g clip-path=\"url(#sheet-%d)\">\n", storey_);
    DrawRaster();
    DrawLinks();
    DrawOpenings();
    DrawRejections();
    DrawStations();
    svg_ += "</g>\n";
    absl::StrAppendFormat(&svg_,
                          "<rect width=\"%.2f\" height=\"%.2f\" fill=\"none\" stroke=\"#111\" "
                          "stroke-width=\"0.25\"/>\n",
                          size.x(), size.y());
    DrawScaleBar();
    DrawAxes();
    return svg_ + "</svg>\n";
  }

 private:
  static constexpr double kFoot = 15;  // mm below the plan, for scale bar and axes

  Eigen::Vector2d InModel(const v1::Vector3& at) const {
    return (conversion::ReadOwnVector(at) - job_.origin).head<2>();
  }
  bool OnStorey(double z) const { return StoreyAt(storeys_, z) == storey_; }
  bool Shown(const v1::Scan& scan) const {
    return report::InModel(scan) && OnStorey(scan.pose().translation().z());
  }
  std::vector<Eigen::Vector2d> Stations() const {
    std::vector<Eigen::Vector2d> stations;
    for (const NumberedScan& of : scans_) {
      if (Shown(*of.scan)) stations.push_back(InModel(of.scan->pose().translation()));
    }
    return stations;
  }

  void Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, absl::string_view style) {
    absl::StrAppendFormat(&svg_, "<line x1=\"%.2f\" y1=\"%.2f\" x2=\"%.2f\" y2=\"%.2f\" %s/>\n",
                          from.x(), from.y(), to.x(), to.y(), style);
  }
  void TextAt(const Eigen::Vector2d& at, double size, absl::string_view anchor,
              const std::string& text, absl::string_view style = "") {
    absl::StrAppendFormat(
        &svg_, "<text x=\"%.2f\" y=\"%.2f\" font-size=\"%.2f\" text-anchor=\"%s\" %s>%s</text>\n",
        at.x(), at.y(), size, anchor, style, Escaped(text));
  }

  void DrawRaster() {
    if (plan_.columns == 0) return;
    // From pixels, row after row from the top, to the sheet.
    const Eigen::Vector2d corner =
        sheet_.ToSheet(plan_.corner + Eigen::Vector2d(0, plan_.edge * plan_.rows));
    const int fine = FinenessOf(plan_);
    const Eigen::Vector2d right = sheet_.Turned(Eigen::Vector2d(plan_.edge / fine, 0));
    const Eigen::Vector2d down = sheet_.Turned(Eigen::Vector2d(0, -plan_.edge / fine));
    absl::StrAppendFormat(
        &svg_,
        "<image width=\"%d\" height=\"%d\" preserveAspectRatio=\"none\" "
        "style=\"image-rendering:pixelated\" transform=\"matrix(%.6f %.6f %.6f %.6f %.4f %.4f)\" "
        "href=\"data:image/png;base64,%s\"/>\n",
        fine * plan_.columns, fine * plan_.rows, right.x(), right.y(), down.x(), down.y(),
        corner.x(), corner.y(), absl::Base64Escape(PlanPng(plan_)));
  }

  const v1::Scan* Find(const std::string& name) const {
    for (const NumberedScan& of : scans_) {
      if (of.scan->name() == name) return of.scan;
    }
    return nullptr;
  }

  void DrawLinks() {
    int64_t most = 1;
    for (const v1::ScanLink& link : job_.graph.links()) {
      most = std::max(most, link.correspondence_count());
    }
    for (int i = 0; i < job_.graph.links_size(); ++i) {
      const v1::ScanLink& link = job_.graph.links(i);
      const v1::Scan* first = Find(link.first_scan());
      const v1::Scan* second = Find(link.second_scan());
      if (first == nullptr || second == nullptr || !Shown(*first) || !Shown(*second)) continue;
      const bool suspect = link.in_doubt() || (i < job_.graph.link_test_ratios_size() &&
                                               job_.graph.link_test_ratios(i) > 1);
      Line(sheet_.ToSheet(InModel(first->pose().translation())),
           sheet_.ToSheet(InModel(second->pose().translation())),
           absl::StrFormat("stroke=\"%s\" stroke-width=\"%.2f\"%s", suspect ? "#a01010" : "#1a5c2e",
                           0.1 + 0.6 * std::sqrt(static_cast<double>(link.correspondence_count()) /
                                                 static_cast<double>(most)),
                           suspect ? " stroke-dasharray=\"1.5 1\"" : ""));
    }
  }

  void DrawOpenings() {
    for (const v1::Opening& opening : job_.coverage.coverage().openings()) {
      if (opening.storey_index() != storeys_[storey_].number) continue;
      const Eigen::Vector2d centre = InModel(opening.centre());
      const Eigen::Vector2d across(-opening.direction().y(), opening.direction().x());
      const Eigen::Vector2d half = 0.5 * opening.width_m() * across;
      const bool left =
          opening.doorway() && !opening.entered() && opening.frontier_area_behind_m2() > 0;
      Line(sheet_.ToSheet(centre - half), sheet_.ToSheet(centre + half),
           left ? "stroke=\"#a01010\" stroke-width=\"1\""
                : "stroke=\"#111\" stroke-width=\"0.5\" stroke-dasharray=\"0.8 0.8\"");
      if (left) {
        TextAt(sheet_.ToSheet(centre) + Eigen::Vector2d(0, -1.2), 3.2, "middle", "?",
               "font-weight=\"bold\" fill=\"#a01010\" stroke=\"#fff\" stroke-width=\"0.5\" "
               "paint-order=\"stroke\"");
      }
    }
  }

  void DrawRejections() {
    for (const v1::Rejection& rejection : job_.session.rejections()) {
      if (!OnStorey(rejection.position().z())) continue;
      const Eigen::Vector2d at = sheet_.ToSheet(InModel(rejection.position()));
      absl::StrAppendFormat(
          &svg_,
          "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"%.2f\" fill=\"none\" stroke=\"#111\" "
          "stroke-width=\"0.3\" stroke-dasharray=\"1 0.7\"/>\n",
          at.x(), at.y(), rejection.radius_m() * sheet_.millimetres_per_metre());
      const char* style = "stroke=\"#111\" stroke-width=\"0.5\"";
      Line(at + Eigen::Vector2d(-1.2, -1.2), at + Eigen::Vector2d(1.2, 1.2), style);
      Line(at + Eigen::Vector2d(-1.2, 1.2), at + Eigen::Vector2d(1.2, -1.2), style);
    }
  }

  void DrawStations() {
    for (const NumberedScan& of : scans_) {
      if (!Shown(*of.scan)) continue;
      const Eigen::Vector2d at = sheet_.ToSheet(InModel(of.scan->pose().translation()));
      absl::StrAppendFormat(&svg_,
                            "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"2.3\" fill=\"#fff\" "
                            "stroke=\"#111\" stroke-width=\"0.45\"/>\n",
                            at.x(), at.y());
      const std::string number = absl::StrCat(of.number);
      TextAt(at + Eigen::Vector2d(0, 0.95), number.size() > 2 ? 2.0 : 2.7, "middle", number,
             "font-weight=\"bold\"");
    }
  }

  void DrawScaleBar() {
    // A round length of about 40 mm.
    const double about = 40 / sheet_.millimetres_per_metre();
    const double power = std::pow(10, std::floor(std::log10(about)));
    const double metres = power * (about / power >= 5 ? 5 : about / power >= 2 ? 2 : 1);
    const double length = metres * sheet_.millimetres_per_metre();
    const double y = sheet_.size().y() + 5;
    const char* const kFills[] = {"#111", "#fff"};
    for (int i = 0; i < 4; ++i) {
      absl::StrAppendFormat(&svg_,
                            "<rect x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"1.6\" "
                            "fill=\"%s\" stroke=\"#111\" stroke-width=\"0.2\"/>\n",
                            0.2 + i * length / 4, y, length / 4, kFills[i % 2]);
    }
    TextAt({0.2, y + 5}, 3, "start", "0");
    TextAt({0.2 + length, y + 5}, 3, "middle",
           absl::StrCat(say_.Number(metres, metres < 1 ? 1 : 0), " m"));
    TextAt({length + 8, y + 1.8}, 3, "start", say_(Text::kScale, sheet_.scale()));
  }

  // The axes of the coordinates: the world's, which need not have north.
  void DrawAxes() {
    const Eigen::Vector2d at(sheet_.size().x() - 12, sheet_.size().y() + 11.5);
    for (const auto& [direction, name] :
         {std::pair(Eigen::Vector2d(1, 0), "x"), std::pair(Eigen::Vector2d(0, 1), "y")}) {
      const Eigen::Vector2d way = sheet_.Turned(direction).normalized();
      const Eigen::Vector2d end = at + 5 * way;
      const Eigen::Vector2d side(-way.y(), way.x());
      Line(at, end, "stroke=\"#111\" stroke-width=\"0.4\"");
      absl::StrAppendFormat(&svg_,
                            "<path d=\"M%.2f %.2f L%.2f %.2f L%.2f %.2f Z\" fill=\"#111\"/>\n",
                            (end + 1.4 * way).x(), (end + 1.4 * way).y(), (end + 0.7 * side).x(),
                            (end + 0.7 * side).y(), (end - 0.7 * side).x(), (end - 0.7 * side).y());
      TextAt(end + 2.8 * way + Eigen::Vector2d(0, 1), 3, "middle", name, "font-style=\"italic\"");
    }
  }

  const JobRecord& job_;
  const std::vector<ReportStorey>& storeys_;
  const size_t storey_;
  const Words& say_;
  const std::vector<NumberedScan> scans_;
  const model::FloorPlan plan_;
  const PlanSheet sheet_;
  std::string svg_;
};

void AddKey(std::string& list, const std::string& drawing, const std::string& words) {
  absl::StrAppend(&list, "<li><svg viewBox=\"0 0 7 4\" aria-hidden=\"true\">", drawing, "</svg>",
                  Escaped(words), "</li>\n");
}

std::string Swatch(const PngColour& colour) {
  return absl::StrCat("<rect x=\"0.2\" y=\"0.2\" width=\"6.6\" height=\"3.6\" fill=\"", Hex(colour),
                      "\" stroke=\"#111\" stroke-width=\"0.2\"/>");
}

// A key of missing surface, hatched as on the plan.
std::string HatchedSwatch(size_t kind) {
  std::string drawing =
      "<rect x=\"0.2\" y=\"0.2\" width=\"6.6\" height=\"3.6\" fill=\"#fff\" stroke=\"#111\" "
      "stroke-width=\"0.2\"/><path d=\"";
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) {
      if (!Hatched(static_cast<model::SurfaceKind>(kind), x, y)) continue;
      absl::StrAppendFormat(&drawing, "M%.1f %.1fh.4v.4h-.4z", 0.3 + 0.4 * x, 3.2 - 0.4 * y);
    }
  }
  return absl::StrCat(drawing, "\" fill=\"", Hex(kPalette[kMissingFrom + kind]), "\"/>");
}

Html Legend(const Words& say) {
  std::string list = "<ul class=\"legend\">\n";
  constexpr Text kCells[] = {Text::kKeyFloor,  Text::kKeyThinFloor, Text::kKeyFurniture,
                             Text::kKeyWall,   Text::kKeyThin,      Text::kKeyHidden,
                             Text::kKeyNoEcho, Text::kKeyOutside};
  for (size_t i = 0; i < std::size(kCells); ++i)
    AddKey(list,
           i + 1 < kMissingFrom ? Swatch(kPalette[i + 1]) : HatchedSwatch(i + 1 - kMissingFrom),
           say(kCells[i]));
  AddKey(
      list,
      "<circle cx=\"3.5\" cy=\"2\" r=\"1.7\" fill=\"#fff\" stroke=\"#111\" stroke-width=\"0.4\"/>",
      say(Text::kKeyStation));
  AddKey(list,
         "<line x1=\"0\" y1=\"2\" x2=\"7\" y2=\"2\" stroke=\"#1a5c2e\" stroke-width=\"0.8\"/>",
         say(Text::kKeyLink));
  AddKey(list,
         "<line x1=\"0\" y1=\"2\" x2=\"7\" y2=\"2\" stroke=\"#a01010\" stroke-width=\"0.6\" "
         "stroke-dasharray=\"1.5 1\"/>",
         say(Text::kKeySuspect));
  AddKey(list,
         "<line x1=\"0\" y1=\"2\" x2=\"7\" y2=\"2\" stroke=\"#111\" stroke-width=\"0.6\" "
         "stroke-dasharray=\"0.8 0.8\"/>",
         say(Text::kKeyOpening));
  AddKey(list, "<line x1=\"0\" y1=\"2\" x2=\"7\" y2=\"2\" stroke=\"#a01010\" stroke-width=\"1\"/>",
         say(Text::kKeyRoom));
  AddKey(list,
         "<path d=\"M2.3 0.8 L4.7 3.2 M4.7 0.8 L2.3 3.2\" stroke=\"#111\" stroke-width=\"0.5\"/>",
         say(Text::kKeyRejected));
  return Html::Raw(list + "</ul>\n");
}

}  // namespace

Html WriteFloorPlan(const JobRecord& job, const std::vector<ReportStorey>& storeys, size_t storey,
                    bool first, const Words& say) {
  Drawing drawing(job, storeys, storey, say);
  Html out = Html::Raw(absl::StrCat("<section class=\"page\" id=\"plan-", storey, "\">\n"));
  if (first) out += Element("h2", say(Text::kPlans));
  const ReportStorey& of = storeys[storey];
  out += Element("h3", of.floor_known ? say(Text::kPlanHeading, StoreyTitle(of, say),
                                            say.Fixed(of.band.floor, 2))
                                      : say(Text::kPlanHeadingNoFloor));
  std::string caption = say(Text::kPlanCaption);
  if (drawing.sheet().turn() != 0) {
    absl::StrAppend(&caption, " ",
                    say(Text::kPlanTurned,
                        say.Fixed(std::abs(drawing.sheet().turn()) * 180 / 3.14159265358979, 1)));
  }
  if (drawing.sheet().cut()) absl::StrAppend(&caption, " ", say(Text::kPlanCut));
  out += Element("figure", Html::Raw(drawing.Svg()) + Legend(say) + Element("figcaption", caption));
  return out + Html::Raw("</section>\n");
}

}  // namespace vantage::report
