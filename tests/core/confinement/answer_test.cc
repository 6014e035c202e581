#include "core/confinement/answer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace vantage::confinement {
namespace {

void Put(Frame frame, const std::string& content, std::string& out) {
  const std::array<uint32_t, 2> header = {static_cast<uint32_t>(frame),
                                          static_cast<uint32_t>(content.size())};
  out.append(reinterpret_cast<const char*>(header.data()), sizeof(header));
  out += content;
}

// Arrives in pieces of at most `piece` bytes.
Answer::Receive From(const std::string& bytes, size_t piece) {
  return [&bytes, piece, at = size_t{0}](char* to, size_t size) mutable -> absl::StatusOr<size_t> {
    const size_t got = std::min({size, piece, bytes.size() - at});
    std::memcpy(to, bytes.data() + at, got);
    at += got;
    return got;
  };
}

// However it was cut into parts and arrives in pieces, an answer is the same; and however much of
// it is missing, or more than is allowed, it is none.
TEST(AnswerTest, CutsDoNotMatter) {
  std::mt19937 random(1);
  for (int times = 0; times < 200; ++times) {
    std::string whole;
    std::string sent;
    std::vector<uint64_t> positions;
    for (int parts = static_cast<int>(random() % 20); parts >= 0; --parts) {
      std::string part(1 + random() % 50, static_cast<char>('a' + parts));
      whole += part;
      Put(Frame::kPart, part, sent);
      if (random() % 3 == 0) {
        positions.push_back(random());
        std::string position(8, '\0');
        std::memcpy(position.data(), &positions.back(), 8);
        Put(Frame::kReached, position, sent);
      }
    }
    Put(Frame::kWhole, "", sent);
    std::vector<uint64_t> reached;
    const auto read = [&](const std::string& bytes, uint64_t max_bytes) {
      reached.clear();
      std::string got(whole.size(), '\0');
      Answer answer(
          From(bytes, 1 + random() % 30), [&](uint64_t p) { reached.push_back(p); }, max_bytes);
      for (size_t at = 0; at < got.size();) {
        const size_t size = std::min<size_t>(got.size() - at, 1 + random() % 40);
        if (!answer.Read(got.data() + at, size).ok()) return std::string("none");
        at += size;
      }
      return answer.ReadEnd().ok() ? got : std::string("none");
    };
    EXPECT_EQ(read(sent, whole.size()), whole);
    EXPECT_EQ(reached, positions);
    EXPECT_EQ(read(sent, whole.size() - 1), "none");
    EXPECT_EQ(read(sent.substr(0, random() % sent.size()), whole.size()), "none");
  }
}

TEST(AnswerTest, WhatIsNoAnswerIsNone) {
  const auto fault = [](Frame frame, const std::string& content) {
    std::string sent;
    Put(frame, content, sent);
    Answer answer(From(sent, 7), {}, 100);
    char byte = 0;
    EXPECT_FALSE(answer.Read(&byte, 1).ok());
    return answer.fault();
  };
  using Fault = Answer::Fault;
  EXPECT_EQ(fault(Frame::kReady, ""), Fault::kSenseless);
  EXPECT_EQ(fault(Frame::kReached, "1234567"), Fault::kSenseless);
  EXPECT_EQ(fault(Frame::kPart, std::string(101, 'x')), Fault::kSenseless);
  EXPECT_EQ(fault(Frame::kWhole, ""), Fault::kSenseless);
  EXPECT_EQ(fault(Frame::kRefused, "123"), Fault::kSenseless);
  EXPECT_EQ(fault(Frame::kRefused, std::string(4, '\3')), Fault::kSenseless);
  EXPECT_EQ(fault(Frame::kRefused, "\3" + std::string(3, '\0') + "why"), Fault::kRefused);
  EXPECT_EQ(fault(Frame::kRefused, std::string(kMaxTextBytes + 5, 'x')), Fault::kSenseless);
  EXPECT_EQ(fault(Frame::kNoMemory, ""), Fault::kNoMemory);
  EXPECT_EQ(fault(Frame::kNoMemory, "x"), Fault::kSenseless);
  EXPECT_EQ(fault(Frame::kUnconfined, "why"), Fault::kUnconfined);
  EXPECT_EQ(fault(Frame::kUnconfined, ""), Fault::kSenseless);
  EXPECT_EQ(fault(static_cast<Frame>(7), ""), Fault::kSenseless);
}

}  // namespace
}  // namespace vantage::confinement
