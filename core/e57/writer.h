// Writes scans as an E57 file (ASTM E2807), from its beginning to its end, without ever going back:
// what comes where is known before the first byte.
#ifndef VANTAGE_CORE_E57_WRITER_H_
#define VANTAGE_CORE_E57_WRITER_H_

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace vantage::e57 {

// What one place saw, as it will be written: spherical coordinates in double, with the row and the
// column of each return; a ray that nothing returned has no record.
struct SetupToWrite {
  std::string name;  // any text
  std::string guid;  // unique; no two set-ups of a file the same
  Eigen::Quaterniond R_file_setup = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t_file_setup = Eigen::Vector3d::Zero();  // m
  uint32_t columns = 0;                                    // of the grid
  uint32_t rows = 0;
  uint64_t records = 0;    // at least 1
  bool intensity = false;  // its records have it; so below
  bool colour = false;
};

// In the set-up's frame: z up.
struct SphericalRecord {
  double range = 0;      // m
  double azimuth = 0;    // rad, counter-clockwise from +x
  double elevation = 0;  // rad, from the horizon up
  uint32_t column = 0;
  uint32_t row = 0;
  uint16_t intensity = 0;           // of 65,535
  std::array<uint8_t, 3> colour{};  // red, green, blue, of 255
};

// Not thread safe.
class Writer {
 public:
  // `guid` is the file's.
  Writer(std::vector<SetupToWrite> setups, absl::string_view guid);

  // Of the whole file, bytes.
  uint64_t size() const { return size_; }
  // The file's next bytes. Begin() once; Add() for the records of the first set-up, in any number
  // of calls, then of the next, as many as were announced; End() once. All of them together are the
  // file.
  std::string Begin();
  std::string Add(std::span<const SphericalRecord> records);
  std::string End();

 private:
  void BeginSection();
  void FlushPacket();
  void EndSection();
  // Hands over the pages that are complete.
  std::string TakePages();

  std::vector<SetupToWrite> setups_;
  std::vector<uint64_t> sections_;  // where each begins, without checksums
  std::string xml_;
  uint64_t xml_begin_ = 0;
  uint64_t size_ = 0;

  std::string bytes_;     // that are no page yet, without checksums
  size_t setup_ = 0;      // that is being written
  uint64_t written_ = 0;  // of its records
  std::vector<SphericalRecord> packet_;
};

}  // namespace vantage::e57

#endif  // VANTAGE_CORE_E57_WRITER_H_
