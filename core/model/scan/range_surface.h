// What a range image says between its samples: which neighbours are one surface, and how far a ray
// in any direction was seen to go (algorithm.md section 4, 'Surface between samples').
#ifndef VANTAGE_CORE_MODEL_SCAN_RANGE_SURFACE_H_
#define VANTAGE_CORE_MODEL_SCAN_RANGE_SURFACE_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/model/scan/angular_axis.h"
#include "core/parallel/parallel.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"

namespace vantage::model {

// Why a scan leaves a place unknown; kNone where it does not. Along kSky (a ray into the open sky,
// core/model/scan/sky.h) and kSite (a return beyond the site's limit) there is nothing to look for.
enum class UnknownReason : uint8_t { kNone, kOcclusion, kHole, kImage, kSky, kSite };

// Whose rays ended where; it does not change any more (OpenRangeSurface does).
class RangeSurface {
 public:
  // `discontinuity_angle` (rad): neighbours are two surfaces when the segment between them makes a
  // smaller angle with the line of sight, unless range noise alone explains it. Mixed pixels
  // (joined to no neighbour, or to one other of them, between a nearer and a farther one) become no
  // information, and so do returns nearer than the scanner's range.
  RangeSurface(const sensor::RangeImage& image, const sensor::ScannerModel& scanner,
               double discontinuity_angle, parallel::Parallel& parallel);

  int columns() const { return azimuth_.size(); }
  int rows() const { return elevation_.size(); }
  const AngularAxis& azimuth() const { return azimuth_; }
  const AngularAxis& elevation() const { return elevation_; }
  float at(int column, int row) const { return range_[Index(column, row)]; }
  const float* Column(int column) const { return &range_[Index(column, 0)]; }
  const std::vector<double>& cos_azimuth() const { return cos_azimuth_; }
  const std::vector<double>& sin_azimuth() const { return sin_azimuth_; }
  const std::vector<double>& cos_elevation() const { return cos_elevation_; }
  const std::vector<double>& sin_elevation() const { return sin_elevation_; }
  size_t bytes() const {  // that it holds on the heap, about
    return range_.capacity() * sizeof(float) + joined_.capacity() +
           4 * sizeof(double) * static_cast<size_t>(columns() + rows());
  }
  // Unit vector of a cell's ray, scanner frame.
  Eigen::Vector3d Direction(int column, int row) const {
    const size_t c = static_cast<size_t>(column);
    const size_t r = static_cast<size_t>(row);
    return {cos_elevation_[r] * cos_azimuth_[c], cos_elevation_[r] * sin_azimuth_[c],
            sin_elevation_[r]};
  }

  // m, one sigma of the scanner's ranges, at the farthest.
  double range_sigma() const { return range_sigma_; }

  // True when the cell holds a return of its own ray: it was not ended as a reflection or a lone
  // ray.
  bool Returned(int column, int row) const {
    return range_[Index(column, row)] > 0 && (joined_[Index(column, row)] & 8) == 0;
  }
  // True when nothing came back: the ray went on, or it went into a reflector.
  bool Hole(int column, int row) const {
    const float range = range_[Index(column, row)];
    return sensor::RangeImage::IsRange(range)
               ? EndReason(joined_[Index(column, row)]) == UnknownReason::kHole
               : range == sensor::RangeImage::kNoReturn;
  }
  // True when some ray ended in the sky or at the site's limit.
  bool EndsInSky() const { return ends_in_sky_; }

  int NextColumn(int column) const {
    return column + 1 < columns() ? column + 1 : (azimuth_.closed() ? 0 : -1);
  }
  // True when the cell is one surface with the cell in the next column (which may wrap), or in the
  // next row.
  bool JoinedToNextColumn(int column, int row) const {
    return (joined_[Index(column, row)] & 9) == 1;
  }
  bool JoinedToNextRow(int column, int row) const {
    return (joined_[Index(column, row)] & 10) == 2;
  }
  // True when the four cells from (column, row) to the next column and row are one surface.
  bool QuadJoined(int column, int row) const { return (joined_[Index(column, row)] & 12) == 4; }

  // With every so many columns and rows only. Two that are left are one surface where all between
  // them were.
  RangeSurface Thinned(int column_stride, int row_stride, parallel::Parallel& parallel) const;

  // How far space was seen to be empty along a direction (scanner frame, any length > 0), and why
  // no farther. Inside a joined quad the range is interpolated as a plane would give it (linearly
  // in 1 / range); elsewhere it is that of the nearest ray.
  struct Reading {
    float range = 0;  // m; 0 where nothing is known along the direction
    UnknownReason beyond = UnknownReason::kImage;
  };
  Reading Read(const Eigen::Vector3d& direction) const;
  // The same for a direction of `azimuth` and `elevation` (rad).
  Reading RangeAt(double azimuth, double elevation) const;

