// One map on a canvas: metres to pixels, grid, axes, scale bar and the marks that both maps share.
#ifndef VANTAGE_CLIENT_PICTURE_MAP_PANEL_H_
#define VANTAGE_CLIENT_PICTURE_MAP_PANEL_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "client/picture/canvas.h"
#include "client/picture/column_map.h"

namespace vantage::picture {

class MapPanel {
 public:
  // The map shows `bounds` (m, model frame, +y up the page) with its top left corner at `corner`
  // (pixels), `scale` pixels to the metre.
  MapPanel(Canvas& canvas, const Eigen::Vector2d& corner, const Eigen::AlignedBox2d& bounds,
           double scale)
      : canvas_(canvas), corner_(corner), bounds_(bounds), scale_(scale) {}

  Eigen::Vector2d ToPixels(const Eigen::Vector2d& at) const {
    return {corner_.x() + (at.x() - bounds_.min().x()) * scale_,
            corner_.y() + (bounds_.max().y() - at.y()) * scale_};
  }
  Eigen::Vector2d min() const { return corner_; }
  Eigen::Vector2d max() const { return corner_ + bounds_.sizes() * scale_; }
  double scale() const { return scale_; }
  const Eigen::AlignedBox2d& bounds() const { return bounds_; }

  void Title(const std::string& text);
  // Lines at every metre, figures at round ones, the axes' names.
  void Grid();
  void ScaleBar();
  void Frame();

  // One raster pixel per column; `origin` in m is the raster's lower left corner.
  void Image(const Eigen::Vector2d& origin, double cell, const Raster& raster);

  void Station(const Eigen::Vector2d& at, int number, bool merged,
               const Colour& colour = palette::kInk);
  // A way through these points.
  void Way(const std::vector<Eigen::Vector2d>& points, const Colour& colour);
  void Next(const Eigen::Vector2d& at, double separation);
  void Candidate(const Eigen::Vector2d& at, int rank);
  void Refused(const Eigen::Vector2d& at);
  void Region(const Eigen::AlignedBox2d& box);

 private:
  double RoundStep() const;

  Canvas& canvas_;
  Eigen::Vector2d corner_;
  Eigen::AlignedBox2d bounds_;
  double scale_;
};

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_MAP_PANEL_H_
