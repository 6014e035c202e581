// Work that ends when either of two want it to: who asked for it, and the session.
#ifndef VANTAGE_SERVER_SESSION_EITHER_STOP_H_
#define VANTAGE_SERVER_SESSION_EITHER_STOP_H_

#include <stop_token>

namespace vantage::session {

// Lives as long as the work.
class EitherStop {
 public:
  EitherStop(const std::stop_token& a, const std::stop_token& b)
      : by_a_(a, Ask{source_}), by_b_(b, Ask{source_}) {}

  std::stop_token token() const { return source_.get_token(); }

 private:
  struct Ask {
    std::stop_source source;
    void operator()() { source.request_stop(); }
  };
  std::stop_source source_;
  std::stop_callback<Ask> by_a_;
  std::stop_callback<Ask> by_b_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_EITHER_STOP_H_
