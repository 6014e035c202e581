#include "client/picture/job_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "absl/strings/str_format.h"
#include "client/picture/column_raster.h"
#include "client/picture/map_panel.h"

namespace vantage::picture {
namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;

constexpr double kWidth = 1900;       // pixels, at most
constexpr double kLeastWidth = 1560;  // the width of title and legend
constexpr double kMargin = 56;
constexpr double kLegendHeight = 120;  // three lines
constexpr double kFigureSize = 17;     // of the lines under the title
constexpr double kPanelTitle = 40;
constexpr double kPanelFoot = 48;
constexpr double kMaxPanelHeight = 1000;

// Scores from above: the best over the heights of each place; gaps of one place are bridged.
struct ScoreRaster {
  Raster raster{0, 0};
  Vector2d origin = Vector2d::Zero();  // m
  double best = 0;                     // samples
};

ScoreRaster MaxOverHeights(const JobPicture& plan) {
  ScoreRaster result;
  const double cell = plan.viewcell_size;
  std::map<std::pair<int, int>, float> best;
  Eigen::Vector2i low = Eigen::Vector2i::Constant(std::numeric_limits<int>::max());
  Eigen::Vector2i high = Eigen::Vector2i::Constant(std::numeric_limits<int>::min());
  for (const JobPicture::ScoredPlace& place : plan.scores) {
    const Eigen::Vector2i at =
        (place.centre.head<2>().cast<double>() / cell).array().floor().cast<int>();
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
    float& score = best.try_emplace({at.x(), at.y()}, 0.0f).first->second;
    score = std::max(score, place.score);
    result.best = std::max(result.best, static_cast<double>(place.score));
  }
  if (best.empty()) return result;
  result.raster = Raster(high.x() - low.x() + 1, high.y() - low.y() + 1);
  result.origin = low.cast<double>() * cell;
  const auto score_at = [&](int x, int y) {
    const auto found = best.find({x, y});
    return found == best.end() ? std::optional<float>() : found->second;
  };
  for (int y = low.y(); y <= high.y(); ++y) {
    for (int x = low.x(); x <= high.x(); ++x) {
      std::optional<float> score = score_at(x, y);
      // A plan that was cut short has scored only every second place here and there.
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
        if (score) break;
        const std::optional<float> before = score_at(x - dx, y - dy);
        const std::optional<float> after = score_at(x + dx, y + dy);
        if (before && after) score = (*before + *after) / 2;
      }
      if (!score) continue;
      result.raster.At(x - low.x(), high.y() - y) =
          Viridis(result.best > 0 ? *score / result.best : 0);
    }
  }
  return result;
}

AlignedBox2d MapBounds(const JobPicture& plan, const ColumnMap& columns) {
  AlignedBox2d bounds;
  if (columns.width() > 0) bounds = columns.bounds();
  for (const auto& station : plan.stations) bounds.extend(station.position);
  for (const auto& candidate : plan.candidates) bounds.extend(candidate.position);
  if (bounds.isEmpty()) bounds = AlignedBox2d(Vector2d(-1, -1), Vector2d(1, 1));
  const Vector2d margin(0.3, 0.3);
  return {bounds.min() - margin, bounds.max() + margin};
}

// Side by side or one above the other, whichever shows more.
struct Layout {
  bool stacked = false;
  double scale = 1;  // pixels per metre
  double width = kWidth;
  double height = 0;
  Vector2d first = Vector2d::Zero();
  Vector2d second = Vector2d::Zero();
};

