// A scan file that the server reads itself comes to what 'vantage scan push' makes of it, also when
// the server is killed while it reads.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "tests/integration/answers.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/support/scan_files.h"
#include "vantage/v1/scan_service.grpc.pb.h"
#include "vantage/v1/scan_service.pb.h"

namespace vantage::integration {
namespace {

constexpr auto kFilePatience = std::chrono::seconds(120);

std::string ProjectFile(int setups, double degrees) {
  std::vector<test_support::NamedScan> scans;
  for (int i = 0; i < setups; ++i) {
    const Eigen::Vector3d at(1.2 + 0.4 * i, 1.4 + 0.3 * (i % 3), 1.4);
    scans.push_back({absl::StrCat("s", i + 1), fixture::NoisyRoom(at, degrees, 7), at});
  }
  return test_support::E57OfSeveral(scans);
}

// The tablet's side: a file in unary pieces.
class FileClient {
 public:
  explicit FileClient(const std::string& address)
      : scans_(v1::ScanService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))) {}

  v1::Upload Create(const std::string& session, const std::string& bytes) {
    v1::CreateUploadRequest request;
    request.set_parent(session);
    request.set_request_id("the-file");
    request.mutable_upload()->mutable_file()->set_name("project.e57");
    v1::UploadTotal& total = *request.mutable_upload()->mutable_total();
    total.set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
    total.set_sha256(bytes::Sha256::Of(bytes));
    v1::CreateUploadResponse response;
    grpc::ClientContext context;
    const grpc::Status status = scans_->CreateUpload(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.upload();
  }
  // Sends from where the server is, at most `pieces`.
  v1::Upload Send(v1::Upload upload, const std::string& bytes, int pieces = 1 << 20) {
    while (upload.state() == v1::UPLOAD_STATE_OPEN && pieces-- > 0) {
      v1::UploadPieceRequest request;
      request.set_upload(upload.name());
      v1::Piece& piece = *request.mutable_piece();
      piece.set_sequence(upload.next_sequence());
      piece.set_offset(upload.next_offset());
      piece.set_data(bytes.substr(static_cast<size_t>(upload.next_offset()), 64 << 10));
      piece.set_crc32c(bytes::Crc32c(piece.data()));
      v1::UploadPieceResponse response;
      grpc::ClientContext context;
      const grpc::Status status = scans_->UploadPiece(&context, request, &response);
      EXPECT_TRUE(status.ok()) << status.error_message();
      if (!status.ok()) break;
      upload = response.upload();
    }
    return upload;
  }
  v1::Upload Get(const std::string& name) {
    v1::GetUploadRequest request;
    request.set_name(name);
    v1::GetUploadResponse response;
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    context.set_deadline(std::chrono::system_clock::now() + kFilePatience);
    scans_->GetUpload(&context, request, &response);
    return response.upload();
  }
  v1::Upload Await(const std::string& name) {
    const auto end = std::chrono::steady_clock::now() + kFilePatience;
    v1::Upload upload = Get(name);
    while (upload.state() == v1::UPLOAD_STATE_READING && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      upload = Get(name);
    }
    return upload;
  }

 private:
  std::unique_ptr<v1::ScanService::Stub> scans_;
};

std::vector<v1::Scan> ScansOf(const ServerProcess& server, const std::string& job) {
  const auto listed =
      Answer<v1::ListScansResponse>(Vantage(server, {"scan", "list", job, "--json"}));
  return {listed.scans().begin(), listed.scans().end()};
}

TEST(Files, ScansThatTheServerReadsAreThoseThatPushSends) {
  const ScratchFolder scratch;
  const std::string bytes = ProjectFile(3, 1.5);
  const std::string path = scratch.File("project.e57");
  std::ofstream(path, std::ios::binary) << bytes;
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  for (const char* job : {"pushed", "read"}) {
    ASSERT_EQ(Vantage(server, {"session", "create", job, "--density", "100"}).exit_code, 0);
  }
  ASSERT_EQ(Vantage(server, {"scan", "push", "pushed", path}).exit_code, 0);
  FileClient client(server.address());
  // Interrupted in the middle, and picked again: it goes on from the server's offset.
  const v1::Upload half = client.Send(client.Create("sessions/read", bytes), bytes, 2);
  ASSERT_EQ(half.next_offset(), 128 << 10);
  FileClient again(server.address());
  v1::Upload upload = again.Create("sessions/read", bytes);
  EXPECT_EQ(upload.name(), half.name());
  EXPECT_EQ(upload.next_offset(), half.next_offset());
  upload = again.Await(again.Send(upload, bytes).name());
  ASSERT_EQ(upload.state(), v1::UPLOAD_STATE_COMMITTED) << upload.state_message();
  EXPECT_EQ(upload.setup_count(), 3);

  const std::vector<v1::Scan> pushed = ScansOf(server, "pushed");
  const std::vector<v1::Scan> read = ScansOf(server, "read");
  ASSERT_EQ(pushed.size(), 3U);
  ASSERT_EQ(read.size(), 3U);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read[i].sha256(), pushed[i].sha256());
    EXPECT_EQ(read[i].encoded_size_bytes(), pushed[i].encoded_size_bytes());
    EXPECT_EQ(read[i].display_name(), pushed[i].display_name());
    EXPECT_EQ(read[i].prior().SerializeAsString(), pushed[i].prior().SerializeAsString());
    EXPECT_EQ(read[i].scanner_model().SerializeAsString(),
              pushed[i].scanner_model().SerializeAsString());
  }
}

