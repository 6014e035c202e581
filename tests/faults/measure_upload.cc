#include <fcntl.h>
#include <grpcpp/grpcpp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <iostream>
#include <limits>
#include <mutex>
#include <thread>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "core/sensor/encoding.h"
#include "server/store/disk_store.h"
#include "server/store/durable_file.h"
#include "tests/faults/fault_figures.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "vantage/v1/scan_service.grpc.pb.h"
#include "vantage/v1/session_service.grpc.pb.h"

namespace vantage::faults {
namespace {

constexpr int64_t kPieceBytes = 256 << 10;  // as the client library's
constexpr size_t kSyncBytes = 4 << 20;
constexpr int64_t kCredit = 8 << 20;
constexpr int kRuns = 3;
constexpr auto kPatience = std::chrono::minutes(2);  // with one stream

std::vector<v1::UploadScanRequest> MessagesOf(const std::string& bytes) {
  std::vector<v1::UploadScanRequest> messages;
  for (int64_t offset = 0; offset < static_cast<int64_t>(bytes.size()); offset += kPieceBytes) {
    const std::string part = bytes.substr(static_cast<size_t>(offset), kPieceBytes);
    v1::Piece& piece = *messages.emplace_back().mutable_piece();
    piece.set_sequence(static_cast<int64_t>(messages.size()) - 1);
    piece.set_offset(offset);
    piece.set_uncompressed_size_bytes(static_cast<int64_t>(part.size()));
    piece.set_crc32c(bytes::Crc32c(part));
    piece.set_compression(v1::COMPRESSION_ZSTD);
    piece.set_data(bytes::ZstdCompress(part));
  }
  return messages;
}

// Writes what it gets to a file, syncs it every 4 MiB and at the end, and says so.
class BareService final : public v1::ScanService::Service {
 public:
  BareService(std::string path, int64_t total) : path_(std::move(path)), total_(total) {}

  grpc::Status UploadScan(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::UploadScanResponse, v1::UploadScanRequest>* stream) override {
    const store::FileDescriptor file(::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
    v1::UploadScanRequest request;
    int64_t received = 0;
    uint64_t written = 0;
    size_t unsynced = 0;
    while (stream->Read(&request)) {
      const std::string& data = request.piece().data();
      if (!store::WriteAt(file.get(), data, written, path_).ok()) return grpc::Status::CANCELLED;
      written += data.size();
      unsynced += data.size();
      received = request.piece().offset() + request.piece().uncompressed_size_bytes();
      const bool last = received == total_;
      if (unsynced < kSyncBytes && !last) continue;
      if (::fsync(file.get()) != 0) return grpc::Status::CANCELLED;
      unsynced = 0;
      v1::UploadScanResponse response;
      response.set_next_offset(received);
      response.set_credit_offset(received + 2 * kCredit);
      response.set_state(last ? v1::UPLOAD_STATE_COMMITTED : v1::UPLOAD_STATE_OPEN);
      stream->Write(response);
      if (last) break;
    }
    return grpc::Status::OK;
  }

 private:
  const std::string path_;
  const int64_t total_;
};

// Seconds until the last word; negative when that is not COMMITTED.
double Send(v1::ScanService::Stub& stub, const std::string& upload,
            std::vector<v1::UploadScanRequest> messages) {
  messages.front().set_upload(upload);
  bool committed = false;
  const double seconds = bench::WallSeconds([&] {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    const auto stream = stub.UploadScan(&context);
    std::mutex mutex;
    std::condition_variable changed;
    // The bare service has none to give.
    int64_t credit = upload == "bare" ? std::numeric_limits<int64_t>::max() : kCredit;
    bool ended = false;
    std::thread reader([&] {
      v1::UploadScanResponse response;
      while (stream->Read(&response)) {
        const std::lock_guard<std::mutex> lock(mutex);
        credit = std::max(credit, response.credit_offset());
        committed = committed || response.state() == v1::UPLOAD_STATE_COMMITTED;
        changed.notify_all();
      }
      const std::lock_guard<std::mutex> lock(mutex);
      ended = true;
      changed.notify_all();
    });
    for (const v1::UploadScanRequest& message : messages) {
      {
        std::unique_lock<std::mutex> lock(mutex);
        changed.wait(lock, [&] {
          return ended ||
                 message.piece().offset() + message.piece().uncompressed_size_bytes() <= credit;
        });
        if (ended) break;
      }
      if (!stream->Write(message)) break;
    }
    {
      std::unique_lock<std::mutex> lock(mutex);
      changed.wait(lock, [&] { return ended || committed; });
    }
    stream->WritesDone();
    reader.join();
    stream->Finish();
  });
  return committed ? seconds : -1;
}

// Waits until the server is idle. A committed scan is registered and merged, and such work must not
// count for the next upload.
void WaitUntilQuiet(const integration::ServerProcess& server) {
  constexpr auto kLook = std::chrono::milliseconds(200);
  constexpr double kQuiet = 0.01;  // s of processor time between two looks
  double before = -1;
  for (double now = server.CpuSeconds(); now - before > kQuiet; now = server.CpuSeconds()) {
    before = now;
    std::this_thread::sleep_for(kLook);
  }
}

double ChildSeconds() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

}  // namespace

bool MeasureUpload(bench::Figures& figures) {
  const integration::ScratchFolder scratch;
  const sensor::RangeImage image = fixture::NoisyRoom({2.0, 1.5, 1.4}, 0.09);
  const std::string bytes = sensor::EncodeRangeImage(image);
  const std::vector<v1::UploadScanRequest> messages = MessagesOf(bytes);
  size_t sent = 0;
  for (const auto& message : messages) sent += message.piece().data().size();

  BareService bare(scratch.File("bare"), static_cast<int64_t>(bytes.size()));
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&bare);
  const std::unique_ptr<grpc::Server> bare_server = builder.BuildAndStart();
  const auto bare_stub = v1::ScanService::NewStub(
      grpc::CreateChannel(absl::StrCat("127.0.0.1:", port), grpc::InsecureChannelCredentials()));

