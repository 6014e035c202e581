#include "server/session/file_allowance.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace vantage::session {

confinement::AllowanceSettings FileAllowance(const SessionDependencies& dependencies,
                                             std::function<bool()> given_up) {
  confinement::AllowanceSettings allowance;
  allowance.memory_option = "the server's --memory-mib";
  allowance.seconds_option = "the server's --file-seconds";
  if (dependencies.limits.file_seconds > 0) allowance.seconds = dependencies.limits.file_seconds;
  if (dependencies.memory != nullptr && dependencies.memory->budget() > 0) {
    allowance.most_memory_bytes = static_cast<uint64_t>(dependencies.memory->budget());
  }
  allowance.given_up = std::move(given_up);
  return allowance;
}

std::string ReaderOf(const SessionContext& context) {
  return context.tenant().empty() ? absl::StrCat("/", context.id()) : context.tenant();
}

}  // namespace vantage::session
