// What planners see of a brick: states, frontier with its causes, attributes (algorithm.md section
// 4, 'Merge').
#ifndef VANTAGE_CORE_MODEL_MERGE_PUBLISH_BRICK_H_
#define VANTAGE_CORE_MODEL_MERGE_PUBLISH_BRICK_H_

#include <memory>

#include "core/model/merge/merge_region.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

// Publishes recomputed brick `i` of the region. Null when all of it is unknown; `all_empty`,
// shared, when all of it is empty. algorithm.md section 4, 'What never comes', says what is given
// up.
//
// An unknown voxel with an empty 6-neighbour is false surface; its cause is the first of occlusion,
// hole, image among the scans whose empty space touches it there. Slivers of it along a compatible
// true surface at most two voxels away are absorbed. False surface that two scans should have
// measured, by range and incidence and with nothing in between, and whose rays did not come back,
// is given up.
std::shared_ptr<const Brick> PublishBrick(const MergeRegion& region, size_t i, double voxel_size,
                                          const std::shared_ptr<const Brick>& all_empty);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_PUBLISH_BRICK_H_
