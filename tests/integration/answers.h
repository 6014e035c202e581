// The command line's JSON, read back.
#ifndef VANTAGE_TESTS_INTEGRATION_ANSWERS_H_
#define VANTAGE_TESTS_INTEGRATION_ANSWERS_H_

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/integration/process.h"

namespace vantage::integration {

template <typename Message>
Message Answer(const Finished& finished) {
  Message message;
  const auto parsed = google::protobuf::util::JsonStringToMessage(finished.out, &message);
  EXPECT_TRUE(parsed.ok()) << "exit code " << finished.exit_code << "\n"
                           << finished.out << "\n"
                           << finished.error;
  return message;
}

// Where real scans and meshes lie; empty when they are not on this machine.
inline std::string SharedData(const std::string& file) {
  const char* root = std::getenv("VANTAGE_SHARED_DATA");
  if (root == nullptr) return "";
  const std::string path = std::string(root) + "/" + file;
  return std::filesystem::exists(path) ? path : "";
}

}  // namespace vantage::integration

#endif  // VANTAGE_TESTS_INTEGRATION_ANSWERS_H_
