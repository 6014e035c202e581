// Errors of a store are counted, logged in full, and reported to clients without the server's
// paths.
#include "server/store/instrumented_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "server/contract/error.h"
#include "server/store/memory_store.h"

namespace vantage::store {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr char kPath[] = "/var/lib/vantage/blobs/5c/5cbc9bc1";

// Every step of blobs fails as it is told.
class FailingStore final : public MemoryStore {
 public:
  FailingStore() : MemoryStore(1 << 20) {}
  absl::Status error;

  absl::StatusOr<std::string> GetBlob(const std::string&) const override { return error; }
  absl::Status ReleaseBlob(const std::string&) override { return error; }
};

class InstrumentedStoreTest : public testing::Test {
 protected:
  int64_t Errors(const std::string& operation, const std::string& code) {
    return metrics_
        .CounterOf("vantage_store_errors_total", "", {{"operation", operation}, {"code", code}})
        .value();
  }

  FailingStore failing_;
  telemetry::Metrics metrics_;
  std::string lines_;
  telemetry::Log log_{telemetry::LogLevel::kInfo,
                      [this](absl::string_view line) { lines_ += std::string(line) + "\n"; }};
  InstrumentedStore store_{failing_, metrics_, log_};
};

TEST_F(InstrumentedStoreTest, TellsTheCodeAndNoPath) {
  for (const absl::StatusCode code :
       {absl::StatusCode::kResourceExhausted, absl::StatusCode::kUnavailable,
        absl::StatusCode::kDataLoss, absl::StatusCode::kNotFound, absl::StatusCode::kAborted,
        absl::StatusCode::kFailedPrecondition, absl::StatusCode::kInternal}) {
    failing_.error = absl::Status(code, std::string("cannot open ") + kPath);
    lines_.clear();
    for (const absl::Status& told :
         {store_.GetBlob("sha256").status(), store_.ReleaseBlob("sha256")}) {
      EXPECT_EQ(told.code(), code);
      EXPECT_THAT(told.ToString(), Not(HasSubstr("/var"))) << told;
      EXPECT_FALSE(told.message().empty());
      EXPECT_EQ(contract::ReasonOf(told),
                code == absl::StatusCode::kResourceExhausted ? "STORE_FULL" : "");
    }
    EXPECT_THAT(lines_, HasSubstr(kPath)) << "the operator has to know";
  }
}

TEST_F(InstrumentedStoreTest, CountsFailuresNotAnswers) {
  failing_.error = absl::NotFoundError("no such blob");
  EXPECT_FALSE(store_.GetBlob("sha256").ok());
  EXPECT_EQ(Errors("get_blob", "NOT_FOUND"), 0);
  failing_.error = absl::UnavailableError("the disk fails");
  EXPECT_FALSE(store_.GetBlob("sha256").ok());
  EXPECT_FALSE(store_.GetBlob("sha256").ok());
  EXPECT_EQ(Errors("get_blob", "UNAVAILABLE"), 2);
}

TEST_F(InstrumentedStoreTest, PassesOnWhatWentWell) {
  const std::string blob = store_.PutBlob("bytes").value();
  EXPECT_EQ(store_.BlobSize(blob).value(), 5);
  EXPECT_EQ(lines_, "");
}

}  // namespace
}  // namespace vantage::store
