#include "core/model/carve/thin_layer.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace vantage::model {
namespace {

// Lines of `step` (rad) of which one stands for all; two lines are left at least.
int StrideOf(double step, int lines) {
  if (!(step > 0)) return 1;
  // A step that is a whole part of kLayerStep but for rounding is one.
  const double stride = std::floor(kLayerStep / step * (1 + 1e-6));
  return static_cast<int>(std::clamp<double>(stride, 1, lines - 1));
}

double MeanStep(const std::vector<double>& lines) {
  return (lines.back() - lines.front()) / static_cast<double>(lines.size() - 1);
}

size_t KeptLines(const std::vector<double>& lines) {
  const int stride = StrideOf(MeanStep(lines), static_cast<int>(lines.size()));
  return (lines.size() + static_cast<size_t>(stride) - 1) / static_cast<size_t>(stride);
}

// The cells of the thinned surface that stand for those that were asked: beside a border some are
// of another surface and don't.
std::vector<ScanCell> CellsFor(const std::vector<ScanCell>& asked, const RangeSurface& surface,
                               const RangeSurface& thinned) {
  constexpr double kSame = 0.1;  // of the range: within a mirror's region ranges differ by less
  std::vector<ScanCell> cells;
  for (const ScanCell& cell : asked) {
    const double azimuth = surface.azimuth().angles()[static_cast<size_t>(cell.column)];
    const double elevation = surface.elevation().angles()[static_cast<size_t>(cell.row)];
    const ScanCell near{thinned.azimuth().Locate(azimuth).nearest(),
                        thinned.elevation().Locate(elevation).nearest()};
    if (!thinned.Returned(near.column, near.row)) continue;
    const float range = surface.at(cell.column, cell.row);
    if (std::abs(thinned.at(near.column, near.row) - range) > kSame * range) continue;
    cells.push_back(near);
  }
  const auto by_place = [](const ScanCell& a, const ScanCell& b) {
    return a.column != b.column ? a.column < b.column : a.row < b.row;
  };
  std::sort(cells.begin(), cells.end(), by_place);
  cells.erase(std::unique(cells.begin(), cells.end(),
                          [](const ScanCell& a, const ScanCell& b) {
                            return a.column == b.column && a.row == b.row;
                          }),
              cells.end());
  return cells;
}

}  // namespace

size_t KeptCells(const sensor::RangeImage& image) {
  return KeptLines(image.azimuth) * KeptLines(image.elevation);
}

void ThinLayer(parallel::Parallel& parallel, ScanLayer& layer) {
  const RangeSurface& surface = layer.range_surface;
  const int columns = StrideOf(MeanStep(surface.azimuth().angles()), surface.columns());
  const int rows = StrideOf(MeanStep(surface.elevation().angles()), surface.rows());
  if (columns == 1 && rows == 1) return;
  RangeSurface thinned = surface.Thinned(columns, rows, parallel);
  for (SuspectedReflector& suspect : layer.suspects) {
    suspect.asked = CellsFor(suspect.asked, surface, thinned);
  }
  layer.range_surface = std::move(thinned);
  layer.holes = HoleMap(layer.range_surface);  // as it is made when a snapshot is read
}

}  // namespace vantage::model