TEST(Files, TheCommandLineMayHaveTheServerRead) {
  const ScratchFolder scratch;
  const std::string path = scratch.File("project.e57");
  std::ofstream(path, std::ios::binary) << ProjectFile(2, 2);
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  ASSERT_EQ(Vantage(server, {"session", "create", "job", "--density", "100"}).exit_code, 0);
  const Finished pushed = Vantage(server, {"scan", "push", "job", path, "--on-server"});
  ASSERT_EQ(pushed.exit_code, 0) << pushed.error;
  EXPECT_THAT(pushed.out, testing::HasSubstr("s1"));
  // Once more: it is there.
  ASSERT_EQ(Vantage(server, {"scan", "push", "job", path, "--on-server"}).exit_code, 0);
  EXPECT_EQ(ScansOf(server, "job").size(), 2U);
  const std::string photo = scratch.File("photo.e57");
  std::ofstream(photo, std::ios::binary) << "\xff\xd8\xff\xe0";
  const Finished refused = Vantage(server, {"scan", "push", "job", photo, "--on-server"});
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_THAT(refused.error, testing::HasSubstr("this is a photo (JPEG), not a scan"));
}

// Killed while it reads, again and again: each scan comes once, in the order of the file.
TEST(Files, AServerThatIsKilledWhileItReadsGoesOnAfterwards) {
  constexpr int kSetups = 6;
  const ScratchFolder scratch;
  const std::string bytes = ProjectFile(kSetups, 0.8);
  const std::string data = scratch.File("data");
  std::string name;
  size_t most = 0;
  for (int run = 0; run < 5; ++run) {
    ServerProcess server(data, "127.0.0.1", {"--tries", "0"});
    ASSERT_FALSE(server.address().empty());
    FileClient client(server.address());
    if (run == 0) {
      ASSERT_EQ(Vantage(server, {"session", "create", "job", "--density", "100"}).exit_code, 0);
      name = client.Send(client.Create("sessions/job", bytes), bytes).name();
    }
    // Later in each run: until it has one scan more than any run before.
    v1::Upload upload = client.Get(name);
    const auto end = std::chrono::steady_clock::now() + kFilePatience;
    while (upload.state() == v1::UPLOAD_STATE_READING &&
           static_cast<size_t>(upload.scans_size()) <= most &&
           std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      upload = client.Get(name);
    }
    EXPECT_GE(static_cast<size_t>(upload.scans_size()), most) << "scans are gone";
    most = static_cast<size_t>(upload.scans_size());
    server.Stop(SIGKILL);
  }
  ServerProcess server(data, "127.0.0.1", {"--tries", "0"});
  ASSERT_FALSE(server.address().empty());
  const v1::Upload upload = FileClient(server.address()).Await(name);
  ASSERT_EQ(upload.state(), v1::UPLOAD_STATE_COMMITTED) << upload.state_message();
  ASSERT_EQ(upload.scans_size(), kSetups);
  const std::vector<v1::Scan> scans = ScansOf(server, "job");
  ASSERT_EQ(scans.size(), static_cast<size_t>(kSetups));
  for (int i = 0; i < kSetups; ++i) {
    EXPECT_EQ(scans[static_cast<size_t>(i)].file_setup(), i + 1);
    EXPECT_EQ(scans[static_cast<size_t>(i)].name(), upload.scans(i));
  }
}

}  // namespace
}  // namespace vantage::integration
