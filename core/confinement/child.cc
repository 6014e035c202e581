#include "core/confinement/child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <optional>
#include <thread>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/confinement/descriptor.h"
#include "core/confinement/sanitized.h"
#include "core/confinement/start.h"

namespace vantage::confinement {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

// How often somebody looks after it while it says nothing, ms; sanitizers bound its memory so.
constexpr int kLook = kSanitized ? 20 : 100;
// More than this at a time is not waiting for the reader: the machine slept, or a person had
// stopped both, s.
constexpr double kLongestLook = 2;
// Between the end of its answers and its own, s.
constexpr double kGrace = 1;
constexpr int kPipeBytes = 1 << 20;

// The same, by a number that is none of those a reader has.
Descriptor Apart(int descriptor) { return Descriptor(fcntl(descriptor, F_DUPFD_CLOEXEC, 10)); }

absl::Status CannotStart(int error, absl::string_view what) {
  return absl::FailedPreconditionError(
      absl::StrCat("its reader cannot be started, and no file is read without one (", what, ": ",
                   std::strerror(error), ")"));
}

struct Ends {
  Descriptor ours;
  Descriptor readers;
};

absl::StatusOr<Ends> QuestionsSocket() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    return CannotStart(errno, "socketpair");
  }
  const Descriptor first(ends[0]);
  const Descriptor second(ends[1]);
  return Ends{Apart(first.get()), Apart(second.get())};
}

absl::StatusOr<Ends> AnswersPipe() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return CannotStart(errno, "pipe2");
  const Descriptor first(ends[0]);
  const Descriptor second(ends[1]);
  fcntl(ends[0], F_SETPIPE_SZ, kPipeBytes);  // in fewer turns, where it is granted
  return Ends{Apart(first.get()), Apart(second.get())};
}

// Nothing of the caller's environment. OpenBLAS, where that is the machine's BLAS, starts threads
// as soon as it is loaded, which make calls that no reader may; with one it starts none. Of a
// sanitizer, that a crash is one.
std::vector<std::string> Environment() {
  const std::string one_thread = "OPENBLAS_NUM_THREADS=1";
  if (!kSanitized) return {one_thread};
  constexpr char kOptions[] =
      "handle_segv=0:handle_sigbus=0:handle_sigfpe=0:handle_sigill=0:handle_abort=0:"
      "detect_leaks=0:abort_on_error=1:symbolize=0";
  return {absl::StrCat("ASAN_OPTIONS=", kOptions), absl::StrCat("TSAN_OPTIONS=", kOptions),
          absl::StrCat("UBSAN_OPTIONS=", kOptions), one_thread};
}

std::vector<char*> Pointers(std::vector<std::string>& strings) {
  std::vector<char*> pointers;
  pointers.reserve(strings.size() + 1);
  for (std::string& string : strings) pointers.push_back(string.data());
  pointers.push_back(nullptr);
  return pointers;
}

std::string Named(int signal) {
  const char* name = sigdescr_np(signal);
  return absl::StrCat("signal ", signal, name == nullptr ? "" : absl::StrCat(" (", name, ")"));
}

constexpr char kBeyond[] = "vantage/beyond-allowance";  // a payload

absl::Status Beyond(const std::string& message) {
  absl::Status status = absl::InvalidArgumentError(message);
  status.SetPayload(kBeyond, absl::Cord());
  return status;
}

constexpr char kWhy[] = "the file is damaged, or an attack";

}  // namespace

bool IsBeyondAllowance(const absl::Status& status) {
  return status.GetPayload(kBeyond).has_value();
}

absl::Status Reworded(const absl::Status& status, absl::string_view message) {
  absl::Status reworded(status.code(), message);
  status.ForEachPayload([&](absl::string_view type, const absl::Cord& payload) {
    reworded.SetPayload(type, payload);
  });
  return reworded;
}

class Child::Process {
 public:
  Process(pid_t pid, Descriptor questions, Descriptor answers)
      : pid_(pid), questions_(std::move(questions)), answers_(std::move(answers)) {}
  ~Process() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    Reap(0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }

