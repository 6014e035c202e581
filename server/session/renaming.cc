#include "server/session/renaming.h"

#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "google/protobuf/descriptor.h"

namespace vantage::session {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;

bool Rename(const std::string& from, const std::string& to, std::string& text) {
  const bool within =
      absl::StartsWith(text, from) && (text.size() == from.size() || text[from.size()] == '/');
  if (within) text = absl::StrCat(to, absl::string_view(text).substr(from.size()));
  return within;
}

void RenameTexts(const std::string& from, const std::string& to, const FieldDescriptor* field,
                 google::protobuf::Message& message) {
  const Reflection& reflection = *message.GetReflection();
  if (!field->is_repeated()) {
    std::string text = reflection.GetString(message, field);
    if (Rename(from, to, text)) reflection.SetString(&message, field, std::move(text));
    return;
  }
  for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
    std::string text = reflection.GetRepeatedString(message, field, i);
    if (Rename(from, to, text)) reflection.SetRepeatedString(&message, field, i, std::move(text));
  }
}

}  // namespace

void RenameSession(const std::string& from, const std::string& to,
                   google::protobuf::Message& message) {
  if (from == to) return;
  const Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->type() == FieldDescriptor::TYPE_STRING) RenameTexts(from, to, field, message);
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      RenameSession(from, to, *reflection.MutableMessage(&message, field));
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
      RenameSession(from, to, *reflection.MutableRepeatedMessage(&message, field, i));
    }
  }
}

}  // namespace vantage::session
