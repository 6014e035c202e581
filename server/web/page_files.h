// The page: the files of a folder, read once.
#ifndef VANTAGE_SERVER_WEB_PAGE_FILES_H_
#define VANTAGE_SERVER_WEB_PAGE_FILES_H_

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/web/http/message.h"

namespace vantage::web {

// Answers from memory, by exact names: no path that anybody sends reaches the file system.
class PageFiles {
 public:
  // No page: whoever asks for it is told how to get it.
  PageFiles() = default;
  // Reads `folder` with its folders, without following links. NOT_FOUND: there is no index.html.
  // FAILED_PRECONDITION: more than 64 MiB or 4096 files, so it is no page. Names the folder.
  static absl::StatusOr<PageFiles> Read(const std::string& folder);

  // One more file, which a browser asks for anew each time; whatever had its path is no more.
  void Add(const std::string& path, const std::string& type, std::string content);

  size_t size() const { return files_.size(); }
  // To GET and HEAD; other methods get 405.
  Response Answer(const Request& request) const;

 private:
  struct File {
    std::string type;
    std::string etag;  // with its quotes; '-gzip' within them for the compressed one
    bool immutable = false;
    std::shared_ptr<const std::string> plain;
    std::shared_ptr<const std::string> compressed;  // null: that is not smaller
  };

  std::map<std::string, File, std::less<>> files_;  // by path, '/index.html'
};

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_PAGE_FILES_H_
