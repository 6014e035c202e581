// What the poses in the headers of scans' files are worth in a session, by those of the scans that
// are in its model.
#ifndef VANTAGE_SERVER_SESSION_HEADER_FRAME_H_
#define VANTAGE_SERVER_SESSION_HEADER_FRAME_H_

#include <Eigen/Geometry>
#include <optional>

#include "server/session/session_state.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// Of a scan whose prior is what its file's header states, and that nobody vouches for.
struct HeaderAdvice {
  // Another scan in the model states the same pose to the bit, as files do that were written
  // without a registration: it says nothing of where this one was made.
  bool repeated = false;
  // Where its header has it if headers are in the frame of the newest scan in the model that has
  // one, and that was merged farther from it than its prior may be wrong. Model frame.
  std::optional<Eigen::Isometry3d> in_frame;
};

// `origin`: of the model frame, m, world. Nothing is advised of scans without such a prior.
HeaderAdvice AdviseOnHeader(const SessionState& state, const v1::Scan& scan,
                            const Eigen::Vector3d& origin);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_HEADER_FRAME_H_
