// A folder of exports is followed: previews first, whole scans in their places, in order, and what
// is still being written is waited for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "core/sensor/encoding.h"
#include "tests/integration/answers.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

class FollowTest : public ::testing::Test {
 protected:
  FollowTest() {
    EXPECT_FALSE(server_.address().empty());
    EXPECT_EQ(Vantage(server_, {"session", "create", "job"}).exit_code, 0);
  }

  std::string In(const std::string& name) const { return scratch_.File(name); }
  // A scan as a file that was written `minutes` ago.
  void Export(const std::string& name, const Eigen::Vector3d& position, int minutes) const {
    std::ofstream(In(name), std::ios::binary)
        << sensor::EncodeRangeImage(fixture::NoisyRoom(position, 1.0));
    fs::last_write_time(In(name), fs::file_time_type::clock::now() - std::chrono::minutes(minutes));
  }
  // The room is the same from two of its corners, so a scan needs to be told where it stands.
  void Tell(const std::string& name, const Eigen::Vector3d& position) const {
    std::ofstream(In("poses.txt"), std::ios::app)
        << name << " 1 0 0 " << position.x() << " 0 1 0 " << position.y() << " 0 0 1 "
        << position.z() << " 0 0 0 1\n";
  }
  Finished Follow(const std::vector<std::string>& more) {
    std::vector<std::string> words = {"follow", scratch_.File(""), "job", "--once"};
    words.insert(words.end(), more.begin(), more.end());
    return Vantage(server_, words);
  }
  std::string Listed() { return Vantage(server_, {"scan", "list", "job"}).out; }

  const ScratchFolder scratch_;
  ServerProcess server_;
};

TEST_F(FollowTest, PreviewsComeFirstAndWholeScansInTheirPlaces) {
  // By the time of their writing, not by name.
  Export("b.vrim", {2.0, 1.5, 1.4}, 3);
  Export("a.vrim", {3.0, 2.5, 1.4}, 2);
  Tell("b", {2.0, 1.5, 1.4});
  Tell("a", {3.0, 2.5, 1.4});
  Tell("c", {1.2, 2.2, 1.4});
  const std::vector<std::string> flags = {"--preview", "--preview-step", "4", "--prior-file",
                                          In("poses.txt")};
  const Finished done = Follow(flags);
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const std::vector<std::string> expected = {"scan-1  b", "a preview", "scan-2  a",
                                             "a preview", "scan-1  b", "scan-2  a"};
  size_t at = 0;
  for (const std::string& next : expected) {
    at = done.out.find(next, at);
    ASSERT_NE(at, std::string::npos) << next << "\\n" << done.out;
    ++at;
  }
  EXPECT_EQ(done.out.find("a preview", at), std::string::npos) << done.out;
  EXPECT_THAT(Listed(), Not(HasSubstr("preview")));
  EXPECT_THAT(Listed(), Not(HasSubstr("scan-3")));
  // Whoever starts it again sends nothing twice, and goes on.
  Export("c.vrim", {1.2, 2.2, 1.4}, 1);
  const Finished again = Follow(flags);
  ASSERT_EQ(again.exit_code, 0) << again.error;
  EXPECT_THAT(again.out, Not(HasSubstr("scan-1")));
  EXPECT_THAT(Listed(), HasSubstr("scan-3"));
  EXPECT_THAT(Listed(), Not(HasSubstr("scan-4")));
}

TEST_F(FollowTest, WhatIsBeingWrittenIsWaitedFor) {
  const std::string bytes = sensor::EncodeRangeImage(fixture::NoisyRoom({2.0, 1.5, 1.4}, 1.0));
  std::thread writer([&] {
    std::ofstream file(In("slow.vrim"), std::ios::binary);
    for (size_t part = 0; part < 8; ++part) {
      const size_t from = part * bytes.size() / 8;
      file << bytes.substr(from, (part + 1) * bytes.size() / 8 - from) << std::flush;
      std::this_thread::sleep_for(std::chrono::milliseconds(250));
    }
  });
  while (!fs::exists(In("slow.vrim"))) std::this_thread::yield();
  const Finished done = Follow({"--settle", "1.5"});
  writer.join();
  EXPECT_EQ(done.exit_code, 0) << done.error;
  EXPECT_THAT(done.out, HasSubstr("merged"));
}

