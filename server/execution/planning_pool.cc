#include "server/execution/planning_pool.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <new>
#include <system_error>
#include <utility>

#include "server/telemetry/log_context.h"

namespace vantage::execution {
namespace {

constexpr std::chrono::milliseconds kSlice(2);
// s of processor time that an owner who wakes may be behind who has had least: what jobs of others
// take to come to a boundary (0.25 s of a merge on a slow machine). Plans hand their slot on every
// 2 ms, so that a short one would otherwise wait for such jobs again and again, and be over before
// that evens out. Nobody gains by it twice: it is used up like all time.
constexpr double kHeadStart = 0.25;
// Threads, however many owners have a plan under way; those without a slot only wait.
constexpr size_t kMostThreads = 256;
constexpr size_t kNone = std::numeric_limits<size_t>::max();

// Processor seconds of the calling thread: time that the system gives to other programs is charged
// to no session.
double ThreadSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Handlers and heartbeats come before planning when they compete for a core.
void YieldToShortTasks() {
  constexpr int kNiceness = 5;
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNiceness);
}

}  // namespace

// All guarded by the pool's mutex.
struct PlanningPool::Turns {
  std::vector<Clock::time_point> ends;  // of the turns of plans that have begun; some are past

  void Drop(Clock::time_point end) {
    const auto it = std::find(ends.begin(), ends.end(), end);
    if (it != ends.end()) ends.erase(it);
  }
};

// All guarded by the pool's mutex.
struct PlanningPool::Owner {
  Owner(std::shared_ptr<Turns> t, bool one) : turns(std::move(t)), one_share(one) {}
  const std::shared_ptr<Turns> turns;
  const bool one_share;   // nobody's: it takes turns with other owners
  double used = 0;        // s of processor time, raised to the least used when it wakes
  double least_used = 0;  // s over weight: what a share of it that wakes starts from
  int active = 0;         // shares that are
  int running = 0;        // jobs begun, not ended
  int running_plans = 0;  // plans of them
};

class PlanningPool::Share {
 public:
  Share(double w, std::shared_ptr<Owner> whose) : weight(w), owner(std::move(whose)) {}
  const double weight;
  const std::shared_ptr<Owner> owner;
  // All guarded by the pool's mutex.
  double used = 0;     // s of processor time over weight, raised to the least used when it wakes
  double seconds = 0;  // s of processor time
  int active = 0;      // workers and queued jobs
  // Of its plan that began last: when its turn ends, and when it should have ended.
  Clock::time_point turn_end = Clock::time_point::min();
  Clock::time_point due = Clock::time_point::max();
};

// A thread of the pool, with or without a slot. Guarded by the pool's mutex except where said.
struct PlanningPool::Worker {
  std::shared_ptr<Share> share;
  JobPriority priority = JobPriority::kPlan;
  bool granted = false;
  std::condition_variable wake;
  // Touched by its own thread only, while it holds a slot.
  Clock::time_point slice_start;
  double charged_until = 0;    // s of its thread's processor time
  std::shared_ptr<Loop> loop;  // what a helper was given
};

// What a worker does.
struct PlanningPool::Doing {
  std::shared_ptr<Share> share;
  JobPriority priority;
};

struct PlanningPool::Queued {
  std::shared_ptr<Share> share;
  JobPriority priority;
  Job job;
  telemetry::LogContext context;  // the trace that it was submitted for
  uint64_t number;
  double seconds;
};

// One call of For(). May outlive it (helpers share it), but `body` is touched only while indices
// remain.
struct PlanningPool::Loop {
  Loop(std::shared_ptr<Share> s, JobPriority p, size_t indices,
       absl::FunctionRef<void(size_t)> call)
      : share(std::move(s)), priority(p), count(indices), body(call) {}

