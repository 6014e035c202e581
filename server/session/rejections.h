// A session's rejections: places that people refused. Their whole state is in the log.
#ifndef VANTAGE_SERVER_SESSION_REJECTIONS_H_
#define VANTAGE_SERVER_SESSION_REJECTIONS_H_

#include <optional>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/session/session_context.h"
#include "vantage/v1/session.pb.h"

namespace vantage::session {

// Thread safe: the log's locks are all that it needs.
class Rejections {
 public:
  explicit Rejections(SessionContext& context) : context_(context) {}

  // `wanted` has position, radius and reason; its message is what the log stores. It holds for
  // `ttl`, without one for good. RESOURCE_EXHAUSTED (TOO_MANY_REJECTIONS).
  absl::StatusOr<v1::Rejection> Create(const v1::Rejection& wanted,
                                       std::optional<absl::Duration> ttl, const RequestKey& key);

 private:
  SessionContext& context_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_REJECTIONS_H_