Layout Arrange(const AlignedBox2d& bounds, double header) {
  const Vector2d size = bounds.sizes();
  const double wide = kWidth - 2 * kMargin;
  const double half = (kWidth - 3 * kMargin) / 2;
  const double beside = std::min(half / size.x(), kMaxPanelHeight / size.y());
  const double above = std::min(wide / size.x(), 0.6 * kMaxPanelHeight / size.y());
  Layout layout;
  layout.stacked = above > 1.15 * beside;
  layout.scale = layout.stacked ? above : beside;
  const double top = header + kPanelTitle;
  const double block = size.y() * layout.scale + kPanelFoot;
  layout.first = {kMargin, top};
  layout.second = layout.stacked ? Vector2d(kMargin, top + block + kPanelTitle)
                                 : Vector2d(kWidth / 2.0 + kMargin / 2, top);
  const double across = size.x() * layout.scale;
  const double used = layout.stacked ? across + 2 * kMargin : 2 * across + 3 * kMargin;
  layout.width = std::clamp(used, kLeastWidth, kWidth);
  if (!layout.stacked) layout.second.x() = layout.width - kMargin - across;
  layout.height = (layout.stacked ? layout.second.y() : top) + block + kLegendHeight;
  return layout;
}

class Legend {
 public:
  Legend(Canvas& canvas, double y) : canvas_(canvas), width_(canvas.width()), at_(kMargin, y) {}

  void Patch(const Colour& colour, const std::string& text) {
    Place(22 + 6 + canvas_.TextWidth(text, kSize));
    canvas_.FillRectangle(at_ - Vector2d(0, 13), at_ + Vector2d(22, 3), colour);
    canvas_.StrokeRectangle(at_ - Vector2d(0, 13), at_ + Vector2d(22, 3), 0.6, palette::kFaintInk);
    Label(28, text);
  }

  // `draw` gets a panel on which the model's origin lies at the middle of the symbol.
  template <typename Draw>
  void Symbol(const std::string& text, Draw&& draw) {
    Place(34 + 6 + canvas_.TextWidth(text, kSize));
    const AlignedBox2d box(Vector2d(-17, -14), Vector2d(17, 14));
    MapPanel panel(canvas_, at_ + Vector2d(0, -19), box, 1.0);
    draw(panel);
    Label(40, text);
  }

  void NextLine() { at_ = {kMargin, at_.y() + 36}; }
  double y() const { return at_.y(); }

 private:
  static constexpr double kSize = 14;
  void Place(double width) {
    if (at_.x() + width > width_ - kMargin && at_.x() > kMargin) NextLine();
  }
  void Label(double shift, const std::string& text) {
    canvas_.Text(at_ + Vector2d(shift, 0), text, kSize, palette::kInk);
    at_.x() += shift + canvas_.TextWidth(text, kSize) + 24;
  }

  Canvas& canvas_;
  double width_;
  Vector2d at_;
};

void DrawColourBar(Canvas& canvas, const MapPanel& panel, double best_score) {
  const double width = 150;
  const Vector2d right(panel.max().x(), panel.min().y() - 14);
  const Vector2d left = right - Vector2d(width + 110, 0);
  Raster bar(64, 1);
  for (int i = 0; i < bar.width; ++i) bar.At(i, 0) = Viridis(i / (bar.width - 1.0));
  canvas.Text(left - Vector2d(8, 0), "score  0", 13, palette::kInk, Align::kRight);
  canvas.Image(left - Vector2d(0, 12), left + Vector2d(width, 2), bar);
  canvas.Text(left + Vector2d(width + 8, 0), absl::StrFormat("%.0f samples", best_score), 13,
              palette::kInk);
}

void DrawStations(MapPanel& panel, const JobPicture& plan) {
  for (const auto& station : plan.stations) {
    panel.Station(station.position, station.number, station.merged);
  }
}

void DrawCoverage(MapPanel& panel, const JobPicture& plan, const ColumnMap& columns) {
  panel.Title("Measured and missing surface (paler: less of the height)");
  panel.Grid();
  if (columns.width() > 0) {
    panel.Image(columns.origin(), columns.cell(), CoverageRaster(columns));
  }
  DrawStations(panel, plan);
  if (!plan.candidates.empty()) panel.Next(plan.candidates[0].position, plan.separation);
  panel.ScaleBar();
  panel.Frame();
}