  // False when no index was left. An exception ends the loop: indices that were not begun are left
  // out, and the caller of For() gets it.
  bool RunOne() {
    const size_t i = next.fetch_add(1);
    if (i >= count) return false;
    if (!failed.load()) {
      try {
        body(i);
      } catch (...) {
        std::lock_guard<std::mutex> lock(mutex);
        if (failure == nullptr) failure = std::current_exception();
        failed = true;
      }
    }
    if (done.fetch_add(1) + 1 == count) {
      std::lock_guard<std::mutex> lock(mutex);
      finished.notify_all();
    }
    return true;
  }
  bool Exhausted() const { return next.load() >= count; }

  const std::shared_ptr<Share> share;
  const JobPriority priority;
  const size_t count;
  const absl::FunctionRef<void(size_t)> body;
  std::atomic<size_t> next{0};
  std::atomic<size_t> done{0};
  std::atomic<bool> failed{false};
  std::mutex mutex;
  std::exception_ptr failure ABSL_GUARDED_BY(mutex);  // the first
  std::condition_variable finished;
};

// The Parallel that a job is handed.
class PlanningPool::Lane final : public parallel::Parallel {
 public:
  Lane(PlanningPool& pool, std::shared_ptr<Share> share, JobPriority priority)
      : pool_(pool), share_(std::move(share)), priority_(priority) {}
  int width() const override { return pool_.slots_; }
  void For(size_t count, absl::FunctionRef<void(size_t)> body) override {
    pool_.For(share_, priority_, count, body);
  }

 private:
  PlanningPool& pool_;
  const std::shared_ptr<Share> share_;
  const JobPriority priority_;
};

namespace {
// The worker that the current thread is, where it is one of the pool's.
thread_local void* current_worker = nullptr;
}  // namespace

PlanningPool::PlanningPool(int slots, int max_jobs, std::chrono::milliseconds turn)
    : slots_(std::max(1, slots)),
      max_jobs_(std::max(2, max_jobs)),
      max_plans_(std::max(1, max_jobs_ * 3 / 4)),
      turns_(static_cast<size_t>(std::max(1, slots / 2))),
      turn_(turn),
      free_slots_(std::max(1, slots)),
      nobodys_turns_(std::make_shared<Turns>()) {
  std::lock_guard<std::mutex> lock(mutex_);
  idle_threads_ = max_jobs_ + 1;
  for (int i = 0; i < idle_threads_; ++i) threads_.emplace_back([this] { RunJobs(); });
  for (int i = 1; i < slots_; ++i) threads_.emplace_back([this] { Help(); });
}

PlanningPool::~PlanningPool() {
  std::deque<Queued> dropped;
  std::vector<std::thread> threads;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    threads.swap(threads_);  // none is added any more
    dropped.swap(queue_);
    for (Worker* helper : idle_helpers_) helper->wake.notify_all();
  }
  queue_changed_.notify_all();
  dropped.clear();
  for (std::thread& thread : threads) thread.join();
}

std::shared_ptr<PlanningPool::Share> PlanningPool::NewShare(double weight,
                                                            const std::string& owner) {
  if (owner.empty()) {
    return std::make_shared<Share>(weight, std::make_shared<Owner>(nobodys_turns_, true));
  }
  std::lock_guard<std::mutex> lock(mutex_);
  std::erase_if(owners_, [](const auto& entry) { return entry.second.expired(); });
  std::shared_ptr<Owner> known = owners_[owner].lock();
  if (known == nullptr) {
    known = std::make_shared<Owner>(std::make_shared<Turns>(), false);
    owners_[owner] = known;
  }
  return std::make_shared<Share>(weight, std::move(known));
}

double PlanningPool::Used(const Share& share) const {
  std::lock_guard<std::mutex> lock(mutex_);
  return share.seconds;
}

PlanningPool::Load PlanningPool::load() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return {queue_.size(), running_};
}

