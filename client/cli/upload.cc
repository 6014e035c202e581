#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct UploadListArguments {
  std::string session;
  bool all = false;
  bool json = false;
};

const char* UploadWord(v1::UploadState state) {
  switch (state) {
    case v1::UPLOAD_STATE_OPEN:
      return "open";
    case v1::UPLOAD_STATE_COMMITTED:
      return "a scan";
    case v1::UPLOAD_STATE_FAILED:
      return "failed";
    case v1::UPLOAD_STATE_EXPIRED:
      return "expired";
    case v1::UPLOAD_STATE_ABORTED:
      return "given up";
    case v1::UPLOAD_STATE_READING:
      return "being read";
    default:
      return "?";
  }
}

absl::StatusOr<ExitCode> RunUploadList(Environment& environment,
                                       const UploadListArguments& arguments) {
  v1::ListUploadsRequest request;
  request.set_parent(client::SessionName(arguments.session));
  if (!arguments.all) {
    request.add_states(v1::UPLOAD_STATE_OPEN);
    request.add_states(v1::UPLOAD_STATE_READING);
  }
  v1::ListUploadsResponse all;
  const absl::Status listed =
      environment.client().CallForPages(request, [&](const v1::ListUploadsResponse& page) {
        all.mutable_uploads()->MergeFrom(page.uploads());
      });
  if (!listed.ok()) return listed;
  if (arguments.json) {
    std::fputs(ToJson(all).c_str(), stdout);
    return ExitCode::kOk;
  }
  if (all.uploads().empty()) {
    std::puts(arguments.all ? "nothing was sent" : "nothing is being sent");
    return ExitCode::kOk;
  }
  Table table({"upload", "state", "arrived", "of", "scan", "since", "for people"});
  for (const v1::Upload& upload : all.uploads()) {
    const auto total = static_cast<double>(upload.total().encoded_size_bytes());
    table.Add({client::IdOf(upload.name()), UploadWord(upload.state()),
               Bytes(static_cast<double>(upload.next_offset())),
               upload.has_total() ? Bytes(total) : "?", client::IdOf(upload.scan()),
               Time(upload.create_time()),
               upload.display_name().empty() ? upload.file().name() : upload.display_name()});
  }
  std::fputs(table.ToString().c_str(), stdout);
  return ExitCode::kOk;
}

struct UploadAbortArguments {
  std::string upload;
  bool json = false;
};

absl::StatusOr<ExitCode> RunUploadAbort(Environment& environment,
                                        const UploadAbortArguments& arguments) {
  v1::AbortUploadRequest request;
  request.set_name(client::UploadName(arguments.upload));
  const auto aborted = environment.client().Call(request);
  if (!aborted.ok()) return aborted.status();
  if (arguments.json) {
    std::fputs(ToJson(aborted->upload()).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s is %s; what was sent of it is dropped\n", client::IdOf(request.name()).c_str(),
              UploadWord(aborted->upload().state()));
  return ExitCode::kOk;
}

}  // namespace

void AddUploadList(CLI::App& parent, Environment& environment) {
  AddCommand<UploadListArguments>(
      parent, environment, "list", "List what is being sent, oldest first",
      "  vantage upload list flat\n  vantage upload list flat --all --json",
      [](CLI::App& command, UploadListArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--all", a.all, "And what became a scan, and what ended without one");
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunUploadList);
}

void AddUploadAbort(CLI::App& parent, Environment& environment) {
  AddCommand<UploadAbortArguments>(
      parent, environment, "abort", "Give an upload up: what was sent of it is dropped",
      "  vantage upload abort flat/upload-3",
      [](CLI::App& command, UploadAbortArguments& a) {
        command.add_option("UPLOAD", a.upload, "JOB/UPLOAD")->required();
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunUploadAbort);
}

}  // namespace vantage::cli
