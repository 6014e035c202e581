// Which algorithms carve scans and merge them.
#ifndef VANTAGE_CORE_MODEL_VIEW_ALGORITHM_VERSION_H_
#define VANTAGE_CORE_MODEL_VIEW_ALGORITHM_VERSION_H_

#include <cstdint>

namespace vantage::model {

// Rises when the same scans would give another model. A snapshot of an older version is loaded as
// it is rather than replayed differently, and saved again as of that version for as long as a scan
// that it carved is in the model.
inline constexpr uint32_t kModelAlgorithmVersion = 12;

// The first that suspects reflectors (core/model/merge/shared_reflections.h).
inline constexpr uint32_t kSuspectsReflectors = 7;

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_ALGORITHM_VERSION_H_
