#include "core/confinement/confine.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "core/confinement/sanitized.h"
#include "core/confinement/system_calls.h"

namespace vantage::confinement {
namespace {

absl::Status Missing(const char* what) {
  return absl::FailedPreconditionError(absl::StrCat(what, ": ", std::strerror(errno)));
}

absl::Status Limit(__rlimit_resource_t resource, uint64_t soft, uint64_t hard, const char* what) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0) return Missing(what);
  // A limit that is there already stays where it is the lower one.
  limit.rlim_max = std::min<rlim_t>(limit.rlim_max, hard);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, soft);
  return setrlimit(resource, &limit) == 0 ? absl::OkStatus() : Missing(what);
}

// Address space that the program and its libraries take, bytes; 0: not known.
uint64_t OwnAddressSpace() {
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  char text[64] = {};
  const ssize_t got = read(file, text, sizeof(text) - 1);
  close(file);
  unsigned long pages = 0;
  if (got <= 0 || std::sscanf(text, "%lu", &pages) != 1) return 0;
  return pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

void BeFirstToGo() {
  const int file = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (file < 0) return;
  [[maybe_unused]] const ssize_t put = write(file, "1000", 4);
  close(file);
}

// Those that root has, and those that the namespace has given.
void GiveUpCapabilities() {
  __user_cap_header_struct header = {_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, 2> none{};
  syscall(SYS_capset, &header, none.data());
}

// What there is no header of where the kernel's are older than the kernel.
struct LandlockRules {
  uint64_t files = 0;     // since version 1
  uint64_t networks = 0;  // since version 4
  uint64_t scopes = 0;    // since version 6: abstract sockets and signals
};

// No file by its name, no network, whatever the version knows of them.
void LockLand() {
  constexpr long kCreate = 444;
  constexpr long kRestrict = 446;
  const long version = syscall(kCreate, nullptr, 0, 1);
  if (version < 1) return;
  LandlockRules rules;
  const int file_rights = version >= 5 ? 16 : version >= 3 ? 15 : version == 2 ? 14 : 13;
  rules.files = (uint64_t{1} << file_rights) - 1;
  if (version >= 4) rules.networks = 3;
  if (version >= 6) rules.scopes = 3;
  const size_t size = version >= 6 ? 24 : version >= 4 ? 16 : 8;
  const long ruleset = syscall(kCreate, &rules, size, 0);
  if (ruleset < 0) return;
  syscall(kRestrict, ruleset, 0);
  close(static_cast<int>(ruleset));
}

}  // namespace

absl::Status Confine(const Bounds& bounds) {
  if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return Missing("ending with its parent");
  if (getppid() != bounds.parent) _exit(1);  // which went in between
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return Missing("no_new_privs");
  const uint64_t own = OwnAddressSpace();
  if (own == 0) {
    return absl::FailedPreconditionError("memory: /proc/self/statm cannot be read; mount /proc");
  }
  BeFirstToGo();
  // Where the first is not to be had, none of the others is.
  unshare(CLONE_NEWUSER | CLONE_NEWNET | CLONE_NEWIPC | CLONE_NEWUTS | CLONE_NEWNS);
  LockLand();
  GiveUpCapabilities();
  // After the namespaces, which set it anew.
  if (prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) != 0) return Missing("no look from outside");
  for (const absl::Status& limited :
       {Limit(RLIMIT_CORE, 0, 0, "no core dumps"),
        Limit(RLIMIT_CPU, bounds.cpu_seconds, bounds.cpu_seconds + 5, "processor time"),
        kSanitized
            ? absl::OkStatus()
            : Limit(RLIMIT_AS, own + bounds.memory_bytes, own + bounds.memory_bytes, "memory")}) {
    if (!limited.ok()) return limited;
  }
  Limit(RLIMIT_FSIZE, 0, 0, "files").IgnoreError();
  Limit(RLIMIT_NPROC, 0, 0, "processes").IgnoreError();
  if (!kSanitized) Limit(RLIMIT_NOFILE, 0, 0, "descriptors").IgnoreError();
  return LeaveFewSystemCalls();
}

}  // namespace vantage::confinement
