// Where the model of a session lies in the world: where its creator says, or where its first scan
// was made.
#ifndef VANTAGE_SERVER_SESSION_SESSION_ORIGIN_H_
#define VANTAGE_SERVER_SESSION_SESSION_ORIGIN_H_

#include <optional>

#include "vantage/v1/session.pb.h"
#include "vantage/v1/upload.pb.h"

namespace vantage::session {

// The origin that a session without a stated one gets from its first scan: whole metres, m, world.
// Nothing where it has one, where the scan does not say where it was made, or where (0, 0, 0) does:
// the scanner stood within half of the site's limit around it.
std::optional<v1::Vector3> OriginByFirstScan(const v1::Session& session, const v1::Upload& first);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SESSION_ORIGIN_H_
