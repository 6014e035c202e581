#include "server/web/page_files.h"

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "core/bytes/checksum.h"

namespace vantage::web {
namespace {

// A page has a megabyte or two; these keep a wrong folder, such as '/', from filling the memory.
constexpr size_t kMaxFiles = 4096;
constexpr uintmax_t kMaxBytes = uintmax_t{64} << 20;
constexpr size_t kEtagBytes = 12;  // of a SHA-256
// What is smaller fits into one packet either way.
constexpr size_t kWorthCompressing = 1024;
constexpr char kIndex[] = "/index.html";
// Names of the files in it change with their content.
constexpr absl::string_view kAssets = "/assets/";
constexpr char kPolicy[] =
    "default-src 'self'; img-src 'self' blob: data:; worker-src 'self' blob:; base-uri 'self'; "
    "form-action 'self'; frame-ancestors 'none'";

std::string TypeOfFile(const std::string& path) {
  static const auto& types = *new std::map<std::string, std::string>{
      {".css", "text/css; charset=utf-8"},
      {".html", "text/html; charset=utf-8"},
      {".ico", "image/x-icon"},
      {".js", "text/javascript; charset=utf-8"},
      {".json", "application/json"},
      {".png", "image/png"},
      {".svg", "image/svg+xml"},
      {".txt", "text/plain; charset=utf-8"},
      {".webmanifest", "application/manifest+json"},
      {".woff2", "font/woff2"},
  };
  const size_t dot = path.rfind('.');
  const auto known = dot == std::string::npos ? types.end() : types.find(path.substr(dot));
  return known == types.end() ? "application/octet-stream" : known->second;
}

// nullptr: it is not smaller.
std::shared_ptr<const std::string> Compressed(const std::string& plain) {
  if (plain.size() < kWorthCompressing) return nullptr;
  z_stream stream{};
  constexpr int kGzip = 16;  // added to the window: with gzip's header
  constexpr int kMemory = 8;
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS + kGzip, kMemory,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    return nullptr;
  }
  std::string packed(deflateBound(&stream, plain.size()), '\0');
  // NOLINTBEGIN: the library's signature
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(plain.data()));
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  // NOLINTEND
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.avail_out = static_cast<uInt>(packed.size());
  const bool whole = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (!whole || packed.size() >= plain.size()) return nullptr;
  packed.shrink_to_fit();
  return std::make_shared<const std::string>(std::move(packed));
}

std::string EtagOf(const std::string& hash, bool compressed) {
  return absl::StrCat("\"", hash, compressed ? "-gzip" : "", "\"");
}

// Whether a list of etags, as in if-none-match, has this one; '*' is any.
bool Has(absl::string_view list, absl::string_view etag) {
  for (absl::string_view part : absl::StrSplit(list, ',')) {
    part = absl::StripAsciiWhitespace(part);
    absl::ConsumePrefix(&part, "W/");
    if (part == etag || part == "*") return true;
  }
  return false;
}

}  // namespace

absl::StatusOr<PageFiles> PageFiles::Read(const std::string& folder) {
  namespace fs = std::filesystem;
  PageFiles page;
  std::error_code error;
  uintmax_t bytes = 0;
  fs::recursive_directory_iterator at(folder, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    if (at->is_symlink() || !at->is_regular_file()) continue;
    std::ifstream file(at->path(), std::ios::binary);
    std::string content{std::istreambuf_iterator<char>(file), {}};
    bytes += content.size();
    if (page.files_.size() >= kMaxFiles || bytes > kMaxBytes) {
      return absl::FailedPreconditionError(
          absl::StrCat(folder,
                       " holds more than a page does: it must be what './dev build web' "
                       "makes"));
    }
    const std::string path =
        absl::StrCat("/", at->path().lexically_relative(folder).generic_string());
    page.Add(path, TypeOfFile(path), std::move(content));
    page.files_[path].immutable = absl::StartsWith(path, kAssets);
  }
  if (error || page.files_.find(kIndex) == page.files_.end()) {
    return absl::NotFoundError(absl::StrCat(folder, " holds no page: there is no index.html"));
  }
  return page;
}

void PageFiles::Add(const std::string& path, const std::string& type, std::string content) {
  File& made = files_[path];
  made.type = type;
  made.etag = absl::BytesToHexString(bytes::Sha256::Of(content).substr(0, kEtagBytes));
  made.compressed = Compressed(content);
  made.plain = std::make_shared<const std::string>(std::move(content));
}

Response PageFiles::Answer(const Request& request) const {
  if (request.method != "GET" && request.method != "HEAD") {
    Response refused = TextResponse(405, "only GET, HEAD and the RPCs of vantage.v1");
    refused.fields.push_back({"allow", "GET, HEAD"});
    return refused;
  }
  const absl::string_view path = request.path();
  const auto found = files_.find(path == "/" ? kIndex : path);
  if (found == files_.end()) {
    if (path == "/") {
      return TextResponse(404,
                          "this server has the API, but no page: './dev build web' makes one, and "
                          "--web-root names its folder");
    }
    return TextResponse(404, "no such page");
  }
  const File& file = found->second;
  const std::string* accepted = request.Find("accept-encoding");
  const bool packed = file.compressed != nullptr && accepted != nullptr && AcceptsGzip(*accepted);
  const std::string etag = EtagOf(file.etag, packed);
  Response response;
  response.fields = {
      {"cache-control", file.immutable ? "max-age=31536000, immutable" : "no-cache"},
      {"etag", etag},
      {"vary", "accept-encoding"},
      {"content-security-policy", kPolicy},
      {"x-content-type-options", "nosniff"},
      {"referrer-policy", "no-referrer"},
      {"cross-origin-resource-policy", "same-origin"},
  };
  const std::string* known = request.Find("if-none-match");
  if (known != nullptr && Has(*known, etag)) {
    response.status = 304;
    return response;
  }
  response.fields.push_back({"content-type", file.type});
  if (packed) response.fields.push_back({"content-encoding", "gzip"});
  response.body = packed ? file.compressed : file.plain;
  return response;
}

}  // namespace vantage::web
