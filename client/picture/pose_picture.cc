#include "client/picture/pose_picture.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/picture/map_panel.h"
#include "client/picture/palette.h"

namespace vantage::picture {
namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPageWidth = 1900;  // pixels, at most
constexpr double kLeastPage = 1240;  // the width of the legend
constexpr double kBorder = 56;
constexpr double kLegendRoom = 118;
constexpr double kTallestPlan = 900;
constexpr double kLineHeight = 21;
constexpr double kFigureSize = 15;
constexpr double kFoot = 52;  // axis figures and scale bar under a panel
constexpr double kSectionTitle = 30;
// Half the thickness of a section, m: a tripod's width to either side.
constexpr double kHalfSection = 0.3;
constexpr float kFlat = 0.7f;  // cosine, 45 degrees: floor, ceiling, tops

constexpr Colour kContradiction = Rgb(0xd55e00);  // vermilion of Okabe and Ito
constexpr Colour kUnmatched = Rgb(0xe69f00);
constexpr Colour kUnknown = Rgb(0x56b4e9);
constexpr Colour kKnownWall = Rgb(0xb4b4b4);
constexpr Colour kKnownFlat = Rgb(0xececec);

// From light for no residual to dark for the largest: it reads in grey, too, and is seen on white.
Colour ResidualColour(double share) {
  constexpr double kLightest = 0.82;
  return Viridis(kLightest * (1 - std::clamp(share, 0.0, 1.0)));
}

std::string LetterOf(size_t place) { return std::string(1, static_cast<char>('A' + place)); }

// Values between the 0.5 and the 99.5 % quantile: rays out of open doors don't shrink the rest.
std::pair<double, double> MostOf(std::vector<double> values) {
  if (values.empty()) return {-1, 1};
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {at(0.005), at(0.995)};
}

struct Extent {
  AlignedBox2d plan;
  double low = 0;  // m, of heights
  double high = 1;
};

// What the panels of some poses show.
Extent ExtentOf(std::span<const PosePicture::Pose> poses) {
  constexpr double kAround = 0.4;  // m
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> z;
  for (const PosePicture::Pose& pose : poses) {
    for (const PosePicture::Sample& s : pose.samples) {
      x.push_back(s.at.x());
      y.push_back(s.at.y());
      z.push_back(s.at.z());
    }
  }
  const auto [x0, x1] = MostOf(std::move(x));
  const auto [y0, y1] = MostOf(std::move(y));
  Extent extent;
  std::tie(extent.low, extent.high) = MostOf(std::move(z));
  extent.plan = AlignedBox2d(Vector2d(x0, y0), Vector2d(x1, y1));
  for (const PosePicture::Pose& pose : poses) {
    extent.plan.extend(pose.station.head<2>());
    extent.low = std::min(extent.low, pose.station.z());
    extent.high = std::max(extent.high, pose.station.z());
  }
  extent.plan.min().array() -= kAround;
  extent.plan.max().array() += kAround;
  extent.low -= kAround;
  extent.high += kAround;
  return extent;
}

// One extent for each pose: the same for all where that shows them nearly as large, so that what is
// the same in the world is at the same place of each; else around each its own, as large as the
// largest.
std::vector<Extent> ExtentsOf(const PosePicture& picture) {
  constexpr double kNearlyAsLarge = 1.6;
  const Extent all = ExtentOf(picture.poses);
  std::vector<Extent> own;
  Vector2d largest = Vector2d::Zero();
  for (const PosePicture::Pose& pose : picture.poses) {
    own.push_back(ExtentOf({&pose, 1}));
    largest = largest.cwiseMax(own.back().plan.sizes());
  }
  const Vector2d together = all.plan.sizes();
  if ((together.array() <= kNearlyAsLarge * largest.array()).all()) {
    return std::vector<Extent>(std::max<size_t>(1, own.size()), all);
  }
  for (Extent& extent : own) {
    const Vector2d middle = extent.plan.center();
    extent.plan = AlignedBox2d(middle - largest / 2, middle + largest / 2);
    extent.low = std::min(extent.low, extent.high - (all.high - all.low));
  }
  return own;
}

// A vertical plane through a station.
struct Section {
  Vector2d origin;
  Vector2d along;   // unit
  double from = 0;  // m, along it
  double to = 0;

