#include "server/field/log_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "server/store/durable_file.h"

namespace vantage::field {
namespace {

TEST(LogFile, IsTurnedOverWhenItHasGrownAndTheOneBeforeIsKept) {
  const std::string path = ::testing::TempDir() + "/field-log";
  std::filesystem::remove(path);
  std::filesystem::remove(path + ".1");
  const auto log = LogFile::Open(path, 10);
  ASSERT_TRUE(log.ok()) << log.status();
  const int descriptor = (*log)->descriptor();
  const auto write_line = [&](const std::string& text) {
    EXPECT_EQ(write(descriptor, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    EXPECT_TRUE((*log)->TurnOver().ok());
  };
  write_line("one\n");
  EXPECT_EQ(*store::ReadWhole(path), "one\n");
  EXPECT_FALSE(std::filesystem::exists(path + ".1"));
  write_line("two two\n");  // that is enough
  EXPECT_EQ(*store::ReadWhole(path), "");
  EXPECT_EQ(*store::ReadWhole(path + ".1"), "one\ntwo two\n");
  write_line("three\n");
  EXPECT_EQ(*store::ReadWhole(path), "three\n");
  write_line("four\n");
  EXPECT_EQ(*store::ReadWhole(path + ".1"), "three\nfour\n");
  EXPECT_EQ((*log)->descriptor(), descriptor);
  struct stat about {};
  ASSERT_EQ(stat(path.c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777U, 0600U);
  // The next server goes on with it.
  write_line("five\n");
  EXPECT_TRUE(LogFile::Open(path, 10).ok());
  EXPECT_EQ(*store::ReadWhole(path), "five\n");
}

}  // namespace
}  // namespace vantage::field