  // False: it does not listen.
  bool Send(absl::string_view question) const {
    const auto size = static_cast<uint32_t>(question.size());
    std::string bytes(reinterpret_cast<const char*>(&size), sizeof(size));
    absl::StrAppend(&bytes, question);
    const ssize_t put =
        send(questions_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return put == static_cast<ssize_t>(bytes.size());
  }

  // As of Answer::Receive; errors that say what was too much.
  absl::StatusOr<size_t> Receive(char* to, size_t size, const Allowance& allowance) {
    Clock::time_point last = Clock::now();
    double silent = 0;
    while (true) {
      pollfd wanted = {answers_.get(), POLLIN, 0};
      const int ready = poll(&wanted, 1, kLook);
      const Clock::time_point now = Clock::now();
      const double look = std::min(Seconds(now - last).count(), kLongestLook);
      last = now;
      waited_ += look;
      if (absl::Status within = CheckBounds(allowance, now); !within.ok()) return within;
      if (ready > 0) {
        const ssize_t got = read(answers_.get(), to, size);
        if (got < 0 && errno == EINTR) continue;
        return got < 0 ? 0 : static_cast<size_t>(got);
      }
      const double used = CpuSeconds();
      silent = used > used_ ? 0 : silent + look;
      used_ = used;
      if (silent > allowance.stall_seconds) {
        return absl::InvalidArgumentError(absl::StrFormat(
            "its reader did nothing for %.0f s and was ended: it waits for a disk or a network "
            "that does not answer, or %s",
            allowance.stall_seconds, kWhy));
      }
    }
  }

  // How it ended, as of waitpid(), within some seconds; nothing where it goes on.
  std::optional<int> AwaitEnd(double seconds) {
    const Clock::time_point end =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(seconds));
    while (true) {
      if (const std::optional<int> how = Reap(WNOHANG)) return how;
      if (Clock::now() > end) return std::nullopt;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

 private:
  std::optional<int> Reap(int flags) {
    int how = 0;
    pid_t got = 0;
    do {
      got = waitpid(pid_, &how, flags);
    } while (got < 0 && errno == EINTR);
    if (got == 0) return std::nullopt;
    pid_ = -1;
    // Somebody else has waited for it, or nobody may (SIGCHLD is ignored).
    return got < 0 ? 0 : how;
  }

  absl::Status CheckBounds(const Allowance& allowance, Clock::time_point now) {
    if (allowance.given_up && allowance.given_up()) {
      return absl::CancelledError("its reader was given up");
    }
    if (waited_ > 2 * allowance.seconds) return OverTime(allowance);
    if (!kSanitized || Seconds(now - measured_).count() * 1e3 < kLook) return absl::OkStatus();
    measured_ = now;
    uint64_t pages = 0;
    uint64_t resident = 0;
    std::ifstream(absl::StrCat("/proc/", pid_, "/statm")) >> pages >> resident;
    resident *= static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
    if (!own_bytes_) own_bytes_ = resident;
    return resident > *own_bytes_ + allowance.memory_bytes ? OverMemory(allowance)
                                                           : absl::OkStatus();
  }

  // Of a processor; that it had so far where it is not told any more.
  double CpuSeconds() const {
    clockid_t clock{};
    timespec used{};
    if (clock_getcpuclockid(pid_, &clock) != 0 || clock_gettime(clock, &used) != 0) return used_;
    return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  }

  pid_t pid_;
  Descriptor questions_;
  Descriptor answers_;
  double waited_ = 0;  // s, for it, in all
  double used_ = 0;    // s of a processor, when it was looked at last
  Clock::time_point measured_;
  std::optional<uint64_t> own_bytes_;  // resident when it was looked at first

 public:
  static absl::Status OverTime(const Allowance& allowance) {
    return Beyond(absl::StrFormat(
        "its reader took longer than %.0f s and was ended: %s; if it is neither, %s allows more "
        "seconds",
        allowance.seconds, kWhy, allowance.seconds_option));
  }
  static absl::Status OverMemory(const Allowance& allowance) {
    return Beyond(absl::StrFormat(
        "its reader needs more than %.0f MB of memory: %s; if it is neither, %s allows more "
        "megabytes",
        1e-6 * static_cast<double>(allowance.memory_bytes), kWhy, allowance.memory_option));
  }
};

Child::Child(std::unique_ptr<Process> process, Allowance allowance)
    : process_(std::move(process)), allowance_(std::move(allowance)) {}
Child::Child(Child&&) noexcept = default;
Child& Child::operator=(Child&&) noexcept = default;
Child::~Child() = default;

absl::StatusOr<Child> Child::Start(const char* reader, int file, const Allowance& allowance) {
  absl::StatusOr<Ends> questions = QuestionsSocket();
  if (!questions.ok()) return questions.status();
  absl::StatusOr<Ends> answers = AnswersPipe();
  if (!answers.ok()) return answers.status();
  const Descriptor handed = Apart(file);
  struct stat found {};
  if (handed.get() < 0 || questions->readers.get() < 0 || answers->readers.get() < 0 ||
      fstat(handed.get(), &found) != 0) {
    return CannotStart(errno, "descriptors");
  }
  std::vector<std::string> words = {
      "vantage: reader",
      kReaderArgument,
      reader,
      absl::StrCat(getpid()),
      absl::StrCat(allowance.memory_bytes),
      absl::StrCat(static_cast<uint64_t>(std::ceil(std::clamp(allowance.seconds, 1.0, 1e9)))),
      absl::StrCat(S_ISREG(found.st_mode) ? found.st_size : 0)};
  std::vector<std::string> environment = Environment();

  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_adddup2(&actions, questions->readers.get(), kQuestions);
  posix_spawn_file_actions_adddup2(&actions, answers->readers.get(), kAnswers);
  posix_spawn_file_actions_adddup2(&actions, handed.get(), kFile);
  if (!kSanitized) posix_spawn_file_actions_adddup2(&actions, handed.get(), STDERR_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&actions, kFile + 1);
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, "/proc/self/exe", &actions, &attributes,
                                Pointers(words).data(), Pointers(environment).data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  // From now on the reader's ends are open in the reader alone, so that its end is seen.
  questions->readers = Descriptor();
  answers->readers = Descriptor();
  if (error != 0) return CannotStart(error, "/proc/self/exe");

  Child child(std::make_unique<Process>(pid, std::move(questions->ours), std::move(answers->ours)),
              allowance);
  if (absl::Status ready = child.AwaitReady(); !ready.ok()) return ready;
  return child;
}

absl::Status Child::AwaitReady() {
  Answer answer([this](char* to, size_t size) { return process_->Receive(to, size, allowance_); },
                {}, 0);
  absl::Status ready = answer.ReadReady();
  if (ready.ok()) return ready;
  if (absl::IsCancelled(ready)) {
    process_ = nullptr;
    return ready;
  }
  if (answer.fault() == Answer::Fault::kUnconfined) {
    process_ = nullptr;
    return absl::FailedPreconditionError(absl::StrCat(
        "its reader cannot be confined, and no file is read without: ", ready.message()));
  }
  const std::optional<int> how = process_->AwaitEnd(kGrace);
  process_ = nullptr;
  return absl::FailedPreconditionError(
      absl::StrCat("its reader did not start (",
                   !how                ? std::string(ready.message())
                   : WIFSIGNALED(*how) ? Named(WTERMSIG(*how))
                                       : absl::StrCat("exit code ", WEXITSTATUS(*how)),
                   "), and no file is read without one"));
}

pid_t Child::pid() const { return process_ == nullptr ? 0 : process_->pid(); }

// `why`: what the link said; OK where it only ended.
absl::Status Child::Ended(const absl::Status& why) {
  const std::optional<int> how =
      why.ok() ? process_->AwaitEnd(kGrace) : std::optional<int>(std::nullopt);
  process_ = nullptr;
  if (!why.ok()) return why;
  if (!how) {
    return absl::InvalidArgumentError(
        absl::StrCat("its reader fell silent in the middle of its answer and was ended: ", kWhy));
  }
  if (!WIFSIGNALED(*how)) {
    return absl::InvalidArgumentError(
        absl::StrCat("its reader ended in the middle of its answer: ", kWhy));
  }
  switch (const int signal = WTERMSIG(*how)) {
    case SIGXCPU:
      return Process::OverTime(allowance_);
    case SIGSYS:
      return absl::InvalidArgumentError(absl::StrCat(
          "its reader ended with ", Named(signal),
          ": it was made to do what no reader may, such as to open a file, a connection or a "
          "process; the file is an attack, or the reader has a fault"));
    case SIGKILL:
    case SIGTERM:
    case SIGINT:
    case SIGHUP:
    case SIGQUIT:
      return absl::FailedPreconditionError(
          absl::StrCat("its reader was ended from outside with ", Named(signal),
                       signal == SIGKILL ? ", as by a system that has no memory left" : ""));
    default:
      return absl::InvalidArgumentError(
          absl::StrCat("its reader ended with ", Named(signal), ": ", kWhy));
  }
}

absl::Status Child::Ask(absl::string_view question, const Reached& reached, Take take) {
  if (!alive()) return absl::InternalError("a reader that has ended was asked");
  if (question.size() > kMaxQuestionBytes) {
    return absl::InvalidArgumentError("what its reader is asked is too long");
  }
  if (!process_->Send(question)) return Ended(absl::OkStatus());
  absl::Status link;
  Answer answer(
      [&](char* to, size_t size) {
        absl::StatusOr<size_t> got = process_->Receive(to, size, allowance_);
        if (!got.ok()) link = got.status();
        return got;
      },
      reached, allowance_.memory_bytes);
  absl::Status taken = take(answer);
  if (taken.ok()) taken = answer.ReadEnd();
  if (taken.ok()) return taken;
  switch (answer.fault()) {
    case Answer::Fault::kRefused:
      return taken;
    case Answer::Fault::kLink:
      return Ended(link);
    case Answer::Fault::kNoMemory:
      process_ = nullptr;
      return Process::OverMemory(allowance_);
    default:
      process_ = nullptr;
      return absl::InvalidArgumentError(
          absl::StrCat("its reader gave an answer without sense (", taken.message(), "): ", kWhy));
  }
}

}  // namespace vantage::confinement
