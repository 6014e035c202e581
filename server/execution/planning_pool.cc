#include "server/execution/planning_pool.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "server/telemetry/log_context.h"

namespace vantage::execution {
namespace {

constexpr std::chrono::milliseconds kSlice(2);
constexpr size_t kNone = std::numeric_limits<size_t>::max();

// Processor seconds of the calling thread: what the system did with other programs meanwhile is
// nobody's account.
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

class PlanningPool::Share {
 public:
  explicit Share(double w) : weight(w) {}
  const double weight;
  // All guarded by the pool's mutex.
  double used = 0;     // s of processor time over weight, raised to the floor when it wakes
  double seconds = 0;  // s of processor time
  int active = 0;      // holders and queued jobs
};

// A thread of the pool, with or without a slot. Guarded by the pool's mutex except where said.
struct PlanningPool::Slot {
  std::shared_ptr<Share> share;
  JobPriority priority = JobPriority::kPlan;
  bool granted = false;
  std::condition_variable wake;
  // Touched by its own thread only, while it holds a slot.
  Clock::time_point slice_start;
  double charged_until = 0;    // s of its thread's processor time
  std::shared_ptr<Loop> loop;  // what a helper was given
};

struct PlanningPool::Queued {
  std::shared_ptr<Share> share;
  JobPriority priority;
  Job job;
  telemetry::LogContext context;  // the trace that it was submitted for
};

// One call of For(). May outlive it (helpers share it), but `body` is touched only while indices
// remain.
struct PlanningPool::Loop {
  Loop(std::shared_ptr<Share> s, JobPriority p, size_t indices,
       absl::FunctionRef<void(size_t)> call)
      : share(std::move(s)), priority(p), count(indices), body(call) {}

  // False when no index was left.
  bool RunOne() {
    const size_t i = next.fetch_add(1);
    if (i >= count) return false;
    body(i);
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
  std::mutex mutex;
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
// The holder that the current thread is, where it is one of the pool's.
thread_local void* current_holder = nullptr;
}  // namespace

PlanningPool::PlanningPool(int slots, int max_jobs)
    : slots_(std::max(1, slots)),
      max_plans_(std::max(1, std::max(2, max_jobs) * 3 / 4)),
      free_slots_(std::max(1, slots)) {
  for (int i = 0; i < std::max(2, max_jobs); ++i) threads_.emplace_back([this] { RunJobs(); });
  for (int i = 1; i < slots_; ++i) threads_.emplace_back([this] { Help(); });
}

PlanningPool::~PlanningPool() {
  std::deque<Queued> dropped;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    dropped.swap(queue_);
    for (Slot* helper : idle_helpers_) helper->wake.notify_all();
  }
  queue_changed_.notify_all();
  dropped.clear();
  for (std::thread& thread : threads_) thread.join();
}

std::shared_ptr<PlanningPool::Share> PlanningPool::NewShare(double weight) {
  return std::make_shared<Share>(weight);
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
  if (share.active++ == 0) share.used = std::max(share.used, floor_);
}

void PlanningPool::Submit(std::shared_ptr<Share> share, JobPriority priority, Job job) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (stopping_) return;
    Activate(*share);
    queue_.push_back({std::move(share), priority, std::move(job), telemetry::CurrentLogContext()});
  }
  queue_changed_.notify_one();
}

size_t PlanningPool::BestQueued() {
  size_t best = kNone;
  for (size_t i = 0; i < queue_.size(); ++i) {
    const Queued& entry = queue_[i];
    if (entry.priority == JobPriority::kPlan && running_plans_ >= max_plans_) continue;
    if (best == kNone || std::tie(entry.share->used, entry.priority) <
                             std::tie(queue_[best].share->used, queue_[best].priority)) {
      best = i;
    }
  }
  return best;
}

PlanningPool::Slot* PlanningPool::BestWaiting() {
  const auto best =
      std::min_element(waiting_.begin(), waiting_.end(), [](const Slot* a, const Slot* b) {
        return std::tie(a->share->used, a->priority) < std::tie(b->share->used, b->priority);
      });
  return best == waiting_.end() ? nullptr : *best;
}

PlanningPool::Loop* PlanningPool::BestLoop() {
  Loop* best = nullptr;
  for (const std::shared_ptr<Loop>& loop : loops_) {
    if (loop->Exhausted()) continue;
    if (best == nullptr ||
        std::tie(loop->share->used, loop->priority) < std::tie(best->share->used, best->priority)) {
      best = loop.get();
    }
  }
  return best;
}

// Gives free slots away, to who has had least.
void PlanningPool::Schedule() {
  while (free_slots_ > 0) {
    Slot* waiting = BestWaiting();
    Loop* loop = idle_helpers_.empty() ? nullptr : BestLoop();
    if (waiting == nullptr && loop == nullptr) return;
    Slot* chosen = waiting;
    if (waiting == nullptr || (loop != nullptr && loop->share->used < waiting->share->used)) {
      chosen = idle_helpers_.back();
      idle_helpers_.pop_back();
      chosen->loop = *std::find_if(loops_.begin(), loops_.end(),
                                   [&](const auto& l) { return l.get() == loop; });
      chosen->priority = loop->priority;
    } else {
      waiting_.erase(std::find(waiting_.begin(), waiting_.end(), chosen));
    }
    const Share& share = *(chosen->loop != nullptr ? chosen->loop->share : chosen->share);
    floor_ = std::max(floor_, share.used);
    --free_slots_;
    chosen->granted = true;
    chosen->wake.notify_one();
  }
}

