// The folder that a power cut leaves behind.
#ifndef VANTAGE_TESTS_FAULTS_CRASHED_DISK_H_
#define VANTAGE_TESTS_FAULTS_CRASHED_DISK_H_

#include <cstdint>
#include <span>
#include <string>

#include "tests/faults/disk_recorder.h"

namespace vantage::faults {

// What becomes of writes, and of names in folders, that were not synced.
enum class Unsynced {
  kLost,  // all of them
  kKept,  // none: what kill -9 leaves
  kTorn,  // any of them is there or not, and the last write of a file may be there in part
};

// Makes `to` (which does not exist) as the recorded folder is when the power goes after these
// steps, which began with what is in `base` ("": nothing), all of it synced. A name and what it
// names are told apart: a file that was synced in a folder that was not is gone.
void MakeCrashedFolder(const std::string& base, std::span<const DiskStep> steps, Unsynced unsynced,
                       uint64_t seed, const std::string& to);

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_CRASHED_DISK_H_
