#include "core/confinement/reader.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include "absl/strings/str_cat.h"
#include "core/confinement/answer.h"
#include "core/confinement/confine.h"
#include "core/confinement/start.h"

namespace vantage::confinement {
namespace {

// A write fails only where nobody reads any more: then there is nothing left to do.
void WriteAll(const char* bytes, size_t size) {
  while (size > 0) {
    const ssize_t put = write(kAnswers, bytes, size);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) _exit(1);
    bytes += put;
    size -= static_cast<size_t>(put);
  }
}

void WriteFrame(Frame frame, absl::string_view content = {}) {
  const std::array<uint32_t, 2> header = {static_cast<uint32_t>(frame),
                                          static_cast<uint32_t>(content.size())};
  WriteAll(reinterpret_cast<const char*>(header.data()), kFrameHeaderBytes);
  WriteAll(content.data(), content.size());
}

bool ReadAll(char* to, size_t size) {
  while (size > 0) {
    const ssize_t got = read(kQuestions, to, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    to += got;
    size -= static_cast<size_t>(got);
  }
  return true;
}

[[noreturn]] void Run(const Reader& reader, const Bounds& bounds, uint64_t file_bytes) {
  if (const absl::Status confined = Confine(bounds); !confined.ok()) {
    WriteFrame(Frame::kUnconfined, confined.message().substr(0, kMaxTextBytes));
    _exit(1);
  }
  WriteFrame(Frame::kReady);
  try {
    Asker asker(file_bytes);
    reader.answer(asker);
  } catch (const std::bad_alloc&) {
    WriteFrame(Frame::kNoMemory);
  }
  _exit(0);
}

}  // namespace

int Asker::file() const { return kFile; }

std::optional<std::string> Asker::Next() {
  uint32_t size = 0;
  if (!ReadAll(reinterpret_cast<char*>(&size), sizeof(size)) || size > kMaxQuestionBytes) {
    return std::nullopt;
  }
  std::string question(size, '\0');
  if (!ReadAll(question.data(), size)) return std::nullopt;
  return question;
}

void Asker::Reached(uint64_t position) {
  WriteFrame(Frame::kReached,
             absl::string_view(reinterpret_cast<const char*>(&position), sizeof(position)));
}

void Asker::Say(absl::string_view bytes) {
  while (!bytes.empty()) {
    WriteFrame(Frame::kPart, bytes.substr(0, kMaxFrameBytes));
    bytes.remove_prefix(std::min(bytes.size(), kMaxFrameBytes));
  }
}

void Asker::End(const absl::Status& status) {
  if (status.ok()) {
    WriteFrame(Frame::kWhole);
    return;
  }
  const auto code = static_cast<uint32_t>(status.code());
  std::string content(reinterpret_cast<const char*>(&code), sizeof(code));
  absl::StrAppend(&content, status.message().substr(0, kMaxTextBytes));
  WriteFrame(Frame::kRefused, content);
}

void RunIfReader(int argc, char** argv, std::initializer_list<Reader> readers) {
  if (argc < 2 || std::strcmp(argv[1], kReaderArgument) != 0) return;
  for (const Reader& reader : readers) {
    if (argc != kReaderArguments || std::strcmp(argv[2], reader.name) != 0) continue;
    Bounds bounds;
    bounds.parent = static_cast<pid_t>(std::atol(argv[3]));
    bounds.memory_bytes = std::strtoull(argv[4], nullptr, 10);
    bounds.cpu_seconds = std::strtoull(argv[5], nullptr, 10);
    if (fcntl(kFile, F_GETFD) < 0) break;  // somebody tried it by hand
    Run(reader, bounds, std::strtoull(argv[6], nullptr, 10));
  }
  std::fprintf(stderr, "%s is for the program itself\n", kReaderArgument);
  _exit(2);
}

}  // namespace vantage::confinement
