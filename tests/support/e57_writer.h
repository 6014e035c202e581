// E57 files for tests, written from the standard (ASTM E2807) and not with our own code: every
// byte of them can be wrong on purpose.
#ifndef VANTAGE_TESTS_SUPPORT_E57_WRITER_H_
#define VANTAGE_TESTS_SUPPORT_E57_WRITER_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vantage::test_support {

// A field of the records: its element in the prototype, and the values of all records as they lie
// in the file.
struct E57Stream {
  std::string element;
  std::string bytes;
};

// Integers between `minimum` and `maximum`, packed into as many bits as tell them apart; of scaled
// ones, `values` are those that are stored. `more` are further attributes.
E57Stream E57Integers(const std::string& name, int64_t minimum, int64_t maximum,
                      const std::vector<int64_t>& values, const std::string& type = "Integer",
                      const std::string& more = "");
// Whole multiples of `scale` between those.
E57Stream E57Scaled(const std::string& name, double scale, double offset, int64_t minimum,
                    int64_t maximum, const std::vector<double>& values);
E57Stream E57Doubles(const std::string& name, const std::vector<double>& values);
E57Stream E57Floats(const std::string& name, const std::vector<double>& values);
E57Stream E57Texts(const std::string& name, const std::vector<std::string>& values);

struct E57SetupFile {
  std::string head;  // elements of the set-up but for its points: guid, name, pose, indexBounds ...
  std::vector<E57Stream> streams;
  uint64_t records = 0;
  std::string codecs;  // within <codecs>
};

struct E57Options {
  size_t page = 1024;   // bytes
  size_t packets = 3;   // over which the records of a set-up are spread
  bool others = false;  // index packets and ignored packets lie between those
};

// <pose> with a quaternion and a translation.
std::string E57Pose(double w, double x, double y, double z, double tx, double ty, double tz);
// <indexBounds>, inclusive.
std::string E57Bounds(int64_t row_min, int64_t row_max, int64_t column_min, int64_t column_max);

std::string WriteE57(const std::vector<E57SetupFile>& setups, const E57Options& options = {});

// The file that has these bytes between its checksums. The header's length and page size are set.
std::string PagesOf(std::string logical, size_t page = 1024);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_E57_WRITER_H_
