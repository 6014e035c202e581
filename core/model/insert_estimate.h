// Estimates what inserting a scan into a model takes of memory, before it is taken.
#ifndef VANTAGE_CORE_MODEL_INSERT_ESTIMATE_H_
#define VANTAGE_CORE_MODEL_INSERT_ESTIMATE_H_

#include <cstdint>

#include "core/model/view/model_config.h"
#include "core/sensor/scan.h"

namespace vantage::model {

// What the memory of a scan's part of a model depends on: what its range image covers, in voxels.
// The image is looked at once, by a million cells at most.
class InsertSize {
 public:
  InsertSize(const sensor::Scan& scan, const ModelConfig& config);

  // The bytes that PartialModel::Insert() takes at its peak, those that stay included; the scan
  // itself is not. Within a fifth where a scan takes 100 MB and more, in a model that does not know
  // what it saw.
  int64_t PeakBytes() const;
  // Of them, those that stay: layer, bricks of the model, planning view.
  int64_t KeptBytes() const;

 private:
  double cells_ = 0;
  double kept_cells_ = 0;  // those that stay in memory
  double surface_ = 0;     // voxels that hold surface, samples and what joins them
  double boundary_ = 0;    // voxels where what was seen empty ends and there is no surface
  double pages_ = 0;       // of what was seen empty, and around it
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_INSERT_ESTIMATE_H_