  Vector2d Of(const Vector3d& at) const { return {(at.head<2>() - origin).dot(along), at.z()}; }
  bool Holds(const Vector3d& at) const {
    const Vector2d off = at.head<2>() - origin;
    return std::abs(off.x() * along.y() - off.y() * along.x()) <= kHalfSection;
  }
};

// Through the largest place that contradicts, where it is not the station itself; else the longer
// way through the scan.
Section SectionOf(const PosePicture::Pose& pose) {
  constexpr double kLeastApart = 0.5;  // m
  Section section{pose.station.head<2>(), Vector2d::UnitX()};
  bool found = false;
  for (const PosePicture::Place& place : pose.places) {
    const Vector2d to = place.centre.head<2>() - section.origin;
    if (to.norm() < kLeastApart) continue;
    section.along = to.normalized();
    found = true;
    break;
  }
  if (!found && !pose.samples.empty()) {
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const PosePicture::Sample& s : pose.samples) {
      const Vector2d off = s.at.head<2>() - section.origin;
      spread += off * off.transpose();
    }
    section.along = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(1);
  }
  // To the right where it can be, so that plan and section read the same way.
  if (section.along.x() < -1e-9) section.along = -section.along;
  std::vector<double> way = {-0.5, 0.5};
  for (const PosePicture::Sample& s : pose.samples) {
    if (section.Holds(s.at)) way.push_back(section.Of(s.at).x());
  }
  std::tie(section.from, section.to) = MostOf(std::move(way));
  section.from -= 0.3;
  section.to += 0.3;
  return section;
}

struct PoseLayout {
  int columns = 1;
  double scale = 1;   // pixels per metre, of plans
  double card = 0;    // pixels, width of a pose
  double header = 0;  // pixels, above a pose's plan
  double plan_height = 0;
  double section_height = 0;  // room for the highest
  double row = 0;             // pixels, height of a row of poses
};

size_t LinesOf(const PosePicture::Pose& pose) { return pose.figures.size() + pose.places.size(); }

// As many poses beside each other as shows them largest.
PoseLayout ArrangePoses(const PosePicture& picture, const std::vector<Extent>& extents,
                        const std::vector<Section>& sections) {
  const Vector2d size = extents.empty() ? Vector2d(1, 1) : Vector2d(extents.front().plan.sizes());
  const int count = std::max<int>(1, static_cast<int>(picture.poses.size()));
  PoseLayout best;
  best.scale = 0;
  for (int columns = 1; columns <= std::min(3, count); ++columns) {
    PoseLayout layout;
    layout.columns = columns;
    layout.card = (kPageWidth - (columns + 1) * kBorder) / columns;
    const double tallest = columns == 1 && count > 1 ? 0.5 * kTallestPlan : kTallestPlan;
    layout.scale = std::min(layout.card / size.x(), tallest / size.y());
    // A picture twice as long has to show things a fifth larger.
    if (layout.scale < 0.83 * best.scale) continue;
    best = layout;
  }
  size_t lines = 0;
  for (const PosePicture::Pose& pose : picture.poses) lines = std::max(lines, LinesOf(pose));
  best.header = 46 + kLineHeight * static_cast<double>(lines) + 26;
  best.plan_height = size.y() * best.scale;
  for (size_t i = 0; i < sections.size(); ++i) {
    const double scale = std::min(best.scale, best.card / (sections[i].to - sections[i].from));
    best.section_height = std::max(best.section_height, (extents[i].high - extents[i].low) * scale);
  }
  best.row = best.header + best.plan_height + kFoot + kSectionTitle + best.section_height + kFoot;
  return best;
}

void Cross(Canvas& canvas, const Vector2d& p, double arm) {
  for (const auto& [stroke, colour] : {std::pair{3.6, palette::kWhite}, {2.0, kContradiction}}) {
    canvas.Line(p - Vector2d(arm, arm), p + Vector2d(arm, arm), stroke, colour);
    canvas.Line(p - Vector2d(arm, -arm), p + Vector2d(arm, -arm), stroke, colour);
  }
}