void PlanningPool::Activate(Share& share) {
  if (share.active++ > 0) return;
  Owner& owner = *share.owner;
  if (owner.active++ == 0) owner.used = std::max(owner.used, least_used_ - kHeadStart);
  share.used = std::max(share.used, owner.least_used);
}

// Processor seconds by which work goes before what would be due: what a turn can take; and as much
// again of a plan that should have ended and has little left to do, since it would pay back its
// turn before that, behind everybody else's work.
double PlanningPool::CreditOf(const Share& share, JobPriority priority) const {
  const double turn = slots_ * std::chrono::duration<double>(turn_).count();
  if (priority == JobPriority::kInteractive) return turn;
  if (priority != JobPriority::kPlan) return 0;
  const Clock::time_point now = Clock::now();
  if (now >= share.due) return 2 * turn;
  return now < share.turn_end ? turn : 0;
}

// Whether the first (a worker, a loop or a queued job) has had less: of owners, else of the shares
// of one. Credit counts among those who take turns, not against other owners.
template <typename A, typename B>
bool PlanningPool::Precedes(const A& a, const B& b) const {
  const double credit_a = CreditOf(*a.share, a.priority);
  const double credit_b = CreditOf(*b.share, b.priority);
  const Owner& of_a = *a.share->owner;
  const Owner& of_b = *b.share->owner;
  const double used_a = of_a.used - (of_a.one_share ? credit_a : 0);
  const double used_b = of_b.used - (of_b.one_share ? credit_b : 0);
  if (&of_a != &of_b && used_a != used_b) return used_a < used_b;
  return a.share->used - credit_a < b.share->used - credit_b;
}

bool PlanningPool::HasTurn(const Queued& entry) const {
  if (entry.priority != JobPriority::kPlan) return true;
  const std::shared_ptr<Turns>& turns = entry.share->owner->turns;
  const Clock::time_point now = Clock::now();
  const auto others =
      std::count_if(turns->ends.begin(), turns->ends.end(), [&](auto end) { return end > now; });
  if (static_cast<size_t>(others) >= turns_) return false;
  return std::none_of(begun_.begin(), begun_.end(),
                      [&](const Worker* other) ABSL_NO_THREAD_SAFETY_ANALYSIS {
                        return other->priority != JobPriority::kPlan &&
                               other->share->owner->turns == turns && Precedes(*other, entry);
                      });
}

bool PlanningPool::MayBegin(const Queued& entry) const { return HasPlace(entry) && HasTurn(entry); }

// When a plan that waits may have its turn at the earliest, though no other ends.
PlanningPool::Clock::time_point PlanningPool::NextTurn() const {
  Clock::time_point next = Clock::time_point::max();
  const Clock::time_point now = Clock::now();
  for (const Queued& entry : queue_) {
    if (entry.priority != JobPriority::kPlan) continue;
    for (const Clock::time_point end : entry.share->owner->turns->ends) {
      if (end > now) next = std::min(next, end);
    }
  }
  return next;
}

std::optional<PlanningPool::Place> PlanningPool::PlaceOf(uint64_t job) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto own = std::find_if(queue_.begin(), queue_.end(),
                                [&](const Queued& entry) { return entry.number == job; });
  if (own == queue_.end()) return std::nullopt;
  const double turn = std::chrono::duration<double>(turn_).count();
  const std::shared_ptr<Turns>& turns = own->share->owner->turns;
  Place place;
  for (auto other = queue_.begin(); other != queue_.end(); ++other) {
    if (other->priority != JobPriority::kPlan || other->share->owner->turns != turns) continue;
    const bool first = Precedes(*other, *own) || (!Precedes(*own, *other) && other < own);
    if (!first) continue;
    ++place.ahead;
    place.seconds += std::min(turn, other->seconds);
  }
  const Clock::time_point now = Clock::now();
  for (const Clock::time_point end : turns->ends) {
    if (end > now) place.seconds += std::chrono::duration<double>(end - now).count();
  }
  place.seconds /= static_cast<double>(turns_);
  return place;
}

