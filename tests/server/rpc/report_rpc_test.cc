// ExportReport.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/bytes/checksum.h"
#include "server/contract/valid_text.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::rpc {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class ReportRpc : public testing::Test {
 protected:
  grpc::Status Export(const v1::ExportReportRequest& request, std::string& file) {
    grpc::ClientContext context;
    const auto stream = server_.models->ExportReport(&context, request);
    v1::ExportReportResponse part;
    file.clear();
    while (stream->Read(&part)) {
      EXPECT_EQ(part.offset(), static_cast<int64_t>(file.size()));
      EXPECT_EQ(part.crc32c(), bytes::Crc32c(part.data()));
      EXPECT_LE(part.data().size(), size_t{256} << 10);
      EXPECT_EQ(part.file_name(), file.empty() ? name_ : "");
      file += part.data();
      version_ = part.model_version();
    }
    return stream->Finish();
  }

  fixture::Script script_;
  fixture::InProcess server_{script_.Make()};
  std::string name_ = "room.html";
  uint64_t version_ = 0;
};

TEST_F(ReportRpc, IsOneValidPageInBothLanguages) {
  v1::ExportReportRequest request;
  request.set_name(server_.OpenRoom("room"));
  {
    grpc::ClientContext context;
    v1::UpdateSessionRequest update;
    update.mutable_session()->set_name(request.name());
    update.mutable_session()->set_display_name("<script>alert(1)</script>");
    update.mutable_update_mask()->add_paths("display_name");
    v1::UpdateSessionResponse updated;
    ASSERT_TRUE(server_.sessions->UpdateSession(&context, update, &updated).ok());
  }
  std::string page;
  ASSERT_TRUE(Export(request, page).ok());
  EXPECT_EQ(version_, 1U);
  EXPECT_EQ(page.substr(0, 15), "<!DOCTYPE html>");
  EXPECT_EQ(page.substr(page.size() - 8), "</html>\n");
  EXPECT_THAT(page, HasSubstr("Sign-off sheet"));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(page, HasSubstr("Opened the job."));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_EQ(contract::ValidText(page, page.size()).find('?'), page.find('?')) << "not UTF-8";
  request.set_language("de");
  request.mutable_utc_offset()->set_seconds(7200);
  ASSERT_TRUE(Export(request, page).ok());
  EXPECT_THAT(page, HasSubstr("Abnahmeblatt"));
  EXPECT_THAT(page, HasSubstr("UTC+02:00"));
}

TEST_F(ReportRpc, OfAJobWithoutScansSaysSo) {
  v1::ExportReportRequest request;
  request.set_name(server_.OpenSession("empty"));
  name_ = "empty.html";
  std::string page;
  ASSERT_TRUE(Export(request, page).ok());
  EXPECT_THAT(page, HasSubstr("No scan is in the model yet"));
  EXPECT_EQ(version_, 0U);
}

TEST_F(ReportRpc, WhatIsAskedWronglyIsNamed) {
  v1::ExportReportRequest request;
  std::string page;
  request.set_name("sessions/none");
  EXPECT_EQ(Export(request, page).error_code(), grpc::StatusCode::NOT_FOUND);
  request.set_name(server_.OpenSession("empty"));
  request.set_language("fr");
  grpc::Status refused = Export(request, page);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(fixture::ViolatedFields(refused), ElementsAre("language"));
  EXPECT_THAT(refused.error_message(), HasSubstr("en, de"));
  request.set_language("");
  request.mutable_utc_offset()->set_seconds(61);
  request.set_required_coverage(1.5);
  refused = Export(request, page);
  EXPECT_THAT(fixture::ViolatedFields(refused), ElementsAre("utc_offset", "required_coverage"));
}

// A reader that goes away leaves room for the next: four may be under way.
TEST_F(ReportRpc, ThatIsGivenUpHoldsNothing) {
  v1::ExportReportRequest request;
  request.set_name(server_.OpenRoom("room"));
  for (int i = 0; i < 12; ++i) {
    grpc::ClientContext context;
    const auto stream = server_.models->ExportReport(&context, request);
    v1::ExportReportResponse part;
    stream->Read(&part);
    context.TryCancel();
    while (stream->Read(&part)) {
    }
    stream->Finish();
  }
  ASSERT_TRUE(server_.server().sessions().WaitUntilIdle(std::chrono::seconds(60)));
  std::string page;
  EXPECT_TRUE(Export(request, page).ok());
}

}  // namespace
}  // namespace vantage::rpc
