// What the examples do about an error: they say it, and end.
#ifndef VANTAGE_CLIENT_EXAMPLES_OR_EXIT_H_
#define VANTAGE_CLIENT_EXAMPLES_OR_EXIT_H_

#include <absl/status/statusor.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

template <typename T>
T OrExit(absl::StatusOr<T> result) {
  if (!result.ok()) {
    std::fprintf(stderr, "%s\n", result.status().ToString().c_str());
    std::exit(1);
  }
  return *std::move(result);
}

#endif  // VANTAGE_CLIENT_EXAMPLES_OR_EXIT_H_