void PlanningPool::Hurry(uint64_t job) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto own = std::find_if(queue_.begin(), queue_.end(),
                                  [&](const Queued& entry) { return entry.number == job; });
    if (own == queue_.end()) return;
    own->priority = JobPriority::kInteractive;
  }
  queue_changed_.notify_one();
}

bool PlanningPool::HasPlace(const Queued& entry) const {
  const Owner& owner = *entry.share->owner;
  // Plans beyond those of all leave as many places as ever for what is no plan.
  const int taken = running_ - std::max(0, running_plans_ - max_plans_);
  switch (entry.priority) {
    case JobPriority::kInteractive:
      return true;
    case JobPriority::kModel:
      // Of nobody's sessions each would be an owner without any.
      return taken < max_jobs_ || (!owner.one_share && owner.running == 0);
    case JobPriority::kPlan:
      return (taken < max_jobs_ && running_plans_ < max_plans_) || owner.running_plans == 0;
  }
  return true;
}

// One thread more than jobs that have begun, so that somebody sees what may begin.
void PlanningPool::KeepOneIdle() {
  if (idle_threads_ > 0 || stopping_ || threads_.size() >= kMostThreads) return;
  try {
    threads_.emplace_back([this] { RunJobs(); });
    ++idle_threads_;
  } catch (const std::system_error&) {
    // The system has none left: who needs it waits until another job ends.
  }
}

uint64_t PlanningPool::Submit(std::shared_ptr<Share> share, JobPriority priority, Job job,
                              double seconds) {
  uint64_t number = 0;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    number = next_job_++;
    if (stopping_) return number;
    Activate(*share);
    queue_.push_back({std::move(share), priority, std::move(job), telemetry::CurrentLogContext(),
                      number, seconds});
    KeepOneIdle();
  }
  queue_changed_.notify_one();
  return number;
}

size_t PlanningPool::BestQueued() {
  size_t best = kNone;
  for (size_t i = 0; i < queue_.size(); ++i) {
    const Queued& entry = queue_[i];
    if (!MayBegin(entry)) continue;
    const bool first = best == kNone || Precedes(entry, queue_[best]) ||
                       (!Precedes(queue_[best], entry) && entry.priority < queue_[best].priority);
    if (first) best = i;
  }
  return best;
}

PlanningPool::Worker* PlanningPool::BestWaiting() {
  const auto best =
      std::min_element(waiting_.begin(), waiting_.end(),
                       [this](const Worker* a, const Worker* b) ABSL_NO_THREAD_SAFETY_ANALYSIS {
                         if (Precedes(*a, *b)) return true;
                         return !Precedes(*b, *a) && a->priority < b->priority;
                       });
  return best == waiting_.end() ? nullptr : *best;
}

PlanningPool::Loop* PlanningPool::BestLoop() {
  Loop* best = nullptr;
  for (const std::shared_ptr<Loop>& loop : loops_) {
    if (loop->Exhausted()) continue;
    if (best == nullptr || Precedes(*loop, *best) ||
        (!Precedes(*best, *loop) && loop->priority < best->priority)) {
      best = loop.get();
    }
  }
  return best;
}

// Gives free slots to the sessions that have had the least time.
void PlanningPool::Schedule() {
  while (free_slots_ > 0) {
    Worker* waiting = BestWaiting();
    Loop* loop = idle_helpers_.empty() ? nullptr : BestLoop();
    if (waiting == nullptr && loop == nullptr) return;
    Worker* chosen = waiting;
    if (waiting == nullptr || (loop != nullptr && Precedes(*loop, *waiting))) {
      chosen = idle_helpers_.back();
      idle_helpers_.pop_back();
      chosen->loop = *std::find_if(loops_.begin(), loops_.end(),
                                   [&](const auto& l) { return l.get() == loop; });
      chosen->priority = loop->priority;
    } else {
      waiting_.erase(std::find(waiting_.begin(), waiting_.end(), chosen));
    }
    const Share& share = *(chosen->loop != nullptr ? chosen->loop->share : chosen->share);
    least_used_ = std::max(least_used_, share.owner->used);
    share.owner->least_used = std::max(share.owner->least_used, share.used);
    --free_slots_;
    chosen->granted = true;
    chosen->wake.notify_one();
  }
}

