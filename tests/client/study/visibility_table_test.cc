#include "client/study/visibility_table.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/study/best_cover.h"
#include "client/study/cover_program.h"
#include "client/study/place_file.h"
#include "core/simulation/random_sequence.h"

namespace vantage::study {
namespace {

namespace fs = std::filesystem;

class VisibilityTableTest : public testing::Test {
 protected:
  VisibilityTableTest() { fs::create_directories(folder_); }
  ~VisibilityTableTest() override { fs::remove_all(folder_); }
  std::string File(const std::string& name) const { return folder_ + "/" + name; }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(File(name), std::ios::binary) << text;
  }
  std::string Bytes(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(File(name), std::ios::binary).rdbuf();
    return text.str();
  }
  void ExpectRefused(const std::string& what) const {
    const auto table = ReadVisibilityTable(folder_);
    EXPECT_EQ(table.status().code(), absl::StatusCode::kInvalidArgument) << table.status();
    EXPECT_NE(std::string(table.status().message()).find(what), std::string::npos)
        << table.status();
  }

  const std::string folder_ = testing::TempDir() + "/table-" +
                              testing::UnitTest::GetInstance()->current_test_info()->name();
};

// A corridor: candidate i sees the samples within three metres of it, one a decimetre.
VisibilityTable Corridor(size_t candidates, size_t samples) {
  VisibilityTable table;
  table.samples = samples;
  for (size_t i = 0; i < candidates; ++i) {
    const double x = 0.6 * static_cast<double>(i);
    table.candidates.emplace_back(x, 0, 1.5);
    simulation::SampleSet set((samples + 63) / 64, 0);
    for (size_t k = 0; k < samples; ++k) {
      const double at = 0.1 * static_cast<double>(k);
      const bool seen = std::abs(at - x) < 3 && simulation::RandomUniform(1, k, i) < 0.9;
      set[k / 64] |= static_cast<uint64_t>(seen) << (k % 64);
    }
    table.sees.push_back(set);
  }
  return table;
}

TEST_F(VisibilityTableTest, ComesBackAsItWas) {
  const VisibilityTable table = Corridor(40, 250);
  ASSERT_TRUE(WriteVisibilityTable(table, folder_).ok());
  // As NumPy has it: magic, version 1.0, a header that ends at a multiple of 64 bytes, the cells.
  const std::string bytes = Bytes("visibility.npy");
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  EXPECT_EQ(bytes.size() % 64, (40 * 250) % 64);
  EXPECT_NE(bytes.find("'shape': (40, 250)"), std::string::npos);
  const auto back = ReadVisibilityTable(folder_);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->samples, 250u);
  EXPECT_EQ(back->sees, table.sees);
  ASSERT_EQ(back->candidates.size(), 40u);
  EXPECT_NEAR((back->candidates[7] - table.candidates[7]).norm(), 0, 1e-4);
}

TEST_F(VisibilityTableTest, SaysWhatIsWrongWithAFile) {
  EXPECT_EQ(ReadVisibilityTable(folder_).status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(WriteVisibilityTable(Corridor(40, 250), folder_).ok());
  const std::string right = Bytes("visibility.npy");
  const std::string places = Bytes("candidates.csv");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string bytes = right;
    bytes.replace(bytes.find(from), from.size(), to);
    Write("visibility.npy", bytes);
  };
  with("|b1", "<f8");
  ExpectRefused("its type");
  with("False", "True ");
  ExpectRefused("C order");
  with("(40, 250)", "(40, 250, 1)");
  ExpectRefused("shape");
  with("(40, 250)", "(40, 999999999)");
  ExpectRefused("too many");
  with("(40, 250)", "(39, 250)");
  ExpectRefused("39 candidates");
  Write("visibility.npy", "no table at all");
  ExpectRefused("NumPy's format");
  Write("visibility.npy", right.substr(0, right.size() - 1));
  ExpectRefused("candidate 39");
  Write("visibility.npy", right + "x");
  ExpectRefused("goes on");
  Write("visibility.npy", right);
  Write("candidates.csv", "x,y,z\n1,2,3\n");
  ExpectRefused("line 1");
  Write("candidates.csv", places + "1,2\n");
  ExpectRefused("line 42");
  Write("candidates.csv", "x_m,y_m,z_m\n");
  ExpectRefused("no place");
}

