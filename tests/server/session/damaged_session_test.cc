// A session whose log is damaged is left out at a start. Nothing that others do then takes anything
// of it: once its log is repaired, all of it is there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "server/contract/error.h"
#include "server/store/backup.h"
#include "server/store/disk_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

constexpr char kMarker[] = "the hall of mirrors";

class DamagedSession : public testing::Test {
 protected:
  DamagedSession() {
    std::string name = testing::TempDir() + "/damaged-XXXXXX";
    folder_ = mkdtemp(name.data());
    script_.EndPlans();
    Start();
    v1::CreateSessionRequest create = Creation();
    create.mutable_session()->set_display_name(kMarker);
    create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
    const auto museum = registry().Create(create, "city").value();
    const auto other = fixture::OpenSession(registry(), "other");
    const auto third = fixture::OpenSession(registry(), "third");
    scan_ = fixture::SendRoom(*museum, {2.0, 1.5, 1.4}).value();
    // The same scan in all three: one blob.
    third_scan_ = fixture::SendRoom(*third, {2.0, 1.5, 1.4}).value();
    EXPECT_TRUE(fixture::SendRoom(*other, {2.0, 1.5, 1.4}).ok());
    events_ = museum->journal().Events(0, 1000).value().size();
  }
  ~DamagedSession() override {
    Stop();
    fs::remove_all(folder_);
  }

  static v1::CreateSessionRequest Creation() {
    v1::CreateSessionRequest create;
    create.set_session_id("museum");
    return create;
  }
  void Start() {
    Stop();
    store_ = store::DiskStore::Open(folder_).value();
    host_ = std::make_unique<fixture::SessionHost>(*store_, script_.Make());
    ASSERT_TRUE(host_->registry.LoadAll().ok());
    ASSERT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
  }
  void Stop() {
    host_.reset();
    store_.reset();
  }
  SessionRegistry& registry() { return host_->registry; }

  // Flips a bit of the session's name in the first entry of its log; again: repairs it.
  void Flip() const {
    const std::string path = folder_ + "/logs.sqlite";
    std::ifstream in(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const size_t sound = bytes.find(kMarker);
    const size_t damaged = bytes.find(std::string(kMarker).replace(0, 1, "u"));
    const size_t at = sound != std::string::npos ? sound : damaged;
    ASSERT_NE(at, std::string::npos);
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(at));
    file.put(sound != std::string::npos ? 'u' : 't');
    ASSERT_TRUE(file.good());
  }

  std::string folder_;
  fixture::Script script_;
  std::unique_ptr<store::DiskStore> store_;
  std::unique_ptr<fixture::SessionHost> host_;
  std::string scan_;
  std::string third_scan_;
  size_t events_ = 0;
};

TEST_F(DamagedSession, ItsIdStaysReservedAndItsLogAndScansStay) {
  Stop();
  Flip();
  for (int start = 0; start < 2; ++start) {
    SCOPED_TRACE(start);
    Start();
    for (int again = 0; again < 2; ++again) {
      const absl::Status refused = registry().Create(Creation(), "city").status();
      EXPECT_TRUE(absl::IsAlreadyExists(refused)) << refused;
      EXPECT_EQ(contract::ReasonOf(refused), "SESSION_EXISTS");
      // Its first entry is damaged, so nobody knows that it is the city's.
      EXPECT_THAT(std::string(refused.message()), Not(HasSubstr("damaged")));
    }
    const absl::Status refused = registry().Create(Creation()).status();
    EXPECT_EQ(contract::ReasonOf(refused), "SESSION_EXISTS");
    EXPECT_THAT(std::string(refused.message()), HasSubstr("damaged"));
  }
  Stop();
  Flip();
  Start();
  const auto museum = registry().Find("museum");
  ASSERT_TRUE(museum.ok()) << museum.status();
  EXPECT_EQ((*museum)->journal().Events(0, 1000).value().size(), events_);
  EXPECT_TRUE((*museum)->scans().LoadImage(scan_).ok());
  const auto report = store::VerifyStore(folder_).value();
  EXPECT_TRUE(report.faults.empty()) << report.faults[0];
}

