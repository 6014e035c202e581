// The number of repetitions of a test.
#ifndef VANTAGE_TESTS_SUPPORT_RUNS_H_
#define VANTAGE_TESTS_SUPPORT_RUNS_H_

namespace vantage::test_support {

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define VANTAGE_SANITIZED
#endif
#endif

// As many as asked for; under sanitizers an eighth of them, at least one: each takes twenty times
// as long there, and what they look for shows in a few.
template <typename Count>
constexpr Count Runs(Count full) {
#ifdef VANTAGE_SANITIZED
  return full < 16 ? 1 : full / 8;
#else
  return full;
#endif
}

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_RUNS_H_