TEST_F(VisibilityTableTest, PlacesMayHaveCommentsAndEmptyLines) {
  Write("p.csv", "# mine\nx_m,y_m,z_m\n\n1, 2,3 # a corner\n-1e0,0,0.5\n");
  const auto places = ReadPlaces(File("p.csv"));
  ASSERT_TRUE(places.ok()) << places.status();
  ASSERT_EQ(places->size(), 2u);
  EXPECT_EQ((*places)[0], Eigen::Vector3d(1, 2, 3));
}

TEST(BestCover, IsProvenInACorridor) {
  const VisibilityTable table = Corridor(60, 400);
  const auto best = BestCover(table, {0.9, 0.05, 20});
  ASSERT_TRUE(best.ok()) << best.status();
  EXPECT_GE(best->covered, 0.9);
  EXPECT_LE(best->least, best->route.size());
  EXPECT_LE(best->route.size(), best->greedy);
  const auto score = ScoreStations(
      table, {0.9, 0.05, 20},
      [&] {
        std::vector<Eigen::Vector3d> places;
        for (const size_t i : best->route) {
          places.push_back(table.candidates[i]);
        }
        return places;
      }(),
      0.1);
  ASSERT_TRUE(score.ok()) << score.status();
  EXPECT_DOUBLE_EQ(score->covered, best->covered);
  EXPECT_EQ(score->linked, best->route.size());
  EXPECT_EQ(score->by_step.size(), best->route.size());
}

TEST(BestCover, BeginsAtTheStartAndCountsIt) {
  VisibilityTable table = Corridor(60, 400);
  table.start = 59;
  const auto best = BestCover(table, {0.9, 0.05, 20});
  ASSERT_TRUE(best.ok()) << best.status();
  EXPECT_EQ(best->route.front(), 59u);
  EXPECT_GE(best->covered, 0.9);
  // What it sees alone is enough for a tenth.
  const auto alone = BestCover(table, {0.05, 0.05, 20});
  ASSERT_TRUE(alone.ok()) << alone.status();
  EXPECT_EQ(alone->route, std::vector<size_t>{59});
  EXPECT_TRUE(alone->proven);
}

// More samples than a programme is given at first: what it finds there is checked on the others.
TEST(BestCover, HoldsOnSamplesThatTheProgrammeDidNotHave) {
  if (FindCoverSolver().empty()) {
    GTEST_SKIP() << "no solver here: install coinor-cbc or glpk-utils";
  }
  simulation::RandomSequence random(5);
  VisibilityTable table;
  table.samples = 4000;
  for (size_t i = 0; i < 60; ++i) {
    table.candidates.emplace_back(static_cast<double>(i), 0, 0);
    simulation::SampleSet set(63, 0);
    for (size_t k = 0; k < table.samples; ++k) {
      if (random.Chance(0.12)) set[k / 64] |= uint64_t{1} << (k % 64);
    }
    table.sees.push_back(set);
  }
  const auto best = BestCover(table, {0.7, 0.05, 4});
  ASSERT_TRUE(best.ok()) << best.status();
  EXPECT_GE(best->covered, 0.7);
  EXPECT_LE(best->route.size(), best->greedy);
  EXPECT_LE(best->least, best->route.size());
}

TEST(BestCover, SaysThatTheGoalIsOutOfReach) {
  VisibilityTable table = Corridor(60, 400);
  const auto best = BestCover(table, {0.9, 0.95, 5});
  EXPECT_EQ(best.status().code(), absl::StatusCode::kFailedPrecondition) << best.status();
  const auto far = ScoreStations(table, {}, {Eigen::Vector3d(0, 9, 0)}, 0.5);
  EXPECT_EQ(far.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(far.status().message()).find("--stations: station 1"), std::string::npos);
}

}  // namespace
}  // namespace vantage::study
