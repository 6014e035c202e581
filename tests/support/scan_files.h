// Range images as the files that instruments write.
#ifndef VANTAGE_TESTS_SUPPORT_SCAN_FILES_H_
#define VANTAGE_TESTS_SUPPORT_SCAN_FILES_H_

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/sensor/range_image.h"

namespace vantage::test_support {

// Structured E57: spherical, whole multiples of 0.1 mm and of a microradian.
std::string E57Of(const sensor::RangeImage& image);

// The same of several, made upright at their places, m.
struct NamedScan {
  std::string name;
  sensor::RangeImage image;
  Eigen::Vector3d position;
};
std::string E57OfSeveral(const std::vector<NamedScan>& scans);

std::string PtxOf(const sensor::RangeImage& image);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_SCAN_FILES_H_
