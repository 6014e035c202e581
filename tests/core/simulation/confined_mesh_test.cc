#include "core/simulation/confined_mesh.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/simulation/mesh_ply.h"
#include "tests/support/printable.h"

namespace vantage::simulation {
namespace {

// A strip of triangles that rises and falls.
std::string StripPly(int corners) {
  std::string text =
      absl::StrCat("ply\nformat ascii 1.0\nelement vertex ", corners,
                   "\nproperty float x\nproperty float y\nproperty float z\n"
                   "element face ",
                   corners - 2, "\nproperty list uchar int vertex_indices\n", "end_header\n");
  for (int i = 0; i < corners; ++i) absl::StrAppend(&text, 0.3 * i, " ", i % 2, " ", i % 7, "\n");
  for (int i = 0; i + 2 < corners; ++i) {
    absl::StrAppend(&text, "3 ", i, " ", i + 1, " ", i + 2, "\n");
  }
  return text;
}

std::string SaidMesh(const TriangleMesh& mesh) {
  std::string bytes;
  SayMesh(mesh, [&](absl::string_view part) { bytes.append(part.data(), part.size()); });
  return bytes;
}

absl::StatusOr<TriangleMesh> HeardMesh(const std::string& bytes, uint64_t max_bytes) {
  size_t at = 0;
  return HearMesh(
      [&](char* to, size_t size) {
        if (size > bytes.size() - at) return absl::OutOfRangeError("it ends early");
        std::copy_n(bytes.data() + at, size, to);
        at += size;
        return absl::OkStatus();
      },
      max_bytes);
}

// Whole files, and the same with a byte damaged or the end cut off at random.
TEST(ConfinedMeshTest, SaysWhatAReaderInThisProcessSays) {
  const std::string path =
      absl::StrCat(testing::TempDir(), "/confined_mesh_test_", getpid(), ".ply");
  std::mt19937 random(5);
  int read = 0;
  for (int times = 0; times < 30; ++times) {
    std::string bytes = StripPly(5 + times);
    if (times % 3 == 1) bytes[random() % bytes.size()] = static_cast<char>(random());
    if (times % 3 == 2) bytes.resize(random() % bytes.size());
    std::ofstream(path, std::ios::binary) << bytes;
    const absl::StatusOr<TriangleMesh> here = ReadMeshPly(path);
    const absl::StatusOr<TriangleMesh> there = ReadMeshConfined(path, {});
    EXPECT_EQ(there.status(), test_support::Printable(here.status()));
    if (!here.ok() || !there.ok()) continue;
    ++read;
    EXPECT_TRUE(there->vertices == here->vertices);
    EXPECT_EQ(there->triangles, here->triangles);
    EXPECT_EQ(there->material, here->material);
  }
  EXPECT_GE(read, 10);
  std::filesystem::remove(path);
  EXPECT_EQ(ReadMeshConfined(path, {}).status(), ReadMeshPly(path).status());
}

// Whatever arrives, what is taken of it is a mesh.
TEST(MeshAnswerTest, WhatIsHeardMakesSense) {
  const TriangleMesh mesh = ParseMeshPly(StripPly(20)).value();
  const std::string bytes = SaidMesh(mesh);
  EXPECT_TRUE(HeardMesh(bytes, 2 * bytes.size()).value().vertices == mesh.vertices);
  EXPECT_EQ(HeardMesh(bytes, 100).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(HeardMesh(bytes.substr(0, bytes.size() - 1), 2 * bytes.size()).status().code(),
            absl::StatusCode::kOutOfRange);
  std::mt19937 random(9);
  int taken = 0;
  for (int times = 0; times < 3000; ++times) {
    std::string damaged = bytes;
    for (int i = 0; i < 2; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
    const absl::StatusOr<TriangleMesh> heard = HeardMesh(damaged, 2 * bytes.size());
    if (!heard.ok()) continue;
    ++taken;
    ASSERT_FALSE(heard->triangles.empty());
    for (const auto& triangle : heard->triangles) {
      for (const uint32_t corner : triangle) ASSERT_LT(corner, heard->vertices.size());
    }
    for (const Eigen::Vector3f& vertex : heard->vertices) ASSERT_TRUE(vertex.allFinite());
  }
  EXPECT_GT(taken, 100);
}

}  // namespace
}  // namespace vantage::simulation
