#include "server/rpc/call/rpc_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/contract/whole_characters.h"
#include "server/conversion/to_proto.h"
#include "server/telemetry/metrics.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::rpc {
namespace {

constexpr char kTraceparent[] = "traceparent";
constexpr size_t kMaxText = 200;  // of what a client wrote, in a line of a log

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

std::string TextIn(const Message& message, const char* field_name) {
  const FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(field_name);
  if (field == nullptr || field->is_repeated() ||
      field->cpp_type() != FieldDescriptor::CPPTYPE_STRING) {
    return "";
  }
  return std::string(
      contract::WholeCharacters(message.GetReflection()->GetString(message, field), kMaxText));
}

// What the answer to a deletion says of backups, for the audit.
std::string BackupsForget(const Message* made) {
  const auto* deleted = dynamic_cast<const v1::DeleteSessionResponse*>(made);
  if (deleted == nullptr || !deleted->has_backups_forget_time()) return "";
  return absl::FormatTime(absl::RFC3339_sec, conversion::ReadTime(deleted->backups_forget_time()),
                          absl::UTCTimeZone());
}

// The resource that a message names: its own name, that of the resource it holds, or its parent.
std::string ResourceOf(const Message& message) {
  for (const char* field : {"name", "upload", "parent"}) {
    if (std::string name = TextIn(message, field); !name.empty()) return name;
  }
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor* field = type.field(i);
    if (field->is_repeated() || field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE ||
        !message.GetReflection()->HasField(message, field)) {
      continue;
    }
    const Message& held = message.GetReflection()->GetMessage(message, field);
    if (std::string name = TextIn(held, "name"); !name.empty()) return name;
  }
  return "";
}

std::string HeaderOf(const grpc::ServerContextBase& context) {
  const auto it = context.client_metadata().find(kTraceparent);
  if (it == context.client_metadata().end()) return "";
  return {it->second.data(), it->second.size()};
}

// Where callers show nothing, nothing tells one from another but their address.
session::Asker AskerOf(const Admission& admission) {
  if (admission.credential.empty()) return {};
  return {admission.caller, admission.administers};
}

}  // namespace

RpcCall::RpcCall(const RpcDependencies& dependencies, const RpcRule& rule,
                 const grpc::ServerContextBase& context)
    : dependencies_(dependencies),
      rule_(rule),
      trace_(telemetry::TraceContext::From(HeaderOf(context))),
      context_(std::make_shared<const std::string>(trace_.trace_id)),
      admission_(Admit(context)),
      sessions_(dependencies.sessions, admission_.tenant, AskerOf(admission_)) {}

RpcCall::~RpcCall() {
  if (counted_) dependencies_.calls.GiveBack(admission_.tenant, rule_.stream);
}

Admission RpcCall::Admit(const grpc::ServerContextBase& context) {
  const int most = static_cast<int>(dependencies_.sessions.dependencies().limits.calls);
  Admission admission = dependencies_.authorizer.Admit(rule_, context);
  if (admission.status.ok()) {
    admission.status = dependencies_.calls.Take(admission.tenant, rule_.stream, most);
    counted_ = admission.status.ok();
  }
  return admission;
}

void RpcCall::Concerns(const Message& request) {
  std::string resource = ResourceOf(request);
  std::string request_id = TextIn(request, "request_id");
  std::lock_guard<std::mutex> lock(mutex_);
  resource_ = std::move(resource);
  request_id_ = std::move(request_id);
}

void RpcCall::Audit(const absl::Status& outcome, const Message* made) {
  // A call that came too often was not tried and is not audited, so that a flood cannot fill the
  // log.
  if (!rule_.mutates || contract::ReasonOf(admission_.status) == "RATE_LIMITED") return;
  std::string resource = made == nullptr ? "" : ResourceOf(*made);
  std::string request_id;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (resource.empty()) resource = resource_;
    request_id = request_id_;
  }
  const telemetry::ScopedLogContext scope(context_);
  const std::string forget = BackupsForget(made);
  dependencies_.log.Audit({{"caller", admission_.caller},
                           {"tenant", admission_.tenant.value_or("")},
                           {"peer", admission_.peer},
                           {"method", absl::string_view(rule_.method.data(), rule_.method.size())},
                           {"resource", resource},
                           {"request_id", request_id},
                           {"code", absl::StatusCodeToString(outcome.code())},
                           {"reason", contract::ReasonOf(outcome)},
                           forget.empty() ? telemetry::LogField()
                                          : telemetry::LogField("backups_forget_time", forget)});
}

void RpcCall::Count(const grpc::Status& status, double seconds) const {
  const std::string method(rule_.method);
  dependencies_.metrics
      .CounterOf(
          "vantage_rpc_total", "Calls that ended, by method and canonical code.",
          {{"method", method},
           {"code", absl::StatusCodeToString(static_cast<absl::StatusCode>(status.error_code()))}})
      .Add();
  dependencies_.metrics
      .HistogramOf(rule_.stream ? "vantage_stream_seconds" : "vantage_rpc_seconds",
                   rule_.stream ? "How long streams were open." : "How long unary calls took.",
                   {{"method", method}})
      .Observe(seconds);
  if (!admission_.status.ok()) {
    dependencies_.metrics
        .CounterOf("vantage_rpc_refused_total", "Calls that were not let in, by reason.",
                   {{"reason", contract::ReasonOf(admission_.status)}})
        .Add();
  }
}

void RpcCall::End(const grpc::Status& status) {
  const double seconds = absl::ToDoubleSeconds(absl::Now() - started_);
  const absl::string_view method(rule_.method.data(), rule_.method.size());
  std::string resource;
  std::string request_id;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    resource = resource_;
    request_id = request_id_;
  }
  Count(status, seconds);
  const telemetry::ScopedLogContext scope(context_);
  if (status.ok()) {
    dependencies_.log.Debug("call", {{"method", method},
                                     {"caller", admission_.caller},
                                     {"resource", resource},
                                     {"request_id", request_id},
                                     {"span_id", trace_.span_id},
                                     {"parent_span_id", trace_.parent_id},
                                     {"seconds", seconds}});
    return;
  }
  // A flood of calls must not become a flood of log lines.
  const bool flood = contract::ReasonOf(admission_.status) == "RATE_LIMITED";
  dependencies_.log.Write(flood ? telemetry::LogLevel::kDebug : telemetry::LogLevel::kInfo,
                          "call failed",
                          {{"method", method},
                           {"caller", admission_.caller},
                           {"peer", admission_.peer},
                           {"resource", resource},
                           {"request_id", request_id},
                           {"code", static_cast<int>(status.error_code())},
                           {"error", status.error_message()},
                           {"span_id", trace_.span_id},
                           {"parent_span_id", trace_.parent_id},
                           {"seconds", seconds}});
}

}  // namespace vantage::rpc
