#include "core/confinement/answer.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace vantage::confinement {
namespace {

// A terminal shows no commands of a stranger.
std::string Printable(std::string text) {
  for (char& c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) c = '?';
  }
  return text;
}

// What a parser may say of a file. Others would make a caller try again, or look for a fault
// elsewhere.
absl::StatusCode CodeOf(uint32_t code) {
  switch (static_cast<absl::StatusCode>(code)) {
    case absl::StatusCode::kDataLoss:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kUnimplemented:
      return static_cast<absl::StatusCode>(code);
    default:
      return absl::StatusCode::kInvalidArgument;
  }
}

}  // namespace

absl::Status Answer::Senseless(const std::string& what) {
  fault_ = Fault::kSenseless;
  return absl::InvalidArgumentError(what);
}

absl::Status Answer::ReceiveAll(char* to, size_t size) {
  while (size > 0) {
    const absl::StatusOr<size_t> got = receive_(to, size);
    if (!got.ok() || *got == 0) {
      fault_ = Fault::kLink;
      return got.ok() ? absl::InvalidArgumentError("it ends early") : got.status();
    }
    to += *got;
    size -= *got;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> Answer::ReadText(size_t size) {
  if (size > kMaxTextBytes) return Senseless(absl::StrCat("a text of ", size, " bytes"));
  std::string text(size, '\0');
  if (absl::Status read = ReceiveAll(text.data(), size); !read.ok()) return read;
  return Printable(std::move(text));
}

absl::Status Answer::ReadFrame() {
  while (true) {
    std::array<uint32_t, 2> header{};
    if (absl::Status read = ReceiveAll(reinterpret_cast<char*>(header.data()), kFrameHeaderBytes);
        !read.ok()) {
      return read;
    }
    const auto [kind, size] = header;
    if (kind > static_cast<uint32_t>(Frame::kUnconfined) || size > kMaxFrameBytes) {
      return Senseless(absl::StrCat("a frame of kind ", kind, " with ", size, " bytes"));
    }
    frame_ = static_cast<Frame>(kind);
    frame_left_ = size;
    if (frame_ == Frame::kPart && size > left_) return Senseless("more bytes than are allowed");
    if (frame_ != Frame::kReached) return absl::OkStatus();
    uint64_t position = 0;
    if (size != sizeof(position)) return Senseless(absl::StrCat("a position of ", size, " bytes"));
    if (absl::Status read = ReceiveAll(reinterpret_cast<char*>(&position), sizeof(position));
        !read.ok()) {
      return read;
    }
    frame_left_ = 0;
    if (reached_) reached_(position);
  }
}

absl::Status Answer::EndOf(Frame frame) {
  if (frame == Frame::kRefused) {
    uint32_t code = 0;
    if (frame_left_ < sizeof(code)) return Senseless("a refusal without a code");
    if (absl::Status read = ReceiveAll(reinterpret_cast<char*>(&code), sizeof(code)); !read.ok()) {
      return read;
    }
    absl::StatusOr<std::string> why = ReadText(frame_left_ - sizeof(code));
    if (!why.ok()) return why.status();
    if (why->empty()) return Senseless("a refusal without a reason");
    fault_ = Fault::kRefused;
    return {CodeOf(code), *why};
  }
  if (frame == Frame::kUnconfined) {
    absl::StatusOr<std::string> why = ReadText(frame_left_);
    if (!why.ok()) return why.status();
    if (why->empty()) return Senseless("a fault without a reason");
    fault_ = Fault::kUnconfined;
    return absl::FailedPreconditionError(*why);
  }
  if (frame == Frame::kNoMemory && frame_left_ == 0) {
    fault_ = Fault::kNoMemory;
    return absl::InvalidArgumentError("no memory left");
  }
  return Senseless(
      absl::StrCat("a frame of kind ", static_cast<uint32_t>(frame), " at the wrong place"));
}

absl::Status Answer::Read(char* to, size_t size) {
  while (size > 0) {
    if (frame_left_ == 0) {
      if (absl::Status read = ReadFrame(); !read.ok()) return read;
      if (frame_ != Frame::kPart) return EndOf(frame_);
      continue;  // a part may be empty
    }
    const size_t piece = std::min(size, frame_left_);
    if (absl::Status read = ReceiveAll(to, piece); !read.ok()) return read;
    to += piece;
    size -= piece;
    frame_left_ -= piece;
    left_ -= piece;
  }
  return absl::OkStatus();
}

absl::Status Answer::ReadEnd() {
  if (frame_left_ > 0) return Senseless("more than an answer");
  if (absl::Status read = ReadFrame(); !read.ok()) return read;
  if (frame_ != Frame::kWhole) return EndOf(frame_);
  return frame_left_ == 0 ? absl::OkStatus() : Senseless("an end with content");
}

absl::Status Answer::ReadReady() {
  if (absl::Status read = ReadFrame(); !read.ok()) return read;
  if (frame_ != Frame::kReady) return EndOf(frame_);
  return frame_left_ == 0 ? absl::OkStatus() : Senseless("a beginning with content");
}

}  // namespace vantage::confinement
