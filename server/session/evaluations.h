// Evaluations of a session that are under way: of positions, tours, priors, comparisons. They keep
// its model in memory.
#ifndef VANTAGE_SERVER_SESSION_EVALUATIONS_H_
#define VANTAGE_SERVER_SESSION_EVALUATIONS_H_

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>

namespace vantage::session {

class Evaluations;

// One of them. Ends once: when it is told to, or with the last who holds it, whatever came between.
// Thread safe.
class Evaluation {
 public:
  Evaluation() = default;
  ~Evaluation() { End(); }
  Evaluation(const Evaluation&) = delete;
  Evaluation& operator=(const Evaluation&) = delete;

  void End() {
    if (std::atomic<int>* const count = count_.exchange(nullptr); count != nullptr) --*count;
  }

 private:
  friend class Evaluations;
  std::atomic<std::atomic<int>*> count_{nullptr};
};

// Thread safe. Outlives them.
class Evaluations {
 public:
  // Null where `most` are under way.
  std::shared_ptr<Evaluation> Begin(size_t most) {
    auto one = std::make_shared<Evaluation>();
    if (count_.fetch_add(1) >= static_cast<int>(most)) {
      --count_;
      return nullptr;
    }
    one->count_ = &count_;
    return one;
  }
  bool any() const { return count_ > 0; }

 private:
  std::atomic<int> count_{0};
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_EVALUATIONS_H_
