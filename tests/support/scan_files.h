// Range images as the files that instruments write.
#ifndef VANTAGE_TESTS_SUPPORT_SCAN_FILES_H_
#define VANTAGE_TESTS_SUPPORT_SCAN_FILES_H_

#include <string>

#include "core/sensor/range_image.h"

namespace vantage::test_support {

// Structured E57: spherical, whole multiples of 0.1 mm and of a microradian.
std::string E57Of(const sensor::RangeImage& image);

std::string PtxOf(const sensor::RangeImage& image);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_SCAN_FILES_H_
