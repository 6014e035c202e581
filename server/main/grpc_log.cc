#include "server/main/grpc_log.h"

#include <grpc/support/log.h>

#include <atomic>

namespace vantage::server {
namespace {

// gRPC's function is called without any context.
std::atomic<telemetry::Log*> written_to{nullptr};

void Write(gpr_log_func_args* said) {
  telemetry::Log* log = written_to.load();
  if (log == nullptr) return;
  const telemetry::LogLevel level = said->severity == GPR_LOG_SEVERITY_ERROR
                                        ? telemetry::LogLevel::kWarning
                                        : telemetry::LogLevel::kDebug;
  log->Write(level, "gRPC", {{"said", said->message}, {"at", said->file}, {"line", said->line}});
}

}  // namespace

GrpcLog::GrpcLog(telemetry::Log& log) {
  written_to = &log;
  gpr_set_log_function(Write);
}

GrpcLog::~GrpcLog() {
  // Its threads may write to the last moment; the default writer is put back by null.
  gpr_set_log_function(nullptr);
  written_to = nullptr;
}

}  // namespace vantage::server
