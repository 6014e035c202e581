#include "tests/support/scan_files.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/support/e57_writer.h"

namespace vantage::test_support {

namespace {

E57SetupFile SetupOf(const sensor::RangeImage& image, const std::string& head) {
  std::vector<double> range, azimuth, elevation;
  std::vector<int64_t> row, column;
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      if (!sensor::RangeImage::IsRange(image.at(c, r))) continue;
      range.push_back(image.at(c, r));
      azimuth.push_back(image.azimuth[static_cast<size_t>(c)]);
      elevation.push_back(image.elevation[static_cast<size_t>(r)]);
      row.push_back(r);
      column.push_back(c);
    }
  }
  const size_t records = range.size();
  return {absl::StrCat(head, E57Bounds(0, image.rows() - 1, 0, image.columns() - 1)),
          {E57Scaled("sphericalRange", 1e-4, 0, 0, 1'000'000, range),
           E57Scaled("sphericalAzimuth", 1e-6, 0, -3'200'000, 3'200'000, azimuth),
           E57Scaled("sphericalElevation", 1e-6, 0, -1'600'000, 1'600'000, elevation),
           E57Integers("rowIndex", 0, image.rows() - 1, row),
           E57Integers("columnIndex", 0, image.columns() - 1, column)},
          records,
          ""};
}

std::string Written(const std::vector<E57SetupFile>& setups) {
  E57Options options;
  options.packets = 1;
  for (const E57SetupFile& setup : setups) {
    // A packet has at most 64 KiB.
    options.packets = std::max<size_t>(options.packets, setup.records / 4000 + 1);
  }
  return WriteE57(setups, options);
}

}  // namespace

std::string E57Of(const sensor::RangeImage& image) {
  return Written({SetupOf(image, "<guid type=\"String\">scan</guid>")});
}

std::string E57OfSeveral(const std::vector<NamedScan>& scans) {
  std::vector<E57SetupFile> setups;
  setups.reserve(scans.size());
  for (const NamedScan& scan : scans) {
    setups.push_back(
        SetupOf(scan.image, absl::StrCat("<guid type=\"String\">scan-", setups.size(),
                                         "</guid><name type=\"String\">", scan.name, "</name>",
                                         E57Pose(1, 0, 0, 0, scan.position.x(), scan.position.y(),
                                                 scan.position.z()))));
  }
  return Written(setups);
}

std::string PtxOf(const sensor::RangeImage& image) {
  std::string ptx =
      absl::StrFormat("%d\n%d\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
                      image.columns(), image.rows());
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      const float range = image.at(c, r);
      const Eigen::Vector3d p = sensor::RangeImage::IsRange(range)
                                    ? Eigen::Vector3d(range * image.Direction(c, r))
                                    : Eigen::Vector3d(0, 0, 0);
      absl::StrAppendFormat(&ptx, "%.6f %.6f %.6f 0.5\n", p.x(), p.y(), p.z());
    }
  }
  return ptx;
}

}  // namespace vantage::test_support