void Triangle(Canvas& canvas, const Vector2d& p, double arm) {
  const auto corners = [&](double r) {
    return std::vector<Vector2d>{p + Vector2d(0, -1.1 * r), p + Vector2d(r, 0.8 * r),
                                 p + Vector2d(-r, 0.8 * r)};
  };
  canvas.FillPolygon(corners(arm + 1.5), palette::kInk);
  canvas.FillPolygon(corners(arm), kContradiction);
}

void Diamond(Canvas& canvas, const Vector2d& p, double arm) {
  const std::vector<Vector2d> corners = {p + Vector2d(0, -arm), p + Vector2d(arm, 0),
                                         p + Vector2d(0, arm), p + Vector2d(-arm, 0)};
  for (size_t i = 0; i < corners.size(); ++i) {
    canvas.Line(corners[i], corners[(i + 1) % corners.size()], 1.6, palette::kInk);
  }
}

void Square(Canvas& canvas, const Vector2d& p, double arm) {
  canvas.StrokeRectangle(p - Vector2d(arm, arm), p + Vector2d(arm, arm), 1.2, kUnmatched);
}

void DrawMark(Canvas& canvas, const Vector2d& p, const PosePicture::Sample& sample,
              double largest_residual) {
  switch (sample.mark) {
    case PosePicture::Mark::kFits:
      canvas.FillCircle(p, 2.5, ResidualColour(std::abs(sample.residual) / largest_residual));
      break;
    case PosePicture::Mark::kNothingKnown:
      canvas.FillCircle(p, 1.5, kUnknown);
      break;
    case PosePicture::Mark::kFitsNothing:
      Square(canvas, p, 2.2);
      break;
    case PosePicture::Mark::kInEmptySpace:
      Cross(canvas, p, 3.6);
      break;
    case PosePicture::Mark::kBehindSurface:
      Triangle(canvas, p, 3.8);
      break;
  }
}

// Keeps marks of a panel apart: of those that would cover each other the first is drawn.
class RoomForMarks {
 public:
  RoomForMarks(const MapPanel& panel, double apart)
      : min_(panel.min()),
        apart_(apart),
        across_(static_cast<int>((panel.max().x() - panel.min().x()) / apart) + 2),
        taken_(static_cast<size_t>(across_) *
               static_cast<size_t>((panel.max().y() - panel.min().y()) / apart + 2)) {}

  bool Take(const Vector2d& p) {
    const Vector2d at = (p - min_) / apart_;
    if (at.x() < 0 || at.y() < 0 || at.x() >= across_) return false;
    const size_t cell =
        static_cast<size_t>(at.y()) * static_cast<size_t>(across_) + static_cast<size_t>(at.x());
    if (cell >= taken_.size() || taken_[cell]) return false;
    taken_[cell] = true;
    return true;
  }

 private:
  Vector2d min_;
  double apart_;
  int across_;
  std::vector<bool> taken_;
};

// Pixels between marks of one kind.
double ApartOf(PosePicture::Mark mark) {
  switch (mark) {
    case PosePicture::Mark::kFits:
    case PosePicture::Mark::kNothingKnown:
      return 2;
    case PosePicture::Mark::kFitsNothing:
      return 6;
    default:
      return 9;
  }
}
constexpr double kApartDiamonds = 9;

// What is drawn later is seen: what contradicts comes last.
constexpr std::array<PosePicture::Mark, 5> kDrawingOrder = {
    PosePicture::Mark::kNothingKnown, PosePicture::Mark::kFits, PosePicture::Mark::kFitsNothing,
    PosePicture::Mark::kInEmptySpace, PosePicture::Mark::kBehindSurface};

void DrawStation(Canvas& canvas, const Vector2d& p, const Vector2d* ahead) {
  canvas.FillCircle(p, 9, palette::kWhite);
  canvas.FillCircle(p, 7, palette::kInk);
  if (ahead == nullptr) return;
  const Vector2d tip = p + 24 * Vector2d(ahead->x(), -ahead->y());
  canvas.Line(p, tip, 5, palette::kWhite);
  canvas.Line(p, tip, 2.4, palette::kInk);
}

