// Intensity and colour come along on request, and out again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/sensor/e57.h"
#include "core/sensor/encoding.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(AppearanceOfScans, ComesAlongOnRequestAndOutAgain) {
  const ScratchFolder scratch;
  sensor::RangeImage image = fixture::ScanRoom({2.0, 1.5, 1.4}, 2.0);
  image.appearance.intensity.resize(image.cells());
  for (size_t i = 0; i < image.cells(); ++i) {
    if (!sensor::RangeImage::IsRange(image.range[i])) continue;
    image.appearance.intensity[i] = static_cast<uint16_t>(1 + i * 7 % 65'535);
  }
  const std::string file = scratch.File("bright.vrim");
  std::ofstream(file, std::ios::binary) << sensor::EncodeRangeImage(image);
  EXPECT_THAT(RunProgram({VANTAGE_BINARY, "file", file}).out, HasSubstr("intensity"));

  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  ASSERT_EQ(Vantage(server, {"session", "create", "job"}).exit_code, 0);
  const Finished colour = Vantage(server, {"scan", "push", "job", file, "--with", "colour"});
  EXPECT_EQ(colour.exit_code, 5) << colour.out;
  EXPECT_THAT(colour.error, HasSubstr("no colour"));
  EXPECT_THAT(colour.error, HasSubstr("out of --with"));
  const Finished pushed = Vantage(server, {"scan", "push", "job", file, "--with", "intensity"});
  ASSERT_EQ(pushed.exit_code, 0) << pushed.error;

  const std::string e57 = scratch.File("job.e57");
  ASSERT_EQ(Vantage(server, {"export", "job", "--format", "scans-e57", "-o", e57}).exit_code, 0);
  sensor::ImportLimits limits;
  limits.appearance.intensity = true;
  const auto source = bytes::ByteSource::Open(e57);
  ASSERT_TRUE(source.ok()) << source.status();
  const auto back = sensor::ParseE57(*source, 0, limits);
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->image.cells(), image.cells());
  // The first column looks along -x, which is the first or the last.
  const double first = back->image.azimuth[0] - image.azimuth[0];
  const int turn = std::abs(first) < 1e-5 ? 0 : image.columns() - 1;
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      const size_t there = back->image.Index((c + turn) % image.columns(), r);
      ASSERT_EQ(back->image.appearance.intensity[there],
                image.appearance.intensity[image.Index(c, r)])
          << c << " " << r;
    }
  }

  const std::string ply = scratch.File("job.ply");
  ASSERT_EQ(Vantage(server, {"export", "job", "--format", "scans-ply", "-o", ply}).exit_code, 0);
  std::ifstream stream(ply, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  EXPECT_THAT(text.substr(0, 400), HasSubstr("property ushort intensity"));
  EXPECT_THAT(text.substr(0, 400), Not(HasSubstr("property uchar red")));
  const size_t header = text.find("end_header\n") + 11;
  EXPECT_EQ(text.size(), header + image.SampleCount() * (3 * 8 + 4 + 2));
}

// Nobody asked: what travels and is kept is as without it.
TEST(AppearanceOfScans, CostsNothingWhereNobodyAsks) {
  const ScratchFolder scratch;
  sensor::RangeImage image = fixture::ScanRoom({2.0, 1.5, 1.4}, 2.0);
  const std::string plain = sensor::EncodeRangeImage(image);
  image.appearance.colour.assign(image.cells(), sensor::Colour{});
  const std::string file = scratch.File("colour.vrim");
  std::ofstream(file, std::ios::binary) << sensor::EncodeRangeImage(image);
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  ASSERT_EQ(Vantage(server, {"session", "create", "job"}).exit_code, 0);
  ASSERT_EQ(Vantage(server, {"scan", "push", "job", file}).exit_code, 0);
  const Finished list = Vantage(server, {"scan", "list", "job", "--json"});
  EXPECT_THAT(list.out, HasSubstr(absl::StrCat("\"encodedSizeBytes\": \"", plain.size(), "\"")));
}

}  // namespace
}  // namespace vantage::integration
