// Tours of a session, while they are made. Nothing of them is stored.
#ifndef VANTAGE_SERVER_SESSION_TOURS_H_
#define VANTAGE_SERVER_SESSION_TOURS_H_

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/session/model_memory.h"
#include "server/session/plan_inputs.h"
#include "server/session/preparation.h"
#include "server/session/session_context.h"
#include "vantage/v1/tour.pb.h"

namespace vantage::session {

// A tour that is being made, for the one who asked for it. Thread safe.
class TourRun {
 public:
  // What there is to tell.
  struct News {
    std::optional<v1::Tour> tour;  // the newest, if it was not taken yet
    bool ended = false;
    absl::Status status;  // of the end
  };
  News Take();
  bool Ended();
  // `call` runs after every change, on any thread; it must be quick. Null: nobody is told.
  void Tell(std::function<void()> call);
  void Stop() { stop_.request_stop(); }

 private:
  friend class Tours;
  void Improve(v1::Tour tour);
  void End(absl::Status status);
  void Notify();

  std::stop_source stop_;
  std::mutex mutex_;
  std::optional<v1::Tour> tour_ ABSL_GUARDED_BY(mutex_);
  uint64_t revision_ ABSL_GUARDED_BY(mutex_) = 0;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
  std::function<void()> call_ ABSL_GUARDED_BY(mutex_);
};

// Thread safe.
class Tours {
 public:
  Tours(SessionContext& context, ModelMemory& model, Preparation& preparation);

  // Begins to make a tour, on the planning pool, in the session's share of it. Errors as
  // Plans::Create(); RESOURCE_EXHAUSTED (TOO_MANY_TOURS): the session makes as many as it may.
  absl::StatusOr<std::shared_ptr<TourRun>> Create(const v1::CreateTourRequest& request);
  // Stops those that are being made; they end soon.
  void Stop();

 private:
  struct Inputs {
    PlanInputs plan;
    tour::TourRequest request;
    // Besides that of the problem; given back with the last copy.
    std::shared_ptr<MemoryAccount::Reservation> memory;
  };
  struct Making;
  struct Made {};
  absl::StatusOr<Inputs> Read(const v1::TourWish& wish);
  absl::StatusOr<Made> Run(TourRun& run, const Inputs& inputs, parallel::Parallel& parallel);

  SessionContext& context_;
  const SessionDependencies& dependencies_;
  ModelMemory& model_;
  Preparation& preparation_;

  std::mutex mutex_;
  std::vector<std::weak_ptr<TourRun>> runs_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_TOURS_H_
