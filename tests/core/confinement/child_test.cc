#include "core/confinement/child.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/confinement/descriptor.h"
#include "core/confinement/sanitized.h"
#include "tests/core/confinement/hidden_readers.h"

namespace vantage::confinement {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;
constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;

class ChildTest : public testing::Test {
 protected:
  ChildTest()
      : path_(testing::TempDir() + "/child_test_" + std::to_string(getpid())),
        file_(
            (std::ofstream(path_) << "what is in it", open(path_.c_str(), O_RDONLY | O_CLOEXEC))) {
    allowance_.memory_bytes = 100'000'000;
    allowance_.seconds = 30;
    allowance_.memory_option = "--more-memory";
    allowance_.seconds_option = "--more-seconds";
  }
  ~ChildTest() override { std::filesystem::remove(path_); }

  absl::StatusOr<Child> Started() { return Child::Start(kHiddenReader, file_.get(), allowance_); }
  // Of an answer of three bytes, unless another length is said.
  absl::Status Ask(Child& child, const std::string& deed, size_t size = 3) {
    answer_.assign(size, '\0');
    return child.Ask(
        deed, [this](uint64_t position) { reached_ = position; },
        [this](Answer& answer) { return answer.Read(answer_.data(), answer_.size()); });
  }
  absl::Status Ask(const std::string& deed, size_t size = 3) {
    absl::StatusOr<Child> child = Started();
    if (!child.ok()) return child.status();
    absl::Status asked = Ask(*child, deed, size);
    alive_ = child->alive();
    return asked;
  }
  // The error of a reader that is gone after it.
  void ExpectLost(const std::string& deed, const testing::Matcher<std::string>& message,
                  absl::StatusCode code = kInvalid) {
    const absl::Status status = Ask(deed);
    EXPECT_EQ(status.code(), code) << deed << ": " << status;
    EXPECT_THAT(std::string(status.message()), AllOf(StartsWith("its reader "), message)) << deed;
    EXPECT_FALSE(alive_) << deed;
  }

