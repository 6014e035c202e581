#include "core/confinement/system_calls.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "core/confinement/sanitized.h"

namespace vantage::confinement {
namespace {

// Libraries start threads of their own when they are loaded, OpenBLAS for one. Such a thread may
// not have begun yet when the calls are taken away, and what it begins with ends nobody.
TEST(LeaveFewSystemCalls, ThreadsThatHaveNotBegunYetBegin) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's threads need more";
  for (int i = 0; i < 200; ++i) {
    const pid_t child = fork();
    if (child == 0) {
      std::thread other([] {});
      const bool confined = LeaveFewSystemCalls().ok();
      other.join();
      _exit(confined ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status) << ", try " << i;
    ASSERT_EQ(WEXITSTATUS(status), 0);
  }
}

}  // namespace
}  // namespace vantage::confinement
