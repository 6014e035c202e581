// A session's rejections: places that people refused. Their whole state is in the log.
#ifndef VANTAGE_SERVER_SESSION_REJECTIONS_H_
#define VANTAGE_SERVER_SESSION_REJECTIONS_H_

#include "absl/status/statusor.h"
#include "server/session/session_context.h"
#include "vantage/v1/plan_service.pb.h"

namespace vantage::session {

// Thread safe: the log's locks are all that it needs.
class Rejections {
 public:
  explicit Rejections(SessionContext& context) : context_(context) {}

  absl::StatusOr<v1::Rejection> Create(const v1::RejectViewRequest& request);

 private:
  SessionContext& context_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_REJECTIONS_H_
