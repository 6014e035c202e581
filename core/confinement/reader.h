// The side of a reader that runs confined, in a process of its own (child.h starts it).
#ifndef VANTAGE_CORE_CONFINEMENT_READER_H_
#define VANTAGE_CORE_CONFINEMENT_READER_H_

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace vantage::confinement {

// Who asked: another process, whose questions are trusted. Each Next() is followed by any number of
// Reached() and Say(), and one End().
class Asker {
 public:
  explicit Asker(uint64_t file_bytes) : file_bytes_(file_bytes) {}

  // The file that is to be read, open, and its size; 0 where it is not a regular one.
  int file() const;
  uint64_t file_bytes() const { return file_bytes_; }

  // The next question; nothing when there are no more.
  std::optional<std::string> Next();
  // How far the file was read.
  void Reached(uint64_t position);
  // A part of the answer, of any size.
  void Say(absl::string_view bytes);
  // The answer is whole, or the file is refused.
  void End(const absl::Status& status);

 private:
  uint64_t file_bytes_;
};

struct Reader {
  const char* name;  // by which it is started
  void (*answer)(Asker& asker);
};

// To be called first of all in main() of a program that starts readers: it is executed again to be
// one of them, and then this does not return.
void RunIfReader(int argc, char** argv, std::initializer_list<Reader> readers);

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_READER_H_