TEST_F(FollowTest, AFileAtFaultIsSaidAndTheOthersAreSent) {
  Export("good.vrim", {2.0, 1.5, 1.4}, 1);
  std::ofstream(In("bad.vrim"), std::ios::binary) << "no scan";
  fs::last_write_time(In("bad.vrim"), fs::file_time_type::clock::now() - std::chrono::minutes(5));
  std::ofstream(In("empty.e57"), std::ios::binary).flush();
  const Finished done = Follow({"--settle", "0.5"});
  EXPECT_EQ(done.exit_code, 7) << done.error;
  EXPECT_THAT(done.error, HasSubstr("bad.vrim"));
  EXPECT_THAT(done.error, HasSubstr("empty.e57"));
  EXPECT_THAT(Listed(), HasSubstr("good"));
}

// Its reader needs more memory than it may have, which ends it as a crash does.
TEST_F(FollowTest, AFileWhoseReaderEndsIsSaidAndTheOthersAreSent) {
  sensor::RangeImage large = fixture::NoisyRoom({3.0, 2.5, 1.4}, 1.0);
  const size_t rows = large.elevation.size();
  large.azimuth.resize(20'000);
  for (size_t i = 0; i < large.azimuth.size(); ++i) {
    large.azimuth[i] = -3.1 + 3e-4 * static_cast<double>(i);
  }
  large.range.assign(large.azimuth.size() * rows, 2.0F);
  std::ofstream(In("large.vrim"), std::ios::binary) << sensor::EncodeRangeImage(large);
  fs::last_write_time(In("large.vrim"), fs::file_time_type::clock::now() - std::chrono::minutes(5));
  Export("good.vrim", {2.0, 1.5, 1.4}, 1);
  const Finished done = Follow({"--settle", "0.5", "--reader-memory", "8"});
  EXPECT_EQ(done.exit_code, 7) << done.error;
  EXPECT_THAT(done.error, HasSubstr("large.vrim: its reader needs more than 8 MB of memory"));
  EXPECT_THAT(done.error, HasSubstr("--reader-memory"));
  EXPECT_THAT(Listed(), HasSubstr("good"));
}

TEST_F(FollowTest, AFolderOrJobThatIsNotThereIsSaid) {
  const Finished folder = Vantage(server_, {"follow", In("none"), "job", "--once"});
  EXPECT_EQ(folder.exit_code, 3);
  EXPECT_THAT(folder.error, HasSubstr("none"));
  Export("a.vrim", {2.0, 1.5, 1.4}, 1);
  const Finished job = Vantage(server_, {"follow", scratch_.File(""), "nojob", "--once"});
  EXPECT_EQ(job.exit_code, 3) << job.error;
}

TEST_F(FollowTest, AnotherScanUnderAPreviewsNameIsRefused) {
  Export("a.vrim", {2.0, 1.5, 1.4}, 1);
  ASSERT_EQ(
      Vantage(server_, {"scan", "push", "job", In("a.vrim"), "--preview", "--preview-step", "4"})
          .exit_code,
      0);
  Export("a.vrim", {3.0, 2.5, 1.4}, 1);
  const Finished other = Vantage(server_, {"scan", "push", "job", In("a.vrim")});
  EXPECT_EQ(other.exit_code, 7) << other.out;
  EXPECT_THAT(other.error, HasSubstr("another scan"));
  EXPECT_THAT(Listed(), HasSubstr("preview"));
}

}  // namespace
}  // namespace vantage::integration
