#include "tests/core/confinement/hidden_readers.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/confinement/answer.h"
#include "core/confinement/child.h"
#include "core/confinement/reader.h"

namespace vantage::confinement {
namespace {

// What is not to be optimised away.
volatile uint64_t sink = 0;

[[noreturn]] void ComputeForEver() {
  while (true) sink = sink + 1;
}

void Raw(const void* bytes, size_t size) { sink = static_cast<uint64_t>(write(1, bytes, size)); }
void RawFrame(uint32_t kind, uint32_t size) {
  const std::array<uint32_t, 2> header = {kind, size};
  Raw(header.data(), sizeof(header));
}

void Overflow(int depth) {
  volatile char frame[4096];
  frame[0] = static_cast<char>(depth);
  if (depth < 1'000'000) Overflow(depth + 1);
  sink = sink + static_cast<uint64_t>(frame[0]);
}

// The number of descriptors that can be read from, of those beside the file.
int OpenDescriptors() {
  int open_ones = 0;
  for (int descriptor = 4; descriptor < 256; ++descriptor) {
    open_ones += read(descriptor, nullptr, 0) == 0 || errno != EBADF ? 1 : 0;
  }
  return open_ones;
}

using Deed = void (*)(Asker& asker);

const std::map<std::string, Deed>& Deeds() {
  static const std::map<std::string, Deed> deeds = {
      // What goes well.
      {"echo",
       [](Asker& asker) {
         std::string bytes(static_cast<size_t>(asker.file_bytes()), '\0');
         const ssize_t got = pread(asker.file(), bytes.data(), bytes.size(), 0);
         asker.Reached(static_cast<uint64_t>(got));
         asker.Say(bytes);
         asker.End(absl::OkStatus());
       }},
      {"refuse",
       [](Asker& asker) {
         asker.Say("begun");
         asker.End(absl::DataLossError("line 7:\033[2J what is that?"));
       }},
      {"try again", [](Asker& asker) { asker.End(absl::UnavailableError("later")); }},
      {"surroundings",
       [](Asker& asker) {
         for (char** variable = environ; variable != nullptr && *variable != nullptr; ++variable) {
           asker.Say(absl::StrCat(*variable, ", "));
         }
         asker.Say(absl::StrCat(OpenDescriptors(), " descriptors"));
         asker.End(absl::OkStatus());
       }},
      // Crashes.
      {"crash",
       [](Asker&) {
         volatile int* nowhere = nullptr;
         *nowhere = 1;  // NOLINT
       }},
      {"abort", [](Asker&) { std::abort(); }},
      {"overflow", [](Asker&) { Overflow(0); }},
      {"exit", [](Asker&) { _exit(0); }},
      {"exception", [](Asker&) { throw 1; }},
      {"killed", [](Asker&) { syscall(SYS_tgkill, getpid(), getpid(), SIGKILL); }},
      // Without end.
      {"hang", [](Asker&) { ComputeForEver(); }},
      {"wait", [](Asker& asker) { asker.Next(); }},
      {"allocate",
       [](Asker&) {
         std::vector<std::vector<char>> all;
         while (true) all.emplace_back(1 << 20, 'x');
       }},
      {"allocate at once",
       [](Asker&) {
         const std::vector<char> all(size_t{1} << 40);
         sink = static_cast<uint64_t>(all[0]);
       }},
      {"progress",
       [](Asker& asker) {
         while (true) asker.Reached(1);
       }},
      {"parts",
       [](Asker& asker) {
         const std::string piece(1 << 20, 'x');
         while (true) asker.Say(piece);
       }},
      // What no reader may.
      {"socket", [](Asker&) { socket(AF_INET, SOCK_STREAM, 0); }},
      {"local socket", [](Asker&) { socket(AF_UNIX, SOCK_STREAM, 0); }},
      {"write file", [](Asker&) { open("/tmp/vantage_hidden_reader", O_WRONLY | O_CREAT, 0600); }},
      {"read file",
       [](Asker& asker) {
         asker.Say(absl::StrCat(open("/etc/passwd", O_RDONLY)));
         asker.End(absl::OkStatus());
       }},
      {"remove", [](Asker&) { unlink("/tmp/vantage_hidden_reader"); }},
      {"fork", [](Asker&) { syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0); }},
      {"execute",
       [](Asker&) {
         char name[] = "/bin/true";
         char* const arguments[] = {name, nullptr};
         execve(name, arguments, nullptr);
       }},
      {"kill parent", [](Asker&) { kill(getppid(), SIGTERM); }},
      {"raise limits",
       [](Asker& asker) {
         const rlimit more = {RLIM_INFINITY, RLIM_INFINITY};
         asker.Say(absl::StrCat(setrlimit(RLIMIT_AS, &more)));
         asker.End(absl::OkStatus());
       }},
      {"code",
       [](Asker&) {
         mmap(nullptr, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1,
              0);
       }},
      // Answers without sense.
      {"rubbish",
       [](Asker&) {
         const std::string bytes(4096, '\xa5');
         Raw(bytes.data(), bytes.size());
         ComputeForEver();
       }},
      {"huge frame", [](Asker&) { RawFrame(2, 0xffffffff); }},
      {"second start", [](Asker&) { RawFrame(0, 0); }},
      {"two answers",
       [](Asker& asker) {
         asker.Say("one");
         asker.Say("two");
         asker.End(absl::OkStatus());
       }},
      {"short answer",
       [](Asker& asker) {
         asker.Say("on");
         asker.End(absl::OkStatus());
       }},
      {"half a frame",
       [](Asker&) {
         RawFrame(2, 100);
         Raw("ha", 2);
         _exit(0);
       }},
      {"close",
       [](Asker&) {
         close(1);
         ComputeForEver();
       }},
      {"close both",
       [](Asker&) {
         close(0);
         close(1);
         ComputeForEver();
       }},
  };
  return deeds;
}

void DoAsAsked(Asker& asker) {
  while (const std::optional<std::string> deed = asker.Next()) Deeds().at (*deed)(asker);
}

Allowance Plenty() {
  Allowance allowance;
  allowance.memory_bytes = 100'000'000;
  allowance.seconds = 60;
  return allowance;
}

int Hold() {
  absl::StatusOr<Child> child = Child::Start(kHiddenReader, STDIN_FILENO, Plenty());
  if (!child.ok()) return 1;
  std::printf("%d\n", child->pid());
  std::fflush(stdout);
  (void)child->Ask("hang", {}, [](Answer& answer) {
    char byte = 0;
    return answer.Read(&byte, 1);
  });
  return 1;
}

// Takes a call away from this process and those it starts: it fails with EPERM, or, of "execute",
// /proc/self/exe cannot be executed.
int Without(const std::string& call) {
  static const std::map<std::string, int> numbers = {{"seccomp", SYS_seccomp},
                                                     {"unshare", SYS_unshare},
                                                     {"landlock", 444},
                                                     {"prctl", SYS_prctl},
                                                     {"execve", SYS_execve}};
  std::array<sock_filter, 4> steps = {
      sock_filter{BPF_LD | BPF_W | BPF_ABS, 0, 0, offsetof(seccomp_data, nr)},
      sock_filter{BPF_JMP | BPF_JEQ | BPF_K, 0, 1, static_cast<uint32_t>(numbers.at(call))},
      sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ERRNO | EPERM},
      sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW}};
  const sock_fprog program = {steps.size(), steps.data()};
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0) return 1;
  absl::StatusOr<Child> child = Child::Start(kHiddenReader, STDIN_FILENO, Plenty());
  const absl::Status asked =
      !child.ok() ? child.status() : child->Ask("surroundings", {}, [](Answer& answer) {
        char text[37];
        absl::Status read = answer.Read(text, sizeof(text));
        if (read.ok()) std::printf("%.37s", text);
        return read;
      });
  if (!asked.ok()) std::printf("%s", asked.ToString().c_str());
  std::fflush(stdout);
  return 0;
}

}  // namespace
}  // namespace vantage::confinement

int main(int argc, char** argv) {
  using namespace vantage::confinement;  // NOLINT
  RunIfReader(argc, argv, {{kHiddenReader, DoAsAsked}});
  if (argc > 1 && std::strcmp(argv[1], kHold) == 0) return Hold();
  if (argc > 2 && std::strcmp(argv[1], kWithout) == 0) return Without(argv[2]);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
