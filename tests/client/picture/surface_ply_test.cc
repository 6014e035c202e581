#include "client/picture/surface_ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "core/model/view/export.h"

namespace vantage::picture {
namespace {

using ::testing::HasSubstr;

constexpr char kHeader[] =
    "ply\nformat binary_little_endian 1.0\ncomment test\nelement vertex 1\n"
    "property float x\nproperty float y\nproperty double z\nproperty float nx\n"
    "property float ny\nproperty float nz\nproperty uchar red\nproperty uchar kind\n"
    "property float density\nproperty float area\nproperty uint samples\nend_header\n";

template <typename T>
void Append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

std::string OneVertex(uint8_t kind) {
  std::string bytes = kHeader;
  Append(bytes, 1.0f);
  Append(bytes, -2.0f);
  Append(bytes, 3.0);
  Append(bytes, 0.0f);
  Append(bytes, 0.0f);
  Append(bytes, 1.0f);
  Append(bytes, uint8_t{255});
  Append(bytes, kind);
  Append(bytes, 1234.0f);
  Append(bytes, 0.0025f);
  Append(bytes, uint32_t{7});
  return bytes;
}

TEST(SurfacePly, ReadsWhatItNeedsFromAnyLayout) {
  const auto elements = ParseSurfacePly(OneVertex(3));
  ASSERT_TRUE(elements.ok()) << elements.status();
  ASSERT_EQ(elements->size(), 1u);
  const SurfaceElement& e = (*elements)[0];
  EXPECT_EQ(e.position, Eigen::Vector3d(1, -2, 3));
  EXPECT_EQ(e.normal, Eigen::Vector3f::UnitZ());
  EXPECT_EQ(e.kind, model::SurfaceKind::kHole);
  EXPECT_EQ(e.density, 1234.0f);
  EXPECT_EQ(e.area, 0.0025f);
}

TEST(SurfacePly, ReadsTheExportOfTheModel) {
  auto brick = std::make_shared<model::Brick>();
  brick->state[5] = model::VoxelState::kFalseImage;
  brick->surface_mask[0] = uint64_t{1} << 5;
  brick->surface.push_back({Eigen::Vector3f(0.275f, 0.025f, 0.025f), Eigen::Vector3f::UnitX(),
                            0.0025f, 0.0f, 0, 0, 0, false, false});
  const model::PlanningView view(0.05, 1, {{model::VoxelIndex::Zero(), brick}}, {});
  const auto elements = ParseSurfacePly(model::ExportSurfacePly(view));
  ASSERT_TRUE(elements.ok()) << elements.status();
  ASSERT_EQ(elements->size(), 1u);
  EXPECT_EQ((*elements)[0].kind, model::SurfaceKind::kImage);
  EXPECT_NEAR((*elements)[0].position.x(), 0.275, 1e-6);
  EXPECT_NEAR((*elements)[0].area, 0.0025, 1e-9);
}

TEST(SurfacePly, RefusesWhatItCannotRead) {
  const std::string good = OneVertex(1);
  const auto message = [](const std::string& bytes) {
    const auto parsed = ParseSurfacePly(bytes);
    EXPECT_EQ(parsed.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(parsed.status().message());
  };
  EXPECT_THAT(message(""), HasSubstr("not a PLY"));
  EXPECT_THAT(message(good.substr(0, good.size() - 1)), HasSubstr("truncated"));
  EXPECT_THAT(message(OneVertex(9)), HasSubstr("kind 9"));
  EXPECT_THAT(message(OneVertex(0)), HasSubstr("kind 0"));
  std::string no_kind = good;
  no_kind.replace(no_kind.find("uchar kind"), 10, "uchar sort");
  EXPECT_THAT(message(no_kind), HasSubstr("no 'kind'"));
  std::string huge = good;
  huge.replace(huge.find("vertex 1"), 8, "vertex 99999999999");
  EXPECT_THAT(message(huge), HasSubstr("truncated"));
  // Every truncation is refused or read, never worse.
  for (size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(ParseSurfacePly(good.substr(0, size)).ok()) << size;
  }
}

}  // namespace
}  // namespace vantage::picture
