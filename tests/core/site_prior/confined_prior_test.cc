// Priors of strangers: in a process of their own, as ParsePrior() in this one.
#include "core/site_prior/confined_prior.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/confinement/descriptor.h"

namespace vantage::site_prior {
namespace {

using testing::HasSubstr;

absl::StatusOr<PriorMesh> Read(const std::string& bytes, const PriorReading& reading = {}) {
  const confinement::Descriptor file(memfd_create("prior", MFD_CLOEXEC));
  EXPECT_EQ(write(file.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  return ReadPriorConfined(file.get(), bytes.size(), reading, {});
}

std::string Room() {
  return "mtllib /etc/passwd\nv 0 0 0\nv 4000 0 0\nv 4000 3000 0\nv 0 3000 0\nv 0 0 2500\n"
         "v 4000 0 2500\nv 4000 3000 2500\nv 0 3000 2500\n"
         "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
}

TEST(ConfinedPriorTest, ReadsWhatTheParserReads) {
  PriorReading millimetres;
  millimetres.unit = 0.001;
  const auto here = ParsePrior(Room(), millimetres);
  const auto there = Read(Room(), millimetres);
  ASSERT_TRUE(here.ok() && there.ok()) << here.status() << there.status();
  EXPECT_EQ(there->vertices, here->vertices);
  EXPECT_EQ(there->triangles, here->triangles);
  EXPECT_EQ(there->unit, 0.001);
}

TEST(ConfinedPriorTest, SaysWhatTheParserSays) {
  const auto metres = Read(Room());
  EXPECT_EQ(metres.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(metres.status().message(), HasSubstr("is 4000 m wide: give the unit, mm"));
  EXPECT_THAT(Read("%PDF").status().message(), HasSubstr("DXF or PNG"));
}

TEST(ConfinedPriorTest, TakesNoFileLargerThanTheBound) {
  const auto large = ReadPriorConfined(0, kMostPriorFileBytes + 1, {}, {});
  EXPECT_EQ(large.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(large.status().message(), HasSubstr("simplify"));
}

// Damage by the byte costs the file, and never this process.
TEST(ConfinedPriorTest, SurvivesDamagedFiles) {
  PriorReading millimetres;
  millimetres.unit = 0.001;
  const std::string dxf =
      "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\n0\n20\n0\n11\n5000\n21\n0\n0\nENDSEC\n0\nEOF\n";
  for (const std::string& whole : {Room(), dxf}) {
    for (size_t at = 0; at < whole.size(); at += 7) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
      for (const std::string& bytes : {damaged, whole.substr(0, at)}) {
        EXPECT_THAT(Read(bytes, millimetres).status().code(),
                    testing::AnyOf(absl::StatusCode::kOk, absl::StatusCode::kInvalidArgument,
                                   absl::StatusCode::kResourceExhausted))
            << at;
      }
    }
  }
}

// The reader may have been taken over: what it answers is a stranger's.
TEST(ConfinedPriorTest, BelievesNothingOfWhatItHears) {
  const auto hear = [](std::string bytes) {
    size_t at = 0;
    return HearPrior([&](char* to, size_t size) -> absl::Status {
      if (at + size > bytes.size()) return absl::InvalidArgumentError("it ended");
      std::memcpy(to, bytes.data() + at, size);
      at += size;
      return absl::OkStatus();
    });
  };
  const auto counts = [](uint64_t vertices, uint64_t triangles, double unit) {
    std::string bytes(sizeof(uint64_t) * 2 + sizeof(double), '\0');
    std::memcpy(bytes.data(), &vertices, 8);
    std::memcpy(bytes.data() + 8, &triangles, 8);
    std::memcpy(bytes.data() + 16, &unit, 8);
    return bytes;
  };
  EXPECT_FALSE(hear(counts(3, uint64_t{1} << 40, 1)).ok());
  EXPECT_FALSE(hear(counts(3, 1, -1)).ok());
  EXPECT_FALSE(hear(counts(3, 1, 1)).ok());
  std::string one = counts(3, 1, 1);
  const float corners[9] = {0, 0, 0, 4, 0, 0, 0, 4, 3};
  const uint32_t beyond[3] = {0, 1, 3};
  one.append(reinterpret_cast<const char*>(corners), sizeof(corners));
  EXPECT_THAT(hear(one + std::string(reinterpret_cast<const char*>(beyond), sizeof(beyond)))
                  .status()
                  .message(),
              HasSubstr("not there"));
}

}  // namespace
}  // namespace vantage::site_prior
