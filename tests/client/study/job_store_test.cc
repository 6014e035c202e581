#include "client/study/job_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace vantage::study {
namespace {

using ::testing::HasSubstr;

class JobStoreTest : public ::testing::Test {
 protected:
  JobStoreTest() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = ::testing::TempDir() + "/vantage_job_store_" + info->name();
    std::filesystem::remove_all(folder_);
    store_.emplace(JobStore::Open(folder_).value());
    record_.set_format_version(kRecordFormat);
    record_.set_scene("flat-101");
    record_.set_planner("ours");
    record_.set_seed(3);
    record_.set_settings("steps 0.25");
    record_.set_attainable_area(1.0 / 3);
    study_records::v1::ScanRecord& scan = *record_.add_scans();
    scan.set_number(1);
    scan.set_covered(0.1 + 0.2);
    scan.add_notes("an \"odd\" note\nin two lines");
  }
  ~JobStoreTest() override { std::filesystem::remove_all(folder_); }

  std::optional<study_records::v1::JobRecord> Read() {
    return store_->Read("flat-101", "ours", 3, "steps 0.25", why_);
  }
  std::string Path() const { return store_->PathOf("flat-101", "ours", 3); }
  std::string Bytes() const {
    std::ifstream file(Path(), std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

  std::string folder_;
  std::optional<JobStore> store_;
  study_records::v1::JobRecord record_;
  std::string why_;
};

TEST_F(JobStoreTest, ReadsToTheBitWhatItWrote) {
  EXPECT_FALSE(Read());
  EXPECT_EQ(why_, "not done");
  ASSERT_TRUE(store_->Write(record_).ok());
  auto read = Read();
  ASSERT_TRUE(read) << why_;
  read->clear_checksum();
  EXPECT_EQ(read->SerializeAsString(), record_.SerializeAsString());
  // Nothing half-made is left behind.
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ + "/jobs")) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(files, 1);
}

TEST_F(JobStoreTest, EveryCutOffRecordIsDamaged) {
  ASSERT_TRUE(store_->Write(record_).ok());
  const std::string whole = Bytes();
  // The last byte is a line end, which says nothing.
  for (size_t size = 0; size + 2 < whole.size(); size += 7) {
    std::ofstream(Path(), std::ios::binary | std::ios::trunc) << whole.substr(0, size);
    EXPECT_FALSE(Read()) << size << " bytes of " << whole.size();
  }
}

TEST_F(JobStoreTest, AChangedFigureIsNoticed) {
  ASSERT_TRUE(store_->Write(record_).ok());
  std::string bytes = Bytes();
  const size_t at = bytes.find("0.30000000000000004");
  ASSERT_NE(at, std::string::npos) << bytes;
  bytes[at + 2] = '4';
  std::ofstream(Path(), std::ios::binary | std::ios::trunc) << bytes;
  EXPECT_FALSE(Read());
  EXPECT_EQ(why_, "damaged");
}

TEST_F(JobStoreTest, OtherSettingsAreAnotherJob) {
  ASSERT_TRUE(store_->Write(record_).ok());
  EXPECT_FALSE(store_->Read("flat-101", "ours", 3, "steps 0.5", why_));
  EXPECT_THAT(why_, HasSubstr("settings"));
  record_.set_format_version(kRecordFormat + 1);
  ASSERT_TRUE(store_->Write(record_).ok());
  EXPECT_FALSE(Read());
  EXPECT_THAT(why_, HasSubstr("format"));
}

TEST_F(JobStoreTest, FolderThatCannotBeMadeIsRefused) {
  std::ofstream(folder_ + "/file") << "no folder";
  EXPECT_EQ(JobStore::Open(folder_ + "/file").status().code(), absl::StatusCode::kPermissionDenied);
}

}  // namespace
}  // namespace vantage::study
