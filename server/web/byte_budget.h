// The memory that requests and answers of all connections may take together.
#ifndef VANTAGE_SERVER_WEB_BYTE_BUDGET_H_
#define VANTAGE_SERVER_WEB_BYTE_BUDGET_H_

#include <atomic>
#include <cstdint>
#include <utility>

namespace vantage::web {

// Thread safe.
class ByteBudget {
 public:
  explicit ByteBudget(int64_t bytes) : left_(bytes) {}

  // Bytes that were taken; gives them back when it ends.
  class Share {
   public:
    Share() = default;
    ~Share() { Reset(); }
    Share(Share&& other) noexcept
        : of_(std::exchange(other.of_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Share& operator=(Share&& other) noexcept {
      Reset();
      of_ = std::exchange(other.of_, nullptr);
      bytes_ = std::exchange(other.bytes_, 0);
      return *this;
    }
    int64_t bytes() const { return bytes_; }
    void Reset() {
      if (of_ != nullptr) of_->left_ += bytes_;
      of_ = nullptr;
      bytes_ = 0;
    }
    // Takes as much more as makes it `bytes`, or leaves it as it is and is false.
    [[nodiscard]] bool GrowTo(ByteBudget& budget, int64_t bytes) {
      if (bytes <= bytes_) return true;
      const int64_t more = bytes - bytes_;
      if (budget.left_.fetch_sub(more) < more) {
        budget.left_ += more;
        return false;
      }
      of_ = &budget;
      bytes_ = bytes;
      return true;
    }

   private:
    ByteBudget* of_ = nullptr;
    int64_t bytes_ = 0;
  };

  int64_t left() const { return left_; }

 private:
  std::atomic<int64_t> left_;
};

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_BYTE_BUDGET_H_
