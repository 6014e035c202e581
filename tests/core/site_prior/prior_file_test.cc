#include "core/site_prior/prior_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/site_prior/mesh_samples.h"
#include "core/site_prior/prior_space.h"

namespace vantage::site_prior {
namespace {

using testing::HasSubstr;

// A box room in an OBJ file, of `size` in its unit.
std::string BoxObj(double x, double y, double z) {
  std::string obj = "# a room\nmtllib none.mtl\nusemtl wall\n";
  for (const double h : {0.0, z}) {
    for (const auto& [u, v] : {std::pair(0.0, 0.0), {x, 0.0}, {x, y}, {0.0, y}}) {
      absl::StrAppend(&obj, absl::StrFormat("v %g %g %g\n", u, v, h));
    }
  }
  absl::StrAppend(&obj, "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  return obj;
}

std::string Line(double x1, double y1, double x2, double y2, const char* layer = "WALLS") {
  return absl::StrFormat("0\nLINE\n8\n%s\n10\n%g\n20\n%g\n11\n%g\n21\n%g\n", layer, x1, y1, x2, y2);
}

std::string Dxf(const std::string& entities, int insunits = 0) {
  return absl::StrCat("0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n", insunits,
                      "\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n", entities, "0\nENDSEC\n0\nEOF\n");
}

std::string Rectangle(double x0, double y0, double x1, double y1) {
  return Line(x0, y0, x1, y0) + Line(x1, y0, x1, y1) + Line(x1, y1, x0, y1) + Line(x0, y1, x0, y0);
}

std::string Png(int width, int height, const std::vector<uint8_t>& grey) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_GRAY;
  std::string bytes(static_cast<size_t>(width * height) + 4096, '\0');
  png_alloc_size_t size = bytes.size();
  EXPECT_NE(png_image_write_to_memory(&image, bytes.data(), &size, 0, grey.data(), 0, nullptr), 0);
  bytes.resize(size);
  return bytes;
}

// Two rooms of 4 m x 5 m with a door between them, in pixels of 5 cm, and a letter in one.
std::vector<uint8_t> TwoRoomsPlan(int width, int height) {
  std::vector<uint8_t> grey(static_cast<size_t>(width * height), 255);
  const auto box = [&](int x0, int y0, int x1, int y1, uint8_t value) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) grey[static_cast<size_t>(y * width + x)] = value;
    }
  };
  box(10, 10, 178, 14, 0);  // walls of 20 cm
  box(10, 114, 178, 118, 0);
  box(10, 10, 14, 118, 0);
  box(174, 10, 178, 118, 0);
  box(92, 10, 96, 118, 0);
  box(92, 50, 96, 70, 255);  // a door of a metre
  box(40, 40, 41, 48, 0);    // a letter
  return grey;
}

model::PlanningView SpaceIn(const PriorMesh& mesh) {
  auto space = SpaceOf(mesh, {}, 0.05);
  EXPECT_TRUE(space.ok()) << space.status();
  return *std::move(space);
}

TEST(PriorFileTest, TellsFormatsByTheirContent) {
  EXPECT_EQ(*FindPriorFormat("ply\nformat ascii 1.0\n"), PriorFormat::kPly);
  EXPECT_EQ(*FindPriorFormat(BoxObj(4, 4, 3)), PriorFormat::kObj);
  EXPECT_EQ(*FindPriorFormat("# SECTION A-A\n# 0\n" + BoxObj(4, 4, 3)), PriorFormat::kObj);
  EXPECT_EQ(*FindPriorFormat("  0\r\nSECTION\r\n  2\r\nENTITIES\r\n"), PriorFormat::kDxf);
  EXPECT_EQ(*FindPriorFormat(Dxf(Rectangle(0, 0, 4, 4))), PriorFormat::kDxf);
  EXPECT_EQ(*FindPriorFormat(Png(200, 128, TwoRoomsPlan(200, 128))), PriorFormat::kPicture);
  EXPECT_THAT(FindPriorFormat("%PDF-1.7").status().message(), HasSubstr("DXF or PNG"));
  EXPECT_THAT(FindPriorFormat("AC1032...").status().message(), HasSubstr("save it as DXF"));
  EXPECT_THAT(FindPriorFormat("").status().message(), HasSubstr("empty"));
}

TEST(PriorFileTest, ReadsObjByAssimpWithoutOpeningWhatItRefersTo) {
  const auto mesh = ParsePrior(BoxObj(4, 5, 3), {});
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->triangles.size(), 12u);
  EXPECT_TRUE(mesh->Bounds().sizes().isApprox(Eigen::Vector3f(4, 5, 3)));
  PriorReading turned;
  turned.y_up = 1;
  const auto upright = ParsePrior(BoxObj(4, 3, 5), turned);
  ASSERT_TRUE(upright.ok()) << upright.status();
  EXPECT_TRUE(upright->Bounds().sizes().isApprox(Eigen::Vector3f(4, 5, 3)));
}

