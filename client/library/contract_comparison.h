// What a server's contract has that this client's has not, and the other way round.
#ifndef VANTAGE_CLIENT_LIBRARY_CONTRACT_COMPARISON_H_
#define VANTAGE_CLIENT_LIBRARY_CONTRACT_COMPARISON_H_

#include <google/protobuf/descriptor.pb.h>

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace vantage::client {

struct Wire;

// Names of methods ('PlanService.CreatePlan'), fields ('Plan.seed') and values of enums
// ('PLAN_STATE_FAILED') of vantage.v1, sorted.
struct ContractComparison {
  std::vector<std::string> server_lacks;
  std::vector<std::string> client_lacks;
};

// Compares with what this program was built with.
ContractComparison CompareContracts(const google::protobuf::FileDescriptorSet& server);

// The files that a server describes its services of vantage.v1 with, by reflection.
// UNIMPLEMENTED: it does not describe itself.
absl::StatusOr<google::protobuf::FileDescriptorSet> ReflectedContract(const Wire& wire);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_CONTRACT_COMPARISON_H_
