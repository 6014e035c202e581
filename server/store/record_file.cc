#include "server/store/record_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "core/bytes/checksum.h"
#include "server/store/durable_file.h"

namespace vantage::store {

RecordHeader RecordHeader::Of(absl::string_view record) {
  RecordHeader header;
  header.size = static_cast<uint32_t>(record.size());
  header.crc32c = bytes::Crc32c(record);
  header.own_crc32c = header.OwnChecksum();
  return header;
}

uint32_t RecordHeader::OwnChecksum() const {
  return bytes::Crc32c(bytes().substr(0, 2 * sizeof(uint32_t)));
}

absl::StatusOr<int64_t> VisitRecords(int fd, const std::string& path,
                                     absl::FunctionRef<absl::Status(absl::string_view)> visit,
                                     bool* damaged) {
  struct stat about {};
  if (::fstat(fd, &about) != 0) return FileError("cannot read", path);
  const int64_t end = about.st_size;
  int64_t at = 0;
  std::string record;
  const auto read = [&](void* to, int64_t size) -> absl::Status {
    for (int64_t have = 0; have < size;) {
      const ssize_t got =
          ::pread(fd, static_cast<char*>(to) + have, static_cast<size_t>(size - have), at + have);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return FileError("cannot read", path);
      have += got;
    }
    at += size;
    return absl::OkStatus();
  };
  while (end - at >= static_cast<int64_t>(sizeof(RecordHeader))) {
    const int64_t begin = at;
    RecordHeader header;
    if (absl::Status got = read(&header, sizeof(header)); !got.ok()) return got;
    if (header.own_crc32c != header.OwnChecksum() || header.size > end - at) return begin;
    record.resize(header.size);
    if (absl::Status got = read(record.data(), header.size); !got.ok()) return got;
    if (bytes::Crc32c(record) != header.crc32c) {
      if (damaged != nullptr) *damaged = at < end;
      return begin;
    }
    if (absl::Status visited = visit(record); !visited.ok()) return visited;
  }
  return at;
}

}  // namespace vantage::store
