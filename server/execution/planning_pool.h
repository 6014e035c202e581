// The threads that carve, register and plan: a fixed number of processor slots, shared fairly
// between sessions, apart from gRPC's threads and from short tasks.
#ifndef VANTAGE_SERVER_EXECUTION_PLANNING_POOL_H_
#define VANTAGE_SERVER_EXECUTION_PLANNING_POOL_H_

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "core/parallel/parallel.h"

namespace vantage::execution {

// Among the jobs of one session the smaller goes first; between sessions the share decides.
enum class JobPriority : uint8_t { kInteractive = 0, kModel = 1, kPlan = 2 };

// Jobs are long, and only a job can suspend itself. A job holds a slot while it computes. At the
// boundaries of parallel bodies, after a slice of 2 ms, it hands the slot to the session that has
// had the least processor time, if that session waits. Slots that no job holds help with the loops
// of the jobs that run.
class PlanningPool {
 public:
  using Job = std::function<void(parallel::Parallel&)>;
  // The processor time that a session has used. Owners (tenants) get equal time while they have
  // work, and so do the sessions of an owner by their weights; who is idle gains no credit, but for
  // a quarter of a second of an owner's, so that the boundaries of others' work cost it nothing.
  class Share;

  // `slots` >= 1 bodies run at a time. At most `max_jobs` (>= 2) jobs are begun at a time, plans
  // being at most three quarters of them; further ones wait in order of share and priority. A plan
  // of an owner without one under way has a place beyond that, and so have the first job of an
  // owner who has none and what is interactive: long work of others, which goes on beside it in its
  // share, never keeps it waiting.
  //
  // Plans take turns, so that each has the processors that it was planned for instead of a sliver
  // of them: of an owner's plans, and of those of all sessions that are nobody's, one for two slots
  // is begun, and the next when that has ended or has run for `turn`; a long plan then goes on
  // beside it. Meanwhile it goes before what others of them do (merges), on credit: no turn begins
  // while one is under way that has had less. Interactive work, which is short, has the same
  // credit, and a plan that is over its time twice as much.
  PlanningPool(int slots, int max_jobs, std::chrono::milliseconds turn = kTurn);
  // Waits for the jobs that have begun; drops those that have not.
  ~PlanningPool();
  PlanningPool(const PlanningPool&) = delete;
  PlanningPool& operator=(const PlanningPool&) = delete;

  // `owner`: whose it is; empty: nobody else's.
  std::shared_ptr<Share> NewShare(double weight = 1.0, const std::string& owner = "");

  // A job that throws std::bad_alloc is over; what is thrown in a loop of its Parallel, on whatever
  // thread, arrives in the job. Never refuses: the callers bound the number (strands submit one
  // each; plans have limits per session and server). `seconds`: that a plan is meant to take.
  // Returns the job's number.
  uint64_t Submit(std::shared_ptr<Share> share, JobPriority priority, Job job, double seconds = 0);

  // Where a plan that has not begun stands among those that it takes turns with.
  struct Place {
    size_t ahead = 0;    // plans that go first
    double seconds = 0;  // until its turn, about
  };
  // Nothing once it has begun.
  std::optional<Place> PlaceOf(uint64_t job) const;
  // A job that has not begun waits for no turn and no place of a plan any more: what it still does
  // is short.
  void Hurry(uint64_t job);

  int slots() const { return slots_; }
  struct Load {
    size_t queued = 0;  // jobs that have not begun
    int running = 0;    // jobs that have
  };
  Load load() const;
  // The processor seconds that a share has used.
  double Used(const Share& share) const;

 private:
  using Clock = std::chrono::steady_clock;
  // Most plans are over by then.
  static constexpr std::chrono::milliseconds kTurn{2000};
  struct Turns;
  struct Owner;
  struct Worker;
  struct Loop;
  struct Queued;
  struct Doing;
  class Lane;

  void RunJobs();
  void Help();
  void Acquire(Worker& worker, std::unique_lock<std::mutex>& lock);
  static void BeginSlice(Worker& worker);
  void Release(Worker& worker) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Charge(Worker& worker) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Schedule() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Worker* BestWaiting() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Loop* BestLoop() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  size_t BestQueued() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Activate(Share& share) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool MayBegin(const Queued& entry) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool HasPlace(const Queued& entry) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool HasTurn(const Queued& entry) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Clock::time_point NextTurn() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void KeepOneIdle() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  static Clock::time_point DueAt(double seconds);
  double CreditOf(const Share& share, JobPriority priority) const;
  template <typename A, typename B>
  bool Precedes(const A& a, const B& b) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void For(const std::shared_ptr<Share>& share, JobPriority priority, size_t count,
           absl::FunctionRef<void(size_t)> body);
  void Yield(Worker& worker);
  bool SliceOver(Worker& worker, bool helps);

  const int slots_;
  const int max_jobs_;
  const int max_plans_;
  const size_t turns_;  // at a time, of those who take turns
  const std::chrono::milliseconds turn_;
  mutable std::mutex mutex_;
  std::condition_variable queue_changed_;
  std::deque<Queued> queue_ ABSL_GUARDED_BY(mutex_);
  std::vector<Worker*> waiting_ ABSL_GUARDED_BY(mutex_);
  std::vector<const Worker*> begun_ ABSL_GUARDED_BY(mutex_);  // whose jobs have, with a slot or not
  std::vector<std::shared_ptr<Loop>> loops_ ABSL_GUARDED_BY(mutex_);
  std::vector<Worker*> idle_helpers_ ABSL_GUARDED_BY(mutex_);
  int free_slots_ ABSL_GUARDED_BY(mutex_);
  int running_ ABSL_GUARDED_BY(mutex_) = 0;
  int running_plans_ ABSL_GUARDED_BY(mutex_) = 0;
  int idle_threads_ ABSL_GUARDED_BY(mutex_) = 0;   // that wait for a job, or soon will
  double least_used_ ABSL_GUARDED_BY(mutex_) = 0;  // s: what an owner that wakes starts from
  std::map<std::string, std::weak_ptr<Owner>> owners_ ABSL_GUARDED_BY(mutex_);  // by name
  const std::shared_ptr<Turns> nobodys_turns_;
  uint64_t next_job_ ABSL_GUARDED_BY(mutex_) = 1;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::execution

#endif  // VANTAGE_SERVER_EXECUTION_PLANNING_POOL_H_
