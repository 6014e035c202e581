// The folder of 'vantaged field' within that of the data: who serves there, and where.
#ifndef VANTAGE_SERVER_FIELD_FIELD_FOLDER_H_
#define VANTAGE_SERVER_FIELD_FIELD_FOLDER_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store/durable_file.h"

namespace vantage::field {

// 'DATA/field': certificate, devices, socket. Backups and archives have none of it.
std::string FieldFolderOf(const std::string& data);
// The socket of the laptop's own command line, as a gRPC address.
std::string SocketIn(const std::string& folder);

// That a server serves with a folder. It ends with the process, however that ends.
class Serving {
 public:
  // Makes the folder, for its owner alone. ALREADY_EXISTS: another process serves with it.
  static absl::StatusOr<std::unique_ptr<Serving>> Begin(const std::string& folder);

  // Where the page is, for whoever pairs a device: 'https://192.168.1.5:7443'.
  absl::Status Tell(const std::string& page) const;

 private:
  Serving(std::string folder, store::FileDescriptor lock)
      : folder_(std::move(folder)), lock_(std::move(lock)) {}

  const std::string folder_;
  const store::FileDescriptor lock_;
};

// Where the page of the server that serves with the folder is. FAILED_PRECONDITION: none does now.
absl::StatusOr<std::string> ServedPage(const std::string& folder);
// Where the page was when it was last told; empty: never.
std::string LastPage(const std::string& folder);

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_FIELD_FOLDER_H_
