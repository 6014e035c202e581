// Tries the scans in doubt again whenever the model has changed, and proposes the pose of those of
// which only one is left (algorithm.md section 9, 'Scans in doubt').
#ifndef VANTAGE_SERVER_SESSION_DOUBT_PROPOSALS_H_
#define VANTAGE_SERVER_SESSION_DOUBT_PROPOSALS_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "core/parallel/parallel.h"
#include "server/session/begun_work.h"
#include "server/session/model_memory.h"
#include "server/session/session_context.h"
#include "vantage/v1/registration.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// Scan.etag: changes whenever that among which a person chooses does; empty where there is nothing
// to choose.
std::string EtagOfDoubt(const v1::Scan& scan);

// What a person is told of a scan that did not register.
std::string DoubtWords(const v1::Registration& registration);

// Used on the strand.
class DoubtProposals {
 public:
  DoubtProposals(SessionContext& context, ModelMemory& model)
      : context_(context), model_(model), work_(context) {}

  // Queues what is due on the strand, behind what waits there: scans that come are not kept waiting
  // for longer than one of those in doubt takes. What is proposed is an event of the log
  // (ScanRefusedEvent) and so is that it is proposed no more. It follows from the scans in the
  // model and from where they stand. Nothing is merged: a person decides.
  void PostWhenDue();
  // The work that is under way is not counted as one that brought the server to its end.
  void GiveUp() { work_.EndAll(); }

 private:
  // The scan in doubt that has waited longest of those that were not tried with the model as it is;
  // empty: there is none.
  std::string NextDue() const;
  void TryNext(parallel::Parallel& parallel);
  absl::Status Try(const std::string& name, parallel::Parallel& parallel);
  absl::StatusOr<std::optional<v1::PoseProposal>> Find(const v1::Scan& scan,
                                                       const ModelSnapshot& model,
                                                       parallel::Parallel& parallel);
  absl::Status Log(const v1::Scan& as_read, const std::optional<v1::PoseProposal>& proposal);

  SessionContext& context_;
  ModelMemory& model_;
  BegunWork work_;
  bool posted_ = false;
  // By scan: the version of the model with which it was tried last. Not in the log: after a restart
  // all are tried once more, with the same result.
  std::map<std::string, uint64_t> tried_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_DOUBT_PROPOSALS_H_
