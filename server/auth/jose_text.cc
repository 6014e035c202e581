#include "server/auth/jose_text.h"

#include <set>
#include <vector>

#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"

namespace vantage::auth {
namespace {

using nlohmann::json;

constexpr size_t kMaxDepth = 8;

// Says no where a member comes twice or the text goes too deep.
class StrictSax : public json::json_sax_t {
 public:
  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(number_integer_t /*value*/) override { return true; }
  bool number_unsigned(number_unsigned_t /*value*/) override { return true; }
  bool number_float(number_float_t /*value*/, const string_t& /*text*/) override { return true; }
  bool string(string_t& /*value*/) override { return true; }
  bool binary(binary_t& /*value*/) override { return false; }
  bool start_object(size_t /*size*/) override { return Deeper(); }
  bool key(string_t& name) override { return members_.back().insert(name).second; }
  bool end_object() override { return Back(); }
  bool start_array(size_t /*size*/) override { return Deeper(); }
  bool end_array() override { return Back(); }
  bool parse_error(size_t /*at*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*error*/) override {
    return false;
  }

 private:
  bool Deeper() {
    members_.emplace_back();
    return members_.size() <= kMaxDepth;
  }
  bool Back() {
    members_.pop_back();
    return true;
  }

  std::vector<std::set<std::string>> members_;  // of the objects that are open
};

}  // namespace

std::optional<std::string> DecodeBase64Url(absl::string_view text) {
  std::string bytes;
  if (!absl::WebSafeBase64Unescape(text, &bytes)) return std::nullopt;
  // That reader forgives spaces, padding and bits that count for nothing.
  if (absl::WebSafeBase64Escape(bytes) != text) return std::nullopt;
  return bytes;
}

json ParseJsonObject(absl::string_view text) {
  json none(json::value_t::discarded);
  // That reader takes a NUL for the end of the text, and would not see what follows.
  if (absl::StrContains(text, '\0')) return none;
  StrictSax strict;
  if (!json::sax_parse(text.begin(), text.end(), &strict)) return none;
  json parsed = json::parse(text.begin(), text.end(), nullptr, false);
  return parsed.is_object() ? parsed : none;
}

std::optional<std::string> StringMember(const json& object, const char* name) {
  const auto member = object.find(name);
  if (member == object.end() || !member->is_string()) return std::nullopt;
  return member->get<std::string>();
}

}  // namespace vantage::auth