TEST(PriorFileTest, SaysWhichUnitMakesABuilding) {
  const auto millimetres = ParsePrior(BoxObj(12000, 9000, 2700), {});
  EXPECT_EQ(millimetres.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(millimetres.status().message(), HasSubstr("is 12000 m wide: give the unit, mm"));
  PriorReading mm;
  mm.unit = 0.001;
  EXPECT_TRUE(ParsePrior(BoxObj(12000, 9000, 2700), mm).ok());
  EXPECT_THAT(ParsePrior(BoxObj(12, 9, 2.7), mm).status().message(),
              HasSubstr("0.012 m wide, less than a room"));
  EXPECT_THAT(ParsePrior(BoxObj(12, 9, 0.1), {}).status().message(), HasSubstr("y axis"));
}

TEST(PriorFileTest, RefusesWhatLiesFarFromItsOwnOrigin) {
  const auto at = [](float x) {
    PriorMesh mesh = *ParsePrior(BoxObj(12, 9, 2.7), {});
    for (Eigen::Vector3f& vertex : mesh.vertices) vertex.x() += x;
    return CheckPrior(mesh);
  };
  EXPECT_THAT(at(5.4e6F).message(), HasSubstr("lies 5400 km from its own origin"));
  EXPECT_THAT(at(5.4e6F).message(), HasSubstr("move it there"));
  EXPECT_FALSE(at(-10'001).ok());
  EXPECT_TRUE(at(9'900).ok());
  // Where it is placed counts, too.
  PriorPose far;
  far.translation.y() = 1e5;
  const auto placed = SpaceOf(*ParsePrior(BoxObj(12, 9, 2.7), {}), far, 0.05);
  EXPECT_EQ(placed.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(placed.status().message(), HasSubstr("100 km from the session's origin"));
}

// A few bytes of triangles without area, over which points would be spread for hours.
TEST(PriorFileTest, RefusesSliversBeforeAnythingIsMadeOfThem) {
  PriorMesh mesh = *ParsePrior(BoxObj(1500, 900, 2.7), {});
  mesh.triangles.clear();
  mesh.vertices.push_back({1499, 0, 0});
  const auto last = static_cast<uint32_t>(mesh.vertices.size() - 1);
  for (int i = 0; i < 100; ++i) mesh.triangles.push_back({0, 1, last});
  mesh.triangles.push_back({0, 2, 6});
  ASSERT_TRUE(CheckPrior(mesh).ok());
  const auto space = SpaceOf(mesh, {}, 0.05);
  EXPECT_EQ(space.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(space.status().message(), HasSubstr("simplify it"));
}

TEST(PriorFileTest, CountsSamplesFromAbove) {
  PriorMesh mesh = *ParsePrior(BoxObj(12, 9, 2.7), {});
  mesh.triangles.push_back({0, 0, 1});  // without area
  PriorPose pose;
  pose.scale = 1.5;
  size_t samples = 0;
  ForEachMeshSample(mesh, pose, 0.1, [&](const auto&, const auto&) { ++samples; });
  const double most = MostMeshSamples(mesh, pose.scale, 0.1);
  EXPECT_GE(most, static_cast<double>(samples));
  EXPECT_LT(most, 1.2 * static_cast<double>(samples));
}

TEST(PriorFileTest, RefusesMoreSurfaceThanItHasMemoryFor) {
  const PriorMesh mesh = *ParsePrior(BoxObj(120, 90, 2.7), {});
  const auto space = SpaceOf(mesh, {}, 0.05);
  EXPECT_EQ(space.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(space.status().message(), HasSubstr("more than 10000 m2 of surface"));
  const PriorMesh room = *ParsePrior(BoxObj(12, 9, 2.7), {});
  EXPECT_LT(EstimateSpaceMemory(room, 1, 0.05), EstimateSpaceMemory(mesh, 1, 0.05) / 2);
  EXPECT_GT(EstimateSpaceMemory(room, 1, 0.05), uint64_t{10} << 20);
}

// A tablet looked into one of two rooms from above, and left the ceiling out; eaves are no room.
TEST(PriorFileTest, FindsARoomWithoutCeilingBesideALargerOneWithOne) {
  PriorMesh mesh = *ParsePrior(BoxObj(9, 6, 2.7), {});
  const auto add = [&](float x, float y, float width, float depth, float z) {
    const auto first = static_cast<uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(
        mesh.vertices.end(),
        {{x, y, z}, {x + width, y, z}, {x + width, y + depth, z}, {x, y + depth, z}});
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  };
  add(20, 0, 4, 4, 0);
  add(0, -0.5F, 9, 0.48F, 2.7F);
  const model::PlanningView space = SpaceIn(mesh);
  EXPECT_TRUE(space.Empty(space.At({4, 3, 1})));
  EXPECT_TRUE(space.Empty(space.At({22, 2, 1})));
  EXPECT_TRUE(space.Empty(space.At({20.2, 2, 1})));
  EXPECT_FALSE(space.Empty(space.At({22, 2, 2.7})));
  EXPECT_FALSE(space.Empty(space.At({4, -0.25, 3.5})));
}

TEST(PriorFileTest, RefusesWhatIsEmptyOrDamaged) {
  EXPECT_THAT(ParsePrior("v 0 0 0\nv 1 0 0\n", {}).status().message(),
              testing::AnyOf(HasSubstr("empty"), HasSubstr("OBJ")));
  EXPECT_THAT(ParsePrior(Dxf(""), {}).status().message(), HasSubstr("no line or polyline"));
  EXPECT_THAT(ParsePrior(Dxf(Line(0, 0, 5, 5, "DOORS")), {}).status().message(),
              HasSubstr("doors"));
  std::string png = Png(200, 128, TwoRoomsPlan(200, 128));
  PriorReading pixels;
  pixels.unit = 0.05;
  EXPECT_THAT(ParsePrior(png, {}).status().message(), HasSubstr("metres for a pixel"));
  EXPECT_THAT(ParsePrior(png.substr(0, png.size() / 2), pixels).status().message(),
              HasSubstr("damaged"));
  EXPECT_THAT(
      ParsePrior(Png(64, 64, std::vector<uint8_t>(64 * 64, 255)), pixels).status().message(),
      HasSubstr("empty"));
}

TEST(PriorFileTest, ReadsWallsOfADxfInItsOwnUnit) {
  const auto mesh = ParsePrior(Dxf(Rectangle(0, 0, 6000, 4000) + Line(3000, 0, 3000, 3000) +
                                       Line(3000, 3000, 2000, 4000, "A-DOOR"),
                                   4),
                               {});
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const Eigen::Vector3f size = mesh->Bounds().sizes();
  EXPECT_NEAR(size.x(), 6, 0.1);
  EXPECT_NEAR(size.y(), 4, 0.1);
  EXPECT_NEAR(size.z(), 2.5, 1e-6);
  const model::PlanningView space = SpaceIn(*mesh);
  // Free on both sides of the wall and in its doorway, where the door's leaf is not drawn.
  EXPECT_TRUE(space.Empty(space.At({1.5, 2, 1.5})));
  EXPECT_TRUE(space.Empty(space.At({4.5, 2, 1.5})));
  EXPECT_TRUE(space.Empty(space.At({2.5, 3.5, 1.5})));
  EXPECT_FALSE(space.Empty(space.At({3.0, 1.5, 1.5})));
  EXPECT_EQ(space.State(space.At({7.5, 2, 1.5})), model::VoxelState::kUnknown);
}

TEST(PriorFileTest, RefusesAnOpenPlan) {
  const auto open = ParsePrior(Dxf(Line(0, 0, 6, 0) + Line(0, 0, 0, 5)), {});
  EXPECT_EQ(open.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(open.status().message(), HasSubstr("open"));
  // A front door is no such gap.
  EXPECT_TRUE(ParsePrior(Dxf(Line(0, 0, 2, 0) + Line(3, 0, 6, 0) + Line(6, 0, 6, 5) +
                             Line(6, 5, 0, 5) + Line(0, 5, 0, 0)),
                         {})
                  .ok());
}

TEST(PriorFileTest, ReadsAPictureWithAScale) {
  PriorReading reading;
  reading.unit = 0.05;
  reading.wall_height = 2.62;
  const auto mesh = ParsePrior(Png(200, 128, TwoRoomsPlan(200, 128)), reading);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const model::PlanningView space = SpaceIn(*mesh);
  // y up: the picture's rows 14 to 114 lie between -5.7 and -0.7 m.
  EXPECT_TRUE(space.Empty(space.At({2, -3, 1.5})));
  EXPECT_TRUE(space.Empty(space.At({6, -3, 1.5})));
  EXPECT_TRUE(space.Empty(space.At({4.7, -3, 1.5})));     // the door
  EXPECT_FALSE(space.Empty(space.At({4.7, -1.5, 1.5})));  // the wall beside it
  EXPECT_TRUE(space.Empty(space.At({2.02, -2.2, 1.5})));  // the letter is no wall
  EXPECT_FALSE(space.Empty(space.At({0.2, -3, 1.5})));
  const auto floor = space.Surface(space.At({2, -3, 0}));
  ASSERT_TRUE(floor.has_value());
  EXPECT_GT(floor->normal.z(), 0.9F);
  EXPECT_EQ(floor->density, 0);
  const auto ceiling = space.Surface(space.At({2, -3, 2.6}));
  ASSERT_TRUE(ceiling.has_value());
  EXPECT_LT(ceiling->normal.z(), -0.9F);
}

TEST(PriorFileTest, ComesBackAsItWasStored) {
  const auto mesh = ParsePrior(BoxObj(4, 5, 3), {});
  ASSERT_TRUE(mesh.ok());
  const std::string bytes = EncodePrior(*mesh);
  const auto again = DecodePrior(bytes);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->triangles, mesh->triangles);
  EXPECT_EQ(again->vertices, mesh->vertices);
  EXPECT_FALSE(DecodePrior(bytes.substr(0, bytes.size() - 1)).ok());
  EXPECT_FALSE(DecodePrior(bytes.substr(0, 7)).ok());
}

}  // namespace
}  // namespace vantage::site_prior
