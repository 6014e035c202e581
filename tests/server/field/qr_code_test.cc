#include "server/field/qr_code.h"

#include <gtest/gtest.h>

#include "absl/strings/match.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace vantage::field {
namespace {

// A row of modules, '#' for dark ones.
std::string Row(const QrModules& modules, size_t y, size_t from, size_t count) {
  std::string row;
  for (size_t x = from; x < from + count; ++x) row += modules[y][x] ? '#' : '.';
  return row;
}

// The patterns by which every reader finds a code (ISO/IEC 18004): three finders, and the timing
// between them.
TEST(EncodeQr, HasThePatternsOfTheNorm) {
  const auto modules =
      EncodeQr("https://192.168.178.34:7443/#token=vantage_" + std::string(43, 'x'));
  ASSERT_TRUE(modules.ok());
  const size_t width = modules->size();
  EXPECT_EQ(width, 37U);  // version 5, level L: 106 bytes
  const char* const finder[] = {"#######", "#.....#", "#.###.#", "#.###.#",
                                "#.###.#", "#.....#", "#######"};
  for (size_t y = 0; y < 7; ++y) {
    EXPECT_EQ(Row(*modules, y, 0, 7), finder[y]);
    EXPECT_EQ(Row(*modules, y, width - 7, 7), finder[y]);
    EXPECT_EQ(Row(*modules, width - 7 + y, 0, 7), finder[y]);
  }
  for (size_t i = 8; i < width - 8; ++i) {
    EXPECT_EQ((*modules)[6][i], i % 2 == 0);
    EXPECT_EQ((*modules)[i][6], i % 2 == 0);
  }
}

TEST(EncodeQr, RefusesWhatFitsInNone) { EXPECT_FALSE(EncodeQr(std::string(3000, 'x')).ok()); }

// What is drawn, read back: the modules with a light margin of four, whatever the terminal shows.
TEST(DrawQr, DrawsTheModulesOnAGroundOfItsOwn) {
  const auto modules = EncodeQr("https://10.42.0.1:7443/");
  ASSERT_TRUE(modules.ok());
  const std::string drawn = DrawQr(*modules, 2);
  std::vector<std::string> rows;
  for (absl::string_view line : absl::StrSplit(drawn, '\n', absl::SkipEmpty())) {
    ASSERT_TRUE(absl::ConsumePrefix(&line, "  \033[38;5;16;48;5;231m"));
    ASSERT_TRUE(absl::ConsumeSuffix(&line, "\033[0m"));
    std::string upper;
    std::string lower;
    while (!line.empty()) {
      if (absl::ConsumePrefix(&line, "█")) {
        upper += '#';
        lower += '#';
      } else if (absl::ConsumePrefix(&line, "▀")) {
        upper += '#';
        lower += '.';
      } else if (absl::ConsumePrefix(&line, "▄")) {
        upper += '.';
        lower += '#';
      } else {
        ASSERT_TRUE(absl::ConsumePrefix(&line, " ")) << line;
        upper += '.';
        lower += '.';
      }
    }
    rows.push_back(upper);
    rows.push_back(lower);
  }
  const size_t width = modules->size();
  const std::string margin(width + 8, '.');
  ASSERT_GE(rows.size(), width + 8);
  for (size_t y = 0; y < rows.size(); ++y) {
    const bool within = y >= 4 && y < width + 4;
    EXPECT_EQ(rows[y], within ? "...." + Row(*modules, y - 4, 0, width) + "...." : margin) << y;
  }
}

}  // namespace
}  // namespace vantage::field