void PlanningPool::Acquire(Worker& worker, std::unique_lock<std::mutex>& lock) {
  worker.granted = false;
  waiting_.push_back(&worker);
  Schedule();
  worker.wake.wait(lock, [&] { return worker.granted; });
  BeginSlice(worker);
}

void PlanningPool::BeginSlice(Worker& worker) {
  worker.slice_start = Clock::now();
  worker.charged_until = ThreadSeconds();
}

void PlanningPool::Charge(Worker& worker) {
  const double now = ThreadSeconds();
  const double seconds = now - worker.charged_until;
  Share& share = *(worker.loop != nullptr ? worker.loop->share : worker.share);
  share.used += seconds / share.weight;
  share.seconds += seconds;
  share.owner->used += seconds;
  worker.charged_until = now;
  worker.slice_start = Clock::now();
}

void PlanningPool::Release(Worker& worker) {
  Charge(worker);
  ++free_slots_;
  worker.granted = false;
}

PlanningPool::Clock::time_point PlanningPool::DueAt(double seconds) {
  // Plans without a budget of time are never due.
  if (!(seconds > 0)) return Clock::time_point::max();
  constexpr double kLongest = 1e6;
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double>(std::min(seconds, kLongest)));
}

void PlanningPool::RunJobs() {
  YieldToShortTasks();
  Worker worker;
  current_worker = &worker;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    size_t index = kNone;
    while (!stopping_ && (index = BestQueued()) == kNone) {
      const Clock::time_point turn = NextTurn();
      if (turn == Clock::time_point::max()) {
        queue_changed_.wait(lock);
      } else {
        queue_changed_.wait_until(lock, turn);
      }
    }
    if (stopping_) return;
    --idle_threads_;
    KeepOneIdle();
    Queued entry = std::move(queue_[index]);
    queue_.erase(queue_.begin() + static_cast<std::ptrdiff_t>(index));
    // This may have been the thread that knew when the next plan has its turn.
    if (!queue_.empty()) queue_changed_.notify_one();
    const bool plan = entry.priority == JobPriority::kPlan;
    const Clock::time_point turn = Clock::now() + turn_;
    if (plan) {
      std::erase_if(entry.share->owner->turns->ends, [](auto end) { return end <= Clock::now(); });
      entry.share->owner->turns->ends.push_back(turn);
      entry.share->turn_end = turn;
      entry.share->due = DueAt(entry.seconds);
      ++running_plans_;
      ++entry.share->owner->running_plans;
    }
    ++running_;
    ++entry.share->owner->running;
    worker.share = entry.share;
    worker.priority = entry.priority;
    begun_.push_back(&worker);
    Acquire(worker, lock);
    lock.unlock();
    {
      const telemetry::ScopedLogContext context(std::move(entry.context));
      Lane lane(*this, entry.share, entry.priority);
      try {
        entry.job(lane);
      } catch (const std::bad_alloc&) {
        // Whoever submitted it says what becomes of it then; here only the process is kept.
      }
      entry.job = nullptr;  // the job's captures are released outside the lock
    }
    lock.lock();
    Release(worker);
    if (--entry.share->active == 0) --entry.share->owner->active;
    begun_.erase(std::find(begun_.begin(), begun_.end(), &worker));
    worker.share.reset();
    if (plan) {
      --running_plans_;
      --entry.share->owner->running_plans;
      entry.share->owner->turns->Drop(turn);
      if (entry.share->turn_end == turn) {
        entry.share->turn_end = Clock::time_point::min();
        entry.share->due = Clock::time_point::max();
      }
    }
    --running_;
    --entry.share->owner->running;
    ++idle_threads_;
    Schedule();
    queue_changed_.notify_one();
  }
}