 private:
  friend class LayerCodec;        // snapshots
  friend class OpenRangeSurface;  // makes it
  // Restores a surface from what a snapshot kept of it.
  RangeSurface(AngularAxis azimuth, AngularAxis elevation, std::vector<float> range,
               std::vector<uint8_t> joined);
  // Nothing is joined yet.
  RangeSurface(const sensor::RangeImage& image, const sensor::ScannerModel& scanner);
  // Why nothing is known beyond the end of a ray with these bits: kOcclusion where it was not
  // ended.
  static UnknownReason EndReason(uint8_t joined) {
    constexpr std::array<UnknownReason, 4> kReasons = {UnknownReason::kHole, UnknownReason::kImage,
                                                       UnknownReason::kSky, UnknownReason::kSite};
    return (joined & 8) == 0 ? UnknownReason::kOcclusion : kReasons[joined & 3];
  }
  static uint8_t EndBits(UnknownReason beyond) {
    return static_cast<uint8_t>(8 + static_cast<int>(beyond) -
                                static_cast<int>(UnknownReason::kHole));
  }
  void FillTables();
  size_t Index(int column, int row) const {
    return static_cast<size_t>(column) * static_cast<size_t>(rows()) + static_cast<size_t>(row);
  }
  // Joins neighbours, and returns the cells that were mixed pixels.
  std::vector<uint32_t> JoinAll(double discontinuity_angle, parallel::Parallel& parallel);
  void Join(double discontinuity_angle, parallel::Parallel& parallel);
  std::vector<uint32_t> DropMixedPixels(parallel::Parallel& parallel);
  void JoinQuads(parallel::Parallel& parallel);

  AngularAxis azimuth_;
  AngularAxis elevation_;
  std::vector<double> cos_azimuth_, sin_azimuth_, cos_elevation_, sin_elevation_;
  std::vector<float> range_;  // as in RangeImage
  double range_sigma_ = 0;
  // Bits: 1 joined to the next column, 2 joined to the next row, 4 quad. 8: the ray was ended and
  // is joined to nothing; then 1 and 2 say why nothing is known beyond (EndBits).
  std::vector<uint8_t> joined_;
  bool ends_in_sky_ = false;
};

// A range surface while it is found out where its rays ended.
class OpenRangeSurface : public RangeSurface {
 public:
  // As RangeSurface's.
  OpenRangeSurface(const sensor::RangeImage& image, const sensor::ScannerModel& scanner,
                   double discontinuity_angle, parallel::Parallel& parallel);

  // Ends the ray of a cell `range` m (> 0) away, for instance at a reflector: empty up to there,
  // nothing known beyond for the reason given (not kNone or kOcclusion), no surface, joined to
  // nothing.
  void EndAt(int column, int row, float range, UnknownReason beyond = UnknownReason::kHole);
  // Ends lone rays that tell nothing, so that no hairs of unknown space run from them to the
  // scanner (algorithm.md section 4, 'Surface between samples').
  RangeSurface Finish(parallel::Parallel& parallel) &&;

 private:
  std::vector<uint32_t> mixed_;  // cells that were mixed pixels
};

// Here, since carving calls it for every voxel near a surface.
inline RangeSurface::Reading RangeSurface::RangeAt(double azimuth, double elevation) const {
  const AngularAxis::Position e = elevation_.Locate(elevation);
  if (!e.inside) return {};
  const AngularAxis::Position a = azimuth_.Locate(azimuth);
  if (!a.inside) return {};
  if (QuadJoined(a.lower, e.lower) && a.upper != a.lower && e.upper != e.lower) {
    const float low = (1 - a.fraction) / at(a.lower, e.lower) + a.fraction / at(a.upper, e.lower);
    const float high = (1 - a.fraction) / at(a.lower, e.upper) + a.fraction / at(a.upper, e.upper);
    return {1.0f / ((1 - e.fraction) * low + e.fraction * high), UnknownReason::kOcclusion};
  }
  const float range = at(a.nearest(), e.nearest());
  if (sensor::RangeImage::IsRange(range)) {
    return {range, EndReason(joined_[Index(a.nearest(), e.nearest())])};
  }
  return {0, range == sensor::RangeImage::kNoReturn ? UnknownReason::kHole : UnknownReason::kImage};
}

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SCAN_RANGE_SURFACE_H_
