// That the listener of ./dev claims finds what is broken.
#include "tests/faults/claim_storm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "tests/faults/claim_log.h"
#include "tests/integration/process.h"

namespace vantage::faults {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int64_t kStart = 1'700'000'000;  // s

// A log of claims that a test writes, a second between events.
class Writer {
 public:
  explicit Writer(ClaimLog& log) : log_(log) {
    v1::SessionEvent event;
    event.mutable_scanner_created()->mutable_scanner()->set_name("red");
    Write(event);
  }
  void Write(v1::SessionEvent event) {
    event.set_sequence(++sequence_);
    event.mutable_time()->set_seconds(kStart + now_++);
    log_.Take(event);
  }
  void Skip() { ++sequence_; }
  void Again() { --sequence_; }
  void Wait(int64_t seconds) { now_ += seconds; }

  v1::Claim ClaimAt(const std::string& name, double x, int64_t ttl = 20) const {
    v1::Claim claim;
    claim.set_name(name);
    claim.set_scanner("red");
    claim.mutable_position()->set_x(x);
    claim.mutable_create_time()->set_seconds(kStart + now_);
    claim.mutable_expire_time()->set_seconds(kStart + now_ + ttl);
    return claim;
  }
  void Take(const v1::Claim& claim) {
    v1::SessionEvent event;
    *event.mutable_claim_taken()->mutable_claim() = claim;
    Write(event);
  }
  void End(const v1::Claim& claim, v1::ClaimEndReason reason, const std::string& scan = "") {
    v1::SessionEvent event;
    *event.mutable_claim_ended()->mutable_claim() = claim;
    event.mutable_claim_ended()->set_end_reason(reason);
    event.mutable_claim_ended()->set_scan(scan);
    Write(event);
  }
  void Merge(const std::string& name, double x) {
    v1::SessionEvent event;
    v1::Scan& scan = *event.mutable_scan_merged()->mutable_scan();
    scan.set_name(name);
    scan.set_scanner("red");
    scan.mutable_pose()->mutable_translation()->set_x(x);
    Write(event);
  }

 private:
  ClaimLog& log_;
  uint64_t sequence_ = 0;
  int64_t now_ = 0;  // s
};

TEST(ClaimLog, FindsNothingWrongWithWhatIsRight) {
  ClaimLog log;
  Writer writer(log);
  const v1::Claim a = writer.ClaimAt("a", 0);
  writer.Take(a);
  const v1::Claim b = writer.ClaimAt("b", 0.61);
  writer.Take(b);
  writer.End(a, v1::CLAIM_END_REASON_RELEASED);
  writer.Take(writer.ClaimAt("c", 0));
  writer.Merge("scan", 1.05);
  writer.End(b, v1::CLAIM_END_REASON_SCAN_ARRIVED, "scan");
  writer.Wait(17);
  writer.End(writer.ClaimAt("c", 0), v1::CLAIM_END_REASON_EXPIRED);
  EXPECT_THAT(log.broken(), IsEmpty());
  EXPECT_EQ(log.held(), 0U);
}

TEST(ClaimLog, FindsGapsRepetitionsAndDoubleClaims) {
  {
    ClaimLog log;
    Writer writer(log);
    writer.Skip();
    writer.Take(writer.ClaimAt("a", 0));
    EXPECT_THAT(absl::StrJoin(log.broken(), "\n"), HasSubstr("an event is lost"));
  }
  {
    ClaimLog log;
    Writer writer(log);
    writer.Again();
    writer.Merge("scan", 0);
    EXPECT_THAT(absl::StrJoin(log.broken(), "\n"), HasSubstr("came twice"));
  }
  {
    ClaimLog log;
    Writer writer(log);
    writer.Take(writer.ClaimAt("a", 0));
    writer.Take(writer.ClaimAt("b", 0.59));
    EXPECT_THAT(absl::StrJoin(log.broken(), "\n"), HasSubstr("b is 0.59 m from a"));
  }
  {
    ClaimLog log;
    Writer writer(log);
    for (int i = 0; i < 9; ++i) writer.Take(writer.ClaimAt(absl::StrCat("c", i), i));
    EXPECT_THAT(absl::StrJoin(log.broken(), "\n"), HasSubstr("red has 9 claims"));
  }
}

TEST(ClaimLog, FindsClaimsThatEndAtTheWrongTime) {
  {
    ClaimLog log;
    Writer writer(log);
    const v1::Claim claim = writer.ClaimAt("a", 0);
    writer.Take(claim);
    writer.End(claim, v1::CLAIM_END_REASON_EXPIRED);
    EXPECT_THAT(absl::StrJoin(log.broken(), "\n"), HasSubstr("s before its time"));
  }
  {
    ClaimLog log;
    Writer writer(log);
    const v1::Claim claim = writer.ClaimAt("a", 0);
    writer.Take(claim);
    writer.Wait(30);
    writer.End(claim, v1::CLAIM_END_REASON_EXPIRED);
    EXPECT_THAT(absl::StrJoin(log.broken(), "\n"), HasSubstr("s after its time"));
  }
  {
    ClaimLog log;
    Writer writer(log);
    writer.Take(writer.ClaimAt("a", 0));
    writer.Wait(30);
    writer.Take(writer.ClaimAt("b", 5));
    EXPECT_THAT(absl::StrJoin(log.broken(), "\n"), HasSubstr("still stands"));
  }
  {
    ClaimLog log;
    Writer writer(log);
    const v1::Claim claim = writer.ClaimAt("a", 0);
    writer.Take(claim);
    writer.Merge("scan", 0.6);
    writer.End(claim, v1::CLAIM_END_REASON_SCAN_ARRIVED, "scan");
    EXPECT_THAT(absl::StrJoin(log.broken(), "\n"), HasSubstr("a scan made 0.60 m away"));
  }
}

}  // namespace
}  // namespace vantage::faults
