#include "client/cli/table.h"

#include <gtest/gtest.h>

namespace vantage::cli {
namespace {

TEST(Table, LinesColumnsUp) {
  Table table({"name", ">gain, m\u00b2", "note"});
  table.Add({"a", "1.5", "short"});
  table.Add({"longer name", "120.25", ""});
  EXPECT_EQ(table.ToString(),
            "name         gain, m\u00b2  note\n"
            "a                 1.5  short\n"
            "longer name    120.25\n");
}

TEST(Table, CountsCharactersNotBytes) {
  EXPECT_EQ(DisplayWidth("m\u00b2 \u00b0"), 4u);
  EXPECT_EQ(PadLeft("\u00b2", 3), "  \u00b2");
  EXPECT_EQ(PadRight("\u00b2", 3), "\u00b2  ");
}

TEST(Table, MissingCellsAreEmpty) {
  Table table({"a", "b"});
  table.Add({"x"});
  EXPECT_EQ(table.ToString(), "a  b\nx\n");
}

}  // namespace
}  // namespace vantage::cli
