// A reader in a process of its own, as the process sees it that has a file to be read.
#ifndef VANTAGE_CORE_CONFINEMENT_CHILD_H_
#define VANTAGE_CORE_CONFINEMENT_CHILD_H_

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/confinement/allowance.h"
#include "core/confinement/answer.h"

namespace vantage::confinement {

// Whether an error of Child::Ask() says that the reader took more memory or time than is allowed.
bool IsBeyondAllowance(const absl::Status& status);
// The same code and payloads with other words.
absl::Status Reworded(const absl::Status& status, absl::string_view message);

// The program that runs is executed again, as the same file even where that was replaced since, and
// confined (confine.h) before it reads a byte. It ends with this object, with the thread that
// started it, and with this process. Not thread safe; any number of them may run.
class Child {
 public:
  using Reached = std::function<void(uint64_t position)>;
  using Take = absl::FunctionRef<absl::Status(Answer& answer)>;

  // `reader`: the name of one that main() hands to RunIfReader(). `file`: open for reading; the
  // caller keeps it. FAILED_PRECONDITION: this machine cannot confine it, or executes nothing.
  // CANCELLED as of Ask().
  static absl::StatusOr<Child> Start(const char* reader, int file, const Allowance& allowance);
  Child(Child&&) noexcept;
  Child& operator=(Child&&) noexcept;
  ~Child();

  // Asks, and has `take` read the answer and judge it as a stranger's: parts that come after are an
  // error. `question`: at most kMaxQuestionBytes.
  // What the reader refuses: its own code and words, as of Answer::Read(). INVALID_ARGUMENT: it
  // ended by a signal or by itself, did what no reader does, took more memory or time than is
  // allowed, or answered what makes no sense; FAILED_PRECONDITION: it was ended from outside;
  // CANCELLED: it was given up (Allowance::given_up). After those there is no reader any more.
  // Messages begin with "its reader" and name no file.
  absl::Status Ask(absl::string_view question, const Reached& reached, Take take);

  // Whether it can be asked.
  bool alive() const { return process_ != nullptr; }
  // 0 where it is not alive.
  pid_t pid() const;

 private:
  class Process;

  Child(std::unique_ptr<Process> process, Allowance allowance);
  absl::Status AwaitReady();
  absl::Status Ended(const absl::Status& why);

  std::unique_ptr<Process> process_;
  Allowance allowance_;
};

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_CHILD_H_
