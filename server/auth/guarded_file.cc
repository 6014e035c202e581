#include "server/auth/guarded_file.h"

#include <sys/stat.h>

#include <cstddef>
#include <fstream>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"

namespace vantage::auth {
namespace {

constexpr size_t kMaxFile = 4 << 20;

}  // namespace

absl::StatusOr<std::string> ReadGuardedFile(const std::string& path, absl::string_view what) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) {
    return absl::NotFoundError(absl::StrCat("cannot find the ", what, " ", path));
  }
  if ((status.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return absl::PermissionDeniedError(
        absl::StrCat("others can write the ", what, " ", path, ": chmod go-w it"));
  }
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file.good()) return absl::NotFoundError(absl::StrCat("cannot read ", path));
  std::string read = std::move(text).str();
  if (read.size() > kMaxFile) {
    return absl::InvalidArgumentError(absl::StrCat(path, " is larger than 4 MiB"));
  }
  return read;
}

}  // namespace vantage::auth
