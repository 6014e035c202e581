// What scans show of their instrument, as sessions keep and use it.
#include "server/session/instrument.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

registration::PairResiduals Residuals(double shared) {
  registration::PairResiduals pair{};
  pair[4] = {300, 300 * shared * shared, 9000, 0.09, 0.08};
  pair[9] = {17, -1.0 / 3, 400, 0.001, 1.0 / 7};  // what no decimal holds
  return pair;
}

class InstrumentTest : public testing::Test {
 protected:
  v1::Scan Send(Session& session, double x) {
    const v1::PosePrior prior = fixture::PriorAt(x, 1.5, 1.4);
    const auto upload = fixture::SendScan(session, fixture::EncodedRoom({x, 1.5, 1.4}), &prior);
    EXPECT_TRUE(upload.ok()) << upload.status();
    if (!upload.ok()) return {};
    session.WaitUntilIdle();
    return session.scans().Get(upload->scan()).value();
  }
  // What an alignment is told now.
  registration::InstrumentResiduals Told(Session& session, double x) {
    script_.SetVerdict(registration::RegistrationOutcome::kFailed);
    script_.SetResiduals({});
    Send(session, x);
    return script_.Instrument();
  }
  static void ExpectSame(const registration::InstrumentResiduals& got,
                         std::vector<registration::PairResiduals> scans) {
    const auto expected = registration::InstrumentResiduals::Of(std::move(scans));
    EXPECT_EQ(got.scans(), expected.scans());
    EXPECT_EQ(got.sums(), expected.sums());
  }
  store::MemoryStore store_{size_t{256} << 20};
  fixture::Script script_;
};

TEST_F(InstrumentTest, EachScanIsToldWhatThoseBeforeItHaveShown) {
  fixture::SessionHost host(store_, script_.Make());
  const auto session = fixture::OpenSession(host.registry, "job");
  Send(*session, 2);  // defines the frame
  script_.SetResiduals(Residuals(0.011));
  Send(*session, 2.4);
  EXPECT_TRUE(script_.Instrument().empty());
  script_.SetResiduals(Residuals(0.013));
  // Kept out of the model by these residuals alone, it counts as well.
  script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
  const v1::Scan kept = Send(*session, 2.8);
  EXPECT_EQ(kept.state(), v1::SCAN_STATE_DOUBTFUL);
  EXPECT_EQ(kept.registration().class_residuals_size(), 2);
  ExpectSame(script_.Instrument(), {Residuals(0.011)});
  ExpectSame(Told(*session, 3.2), {Residuals(0.013), Residuals(0.011)});
}

TEST_F(InstrumentTest, OfWithdrawnScansNothingIsLearned) {
  fixture::SessionHost host(store_, script_.Make());
  const auto session = fixture::OpenSession(host.registry, "job");
  Send(*session, 2);
  script_.SetResiduals(Residuals(0.011));
  const v1::Scan gone = Send(*session, 2.4);
  script_.SetResiduals(Residuals(0.013));
  Send(*session, 2.8);
  ASSERT_TRUE(session->scans().Withdraw(gone.name(), {}).ok());
  session->WaitUntilIdle();
  ExpectSame(Told(*session, 3.2), {Residuals(0.013)});
}

TEST_F(InstrumentTest, IsTheSameAfterARestart) {
  const auto register_two = [&](double first, double second) {
    fixture::SessionHost host(store_, script_.Make());
    const auto session = fixture::OpenSession(host.registry, "job");
    Send(*session, 2);
    script_.SetResiduals(Residuals(first));
    Send(*session, 2.4);
    script_.SetResiduals(Residuals(second));
    Send(*session, 2.8);
  };
  register_two(0.011, 0.013);
  fixture::SessionHost again(store_, script_.Make());
  ASSERT_TRUE(again.registry.LoadAll().ok());
  const auto session = again.registry.Find("job");
  ASSERT_TRUE(session.ok()) << session.status();
  ExpectSame(Told(**session, 3.2), {Residuals(0.011), Residuals(0.013)});
}

TEST_F(InstrumentTest, IsLearnedOfEachScannerByItself) {
  v1::ScannerModel one;
  one.set_id("one");
  one.set_range_noise_m(0.003);
  v1::ScannerModel other = one;
  other.set_range_noise_m(0.001);
  SessionState state;
  const auto add = [&](const std::string& name, const v1::ScannerModel& scanner, double shared) {
    v1::Scan& scan = state.scans[name].scan;
    scan.set_name(name);
    *scan.mutable_scanner_model() = scanner;
    v1::ClassResiduals& of = *scan.mutable_registration()->add_class_residuals();
    of.set_class_index(4);
    of.set_block_count(100);
    of.set_shared_m2(100 * shared * shared);
    of.set_freedom_count(100);
  };
  add("a", one, 0.01);
  add("b", other, 0.02);
  EXPECT_EQ(InstrumentShown(state, one).scans(), 1u);
  EXPECT_DOUBLE_EQ(InstrumentShown(state, one).sums()[4].shared, 100 * 0.01 * 0.01);
  EXPECT_DOUBLE_EQ(InstrumentShown(state, other).sums()[4].shared, 100 * 0.02 * 0.02);
  EXPECT_TRUE(InstrumentShown(state, one, "a").empty());
  EXPECT_NE(session::Told(InstrumentShown(state, one)),
            session::Told(InstrumentShown(state, other)));
}

}  // namespace
}  // namespace vantage::session
