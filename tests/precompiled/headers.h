// What most tests of the core include, compiled once for all of them (tests/CMakeLists.txt). Each
// file includes what it uses all the same.
#ifndef VANTAGE_TESTS_PRECOMPILED_HEADERS_H_
#define VANTAGE_TESTS_PRECOMPILED_HEADERS_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"

#endif  // VANTAGE_TESTS_PRECOMPILED_HEADERS_H_