void PlanningPool::Help() {
  YieldToShortTasks();
  Worker worker;
  current_worker = &worker;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    idle_helpers_.push_back(&worker);
    Schedule();
    worker.wake.wait(lock,
                     [&]() ABSL_NO_THREAD_SAFETY_ANALYSIS { return worker.granted || stopping_; });
    if (!worker.granted) {
      // A job that still runs would use this frame after it is gone.
      idle_helpers_.erase(std::find(idle_helpers_.begin(), idle_helpers_.end(), &worker));
      return;
    }
    BeginSlice(worker);
    lock.unlock();
    while (worker.loop->RunOne() && !SliceOver(worker, true)) {
    }
    lock.lock();
    Release(worker);
    std::shared_ptr<Loop> loop = std::move(worker.loop);
    worker.loop = nullptr;
    if (loop->Exhausted())
      loops_.erase(std::remove(loops_.begin(), loops_.end(), loop), loops_.end());
  }
}

// True when the worker's slice is over and a session that has had less time wants its slot.
bool PlanningPool::SliceOver(Worker& worker, bool helps) {
  if (Clock::now() - worker.slice_start < kSlice) return false;
  std::lock_guard<std::mutex> lock(mutex_);
  Charge(worker);
  // A plan may have waited until this job has had as much.
  if (!queue_.empty()) queue_changed_.notify_one();
  const Doing own{worker.loop != nullptr ? worker.loop->share : worker.share, worker.priority};
  const Worker* waiting = BestWaiting();
  if (waiting != nullptr && (Precedes(*waiting, own) ||
                             (waiting->share == own.share && waiting->priority < own.priority))) {
    return true;
  }
  // A job leaves its slot to such a loop where a helper is there to take it; a helper itself would.
  if (!helps && idle_helpers_.empty()) return false;
  const Loop* loop = BestLoop();
  return loop != nullptr && Precedes(*loop, own);
}

void PlanningPool::Yield(Worker& worker) {
  if (!SliceOver(worker, false)) return;
  std::unique_lock<std::mutex> lock(mutex_);
  Release(worker);
  // A helper inside a nested loop waits on behalf of the session that it helps.
  std::shared_ptr<Loop> loop = std::move(worker.loop);
  worker.loop = nullptr;
  const std::shared_ptr<Share> own = worker.share;
  if (own == nullptr) worker.share = loop->share;
  Acquire(worker, lock);
  worker.share = own;
  worker.loop = std::move(loop);
}

void PlanningPool::For(const std::shared_ptr<Share>& share, JobPriority priority, size_t count,
                       absl::FunctionRef<void(size_t)> body) {
  if (count == 0) return;
  auto* worker = static_cast<Worker*>(current_worker);
  auto loop = std::make_shared<Loop>(share, priority, count, body);
  if (count > 1 && slots_ > 1) {
    std::lock_guard<std::mutex> lock(mutex_);
    loops_.push_back(loop);
    Schedule();
  }
  while (loop->RunOne()) {
    if (worker != nullptr) Yield(*worker);
  }
  std::exception_ptr failure;
  {
    std::unique_lock<std::mutex> lock(loop->mutex);
    loop->finished.wait(lock, [&] { return loop->done.load() == count; });
    failure = loop->failure;
  }
  if (count > 1 && slots_ > 1) {
    std::lock_guard<std::mutex> lock(mutex_);
    loops_.erase(std::remove(loops_.begin(), loops_.end(), loop), loops_.end());
  }
  if (failure != nullptr) std::rethrow_exception(failure);
}

}  // namespace vantage::execution