TEST_F(DamagedSession, SaysSoToItsTenantAndCanBeGivenUp) {
  Stop();
  Flip();
  Start();
  // The damage is in the entry that names the tenant, so only who sees all sessions is told.
  EXPECT_TRUE(absl::IsNotFound(registry().Find("museum", "city").status()));
  EXPECT_TRUE(absl::IsNotFound(registry().Delete("museum", "", "city").status()));
  const absl::Status damaged = registry().Find("museum").status();
  EXPECT_TRUE(absl::IsDataLoss(damaged)) << damaged;
  EXPECT_EQ(contract::ReasonOf(damaged), "SESSION_DAMAGED");
  EXPECT_THAT(std::string(damaged.message()), HasSubstr("vantaged salvage museum"));
  EXPECT_EQ(registry().Totals().left_out, 1U);
  ASSERT_TRUE(registry().Delete("museum", "request").ok());
  EXPECT_TRUE(registry().Delete("museum", "request").ok()) << "sent again";
  EXPECT_TRUE(absl::IsNotFound(registry().Find("museum").status()));
  EXPECT_EQ(registry().Totals().left_out, 0U);
  EXPECT_TRUE(registry().Create(Creation()).ok());
  Start();
  EXPECT_TRUE(registry().Find("third").value()->scans().LoadImage(third_scan_).ok());
  const auto report = store::VerifyStore(folder_).value();
  EXPECT_TRUE(report.faults.empty()) << report.faults[0];
}

TEST_F(DamagedSession, SaysSoToItsTenantWhereItIsKnown) {
  const auto entries = store_->Read("museum", 0, 1000).value();
  // A log that breaks off in its second entry.
  storage::v1::LogEntry second = entries[1];
  ASSERT_TRUE(store_->Append("palace", entries[0]).ok());
  second.mutable_event()->clear_event();
  ASSERT_TRUE(store_->Append("palace", second).ok());
  Start();
  EXPECT_EQ(contract::ReasonOf(registry().Find("palace", "city").status()), "SESSION_DAMAGED");
  EXPECT_TRUE(absl::IsNotFound(registry().Find("palace", "village").status()));
  EXPECT_TRUE(absl::IsNotFound(registry().Delete("palace", "", "village").status()));
  EXPECT_TRUE(registry().Delete("palace", "", "city").ok());
}

// While it is not known what a damaged session needs, nothing that was there is removed, whoever
// lets go of it.
TEST_F(DamagedSession, WhatOthersLetGoOfStays) {
  Stop();
  Flip();
  Start();
  ASSERT_TRUE(registry().Delete("other").ok());
  const auto third = registry().Find("third").value();
  EXPECT_TRUE(third->scans().LoadImage(third_scan_).ok());
  ASSERT_TRUE(registry().Delete("third").ok());
  Stop();
  Flip();
  Start();
  EXPECT_TRUE(registry().Find("museum").value()->scans().LoadImage(scan_).ok());
  // Now that all is known, only what it needs is kept.
  ASSERT_TRUE(registry().Delete("museum").ok());
  for (const auto& file : fs::recursive_directory_iterator(folder_ + "/blobs")) {
    EXPECT_FALSE(file.is_regular_file()) << file.path();
  }
}

// A log that was written meanwhile, by whomever, is not this call's to take back.
TEST_F(DamagedSession, AFailingCreationTakesBackOnlyWhatItWrote) {
  const auto entries = store_->Read("museum", 0, 1000).value();
  for (const storage::v1::LogEntry& entry : entries) {
    ASSERT_TRUE(store_->Append("unknown", entry).ok());
  }
  v1::CreateSessionRequest create;
  create.set_session_id("unknown");
  EXPECT_FALSE(registry().Create(create).ok());
  EXPECT_EQ(store_->Read("unknown", 0, 1000).value().size(), entries.size());
}

}  // namespace
}  // namespace vantage::session
