// The scans of a load job: scans of a furnished flat from the views that a planner chose, in order.
#ifndef VANTAGE_TESTS_LOAD_LOAD_SCANS_H_
#define VANTAGE_TESTS_LOAD_LOAD_SCANS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/sensor/scan.h"

namespace vantage::load {

// `count` scans of 1,440 x 600 cells with the faults of a real scanner. The first has its true pose
// as its prior, the others are up to 10 cm an axis and 5 degrees off.
std::vector<sensor::Scan> MakeLoadScans(size_t count);

// The same scan with one sample 1 mm farther, a different one for each `number`, so that the bytes
// are those of a new scan.
sensor::RangeImage Unseen(const sensor::RangeImage& image, uint64_t number);

}  // namespace vantage::load

#endif  // VANTAGE_TESTS_LOAD_LOAD_SCANS_H_