void PlanningPool::Acquire(Slot& slot, std::unique_lock<std::mutex>& lock) {
  slot.granted = false;
  waiting_.push_back(&slot);
  Schedule();
  slot.wake.wait(lock, [&] { return slot.granted; });
  BeginSlice(slot);
}

void PlanningPool::BeginSlice(Slot& slot) {
  slot.slice_start = Clock::now();
  slot.charged_until = ThreadSeconds();
}

void PlanningPool::Charge(Slot& slot) {
  const double now = ThreadSeconds();
  const double seconds = now - slot.charged_until;
  Share& share = *(slot.loop != nullptr ? slot.loop->share : slot.share);
  share.used += seconds / share.weight;
  share.seconds += seconds;
  slot.charged_until = now;
  slot.slice_start = Clock::now();
}

void PlanningPool::Release(Slot& slot) {
  Charge(slot);
  ++free_slots_;
  slot.granted = false;
}

void PlanningPool::RunJobs() {
  YieldToShortTasks();
  Slot slot;
  current_holder = &slot;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    size_t index = kNone;
    queue_changed_.wait(lock, [&]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
      if (stopping_) return true;
      index = BestQueued();
      return index != kNone;
    });
    if (stopping_) return;
    Queued entry = std::move(queue_[index]);
    queue_.erase(queue_.begin() + static_cast<std::ptrdiff_t>(index));
    const bool plan = entry.priority == JobPriority::kPlan;
    if (plan) ++running_plans_;
    ++running_;
    slot.share = entry.share;
    slot.priority = entry.priority;
    Acquire(slot, lock);
    lock.unlock();
    {
      const telemetry::ScopedLogContext context(std::move(entry.context));
      Lane lane(*this, entry.share, entry.priority);
      entry.job(lane);
      entry.job = nullptr;  // what it holds is released outside the lock
    }
    lock.lock();
    Release(slot);
    --entry.share->active;
    slot.share.reset();
    if (plan) --running_plans_;
    --running_;
    Schedule();
    queue_changed_.notify_one();
  }
}

void PlanningPool::Help() {
  YieldToShortTasks();
  Slot slot;
  current_holder = &slot;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    idle_helpers_.push_back(&slot);
    Schedule();
    slot.wake.wait(lock,
                   [&]() ABSL_NO_THREAD_SAFETY_ANALYSIS { return slot.granted || stopping_; });
    if (!slot.granted) {
      // A job that still runs would give work to this frame when it is gone.
      idle_helpers_.erase(std::find(idle_helpers_.begin(), idle_helpers_.end(), &slot));
      return;
    }
    BeginSlice(slot);
    lock.unlock();
    while (slot.loop->RunOne() && !SliceOver(slot, true)) {
    }
    lock.lock();
    Release(slot);
    std::shared_ptr<Loop> loop = std::move(slot.loop);
    slot.loop = nullptr;
    if (loop->Exhausted())
      loops_.erase(std::remove(loops_.begin(), loops_.end(), loop), loops_.end());
  }
}

// True when the holder's slice is over and somebody who has had less wants its slot.
bool PlanningPool::SliceOver(Slot& slot, bool leave_when_contended) {
  if (Clock::now() - slot.slice_start < kSlice) return false;
  std::lock_guard<std::mutex> lock(mutex_);
  Charge(slot);
  const Share& own = *(slot.loop != nullptr ? slot.loop->share : slot.share);
  const Slot* waiting = BestWaiting();
  if (waiting != nullptr && (waiting->share->used < own.used ||
                             (waiting->share.get() == &own && waiting->priority < slot.priority))) {
    return true;
  }
  if (!leave_when_contended) return false;
  const Loop* loop = BestLoop();
  return loop != nullptr && loop->share->used < own.used;
}

void PlanningPool::Yield(Slot& slot) {
  if (!SliceOver(slot, false)) return;
  std::unique_lock<std::mutex> lock(mutex_);
  Release(slot);
  // A helper inside a nested loop waits on behalf of the session that it helps.
  std::shared_ptr<Loop> loop = std::move(slot.loop);
  slot.loop = nullptr;
  const std::shared_ptr<Share> own = slot.share;
  if (own == nullptr) slot.share = loop->share;
  Acquire(slot, lock);
  slot.share = own;
  slot.loop = std::move(loop);
}

void PlanningPool::For(const std::shared_ptr<Share>& share, JobPriority priority, size_t count,
                       absl::FunctionRef<void(size_t)> body) {
  if (count == 0) return;
  auto* slot = static_cast<Slot*>(current_holder);
  auto loop = std::make_shared<Loop>(share, priority, count, body);
  if (count > 1 && slots_ > 1) {
    std::lock_guard<std::mutex> lock(mutex_);
    loops_.push_back(loop);
    Schedule();
  }
  while (loop->RunOne()) {
    if (slot != nullptr) Yield(*slot);
  }
  {
    std::unique_lock<std::mutex> lock(loop->mutex);
    loop->finished.wait(lock, [&] { return loop->done.load() == count; });
  }
  if (count > 1 && slots_ > 1) {
    std::lock_guard<std::mutex> lock(mutex_);
    loops_.erase(std::remove(loops_.begin(), loops_.end(), loop), loops_.end());
  }
}

}  // namespace vantage::execution
