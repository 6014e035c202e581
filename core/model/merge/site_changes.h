// What was moved between scans, as the places where one shows surface and another sees through
// (algorithm.md section 4, 'What was moved').
#ifndef VANTAGE_CORE_MODEL_MERGE_SITE_CHANGES_H_
#define VANTAGE_CORE_MODEL_MERGE_SITE_CHANGES_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/model/carve/scan_layer.h"
#include "core/model/view/planning_view.h"

namespace vantage::model {

struct SiteChange {
  enum class Kind : uint8_t {
    kCame,  // the scan shows surface where the model was known to be empty
    kGone   // it sees through surface of the model
  };
  Kind kind = Kind::kCame;
  std::string since;  // the newest scan that saw through it, or showed it
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, model frame
  Eigen::AlignedBox3d box;                           // m, model frame
  double area = 0;  // m2: of its outline along that axis along which it is largest
};

// What the layer `of`, which came last, shows otherwise than `model`, which is made of the others
// in `layers`; they came in this order. The largest first, at most twenty. Seen through is a voxel
// that is empty together with all 26 around it, so that neither edges nor poses that are off by
// less than a voxel are changes; nor is what is smaller than a tenth of a square metre, or what
// known surface hides, as a mirror's wall does the image. Panes and mirrors that one scan meets
// squarely and another sees through are changes, too.
std::vector<SiteChange> FindSiteChanges(
    const PlanningView& model, const std::string& of,
    const std::map<std::string, std::unique_ptr<ScanLayer>>& layers,
    std::span<const std::string> order);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_SITE_CHANGES_H_
