#include "client/library/contract_comparison.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/empty.pb.h>
#include <google/protobuf/unknown_field_set.h>
#include <grpcpp/generic/generic_stub.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <set>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/library/wire.h"

namespace vantage::client {
namespace {

using google::protobuf::DescriptorProto;
using google::protobuf::Empty;
using google::protobuf::EnumDescriptorProto;
using google::protobuf::FileDescriptorProto;
using google::protobuf::UnknownField;
using google::protobuf::UnknownFieldSet;
using Names = std::set<std::string>;

constexpr char kPackage[] = "vantage.v1";
constexpr const char* kServices[] = {"SessionService", "ScanService", "PlanService", "ModelService",
                                     "FleetService"};

// Of grpc.reflection.v1alpha, whose messages Debian has no header of: numbers of the fields.
constexpr char kReflection[] = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
constexpr int kFileContainingSymbol = 4;  // of the request
constexpr int kFileDescriptorResponse = 4;
constexpr int kFileDescriptorProto = 1;

void AddValues(const EnumDescriptorProto& type, Names& names) {
  for (const auto& value : type.value()) names.insert(value.name());
}

void AddFields(const DescriptorProto& type, const std::string& within, Names& names) {
  const std::string name = absl::StrCat(within, type.name());
  for (const auto& field : type.field()) names.insert(absl::StrCat(name, ".", field.name()));
  for (const auto& nested : type.nested_type()) AddFields(nested, name + ".", names);
  for (const auto& nested : type.enum_type()) AddValues(nested, names);
}

Names NamesOf(const FileDescriptorProto& file) {
  Names names;
  if (file.package() != kPackage) return names;
  for (const auto& service : file.service()) {
    for (const auto& method : service.method()) {
      names.insert(absl::StrCat(service.name(), ".", method.name()));
    }
  }
  for (const auto& type : file.message_type()) AddFields(type, "", names);
  for (const auto& type : file.enum_type()) AddValues(type, names);
  return names;
}

// The files that describe the services, with all that they import.
void AddOwn(const google::protobuf::FileDescriptor& file, Names& seen, Names& names) {
  if (!seen.insert(file.name()).second) return;
  FileDescriptorProto proto;
  file.CopyTo(&proto);
  names.merge(NamesOf(proto));
  for (int i = 0; i < file.dependency_count(); ++i) AddOwn(*file.dependency(i), seen, names);
}

Names OwnNames() {
  Names seen;
  Names names;
  for (const char* service : kServices) {
    const auto* known = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
        absl::StrCat(kPackage, ".", service));
    if (known != nullptr) AddOwn(*known->file(), seen, names);
  }
  return names;
}

std::vector<std::string> Without(const Names& all, const Names& taken) {
  std::vector<std::string> rest;
  std::set_difference(all.begin(), all.end(), taken.begin(), taken.end(), std::back_inserter(rest));
  return rest;
}

void AddFiles(const UnknownFieldSet& response, std::set<std::string>& files,
              google::protobuf::FileDescriptorSet& set) {
  for (int i = 0; i < response.field_count(); ++i) {
    const UnknownField& answer = response.field(i);
    if (answer.number() != kFileDescriptorResponse ||
        answer.type() != UnknownField::TYPE_LENGTH_DELIMITED) {
      continue;
    }
    Empty described;
    if (!described.ParseFromString(answer.length_delimited())) continue;
    const UnknownFieldSet& parts = described.GetReflection()->GetUnknownFields(described);
    for (int k = 0; k < parts.field_count(); ++k) {
      FileDescriptorProto file;
      if (parts.field(k).number() != kFileDescriptorProto ||
          parts.field(k).type() != UnknownField::TYPE_LENGTH_DELIMITED ||
          !file.ParseFromString(parts.field(k).length_delimited())) {
        continue;
      }
      if (files.insert(file.name()).second) *set.add_file() = std::move(file);
    }
  }
}

}  // namespace

ContractComparison CompareContracts(const google::protobuf::FileDescriptorSet& server) {
  Names there;
  for (const FileDescriptorProto& file : server.file()) there.merge(NamesOf(file));
  const Names here = OwnNames();
  return {Without(here, there), Without(there, here)};
}

absl::StatusOr<google::protobuf::FileDescriptorSet> ReflectedContract(const Wire& wire) {
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(wire.options.timeout));
  if (absl::Status prepared = wire.Prepare(context); !prepared.ok()) return prepared;
  // One step after the other: what the queue gives back is always what was asked last.
  grpc::CompletionQueue queue;
  const auto done = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  grpc::TemplatedGenericStub<Empty, Empty> stub(wire.channel);
  const auto stream = stub.PrepareCall(&context, kReflection, &queue);
  stream->StartCall(nullptr);
  bool goes_on = done();
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> files;
  for (const char* service : kServices) {
    if (!goes_on) break;
    Empty request;
    request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(
        kFileContainingSymbol, absl::StrCat(kPackage, ".", service));
    stream->Write(request, nullptr);
    goes_on = done();
    if (!goes_on) break;
    Empty response;
    stream->Read(&response, nullptr);
    goes_on = done();
    if (goes_on) AddFiles(response.GetReflection()->GetUnknownFields(response), files, set);
  }
  if (goes_on) {
    stream->WritesDone(nullptr);
    done();
  }
  grpc::Status status;
  stream->Finish(&status, nullptr);
  done();
  queue.Shutdown();
  while (done()) {
  }
  if (!status.ok()) return wire.Failure(status);
  return set;
}

}  // namespace vantage::client