  integration::ServerProcess server(scratch.File("data"));
  const auto channel = grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials());
  const auto sessions = v1::SessionService::NewStub(channel);
  const auto scans = v1::ScanService::NewStub(channel);
  std::vector<double> bare_seconds;
  std::vector<double> our_seconds;
  for (int run = 0; run <= kRuns; ++run) {
    WaitUntilQuiet(server);
    const double reference = Send(*bare_stub, "bare", messages);
    // A session of its own, ended at once: what becomes of the scan afterwards is not the upload's.
    v1::CreateSessionRequest open;
    open.mutable_session()->mutable_model_config()->set_voxel_size_m(0.5);
    open.mutable_session()->mutable_planning_config()->set_viewcell_size_m(0.5);
    v1::CreateSessionResponse opened;
    grpc::ClientContext opening;
    sessions->CreateSession(&opening, open, &opened);
    v1::CreateUploadRequest create;
    create.set_parent(opened.session().name());
    create.mutable_upload()->mutable_total()->set_encoded_size_bytes(
        static_cast<int64_t>(bytes.size()));
    create.mutable_upload()->mutable_total()->set_sha256(bytes::Sha256::Of(bytes));
    v1::CreateUploadResponse created;
    grpc::ClientContext creating;
    if (!scans->CreateUpload(&creating, create, &created).ok()) return false;
    const double ours = Send(*scans, created.upload().name(), messages);
    v1::DeleteSessionRequest remove;
    remove.set_name(opened.session().name());
    v1::DeleteSessionResponse removed;
    grpc::ClientContext removing;
    sessions->DeleteSession(&removing, remove, &removed);
    if (reference < 0 || ours < 0) {
      std::cerr << "upload: a stream broke off\n";
      return false;
    }
    std::cerr << "upload: run " << run << " of " << kRuns << ", " << reference << " s bare, "
              << ours << " s\n";
    if (run == 0) continue;  // warms both up
    bare_seconds.push_back(reference);
    our_seconds.push_back(ours);
  }
  bare_server->Shutdown();
  const double reference = bench::Percentile(bare_seconds, 0.5);
  const double ours = bench::Percentile(our_seconds, 0.5);
  figures.Add({"upload.seconds", ours, "s", "",
               absl::StrCat(bytes.size() >> 20, " MiB of range image in ", sent >> 20,
                            " MiB of messages, to COMMITTED")});
  figures.Add({"upload.share", reference / ours, "", "0.7",
               "of what a bare stream of the same messages with an fsync every 4 MiB moves"});

  // The command line, which reads a file, builds the range image, encodes, compresses and sends it.
  const sensor::RangeImage small = fixture::NoisyRoom({2.0, 1.5, 1.4}, 0.36);
  const std::string file = scratch.File("scan.ptx");
  if (std::FILE* out = std::fopen(file.c_str(), "w"); out != nullptr) {
    std::fprintf(out, "%d\n%d\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n", small.columns(), small.rows());
    std::fprintf(out, "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    for (int c = 0; c < small.columns(); ++c) {
      for (int r = 0; r < small.rows(); ++r) {
        const Eigen::Vector3d p = static_cast<double>(small.at(c, r)) * small.Direction(c, r);
        std::fprintf(out, "%.4f %.4f %.4f 0.5\n", p.x(), p.y(), p.z());
      }
    }
    std::fclose(out);
    integration::Vantage(server, {"session", "create", "cpu"});
    const double before = ChildSeconds();
    const integration::Finished pushed =
        integration::Vantage(server, {"scan", "push", "cpu", file, "--no-wait"});
    if (pushed.exit_code == 0) {
      figures.Add({"upload.client.cpu", (ChildSeconds() - before) * 1e6 / small.cells(),
                   "s/Msample", "", "the command line, from a PTX file to COMMITTED"});
    } else {
      std::cerr << "upload: " << pushed.error;
    }
  }
  return true;
}

}  // namespace vantage::faults
