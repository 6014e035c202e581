// What goes back from a confined reader to the process that started it: frames on a pipe. The
// reader may have been taken over by what it read, so nothing that it says is believed.
//
//   offset  size  what
//        0     4  kind (u32)
//        4     4  bytes of content that follow (u32), at most 1 MiB
//
//   kind  content
//      0  none: the reader is confined, and ready
//      1  how far the file was read: a byte (u64)
//      2  a part of the answer
//      3  none: the answer is whole
//      4  the file is refused: a canonical code (u32), and why (text, at most 64 KiB)
//      5  none: there was no memory left
//      6  what kept the reader from being confined (text, at most 64 KiB)
//
// An answer is any number of 1 and 2, and then one of 3 to 6.
#ifndef VANTAGE_CORE_CONFINEMENT_ANSWER_H_
#define VANTAGE_CORE_CONFINEMENT_ANSWER_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace vantage::confinement {

enum class Frame : uint32_t {
  kReady = 0,
  kReached = 1,
  kPart = 2,
  kWhole = 3,
  kRefused = 4,
  kNoMemory = 5,
  kUnconfined = 6,
};

inline constexpr size_t kFrameHeaderBytes = 8;
inline constexpr size_t kMaxFrameBytes = 1 << 20;
inline constexpr size_t kMaxTextBytes = 1 << 16;

// An answer as it arrives. Once a call has failed, nothing more is to be asked of it.
class Answer {
 public:
  // The next bytes, at least one and at most `size`; 0 when no more will come.
  using Receive = std::function<absl::StatusOr<size_t>(char* to, size_t size)>;
  using Reached = std::function<void(uint64_t position)>;

  // `max_bytes`: of all parts together.
  Answer(Receive receive, Reached reached, uint64_t max_bytes)
      : receive_(std::move(receive)), reached_(std::move(reached)), left_(max_bytes) {}

  // What ended it before it was whole.
  enum class Fault {
    kNone,
    kLink,        // Receive failed, or no more came; the status is that of Receive
    kRefused,     // the reader's own words of the file; it can be asked again
    kNoMemory,    // so does the reader say
    kUnconfined,  // so does the reader say
    kSenseless,   // what came is no answer
  };
  Fault fault() const { return fault_; }

  // The next `size` bytes of all parts. INVALID_ARGUMENT: what came is no answer, or it ended
  // before. With kRefused, the code and the words of the reader; never one that asks for a second
  // try, or speaks of more than the file.
  absl::Status Read(char* to, size_t size);
  // INVALID_ARGUMENT as of Read(), or there is more.
  absl::Status ReadEnd();
  // Of a reader that starts: that it is ready.
  absl::Status ReadReady();
  // What is left of `max_bytes`.
  uint64_t left() const { return left_; }

 private:
  // The header of the next frame that is not kReached.
  absl::Status ReadFrame();
  absl::Status ReceiveAll(char* to, size_t size);
  absl::StatusOr<std::string> ReadText(size_t size);
  // Of a frame with which an answer ends too early.
  absl::Status EndOf(Frame frame);
  absl::Status Senseless(const std::string& what);

  Receive receive_;
  Reached reached_;
  uint64_t left_;
  Fault fault_ = Fault::kNone;
  Frame frame_ = Frame::kPart;
  size_t frame_left_ = 0;  // bytes of the frame that are still to come
};

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_ANSWER_H_
