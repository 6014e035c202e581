#include "core/confinement/system_calls.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/confinement/sanitized.h"

namespace vantage::confinement {
namespace {

#if defined(__x86_64__)
constexpr uint32_t kMachine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr uint32_t kMachine = AUDIT_ARCH_AARCH64;
#else
constexpr uint32_t kMachine = 0;
#endif

// Numbers from here on are those of another table of x86-64 (x32).
constexpr uint32_t kOtherTable = 0x40000000;

// A program of the kernel's packet filter, which sees the number of a call and its arguments.
class Filter {
 public:
  Filter() {
    Load(offsetof(seccomp_data, arch));
    Unless(BPF_JEQ, kMachine, SECCOMP_RET_KILL_PROCESS);
    Load(offsetof(seccomp_data, nr));
    If(BPF_JGE, kOtherTable, SECCOMP_RET_KILL_PROCESS);
  }

  void Allow(long call) { If(BPF_JEQ, static_cast<uint32_t>(call), SECCOMP_RET_ALLOW); }
  void Refuse(long call) { If(BPF_JEQ, static_cast<uint32_t>(call), SECCOMP_RET_ERRNO | EPERM); }

  // Allows a call by the lower halves of its arguments, which hold all that is asked about here.
  struct Test {
    int argument;
    uint16_t comparison;  // BPF_JEQ, BPF_JGT, or BPF_JSET: one of the bits
    uint32_t value;
    bool wanted;
  };
  void AllowWhere(long call, const std::vector<Test>& tests) {
    // What follows is skipped by other calls: the tests, two steps each and what they load, then
    // the two ways to end.
    const size_t skip = 3 * tests.size() + 1;
    Step(BPF_JMP | BPF_JEQ | BPF_K, static_cast<uint32_t>(call), 0, static_cast<uint8_t>(skip));
    for (const Test& test : tests) {
      Load(offsetof(seccomp_data, args) + sizeof(uint64_t) * static_cast<size_t>(test.argument));
      if (test.wanted) {
        Unless(test.comparison, test.value, SECCOMP_RET_KILL_PROCESS);
      } else {
        If(test.comparison, test.value, SECCOMP_RET_KILL_PROCESS);
      }
    }
    Return(SECCOMP_RET_ALLOW);
  }

  std::vector<sock_filter> Finish() && {
    Return(SECCOMP_RET_KILL_PROCESS);
    return std::move(steps_);
  }

 private:
  void Step(int code, uint32_t value, uint8_t if_true = 0, uint8_t if_false = 0) {
    steps_.push_back({static_cast<uint16_t>(code), if_true, if_false, value});
  }
  void Load(size_t offset) { Step(BPF_LD | BPF_W | BPF_ABS, static_cast<uint32_t>(offset)); }
  void Return(uint32_t what) { Step(BPF_RET | BPF_K, what); }
  void If(uint16_t comparison, uint32_t value, uint32_t what) {
    Step(BPF_JMP | comparison | BPF_K, value, 0, 1);
    Return(what);
  }
  void Unless(uint16_t comparison, uint32_t value, uint32_t what) {
    Step(BPF_JMP | comparison | BPF_K, value, 1, 0);
    Return(what);
  }

  std::vector<sock_filter> steps_;
};

std::vector<sock_filter> FewCalls() {
  Filter filter;
  for (const long call : {SYS_read,         SYS_pread64,      SYS_close,
                          SYS_munmap,       SYS_mremap,       SYS_brk,
                          SYS_madvise,      SYS_futex,        SYS_clock_gettime,
                          SYS_gettimeofday, SYS_getrandom,    SYS_exit,
                          SYS_exit_group,   SYS_rt_sigreturn, SYS_rt_sigprocmask,
                          SYS_rt_sigaction, SYS_sched_yield,  SYS_restart_syscall,
                          SYS_getpid,       SYS_gettid}) {
    filter.Allow(call);
  }
  // What a thread begins with: one that a library started when it was loaded may not have come so
  // far yet.
  for (const long call : {SYS_rseq, SYS_set_robust_list}) filter.Allow(call);
  for (const long call : {SYS_sysinfo, SYS_sched_getaffinity, SYS_prlimit64, SYS_uname, SYS_ioctl,
                          SYS_lseek, SYS_fcntl, SYS_fstat, SYS_newfstatat, SYS_getcwd}) {
    filter.Refuse(call);
  }
  const Filter::Test no_code = {2, BPF_JSET, PROT_EXEC, false};
  filter.AllowWhere(SYS_mprotect, {no_code});
  // abort() sends the signal to itself.
  filter.AllowWhere(SYS_tgkill, {{0, BPF_JEQ, static_cast<uint32_t>(getpid()), true}});
  if (kSanitized) {
    // A report needs to find out what lies where.
    filter.AllowWhere(SYS_mmap, {no_code});
    filter.AllowWhere(SYS_openat, {{2, BPF_JSET, O_WRONLY | O_RDWR | O_CREAT | O_TRUNC, false}});
    filter.Allow(SYS_readlinkat);
    filter.Allow(SYS_sigaltstack);
    // What type an object has is looked up where it can be read, which a pipe tells.
    for (const long call : {SYS_pipe2, SYS_write, SYS_writev}) filter.Allow(call);
  } else {
    for (const long call : {SYS_write, SYS_writev}) {
      filter.AllowWhere(call, {{0, BPF_JGT, STDERR_FILENO, false}});
    }
    filter.AllowWhere(SYS_mmap, {no_code, {3, BPF_JSET, MAP_ANONYMOUS, true}});
  }
  return std::move(filter).Finish();
}

}  // namespace

absl::Status LeaveFewSystemCalls() {
  if (kMachine == 0) {
    return absl::FailedPreconditionError("readers are confined on x86-64 and 64-bit Arm only");
  }
  std::vector<sock_filter> steps = FewCalls();
  const sock_fprog program = {static_cast<uint16_t>(steps.size()), steps.data()};
  // A sanitizer's own thread needs more; there is no other.
  const unsigned flags = kSanitized ? 0 : SECCOMP_FILTER_FLAG_TSYNC;
  if (syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, flags, &program) != 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("system calls cannot be taken away (seccomp: ", std::strerror(errno),
                     "); a kernel with CONFIG_SECCOMP_FILTER is needed, and a container that "
                     "leaves seccomp to its processes"));
  }
  return absl::OkStatus();
}

}  // namespace vantage::confinement