void DrawLetter(Canvas& canvas, const MapPanel& panel, Vector2d p, size_t place) {
  // Beside what it names, and inside the panel.
  p += Vector2d(14, -14);
  p = p.cwiseMax(panel.min() + Vector2d(12, 12)).cwiseMin(panel.max() - Vector2d(12, 12));
  canvas.FillCircle(p, 11, palette::kInk);
  canvas.FillCircle(p, 9.5, palette::kWhite);
  canvas.Text(p + Vector2d(0, 5), LetterOf(place), 14, palette::kInk, Align::kCentre, true);
}

void OutlinePlace(Canvas& canvas, const Vector2d& a, const Vector2d& b) {
  const Vector2d around(5, 5);
  canvas.StrokeRectangle(a.cwiseMin(b) - around, a.cwiseMax(b) + around, 1.4, palette::kInk);
}

void DrawPlan(Canvas& canvas, MapPanel& panel, const PosePicture& picture,
              const PosePicture::Pose& pose, const Section& section) {
  panel.Grid();
  canvas.Clip(panel.min(), panel.max());
  const double half = std::max(0.7, 0.5 * picture.surface_spacing * panel.scale());
  for (const bool walls : {false, true}) {
    for (const PosePicture::Surface& s : picture.surface) {
      if ((std::abs(s.normal.z()) < kFlat) != walls) continue;
      const Vector2d p = panel.ToPixels(s.at.head<2>());
      canvas.FillRectangle(p - Vector2d(half, half), p + Vector2d(half, half),
                           walls ? kKnownWall : kKnownFlat);
    }
  }
  for (const PosePicture::Mark mark : kDrawingOrder) {
    RoomForMarks room(panel, ApartOf(mark));
    for (const PosePicture::Sample& s : pose.samples) {
      // Floor and ceiling would cover what stands between them; the section shows them.
      if (s.mark != mark || std::abs(s.normal.z()) >= kFlat) continue;
      const Vector2d p = panel.ToPixels(s.at.head<2>());
      if (room.Take(p)) DrawMark(canvas, p, s, picture.largest_residual);
    }
  }
  RoomForMarks room(panel, kApartDiamonds);
  for (const size_t i : pose.seen_through) {
    const PosePicture::Surface& piece = picture.surface[i];
    if (std::abs(piece.normal.z()) >= kFlat) continue;
    const Vector2d p = panel.ToPixels(piece.at.head<2>());
    if (room.Take(p)) Diamond(canvas, p, 3.6);
  }
  const Vector2d from = panel.ToPixels(section.origin + section.from * section.along);
  const Vector2d to = panel.ToPixels(section.origin + section.to * section.along);
  constexpr double kDash = 8;  // pixels
  const double length = (to - from).norm();
  for (double t = 0; t < length; t += 2 * kDash) {
    canvas.Line(from + (to - from) * (t / length),
                from + (to - from) * (std::min(length, t + kDash) / length), 1, palette::kFaintInk);
  }
  for (size_t i = 0; i < pose.places.size(); ++i) {
    const PosePicture::Place& place = pose.places[i];
    // Around a whole floor it would say nothing.
    const Vector2d shown = panel.bounds().sizes();
    const Vector2d size = place.box.sizes().head<2>();
    if (size.x() * size.y() > 0.3 * shown.x() * shown.y()) continue;
    OutlinePlace(canvas, panel.ToPixels(place.box.min().head<2>()),
                 panel.ToPixels(place.box.max().head<2>()));
  }
  DrawStation(canvas, panel.ToPixels(pose.station.head<2>()), &pose.ahead);
  for (size_t i = 0; i < pose.places.size(); ++i) {
    DrawLetter(canvas, panel, panel.ToPixels(pose.places[i].centre.head<2>()), i);
  }
  canvas.Unclip();
  panel.ScaleBar();
  panel.Frame();
}

