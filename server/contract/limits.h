// Limits on everything that clients send or ask for.
#ifndef VANTAGE_SERVER_CONTRACT_LIMITS_H_
#define VANTAGE_SERVER_CONTRACT_LIMITS_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/time/time.h"

namespace vantage::contract {

struct Limits {
  size_t sessions = 1000;
  size_t scans_per_session = 1000;
  size_t pending_scans_per_session = 32;  // received, not yet merged or refused
  size_t open_uploads_per_session = 16;
  size_t running_plans_per_session = 8;  // queued or running
  size_t plans_per_session = 10'000;
  size_t scanners_per_session = 64;
  size_t scanners_ever = 1024;         // of a session, with those that were deleted
  size_t claims_per_session = 20'000;  // ever taken
  // Whose scans have not come: more than a day's. Each costs every plan a look at all cells.
  size_t stations_per_session = 128;
  size_t full_plans_per_session = 16;       // the newest, whose patches and map of scores are kept
  size_t snapshots_per_session = 2;         // of the model, the newest; 0: none are written
  size_t snapshot_bytes = size_t{8} << 30;  // decompressed, of one that is loaded
  int64_t log_bytes_per_session = int64_t{256} << 20;  // beyond: nothing that adds to the session
  size_t exports_per_session = 4;                      // at a time
  size_t imports = 8;                                  // at a time
  size_t evaluations = 32;                             // what-ifs of a session at a time
  int64_t encoded_scan_bytes = int64_t{512} << 20;
  // Of a file that the server reads: a station of the finest setting with everything that
  // instruments write (100 million points of 40 bytes), and of those on their way in a session.
  int64_t file_bytes = int64_t{4} << 30;
  int64_t file_bytes_per_session = int64_t{16} << 30;
  size_t files_read_at_once = 3;  // of all sessions
  // Of a processor, that reading a file may take, and twice as many in all; 0: by its size
  // (core/confinement/allowance.h).
  double file_seconds = 0;
  size_t scan_cells = 100'000'000;
  int64_t piece_bytes = 1 << 20;    // before compression
  int64_t credit_bytes = 32 << 20;  // in flight
  size_t pieces_per_upload = 1 << 18;
  absl::Duration upload_idle = absl::Hours(24);
  // After this time without an event a session is deleted, and a withdrawn scan's data are erased.
  absl::Duration keep_sessions = absl::InfiniteDuration();
  absl::Duration keep_withdrawn_scans = absl::InfiniteDuration();
  // Neither goes before a second look, so much later, agrees.
  absl::Duration second_look = absl::Hours(1);
  // How long the operator keeps a backup, which holds what is deleted meanwhile; zero: not known.
  absl::Duration keep_backups = absl::ZeroDuration();
  // After this time without use a session's model leaves memory.
  absl::Duration evict_after = absl::InfiniteDuration();
  // Work (a scan's merge, the loading of a model) that brought the server to its end so often is
  // set aside; 0: it is tried for ever.
  int tries = 2;
  size_t calls = 4096;          // under way at a time, streams included
  int64_t tenant_bytes = 0;     // quota of each tenant; 0: none
  int message_bytes = 4 << 20;  // received
};

}  // namespace vantage::contract

#endif  // VANTAGE_SERVER_CONTRACT_LIMITS_H_
