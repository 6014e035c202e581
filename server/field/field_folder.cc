#include "server/field/field_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace vantage::field {
namespace {

std::string LockIn(const std::string& folder) { return folder + "/lock"; }
std::string PageIn(const std::string& folder) { return folder + "/page"; }

// Of the whole file. Whoever asks who has it disturbs nobody, unlike with flock().
struct flock WholeFile() {
  struct flock whole {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  return whole;
}

}  // namespace

std::string FieldFolderOf(const std::string& data) { return data + "/field"; }

std::string SocketIn(const std::string& folder) { return absl::StrCat("unix:", folder, "/socket"); }

absl::StatusOr<std::unique_ptr<Serving>> Serving::Begin(const std::string& folder) {
  if (absl::Status made = store::MakeFolder(folder); !made.ok()) return made;
  // Its socket, too, is for the owner alone.
  if (chmod(folder.c_str(), S_IRWXU) != 0) return store::FileError("cannot close", folder);
  store::FileDescriptor lock(::open(LockIn(folder).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (!lock.ok()) return store::FileError("cannot open", LockIn(folder));
  struct flock whole = WholeFile();
  if (::fcntl(lock.get(), F_OFD_SETLK, &whole) != 0) {
    if (errno != EAGAIN && errno != EACCES) return store::FileError("cannot lock", LockIn(folder));
    return absl::AlreadyExistsError(absl::StrCat("another server serves with ", folder));
  }
  return std::unique_ptr<Serving>(new Serving(folder, std::move(lock)));
}

absl::Status Serving::Tell(const std::string& page) const {
  return store::ReplaceFile(PageIn(folder_), PageIn(folder_) + ".new", page + "\n");
}

absl::StatusOr<std::string> ServedPage(const std::string& folder) {
  const store::FileDescriptor lock(::open(LockIn(folder).c_str(), O_RDWR | O_CLOEXEC));
  struct flock whole = WholeFile();
  const bool held =
      lock.ok() && ::fcntl(lock.get(), F_OFD_GETLK, &whole) == 0 && whole.l_type != F_UNLCK;
  const std::string page = held ? LastPage(folder) : "";
  if (page.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("no 'vantaged field' serves the data of ", folder));
  }
  return page;
}

std::string LastPage(const std::string& folder) {
  const absl::StatusOr<std::string> text = store::ReadWhole(PageIn(folder));
  return text.ok() ? std::string(absl::StripAsciiWhitespace(*text)) : "";
}

}  // namespace vantage::field