void DrawSection(Canvas& canvas, MapPanel& panel, const PosePicture& picture,
                 const PosePicture::Pose& pose, const Section& section) {
  canvas.Text({panel.min().x(), panel.min().y() - 9},
              absl::StrFormat("Section along the dashed line, %.1f m thick, with floor and ceiling",
                              2 * kHalfSection),
              14, palette::kInk, Align::kLeft, true);
  const double low = std::ceil(panel.bounds().min().y());
  for (double z = low; z <= panel.bounds().max().y(); z += 1) {
    const double py = panel.ToPixels({0, z}).y();
    canvas.Line({panel.min().x(), py}, {panel.max().x(), py}, 1, palette::kGrid);
    canvas.Text({panel.min().x() - 6, py + 4}, absl::StrCat(std::lround(z)), 12, palette::kFaintInk,
                Align::kRight);
  }
  canvas.Clip(panel.min(), panel.max());
  const double half = std::max(0.7, 0.5 * picture.surface_spacing * panel.scale());
  for (const PosePicture::Surface& s : picture.surface) {
    if (!section.Holds(s.at)) continue;
    const Vector2d p = panel.ToPixels(section.Of(s.at));
    canvas.FillRectangle(p - Vector2d(half, half), p + Vector2d(half, half), kKnownWall);
  }
  for (const PosePicture::Mark mark : kDrawingOrder) {
    RoomForMarks room(panel, ApartOf(mark));
    for (const PosePicture::Sample& s : pose.samples) {
      if (s.mark != mark || !section.Holds(s.at)) continue;
      const Vector2d p = panel.ToPixels(section.Of(s.at));
      if (room.Take(p)) DrawMark(canvas, p, s, picture.largest_residual);
    }
  }
  RoomForMarks room(panel, kApartDiamonds);
  for (const size_t i : pose.seen_through) {
    const Vector3d& at = picture.surface[i].at;
    if (!section.Holds(at)) continue;
    const Vector2d p = panel.ToPixels(section.Of(at));
    if (room.Take(p)) Diamond(canvas, p, 3.6);
  }
  DrawStation(canvas, panel.ToPixels(section.Of(pose.station)), nullptr);
  for (size_t i = 0; i < pose.places.size(); ++i) {
    const Vector3d& centre = pose.places[i].centre;
    if (section.Holds(centre)) DrawLetter(canvas, panel, panel.ToPixels(section.Of(centre)), i);
  }
  canvas.Unclip();
  panel.Frame();
}

// `text` as far as it fits into `width` pixels.
void CutText(Canvas& canvas, const Vector2d& at, const std::string& text, double width) {
  std::string shown = text;
  while (shown.size() > 3 && canvas.TextWidth(shown, kFigureSize) > width) {
    shown = absl::StrCat(shown.substr(0, shown.size() - 4), "...");
  }
  canvas.Text(at, shown, kFigureSize, palette::kInk);
}

void DrawPose(Canvas& canvas, const PosePicture& picture, const PosePicture::Pose& pose,
              const Section& section, const Extent& extent, const PoseLayout& layout,
              const Vector2d& corner) {
  canvas.Text(corner + Vector2d(0, 24), pose.title, 20, palette::kInk, Align::kLeft, true);
  double y = corner.y() + 50;
  for (const std::string& line : pose.figures) {
    CutText(canvas, {corner.x(), y}, line, layout.card);
    y += kLineHeight;
  }
  for (size_t i = 0; i < pose.places.size(); ++i) {
    CutText(canvas, {corner.x(), y}, absl::StrCat(LetterOf(i), "  ", pose.places[i].words),
            layout.card);
    y += kLineHeight;
  }
  const Vector2d at = corner + Vector2d(0, layout.header);
  MapPanel plan(canvas, at, extent.plan, layout.scale);
  DrawPlan(canvas, plan, picture, pose, section);
  const AlignedBox2d box(Vector2d(section.from, extent.low), Vector2d(section.to, extent.high));
  MapPanel cut(canvas, at + Vector2d(0, layout.plan_height + kFoot + kSectionTitle), box,
               std::min(layout.scale, layout.card / box.sizes().x()));
  DrawSection(canvas, cut, picture, pose, section);
}

