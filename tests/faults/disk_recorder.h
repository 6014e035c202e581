// Records each step that a process makes on the files below one folder, and makes steps fail on
// request. The C library's calls that change files are redefined in the program that links this, so
// that SQLite's calls pass here, too.
#ifndef VANTAGE_TESTS_FAULTS_DISK_RECORDER_H_
#define VANTAGE_TESTS_FAULTS_DISK_RECORDER_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vantage::faults {

struct DiskStep {
  enum class Kind {
    kCreateFile,
    kMakeFolder,
    kWrite,
    kTruncate,
    kSyncFile,
    kSyncFolder,
    kRename,
    kLink,
    kRemove
  };
  Kind kind = Kind::kWrite;
  uint64_t node = 0;     // of the file or folder: never used again for another
  std::string path;      // below the folder; "" is the folder itself
  std::string new_path;  // of kRename and kLink
  uint64_t offset = 0;   // of kWrite; the new size of kTruncate
  std::string bytes;     // of kWrite
};

// One at a time in a process.
class DiskRecorder {
 public:
  // Records what happens below `folder` from now on.
  static void Start(const std::string& folder);
  static std::vector<DiskStep> Stop();
  // Steps so far.
  static size_t Count();

  // From now on every step below `folder` fails with `error` (errno) from the `after`-th on,
  // `times` of them; writes that do not are whole.
  static void FailSteps(const std::string& folder, size_t after, int error, size_t times);
  // How many steps have failed so far.
  static size_t Failed();
  static void FailNoMore();
};

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_DISK_RECORDER_H_
