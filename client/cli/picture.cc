#include "client/cli/command.h"
namespace vantage::cli {
void AddPicture(CLI::App&, Environment&) {}
}  // namespace vantage::cli