void DrawPoseLegend(Canvas& canvas, double y, double largest_residual) {
  constexpr double kSize = 14;
  constexpr double kBar = 180;
  double x = kBorder;
  const auto label = [&](const std::string& text, double gap) {
    canvas.Text({x, y + 5}, text, kSize, palette::kInk);
    x += canvas.TextWidth(text, kSize) + gap;
  };
  label("distance to known surface:  0", 8);
  Raster bar(64, 1);
  for (int i = 0; i < bar.width; ++i) bar.At(i, 0) = ResidualColour(i / (bar.width - 1.0));
  canvas.Image({x, y - 8}, {x + kBar, y + 8}, bar);
  canvas.StrokeRectangle({x, y - 8}, {x + kBar, y + 8}, 0.6, palette::kFaintInk);
  x += kBar + 8;
  label(absl::StrFormat("%.0f mm and more", 1000 * largest_residual), 30);
  x += 6;
  canvas.FillCircle({x, y}, 1.8, kUnknown);
  x += 12;
  label("nothing known there", 26);
  x += 6;
  canvas.FillRectangle({x - 6, y - 6}, {x + 8, y + 6}, kKnownWall);
  x += 16;
  label("known wall", 18);
  canvas.FillRectangle({x, y - 6}, {x + 14, y + 6}, kKnownFlat);
  canvas.StrokeRectangle({x, y - 6}, {x + 14, y + 6}, 0.6, palette::kFaintInk);
  x += 22;
  label("known floor, ceiling", 18);
  y += 34;
  x = kBorder + 6;
  canvas.Text({kBorder, y + 5}, "contradicts:", kSize, palette::kInk, Align::kLeft, true);
  x += canvas.TextWidth("contradicts:", kSize, true) + 16;
  Cross(canvas, {x, y}, 5);
  x += 14;
  label("in space known to be empty", 26);
  Triangle(canvas, {x, y}, 5.5);
  x += 14;
  label("behind known surface (seen through it)", 26);
  Diamond(canvas, {x, y}, 5);
  x += 14;
  label("known surface that the scan does not see", 26);
  Square(canvas, {x, y}, 4);
  x += 14;
  label("fits nothing that is known", 26);
  DrawStation(canvas, {x, y}, nullptr);
  x += 16;
  label("scanner", 20);
}

}  // namespace

Canvas DrawPosePicture(const PosePicture& picture) {
  const std::vector<Extent> extents = ExtentsOf(picture);
  std::vector<Section> sections;
  for (const PosePicture::Pose& pose : picture.poses) sections.push_back(SectionOf(pose));
  const PoseLayout layout = ArrangePoses(picture, extents, sections);
  const int count = static_cast<int>(picture.poses.size());
  const int rows = (count + layout.columns - 1) / layout.columns;
  const double across =
      extents.empty() ? layout.card
                      : std::max(extents.front().plan.sizes().x() * layout.scale, layout.card);
  const double width =
      std::clamp(layout.columns * (across + kBorder) + kBorder, kLeastPage, kPageWidth);
  std::vector<std::string> figures;
  Canvas ruler(1, 1, palette::kWhite);
  for (const std::string& figure : picture.figures) {
    for (std::string& line : Wrapped(ruler, figure, kFigureSize, width - 2 * kBorder)) {
      figures.push_back(std::move(line));
    }
  }
  const double header = 66 + 24 * static_cast<double>(figures.size());
  Canvas canvas(static_cast<int>(width),
                static_cast<int>(std::ceil(header + rows * layout.row + kLegendRoom)),
                palette::kWhite);
  canvas.Text({kBorder, 44}, picture.title, 26, palette::kInk, Align::kLeft, true);
  double y = 72;
  for (const std::string& line : figures) {
    canvas.Text({kBorder, y}, line, kFigureSize, palette::kInk);
    y += 24;
  }
  for (int i = 0; i < count; ++i) {
    const int row = i / layout.columns;
    const Vector2d corner(kBorder + (i % layout.columns) * (layout.card + kBorder),
                          header + row * layout.row);
    DrawPose(canvas, picture, picture.poses[static_cast<size_t>(i)],
             sections[static_cast<size_t>(i)], extents[static_cast<size_t>(i)], layout, corner);
  }
  DrawPoseLegend(canvas, header + rows * layout.row + 30, picture.largest_residual);
  return canvas;
}

absl::Status WritePosePicture(const PosePicture& picture, const std::string& path) {
  return DrawPosePicture(picture).WritePng(path);
}

}  // namespace vantage::picture
