// What is written is what the standard says, read by hand, and comes back to the bit. (Another
// program's reader has read such files, too: see core/sensor/e57.h.)
#include "core/e57/writer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "core/bytes/checksum.h"
#include "core/e57/index.h"
#include "core/e57/paged_bytes.h"
#include "core/e57/records.h"

namespace vantage::e57 {
namespace {

struct Made {
  std::vector<SetupToWrite> setups;
  std::vector<std::vector<SphericalRecord>> records;
  std::string file;
};

// Set-ups of these many records, written in pieces of random size.
Made Write(const std::vector<uint64_t>& counts, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Made made;
  for (size_t i = 0; i < counts.size(); ++i) {
    SetupToWrite setup;
    setup.name = i == 0 ? "door <&> \"hall\" ]]> \u00e4" : "scan" + std::to_string(i);
    setup.guid = "{guid-" + std::to_string(i) + "}";
    setup.R_file_setup =
        Eigen::Quaterniond(uniform(random), uniform(random), uniform(random), uniform(random))
            .normalized();
    setup.t_file_setup = {450'000.1234 + uniform(random), 5'412'000.5678, 312.25};
    setup.columns = 70'000;
    setup.rows = 300;
    setup.records = counts[i];
    setup.intensity = seed % 2 == 0 || i == 1;
    setup.colour = seed % 3 == 0 || i == 1;
    std::vector<SphericalRecord> records(counts[i]);
    for (SphericalRecord& r : records) {
      r = {std::abs(uniform(random)) * 100, uniform(random) * 3, uniform(random),
           static_cast<uint32_t>(random() % setup.columns),
           static_cast<uint32_t>(random() % setup.rows)};
      r.intensity = setup.intensity ? static_cast<uint16_t>(random()) : 0;
      if (setup.colour) r.colour = {static_cast<uint8_t>(random()), 255, 7};
    }
    made.setups.push_back(setup);
    made.records.push_back(std::move(records));
  }
  Writer writer(made.setups, "{guid}");
  made.file = writer.Begin();
  for (const std::vector<SphericalRecord>& records : made.records) {
    for (size_t from = 0; from < records.size();) {
      const size_t count = std::min<size_t>(records.size() - from, 1 + random() % 3000);
      made.file += writer.Add(std::span(records).subspan(from, count));
      from += count;
    }
  }
  made.file += writer.End();
  EXPECT_EQ(made.file.size(), writer.size());
  return made;
}

template <typename T>
T At(const std::string& bytes, size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

TEST(E57Writer, ComesBackToTheBit) {
  for (const std::vector<uint64_t>& counts :
       {std::vector<uint64_t>{1}, {1699}, {1700}, {1701, 1}, {5, 4000, 12'345}}) {
    const Made made = Write(counts, static_cast<uint32_t>(counts.size()));
    absl::StatusOr<PagedBytes> pages = PagedBytes::Open(made.file);
    ASSERT_TRUE(pages.ok()) << pages.status();
    const auto index = ReadIndex(*pages);
    ASSERT_TRUE(index.ok()) << index.status();
    ASSERT_EQ(index->size(), counts.size());
    for (size_t i = 0; i < counts.size(); ++i) {
      const ScanSetup& setup = (*index)[i];
      EXPECT_EQ(setup.name, made.setups[i].name);
      EXPECT_EQ(setup.records, counts[i]);
      ASSERT_TRUE(setup.T_file_setup.has_value());
      EXPECT_EQ(setup.T_file_setup->translation(), made.setups[i].t_file_setup);
      EXPECT_TRUE(setup.T_file_setup->linear().isApprox(
          made.setups[i].R_file_setup.toRotationMatrix(), 1e-15));
      ASSERT_TRUE(setup.bounds.has_value());
      EXPECT_EQ(setup.bounds->column_max, 69'999);
      EXPECT_EQ(setup.bounds->row_max, 299);
      std::vector<size_t> fields;
      for (const char* name : {"sphericalRange", "sphericalAzimuth", "sphericalElevation",
                               "rowIndex", "columnIndex"}) {
        ASSERT_TRUE(setup.FieldOf(name).has_value()) << name;
        fields.push_back(*setup.FieldOf(name));
      }
      const bool intensity = made.setups[i].intensity;
      const bool colour = made.setups[i].colour;
      ASSERT_EQ(setup.FieldOf("intensity").has_value(), intensity);
      ASSERT_EQ(setup.FieldOf("colorGreen").has_value(), colour);
      if (intensity) {
        fields.push_back(*setup.FieldOf("intensity"));
        ASSERT_TRUE(setup.intensity_limits.has_value());
        EXPECT_EQ(setup.intensity_limits->max, 65535);
      }
      if (colour) {
        fields.push_back(*setup.FieldOf("colorRed"));
        fields.push_back(*setup.FieldOf("colorBlue"));
        ASSERT_TRUE(setup.colour_limits.has_value());
        EXPECT_EQ(setup.colour_limits->max, 255);
      }
      size_t at = 0;
      const absl::Status read = ReadRecords(*pages, setup, fields, [&](RecordBlock block) {
        for (size_t k = 0; k < block[0].size(); ++k, ++at) {
          const SphericalRecord& r = made.records[i][at];
          EXPECT_EQ(block[0][k], r.range);
          EXPECT_EQ(block[1][k], r.azimuth);
          EXPECT_EQ(block[2][k], r.elevation);
          EXPECT_EQ(block[3][k], r.row);
          EXPECT_EQ(block[4][k], r.column);
          if (intensity) {
            EXPECT_EQ(block[5][k], r.intensity);
          }
          if (colour) {
            EXPECT_EQ(block[intensity ? 6 : 5][k], r.colour[0]);
            EXPECT_EQ(block[intensity ? 7 : 6][k], r.colour[2]);
          }
        }
        return absl::OkStatus();
      });
      EXPECT_TRUE(read.ok()) << read;
      EXPECT_EQ(at, counts[i]);
    }
  }
}

// The standard's tables 1, 22 to 26, field by field, without the reader.
TEST(E57Writer, IsLaidOutAsTheStandardSays) {
  const Made made = Write({2500}, 7);
  const std::string& file = made.file;
  EXPECT_EQ(file.substr(0, 8), "ASTM-E57");
  EXPECT_EQ(At<uint32_t>(file, 8), 1u);
  EXPECT_EQ(At<uint32_t>(file, 12), 0u);
  EXPECT_EQ(At<uint64_t>(file, 16), file.size());
  EXPECT_EQ(At<uint64_t>(file, 40), 1024u);
  std::string logical;
  for (size_t page = 0; page < file.size(); page += 1024) {
    const std::string content = file.substr(page, 1020);
    uint32_t stored = 0;
    for (size_t i = 0; i < 4; ++i) {
      stored = stored << 8 | static_cast<uint8_t>(file[page + 1020 + i]);
    }
    ASSERT_EQ(stored, bytes::Crc32c(content)) << page;
    logical += content;
  }
  const auto place = [](uint64_t physical) { return physical / 1024 * 1020 + physical % 1024; };
  const std::string xml = logical.substr(place(At<uint64_t>(file, 24)), At<uint64_t>(file, 32));
  EXPECT_EQ(xml.substr(0, 5), "<?xml");
  EXPECT_EQ(xml.substr(xml.size() - 10), "</e57Root>");
  ASSERT_NE(xml.find("fileOffset=\"48\" recordCount=\"2500\""), std::string::npos) << xml;
  // Section: id, seven reserved, its length, first data packet, index.
  EXPECT_EQ(At<uint64_t>(logical, 48), 1u);
  const uint64_t length = At<uint64_t>(logical, 56);
  EXPECT_EQ(place(At<uint64_t>(logical, 64)), 80u);
  const uint64_t index = place(At<uint64_t>(logical, 72));
  EXPECT_EQ(length % 4, 0u);
  EXPECT_EQ(48 + length, place(At<uint64_t>(file, 24)));
  size_t at = 80;
  size_t records = 0;
  while (at < index) {
    ASSERT_EQ(logical[at], 1) << "a data packet";
    ASSERT_EQ(logical[at + 1], 0);
    const size_t size = size_t{At<uint16_t>(logical, at + 2)} + 1;
    ASSERT_EQ(size % 4, 0u);
    ASSERT_EQ(At<uint16_t>(logical, at + 4), 5u) << "streams";
    const size_t here = At<uint16_t>(logical, at + 6) / 8;
    size_t streams = 0;
    for (size_t s = 0; s < 5; ++s) streams += At<uint16_t>(logical, at + 6 + 2 * s);
    ASSERT_EQ(size, 16 + streams);
    ASSERT_EQ(At<double>(logical, at + 16), made.records[0][records].range);
    ASSERT_EQ(At<uint32_t>(logical, at + 16 + 28 * here), made.records[0][records].column);
    records += here;
    at += size;
  }
  EXPECT_EQ(at, index);
  EXPECT_EQ(records, 2500u);
  EXPECT_EQ(logical[index], 0) << "an index packet";
  EXPECT_EQ(At<uint16_t>(logical, index + 2) + 1u, 48 + length - index);
  EXPECT_EQ(At<uint16_t>(logical, index + 4), 1u) << "entries";
  EXPECT_EQ(At<uint64_t>(logical, index + 16), 0u);
  EXPECT_EQ(place(At<uint64_t>(logical, index + 24)), 80u);
}

}  // namespace
}  // namespace vantage::e57