void DrawScores(Canvas& canvas, MapPanel& panel, const JobPicture& plan, const ColumnMap& columns) {
  panel.Title("Score of the next scan");
  panel.Grid();
  const ScoreRaster scores = MaxOverHeights(plan);
  if (scores.raster.width > 0) {
    panel.Image(scores.origin, plan.viewcell_size, scores.raster);
    DrawColourBar(canvas, panel, scores.best);
  }
  if (columns.width() > 0) panel.Image(columns.origin(), columns.cell(), ContextRaster(columns));
  for (const Vector2d& place : plan.refused) panel.Refused(place);
  for (size_t i = plan.candidates.size(); i-- > 1;) {
    panel.Candidate(plan.candidates[i].position, static_cast<int>(i) + 1);
  }
  DrawStations(panel, plan);
  if (!plan.candidates.empty()) {
    if (plan.candidates[0].region) panel.Region(*plan.candidates[0].region);
    panel.Next(plan.candidates[0].position, plan.separation);
  }
  panel.ScaleBar();
  panel.Frame();
}

void DrawLegend(Canvas& canvas, double y, const JobPicture& plan) {
  Legend legend(canvas, y);
  legend.Patch(palette::kMeasured, "wall or object at density");
  legend.Patch(palette::kUnderSampled, "under-sampled");
  legend.Patch(palette::kMeasuredFlat, "floor, ceiling at density");
  legend.Patch(palette::kUnderSampledFlat, "under-sampled");
  legend.Patch(palette::kOcclusion, "missing: hidden behind something");
  legend.Patch(palette::kHole, "missing: nothing came back (glass, black)");
  legend.Patch(palette::kImageBoundary, "missing: outside the field of view");
  legend.NextLine();
  const Vector2d origin = Vector2d::Zero();
  legend.Symbol("scanned, in order", [&](MapPanel& p) { p.Station(origin, 1, true); });
  legend.Symbol("scanned, not joined", [&](MapPanel& p) { p.Station(origin, 2, false); });
  legend.Symbol(absl::StrFormat("next position (ring: %.1f m; square: as good)", plan.separation),
                [&](MapPanel& p) { p.Next(origin, 0); });
  legend.Symbol("next best, by rank", [&](MapPanel& p) { p.Candidate(origin, 2); });
  legend.Symbol("would not register", [&](MapPanel& p) { p.Refused(origin); });
}

}  // namespace

Canvas DrawJobPicture(const JobPicture& plan) {
  const ColumnMap columns(plan.surfaces, plan.voxel_size, plan.required_density);
  const AlignedBox2d bounds = MapBounds(plan, columns);
  // The canvas is at least so wide, whatever the maps need.
  std::vector<std::string> figures;
  Canvas ruler(1, 1, palette::kWhite);
  for (const std::string& figure : plan.figures) {
    for (std::string& line : Wrapped(ruler, figure, kFigureSize, kLeastWidth - 2 * kMargin)) {
      figures.push_back(std::move(line));
    }
  }
  const double header = 62 + 24 * static_cast<double>(figures.size());
  const Layout layout = Arrange(bounds, header);

  Canvas canvas(static_cast<int>(layout.width), static_cast<int>(std::ceil(layout.height)),
                palette::kWhite);
  canvas.Text({kMargin, 44}, plan.title, 27, palette::kInk, Align::kLeft, true);
  double y = 72;
  for (const std::string& line : figures) {
    canvas.Text({kMargin, y}, line, kFigureSize, palette::kInk);
    y += 24;
  }
  MapPanel coverage(canvas, layout.first, bounds, layout.scale);
  DrawCoverage(coverage, plan, columns);
  MapPanel scores(canvas, layout.second, bounds, layout.scale);
  DrawScores(canvas, scores, plan, columns);
  DrawLegend(canvas, layout.height - kLegendHeight + 30, plan);
  return canvas;
}

absl::Status WriteJobPicture(const JobPicture& plan, const std::string& path) {
  return DrawJobPicture(plan).WritePng(path);
}

}  // namespace vantage::picture
