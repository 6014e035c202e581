#include "server/web/http/request_reader.h"

#include <limits>
#include <string>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace vantage::web {
namespace {

namespace http = boost::beast::http;

absl::string_view View(boost::beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

struct RequestReader::Parser : http::request_parser<http::string_body> {};

RequestReader::RequestReader() : parser_(std::make_unique<Parser>()) {
  parser_->header_limit(kMaxHeadBytes);
  // Whoever reads looks at announced() and body_bytes(): what may come depends on the head.
  parser_->body_limit(std::numeric_limits<uint64_t>::max());
  parser_->eager(false);
}

RequestReader::~RequestReader() = default;
RequestReader::RequestReader(RequestReader&&) noexcept = default;
RequestReader& RequestReader::operator=(RequestReader&&) noexcept = default;

absl::Status RequestReader::ReadHead() {
  has_head_ = true;
  const auto& read = parser_->get();
  head_.method = std::string(View(read.method_string()));
  head_.target = std::string(View(read.target()));
  head_.http_1_0 = read.version() < 11;
  head_.keep_alive = parser_->keep_alive();
  for (const auto& field : read) {
    head_.fields.push_back(
        {absl::AsciiStrToLower(View(field.name_string())), std::string(View(field.value()))});
  }
  // What other codings there are nobody uses, but to hide a second request from a proxy.
  const std::string* coding = head_.Find("transfer-encoding");
  if (coding != nullptr &&
      (head_.Count("transfer-encoding") > 1 || !absl::EqualsIgnoreCase(*coding, "chunked"))) {
    return absl::UnimplementedError("transfer-encoding must be chunked");
  }
  if (head_.Count("host") > 1 || (!head_.http_1_0 && head_.Count("host") == 0)) {
    return absl::InvalidArgumentError("a request names one host");
  }
  return absl::OkStatus();
}

absl::StatusOr<size_t> RequestReader::Take(absl::string_view bytes) {
  size_t used = 0;
  begun_ = begun_ || !bytes.empty();
  while (!parser_->is_done()) {
    boost::system::error_code error;
    const size_t n =
        parser_->put(boost::asio::buffer(bytes.data() + used, bytes.size() - used), error);
    used += n;
    if (error == http::error::need_more) return used;
    if (error == http::error::header_limit) {
      return absl::ResourceExhaustedError("the request's head is too long");
    }
    if (error) return absl::InvalidArgumentError(absl::StrCat("no request: ", error.message()));
    if (!has_head_ && parser_->is_header_done()) {
      if (absl::Status read = ReadHead(); !read.ok()) return read;
      return used;
    }
    if (n == 0 && used == bytes.size()) return used;
  }
  return used;
}

bool RequestReader::done() const { return has_head_ && parser_->is_done(); }

std::optional<uint64_t> RequestReader::announced() const {
  const auto length = parser_->content_length();
  if (!length) return std::nullopt;
  return *length;
}

size_t RequestReader::body_bytes() const { return parser_->get().body().size(); }

Request RequestReader::Finish() {
  head_.body = std::move(parser_->get().body());
  return std::move(head_);
}

}  // namespace vantage::web
