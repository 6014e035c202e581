// Somebody who waits for the answer of one of a session's evaluations.
#ifndef VANTAGE_SERVER_SESSION_ASKED_EVALUATION_H_
#define VANTAGE_SERVER_SESSION_ASKED_EVALUATION_H_

#include <functional>
#include <memory>
#include <new>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/contract/out_of_memory.h"
#include "server/session/evaluations.h"
#include "server/session/session_context.h"

namespace vantage::session {

// Answered once: also where the work is dropped, or memory ends on the way. The evaluation has
// ended by then, so that who is answered may ask the next. Not thread safe. The session outlives
// it.
template <typename Response>
class AskedEvaluation {
 public:
  using Done = std::function<void(absl::StatusOr<Response>)>;

  AskedEvaluation(SessionContext& context, std::shared_ptr<Evaluation> evaluation, Done done)
      : context_(context), evaluation_(std::move(evaluation)), done_(std::move(done)) {}
  ~AskedEvaluation() {
    if (done_ == nullptr) return;
    try {
      Give(context_.Dropped());
    } catch (const std::bad_alloc&) {
      Give(absl::Status(absl::StatusCode::kResourceExhausted, ""));  // no memory for words
    }
  }
  AskedEvaluation(const AskedEvaluation&) = delete;
  AskedEvaluation& operator=(const AskedEvaluation&) = delete;

  // `work`: what the answer is, an absl::StatusOr<Response>.
  template <typename Work>
  void Answer(Work&& work) {
    Give(contract::UnlessOutOfMemory(
        [&]() -> absl::StatusOr<Response> { return std::forward<Work>(work)(); }));
  }

 private:
  void Give(absl::StatusOr<Response> response) {
    if (done_ == nullptr) return;
    evaluation_->End();
    std::exchange(done_, nullptr)(std::move(response));
  }

  SessionContext& context_;
  const std::shared_ptr<Evaluation> evaluation_;
  Done done_;
};

// What work is asked in, as a job of the planning pool: `work` gets the job's Parallel.
template <typename Response, typename Work>
void RunAsked(SessionContext& context, std::shared_ptr<Evaluation> evaluation,
              typename AskedEvaluation<Response>::Done done, Work work) {
  const auto asked =
      std::make_shared<AskedEvaluation<Response>>(context, std::move(evaluation), std::move(done));
  context.RunInteractive([asked, work = std::move(work)](parallel::Parallel& parallel) {
    asked->Answer([&] { return work(parallel); });
  });
}

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_ASKED_EVALUATION_H_
