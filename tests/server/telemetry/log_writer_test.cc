// Readers of the log that stall, die or come back: work never waits, and what was lost is counted.
#include "server/telemetry/log_writer.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace vantage::telemetry {
namespace {

double SecondsOf(const std::function<void()>& work) {
  const auto started = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
}

bool IsNoteOfLoss(const std::string& line) {
  return absl::StrContains(line, "log lines were lost");
}

class LogWriterTest : public testing::TestWithParam<bool> {
 protected:
  LogWriterTest() {
    std::signal(SIGPIPE, SIG_IGN);
    int ends[2];
    // journald reads a socket, containers a pipe.
    const int made = GetParam() ? socketpair(AF_UNIX, SOCK_STREAM, 0, ends) : pipe(ends);
    EXPECT_EQ(made, 0);
    read_ = ends[0];
    write_ = ends[1];
  }
  // The end that is written to stays open: a thread that was left behind may still use it.
  ~LogWriterTest() override { CloseReader(); }

  void CloseReader() {
    if (read_ >= 0) close(read_);
    read_ = -1;
  }

  // All lines, once they are `enough`; those that came after 20 s, if they never are.
  std::vector<std::string> ReadLines(
      const std::function<bool(const std::vector<std::string>& lines)>& enough) const {
    std::string text;
    char bytes[65536];
    fcntl(read_, F_SETFL, O_NONBLOCK);
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < until) {
      const ssize_t got = read(read_, bytes, sizeof bytes);
      if (got > 0) {
        text.append(bytes, static_cast<size_t>(got));
        continue;
      }
      if (absl::EndsWith(text, "\n") && enough(LinesOf(text))) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(text.empty() || absl::EndsWith(text, "\n"));
    return LinesOf(text);
  }

  static std::vector<std::string> LinesOf(const std::string& text) {
    std::vector<std::string> lines = absl::StrSplit(text, '\n');
    lines.pop_back();
    return lines;
  }

  int read_ = -1;
  int write_ = -1;
};

INSTANTIATE_TEST_SUITE_P(PipeAndSocket, LogWriterTest, testing::Bool());

void ExpectNumbersInOrder(const std::vector<std::string>& lines, int count) {
  ASSERT_EQ(lines.size(), count);
  for (int i = 0; i < count; ++i) EXPECT_EQ(lines[i], absl::StrCat(i));
}

TEST_P(LogWriterTest, WhatIsWrittenIsReadInOrder) {
  LogWriter writer(write_);
  for (int i = 0; i < 300; ++i) writer.Write(absl::StrCat(i));
  ExpectNumbersInOrder(ReadLines([](const auto& lines) { return lines.size() >= 300; }), 300);
  EXPECT_EQ(writer.lost(), 0);
}

TEST_P(LogWriterTest, TheEndWaitsForWhatIsStillToBeWritten) {
  // On a busy machine the thread may come to nothing within the patience that the end has.
  const double seconds = SecondsOf([&] {
    LogWriter writer(write_);
    for (int i = 0; i < 300; ++i) writer.Write(absl::StrCat(i));
  });
  if (seconds >= std::chrono::duration<double>(LogWriter::kPatience).count()) {
    GTEST_SKIP() << "the thread that writes had no turn within " << seconds << " s";
  }
  ExpectNumbersInOrder(ReadLines([](const auto&) { return true; }), 300);
}

TEST_P(LogWriterTest, AReaderThatStallsStopsNobodyAndLosesWhatHasNoRoom) {
  constexpr int kLines = 100'000;
  const std::string filling(100, 'x');
  LogWriter writer(write_, 1 << 20);
  EXPECT_LT(SecondsOf([&] {
              for (int i = 0; i < kLines; ++i) writer.Write(absl::StrCat(i, " ", filling));
            }),
            5);
  EXPECT_GT(writer.lost(), 0);
  EXPECT_LT(writer.lost(), kLines - 9'000);  // a mebibyte of them waits
  // It goes on: lines come whole and in order, and the number of those that are missing.
  int64_t said = 0;
  int64_t whole = 0;
  int64_t last = -1;
  const auto all_told = [&](const std::vector<std::string>& lines) {
    const auto notes = std::count_if(lines.begin(), lines.end(), IsNoteOfLoss);
    return static_cast<int64_t>(lines.size()) - notes + writer.lost() == kLines;
  };
  for (const std::string& line : ReadLines(all_told)) {
    if (IsNoteOfLoss(line)) {
      int64_t count = 0;
      ASSERT_TRUE(absl::SimpleAtoi(
          line.substr(line.rfind(':') + 1, line.size() - line.rfind(':') - 2), &count))
          << line;
      said += count;
    } else {
      int64_t number = 0;
      ASSERT_TRUE(absl::EndsWith(line, absl::StrCat(" ", filling))) << line;
      ASSERT_TRUE(absl::SimpleAtoi(line.substr(0, line.find(' ')), &number)) << line;
      EXPECT_GT(number, last);
      last = number;
      ++whole;
    }
  }
  EXPECT_EQ(said, writer.lost());
  EXPECT_EQ(whole + writer.lost(), kLines);
}

TEST_P(LogWriterTest, AReaderThatDiesEndsNothing) {
  LogWriter writer(write_);
  writer.Write("read by nobody");
  CloseReader();
  for (int i = 0; i < 1000; ++i) writer.Write("nor this");
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (writer.lost() < 1000 && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GE(writer.lost(), 1000);
}

TEST_P(LogWriterTest, TheEndDoesNotWaitForAReaderThatStalls) {
  EXPECT_LT(SecondsOf([&] {
              LogWriter writer(write_);
              for (int i = 0; i < 30'000; ++i) writer.Write(std::string(100, 'x'));
            }),
            2);
}

}  // namespace
}  // namespace vantage::telemetry