  std::string path_;
  Descriptor file_;
  Allowance allowance_;
  std::string answer_;
  uint64_t reached_ = 0;
  bool alive_ = false;
};

TEST_F(ChildTest, ReadsWhatItIsHandedAndAnswersAgainAndAgain) {
  absl::StatusOr<Child> child = Started();
  ASSERT_TRUE(child.ok()) << child.status();
  for (int times = 0; times < 3; ++times) {
    const absl::Status asked = Ask(*child, "echo", 13);
    EXPECT_TRUE(asked.ok()) << asked;
    EXPECT_EQ(answer_, "what is in it");
    EXPECT_EQ(std::exchange(reached_, 0), 13u);
  }
  // What it says of the file, in its words, but with nothing that a terminal would obey; it goes
  // on.
  const absl::Status refused = Ask(*child, "refuse", 100);
  EXPECT_EQ(refused, absl::DataLossError("line 7:?[2J what is that?"));
  EXPECT_TRUE(Ask(*child, "echo", 13).ok());
  // Nothing makes a caller try again for ever.
  EXPECT_EQ(Ask(*child, "try again"), absl::InvalidArgumentError("later"));
}

TEST_F(ChildTest, HasNothingOfItsParentsEnvironmentAndFiles) {
  const Descriptor other(open("/dev/null", O_RDWR));  // not closed by executing
  if (kSanitized) GTEST_SKIP() << "a sanitizer has options";
  const absl::Status asked = Ask("surroundings", 37);
  EXPECT_TRUE(asked.ok()) << asked;
  EXPECT_EQ(answer_, "OPENBLAS_NUM_THREADS=1, 0 descriptors");
}

TEST_F(ChildTest, ACrashIsAnError) {
  ExpectLost("crash", HasSubstr("signal 11 (Segmentation fault): the file is damaged"));
  ExpectLost("overflow", HasSubstr("signal 11"));
  ExpectLost("abort", HasSubstr("signal 6 (Aborted)"));
  ExpectLost("exception", HasSubstr("signal 6"));
  ExpectLost("exit", HasSubstr("ended in the middle of its answer"));
  ExpectLost("killed", HasSubstr("ended from outside with signal 9"),
             absl::StatusCode::kFailedPrecondition);
}

TEST_F(ChildTest, TimeIsBounded) {
  allowance_.seconds = 1;
  const auto start = std::chrono::steady_clock::now();
  for (const char* deed : {"hang", "progress"}) {
    ExpectLost(deed, AllOf(HasSubstr("longer than 1 s"), HasSubstr("--more-seconds")));
  }
  allowance_.seconds = 60;
  allowance_.stall_seconds = 0.5;
  ExpectLost("wait", HasSubstr("did nothing for"));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST_F(ChildTest, MemoryIsBounded) {
  allowance_.memory_bytes = 50'000'000;
  const auto message = AllOf(HasSubstr("more than 50 MB of memory"), HasSubstr("--more-memory"));
  ExpectLost("allocate", message);
  if (!kSanitized) ExpectLost("allocate at once", message);
  // What it sends is bounded likewise, whoever reads it.
  absl::StatusOr<Child> child = Started();
  ASSERT_TRUE(child.ok()) << child.status();
  uint64_t taken = 0;
  const absl::Status asked = child->Ask("parts", {}, [&](Answer& answer) {
    std::string piece(1000, '\0');
    while (true) {
      if (absl::Status read = answer.Read(piece.data(), piece.size()); !read.ok()) return read;
      taken += piece.size();
    }
  });
  EXPECT_THAT(std::string(asked.message()), HasSubstr("more bytes than are allowed"));
  EXPECT_LE(taken, allowance_.memory_bytes);
}

TEST_F(ChildTest, WhatNoReaderMayEndsIt) {
  std::filesystem::remove("/tmp/vantage_hidden_reader");
  for (const char* deed : {"socket", "local socket", "write file", "remove", "fork", "execute",
                           "kill parent", "code"}) {
    ExpectLost(deed, HasSubstr("signal 31 (Bad system call)"));
  }
  EXPECT_FALSE(std::filesystem::exists("/tmp/vantage_hidden_reader"));
  // A sanitizer's report may look into files; Landlock, where there is one, leaves it none.
  if (!kSanitized) ExpectLost("read file", HasSubstr("signal 31"));
  const absl::Status raised = Ask("raise limits", 2);
  EXPECT_TRUE(raised.ok()) << raised;
  EXPECT_EQ(answer_, "-1");
}

TEST_F(ChildTest, AnAnswerWithoutSenseIsAnError) {
  for (const char* deed :
       {"rubbish", "huge frame", "second start", "two answers", "short answer"}) {
    ExpectLost(deed, AllOf(HasSubstr("without sense"), HasSubstr("an attack")));
  }
  ExpectLost("half a frame", HasSubstr("ended in the middle of its answer"));
  ExpectLost("close", HasSubstr("fell silent"));
  ExpectLost("close both", HasSubstr("fell silent"));
}

TEST_F(ChildTest, EndsWithItsObject) {
  pid_t pid = 0;
  {
    absl::StatusOr<Child> child = Started();
    ASSERT_TRUE(child.ok()) << child.status();
    pid = child->pid();
    EXPECT_EQ(kill(pid, 0), 0);
  }
  EXPECT_EQ(kill(pid, 0), -1);
  EXPECT_EQ(errno, ESRCH);
}

// What this program prints, executed with other arguments.
std::string OutputOf(const std::string& arguments) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  FILE* out = popen(("exec " + self + " " + arguments + " </dev/null").c_str(), "re");
  std::string text;
  for (int c = std::fgetc(out); c != EOF; c = std::fgetc(out)) text += static_cast<char>(c);
  pclose(out);
  return text;
}

TEST_F(ChildTest, EndsWithItsParent) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t holder = fork();
  if (holder == 0) {
    dup2(ends[1], STDOUT_FILENO);
    dup2(file_.get(), STDIN_FILENO);
    execl("/proc/self/exe", "holder", kHold, nullptr);
    _exit(127);
  }
  close(ends[1]);
  FILE* out = fdopen(ends[0], "r");
  int reader = 0;
  ASSERT_EQ(std::fscanf(out, "%d", &reader), 1);
  std::fclose(out);
  EXPECT_EQ(kill(reader, 0), 0);
  kill(holder, SIGKILL);
  waitpid(holder, nullptr, 0);
  // Whoever inherits it may take a moment to bury it.
  const auto gone = [&] {
    std::string state;
    std::ifstream stat("/proc/" + std::to_string(reader) + "/stat");
    return !(stat >> state >> state >> state) || state == "Z" || kill(reader, 0) != 0;
  };
  for (int i = 0; i < 1000 && !gone(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(gone());
}

TEST_F(ChildTest, WhatIsRequiredAndMissingIsSaidAndNothingIsRead) {
  EXPECT_THAT(OutputOf("--without seccomp"),
              AllOf(StartsWith("FAILED_PRECONDITION: its reader cannot be confined"),
                    HasSubstr("CONFIG_SECCOMP_FILTER")));
  EXPECT_THAT(OutputOf("--without prctl"),
              StartsWith("FAILED_PRECONDITION: its reader cannot be confined"));
  EXPECT_THAT(OutputOf("--without execve"),
              AllOf(StartsWith("FAILED_PRECONDITION: its reader cannot be started"),
                    HasSubstr("/proc/self/exe")));
}

TEST_F(ChildTest, WhatComesOnTopMayBeMissing) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer has an environment";
  EXPECT_EQ(OutputOf("--without unshare"), "OPENBLAS_NUM_THREADS=1, 0 descriptors");
  EXPECT_EQ(OutputOf("--without landlock"), "OPENBLAS_NUM_THREADS=1, 0 descriptors");
}

TEST_F(ChildTest, AReaderThatIsNotThereDoesNotStart) {
  const auto start = std::chrono::steady_clock::now();
  const absl::Status status = Child::Start("nobody", file_.get(), allowance_).status();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("did not start (exit code 2)"));
}

}  // namespace
}  // namespace vantage::confinement
