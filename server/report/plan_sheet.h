// Where a storey lies on paper: turned so that its walls run along the sheet, at a scale that
// surveyors use.
#ifndef VANTAGE_SERVER_REPORT_PLAN_SHEET_H_
#define VANTAGE_SERVER_REPORT_PLAN_SHEET_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "core/model/view/floor_plan.h"

namespace vantage::report {

class PlanSheet {
 public:
  // Of a plan, with the stations on it (m, model frame), on a sheet of at most this size (mm). What
  // lies far from nearly everything, as seen out of a window, is cut off.
  PlanSheet(const model::FloorPlan& plan, const std::vector<Eigen::Vector2d>& stations,
            const Eigen::Vector2d& most);

  // mm from the sheet's upper left corner.
  Eigen::Vector2d ToSheet(const Eigen::Vector2d& at) const;
  // The same of a direction or a length: mm for each m.
  Eigen::Vector2d Turned(const Eigen::Vector2d& direction) const;
  double millimetres_per_metre() const { return 1000.0 / scale_; }
  int scale() const { return scale_; }                   // 1 : scale
  const Eigen::Vector2d& size() const { return size_; }  // mm
  // By how much the world's x is turned on the sheet, rad, counter-clockwise.
  double turn() const { return turn_; }
  bool cut() const { return cut_; }  // some of the plan is not on it

 private:
  Eigen::Matrix2d rotation_;  // from the model frame
  Eigen::AlignedBox2d box_;   // m, turned
  double turn_ = 0;
  int scale_ = 100;
  Eigen::Vector2d size_ = Eigen::Vector2d::Zero();
  bool cut_ = false;
};

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_PLAN_SHEET_H_
