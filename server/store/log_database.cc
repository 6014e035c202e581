#include "server/store/log_database.h"

#include <fcntl.h>
#include <sqlite3.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/store/durable_file.h"
#include "server/store/left_out.h"

namespace vantage::store {
namespace {

constexpr int kBusyMilliseconds = 10'000;
// The time to wait for work that can also be done later.
constexpr int kBusyBrieflyMilliseconds = 100;

absl::Status DatabaseError(sqlite3* database, absl::string_view doing) {
  const int code = sqlite3_errcode(database) & 0xff;
  const std::string message = absl::StrCat("cannot ", doing, ": ", sqlite3_errmsg(database));
  switch (code) {
    case SQLITE_FULL:
      return absl::ResourceExhaustedError(
          absl::StrCat("the store has no room (", message, "); make some, then try again"));
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return absl::DataLossError(absl::StrCat(message, "; restore it from a backup"));
    default:
      return absl::UnavailableError(message);
  }
}

// A statement in use; gives it back reset.
class Use {
 public:
  explicit Use(sqlite3_stmt* statement) : statement_(statement) {}
  ~Use() {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;

  void Bind(int place, absl::string_view text) {
    sqlite3_bind_text64(statement_, place, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8);
  }
  void BindBytes(int place, absl::string_view bytes) {
    sqlite3_bind_blob64(statement_, place, bytes.data(), bytes.size(), SQLITE_STATIC);
  }
  void Bind(int place, uint64_t number) {
    sqlite3_bind_int64(statement_, place, static_cast<sqlite3_int64>(number));
  }
  int Step() { return sqlite3_step(statement_); }
  uint64_t Number(int column) {
    return static_cast<uint64_t>(sqlite3_column_int64(statement_, column));
  }
  std::string Bytes(int column) {
    const void* bytes = sqlite3_column_blob(statement_, column);
    const auto size = static_cast<size_t>(sqlite3_column_bytes(statement_, column));
    return bytes == nullptr ? "" : std::string(static_cast<const char*>(bytes), size);
  }

 private:
  sqlite3_stmt* statement_;
};

// The first of the entries that this one stands for.
uint64_t FirstOf(uint64_t sequence, absl::string_view bytes) {
  storage::v1::LogEntry entry;
  const bool read = entry.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  return read ? FirstSequence(entry.event()) : sequence;
}

// True where the entry is the `expected` one, or stands for it and others.
bool Follows(uint64_t sequence, absl::string_view bytes, uint64_t expected) {
  if (sequence == expected) return true;
  return sequence > expected && FirstOf(sequence, bytes) <= expected;
}

constexpr char kAppend[] =
    "INSERT INTO log (session, sequence, crc32c, entry) SELECT ?1, ?2, ?3, ?4 "
    "WHERE ?2 = (SELECT coalesce(max(sequence), 0) + 1 FROM log WHERE session = ?1)";
// Of the entries that a stub stands for: whether they are whole, and not the end of the log.
constexpr char kMayCompact[] =
    "SELECT EXISTS (SELECT 1 FROM log WHERE session = ?1 AND sequence = ?2 - 1) AND "
    "EXISTS (SELECT 1 FROM log WHERE session = ?1 AND sequence = ?3) AND "
    "EXISTS (SELECT 1 FROM log WHERE session = ?1 AND sequence > ?3)";
constexpr char kCompact[] =
    "DELETE FROM log WHERE session = ?1 AND sequence >= ?2 AND sequence < ?3";
constexpr char kPutStub[] =
    "UPDATE log SET crc32c = ?3, entry = ?4 WHERE session = ?1 AND sequence = ?2";
constexpr char kPutEntry[] =
    "INSERT INTO log (session, sequence, crc32c, entry) VALUES (?1, ?2, ?3, ?4)";
constexpr char kReadBackwards[] =
    "SELECT sequence, crc32c, entry FROM log WHERE session = ?1 ORDER BY sequence DESC";
constexpr char kRead[] =
    "SELECT sequence, crc32c, entry FROM log WHERE session = ?1 AND sequence > ?2 "
    "ORDER BY sequence LIMIT ?3";
constexpr char kKnown[] = "SELECT 1 FROM log WHERE session = ?1 LIMIT 1";
constexpr char kSessions[] = "SELECT DISTINCT session FROM log ORDER BY session";
constexpr char kDrop[] = "DELETE FROM log WHERE session = ?1";
constexpr char kPutSnapshot[] =
    "INSERT OR REPLACE INTO snapshot (session, sequence, algorithm_version, blob) "
    "SELECT ?1, ?2, ?3, ?4 WHERE EXISTS (SELECT 1 FROM log WHERE session = ?1)";
constexpr char kSnapshots[] =
    "SELECT sequence, algorithm_version, blob FROM snapshot WHERE session = ?1 "
    "ORDER BY sequence DESC";
constexpr char kDropSnapshot[] = "DELETE FROM snapshot WHERE session = ?1 AND sequence = ?2";
constexpr char kBeginWork[] =
    "INSERT INTO begun (session, work, times) SELECT ?1, ?2, 1 "
    "WHERE EXISTS (SELECT 1 FROM log WHERE session = ?1) "
    "ON CONFLICT (session, work) DO UPDATE SET times = times + 1 RETURNING times";
constexpr char kEndWork[] = "DELETE FROM begun WHERE session = ?1 AND work = ?2";
// Tables that a folder of an older release may lack, and triggers, which work there, too. Those
// that it had before forgot snapshots with any entry that went.
constexpr char kAddTables[] =
    "CREATE TABLE IF NOT EXISTS snapshot (session TEXT NOT NULL, sequence INTEGER NOT NULL,"
    " algorithm_version INTEGER NOT NULL, blob BLOB NOT NULL, PRIMARY KEY (session, sequence))"
    " WITHOUT ROWID;"
    "DROP TRIGGER IF EXISTS snapshot_goes_with_log;"
    "CREATE TRIGGER IF NOT EXISTS snapshot_goes_with_last_entry AFTER DELETE ON log"
    " WHEN NOT EXISTS (SELECT 1 FROM log WHERE session = OLD.session) BEGIN"
    " DELETE FROM snapshot WHERE session = OLD.session; END;"
    "CREATE TABLE IF NOT EXISTS seen (only_row INTEGER PRIMARY KEY CHECK (only_row = 1),"
    " milliseconds INTEGER NOT NULL) WITHOUT ROWID;"
    "CREATE TABLE IF NOT EXISTS begun (session TEXT NOT NULL, work TEXT NOT NULL,"
    " times INTEGER NOT NULL, PRIMARY KEY (session, work)) WITHOUT ROWID;"
    "DROP TRIGGER IF EXISTS begun_goes_with_log;"
    "CREATE TRIGGER IF NOT EXISTS begun_goes_with_last_entry AFTER DELETE ON log"
    " WHEN NOT EXISTS (SELECT 1 FROM log WHERE session = OLD.session) BEGIN"
    " DELETE FROM begun WHERE session = OLD.session; END;"
    "CREATE TABLE IF NOT EXISTS deletion (number INTEGER PRIMARY KEY AUTOINCREMENT,"
    " tenant TEXT NOT NULL, request TEXT NOT NULL, session TEXT NOT NULL,"
    " milliseconds INTEGER NOT NULL)";
constexpr char kRememberDeletion[] =
    "INSERT INTO deletion (tenant, request, session, milliseconds) VALUES (?1, ?2, ?3, ?4)";
constexpr char kForgetDeletions[] =
    "DELETE FROM deletion WHERE number <= (SELECT max(number) FROM deletion) - ?1";
constexpr char kDeletions[] =
    "SELECT tenant, request, session, milliseconds FROM deletion ORDER BY number";
constexpr char kSeenTime[] = "SELECT milliseconds FROM seen";
constexpr char kPutSeenTime[] =
    "INSERT OR REPLACE INTO seen (only_row, milliseconds) VALUES (1, ?1)";

}  // namespace

struct LogDatabase::Connection {
  sqlite3* database = nullptr;
  std::map<const char*, sqlite3_stmt*> statements;

  ~Connection() {
    for (const auto& [text, statement] : statements) sqlite3_finalize(statement);
    sqlite3_close(database);
  }

  absl::Status Run(const char* sql) {
    return sqlite3_exec(database, sql, nullptr, nullptr, nullptr) == SQLITE_OK
               ? absl::OkStatus()
               : DatabaseError(database, absl::StrCat("do '", sql, "'"));
  }

  absl::StatusOr<int> Ask(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database, sql, -1, &statement, nullptr) != SQLITE_OK) {
      return DatabaseError(database, absl::StrCat("ask '", sql, "'"));
    }
    absl::StatusOr<int> answer = 0;
    if (sqlite3_step(statement) == SQLITE_ROW) {
      answer = sqlite3_column_int(statement, 0);
    } else {
      answer = DatabaseError(database, absl::StrCat("ask '", sql, "'"));
    }
    sqlite3_finalize(statement);
    return answer;
  }

  absl::Status Prepare(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v3(database, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr) !=
        SQLITE_OK) {
      return DatabaseError(database, absl::StrCat("prepare '", sql, "'"));
    }
    statements[sql] = statement;
    return absl::OkStatus();
  }

  absl::Status Open(const std::string& path, int flags) {
    if (sqlite3_open_v2(path.c_str(), &database, flags | SQLITE_OPEN_NOMUTEX, nullptr) !=
        SQLITE_OK) {
      return DatabaseError(database, absl::StrCat("open ", path));
    }
    sqlite3_extended_result_codes(database, 1);
    sqlite3_busy_timeout(database, kBusyMilliseconds);
    return absl::OkStatus();
  }

  // The schema's version; 0: there is none yet.
  absl::StatusOr<int> KnownVersion() {
    absl::StatusOr<int> version = Ask("PRAGMA user_version");
    if (!version.ok() || *version <= kSchemaVersion) return version;
    return absl::FailedPreconditionError(
        absl::StrCat("the data are of schema ", *version, ", this release reads up to ",
                     kSchemaVersion, ": start the newer release, or restore a backup"));
  }

  absl::Status PrepareToRead() {
    for (const char* statement : {kRead, kReadBackwards, kKnown, kSessions}) {
      if (absl::Status prepared = Prepare(statement); !prepared.ok()) return prepared;
    }
    return absl::OkStatus();
  }

  // Makes the log of a new database.
  absl::Status Migrate() {
    const absl::StatusOr<int> version = KnownVersion();
    if (!version.ok()) return version.status();
    if (*version > 0) return absl::OkStatus();
    return Run(
        "BEGIN IMMEDIATE;"
        "CREATE TABLE log (session TEXT NOT NULL, sequence INTEGER NOT NULL,"
        " crc32c INTEGER NOT NULL, entry BLOB NOT NULL, PRIMARY KEY (session, sequence))"
        " WITHOUT ROWID;"
        "PRAGMA user_version = 1;"
        "COMMIT");
  }
};

absl::StatusOr<std::unique_ptr<LogDatabase>> LogDatabase::Open(const std::string& path) {
  auto writer = std::make_unique<Connection>();
  absl::Status status = writer->Open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  // Deleted content is overwritten, too.
  for (const char* setting :
       {"PRAGMA journal_mode = WAL", "PRAGMA synchronous = FULL", "PRAGMA secure_delete = ON"}) {
    if (status.ok()) status = writer->Run(setting);
  }
  if (status.ok()) status = writer->Migrate();
  // Syncs what the system had not yet written when the last process was killed, before anybody
  // reads it.
  if (status.ok()) status = writer->Run("PRAGMA wal_checkpoint(TRUNCATE)");
  if (status.ok()) status = writer->Run(kAddTables);
  for (const char* statement :
       {kAppend, kMayCompact, kCompact, kPutStub, kDrop, kPutSnapshot, kSnapshots, kDropSnapshot,
        kBeginWork, kEndWork, kSeenTime, kPutSeenTime, kKnown, kPutEntry, kRememberDeletion,
        kForgetDeletions, kDeletions}) {
    if (status.ok()) status = writer->Prepare(statement);
  }
  auto reader = std::make_unique<Connection>();
  if (status.ok()) status = reader->Open(path, SQLITE_OPEN_READONLY);
  if (status.ok()) status = reader->PrepareToRead();
  if (!status.ok()) return status;
  return std::unique_ptr<LogDatabase>(new LogDatabase(path, std::move(writer), std::move(reader)));
}

absl::StatusOr<std::unique_ptr<LogDatabase>> LogDatabase::OpenToRead(const std::string& path) {
  auto reader = std::make_unique<Connection>();
  absl::Status status = reader->Open(path, SQLITE_OPEN_READONLY);
  if (status.ok()) status = reader->KnownVersion().status();
  if (status.ok()) status = reader->PrepareToRead();
  if (!status.ok()) return status;
  return std::unique_ptr<LogDatabase>(new LogDatabase(path, nullptr, std::move(reader)));
}

LogDatabase::LogDatabase(std::string path, std::unique_ptr<Connection> writer,
                         std::unique_ptr<Connection> reader)
    : path_(std::move(path)), writer_(std::move(writer)), reader_(std::move(reader)) {}

LogDatabase::~LogDatabase() = default;

absl::Status LogDatabase::Append(const std::string& session, uint64_t sequence,
                                 absl::string_view entry) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use append(writer_->statements.at(kAppend));
  append.Bind(1, absl::string_view(session));
  append.Bind(2, sequence);
  append.Bind(3, uint64_t{bytes::Crc32c(entry)});
  append.BindBytes(4, entry);
  if (append.Step() != SQLITE_DONE) {
    return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
  }
  if (sqlite3_changes(writer_->database) == 1) return absl::OkStatus();
  return absl::AbortedError(
      absl::StrCat("session ", session, ": entry ", sequence, " is not the next one"));
}

absl::StatusOr<std::vector<std::string>> LogDatabase::Read(const std::string& session,
                                                           uint64_t after, size_t limit) const {
  std::lock_guard<std::mutex> lock(read_mutex_);
  std::vector<std::string> entries;
  {
    Use read(reader_->statements.at(kRead));
    read.Bind(1, absl::string_view(session));
    read.Bind(2, after);
    read.Bind(3, uint64_t{limit});
    uint64_t expected = after + 1;
    int step = SQLITE_ROW;
    while ((step = read.Step()) == SQLITE_ROW) {
      std::string entry = read.Bytes(2);
      const uint64_t sequence = read.Number(0);
      if (read.Number(1) != bytes::Crc32c(entry) || !Follows(sequence, entry, expected)) {
        return absl::DataLossError(absl::StrCat("session ", session, ": entry ", expected, " in ",
                                                path_, " is damaged or missing"));
      }
      expected = sequence + 1;
      entries.push_back(std::move(entry));
    }
    if (step != SQLITE_DONE) {
      return DatabaseError(reader_->database, absl::StrCat("read ", path_));
    }
  }
  if (!entries.empty()) return entries;
  Use known(reader_->statements.at(kKnown));
  known.Bind(1, absl::string_view(session));
  if (known.Step() != SQLITE_ROW) return absl::NotFoundError(absl::StrCat("no log of ", session));
  return entries;
}

// Where a page of the file is damaged, what lies before it is read forwards and what lies behind it
// backwards.
absl::StatusOr<std::vector<std::string>> LogDatabase::ReadSound(
    const std::string& session, std::vector<std::string>& faults) const {
  std::lock_guard<std::mutex> lock(read_mutex_);
  std::map<uint64_t, std::string> sound;
  uint64_t last = 0;
  bool whole = true;
  for (const char* statement : {kRead, kReadBackwards}) {
    Use read(reader_->statements.at(statement));
    read.Bind(1, absl::string_view(session));
    if (statement == kRead) {
      read.Bind(2, uint64_t{0});
      read.Bind(3, uint64_t{std::numeric_limits<int64_t>::max()});
    }
    int step = SQLITE_ROW;
    while ((step = read.Step()) == SQLITE_ROW) {
      const uint64_t sequence = read.Number(0);
      std::string entry = read.Bytes(2);
      last = std::max(last, sequence);
      if (read.Number(1) == bytes::Crc32c(entry)) sound.try_emplace(sequence, std::move(entry));
    }
    whole = step == SQLITE_DONE;
    if (whole) break;
    faults.emplace_back(DatabaseError(reader_->database, absl::StrCat("read ", path_)).message());
  }
  if (last == 0 && whole) return absl::NotFoundError(absl::StrCat("no log of ", session));
  std::vector<std::string> entries;
  uint64_t next = 1;
  const auto missing = [&](uint64_t until) {
    if (next == until) return;
    const std::string which = until - next == 1 ? absl::StrCat("entry ", next)
                                                : absl::StrCat("entries ", next, " to ", until - 1);
    faults.push_back(absl::StrCat("session ", session, ": ", which, " in ", path_,
                                  until - next == 1 ? " is" : " are", " damaged or missing"));
  };
  for (auto& [sequence, entry] : sound) {
    if (!Follows(sequence, entry, next)) missing(FirstOf(sequence, entry));
    next = sequence + 1;
    entries.push_back(std::move(entry));
  }
  missing(std::max(last + 1, next));
  return entries;
}

absl::Status LogDatabase::Compact(const std::string& session, const std::vector<Stub>& stubs) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  absl::Status status = writer_->Run("BEGIN IMMEDIATE; PRAGMA user_version = 2");
  for (const Stub& stub : stubs) {
    if (status.ok()) status = PutStub(session, stub);
  }
  return EndTransaction(std::move(status));
}

absl::Status LogDatabase::PutStub(const std::string& session, const Stub& stub) {
  {
    Use may(writer_->statements.at(kMayCompact));
    may.Bind(1, absl::string_view(session));
    may.Bind(2, stub.first);
    may.Bind(3, stub.last);
    if (may.Step() != SQLITE_ROW) {
      return DatabaseError(writer_->database, absl::StrCat("read ", path_));
    }
    if (may.Number(0) == 0 || stub.first > stub.last) {
      return absl::AbortedError(absl::StrCat("session ", session, ": ", stub.first, " to ",
                                             stub.last, " are no entries to leave out"));
    }
  }
  Use leave(writer_->statements.at(kCompact));
  leave.Bind(1, absl::string_view(session));
  leave.Bind(2, stub.first);
  leave.Bind(3, stub.last);
  Use put(writer_->statements.at(kPutStub));
  put.Bind(1, absl::string_view(session));
  put.Bind(2, stub.last);
  put.Bind(3, uint64_t{bytes::Crc32c(stub.entry)});
  put.BindBytes(4, stub.entry);
  if (leave.Step() == SQLITE_DONE && put.Step() == SQLITE_DONE) return absl::OkStatus();
  return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
}

absl::StatusOr<std::vector<std::string>> LogDatabase::Sessions() const {
  std::lock_guard<std::mutex> lock(read_mutex_);
  Use read(reader_->statements.at(kSessions));
  std::vector<std::string> sessions;
  int step = SQLITE_ROW;
  while ((step = read.Step()) == SQLITE_ROW) sessions.push_back(read.Bytes(0));
  if (step != SQLITE_DONE) return DatabaseError(reader_->database, absl::StrCat("read ", path_));
  return sessions;
}

absl::Status LogDatabase::PutLog(const std::string& session,
                                 absl::FunctionRef<absl::Status(TakeEntry)> entries) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  {
    Use known(writer_->statements.at(kKnown));
    known.Bind(1, absl::string_view(session));
    if (known.Step() == SQLITE_ROW) {
      return absl::AbortedError(absl::StrCat("session ", session, " has a log"));
    }
  }
  absl::Status status = writer_->Run("BEGIN IMMEDIATE");
  uint64_t next = 1;
  bool stubs = false;
  if (status.ok()) {
    status = entries([&](uint64_t first, uint64_t last, absl::string_view entry) -> absl::Status {
      if (first != next || last < first) {
        return absl::AbortedError(
            absl::StrCat("session ", session, ": entry ", next, " is missing"));
      }
      next = last + 1;
      stubs = stubs || last > first;
      Use put(writer_->statements.at(kPutEntry));
      put.Bind(1, absl::string_view(session));
      put.Bind(2, last);
      put.Bind(3, uint64_t{bytes::Crc32c(entry)});
      put.BindBytes(4, entry);
      if (put.Step() == SQLITE_DONE) return absl::OkStatus();
      return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
    });
  }
  if (status.ok() && next == 1) {
    status = absl::AbortedError(absl::StrCat("session ", session, ": there is no entry"));
  }
  // As in Compact(): a release that does not know them takes them for damage.
  if (status.ok() && stubs) status = writer_->Run("PRAGMA user_version = 2");
  return EndTransaction(std::move(status));
}

absl::Status LogDatabase::EndTransaction(absl::Status status) {
  if (status.ok()) status = writer_->Run("COMMIT");
  if (!status.ok() && sqlite3_get_autocommit(writer_->database) == 0) {
    writer_->Run("ROLLBACK").IgnoreError();
  }
  return status;
}

absl::Status LogDatabase::Drop(const std::string& session) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  absl::Status dropped = DropLog(session);
  if (dropped.ok()) EmptyWriteAheadLog();
  return dropped;
}

absl::Status LogDatabase::DropByRequest(const DeletionRecord& deletion) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  absl::Status status = writer_->Run("BEGIN IMMEDIATE");
  if (status.ok()) status = DropLog(deletion.session);
  if (status.ok()) status = Remember(deletion);
  status = EndTransaction(std::move(status));
  if (status.ok()) EmptyWriteAheadLog();
  return status;
}

absl::Status LogDatabase::DropLog(const std::string& session) {
  Use drop(writer_->statements.at(kDrop));
  drop.Bind(1, absl::string_view(session));
  if (drop.Step() != SQLITE_DONE) {
    return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
  }
  if (sqlite3_changes(writer_->database) > 0) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat("no log of ", session));
}

absl::Status LogDatabase::Remember(const DeletionRecord& deletion) {
  Use remember(writer_->statements.at(kRememberDeletion));
  remember.Bind(1, absl::string_view(deletion.tenant));
  remember.Bind(2, absl::string_view(deletion.request));
  remember.Bind(3, absl::string_view(deletion.session));
  remember.Bind(4, static_cast<uint64_t>(absl::ToUnixMillis(deletion.time)));
  Use forget(writer_->statements.at(kForgetDeletions));
  forget.Bind(1, uint64_t{Store::kRememberedDeletions});
  if (remember.Step() == SQLITE_DONE && forget.Step() == SQLITE_DONE) return absl::OkStatus();
  return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
}

void LogDatabase::EmptyWriteAheadLog() {
  sqlite3_busy_timeout(writer_->database, kBusyBrieflyMilliseconds);
  writer_->Run("PRAGMA wal_checkpoint(TRUNCATE)").IgnoreError();
  sqlite3_busy_timeout(writer_->database, kBusyMilliseconds);
}

absl::StatusOr<std::vector<DeletionRecord>> LogDatabase::Deletions() const {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use read(writer_->statements.at(kDeletions));
  std::vector<DeletionRecord> deletions;
  int step = SQLITE_ROW;
  while ((step = read.Step()) == SQLITE_ROW) {
    deletions.push_back({read.Bytes(0), read.Bytes(1), read.Bytes(2),
                         absl::FromUnixMillis(static_cast<int64_t>(read.Number(3)))});
  }
  if (step != SQLITE_DONE) return DatabaseError(writer_->database, absl::StrCat("read ", path_));
  return deletions;
}

absl::Status LogDatabase::PutSnapshot(const std::string& session, const SnapshotRecord& snapshot) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use put(writer_->statements.at(kPutSnapshot));
  put.Bind(1, absl::string_view(session));
  put.Bind(2, snapshot.sequence);
  put.Bind(3, uint64_t{snapshot.algorithm_version});
  put.BindBytes(4, snapshot.blob);
  if (put.Step() != SQLITE_DONE) {
    return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
  }
  if (sqlite3_changes(writer_->database) > 0) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat("no log of ", session));
}

absl::StatusOr<std::vector<SnapshotRecord>> LogDatabase::Snapshots(
    const std::string& session) const {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use read(writer_->statements.at(kSnapshots));
  read.Bind(1, absl::string_view(session));
  std::vector<SnapshotRecord> snapshots;
  int step = SQLITE_ROW;
  while ((step = read.Step()) == SQLITE_ROW) {
    snapshots.push_back({read.Number(0), static_cast<uint32_t>(read.Number(1)), read.Bytes(2)});
  }
  if (step != SQLITE_DONE) return DatabaseError(writer_->database, absl::StrCat("read ", path_));
  return snapshots;
}

absl::Status LogDatabase::DropSnapshot(const std::string& session, uint64_t sequence) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use drop(writer_->statements.at(kDropSnapshot));
  drop.Bind(1, absl::string_view(session));
  drop.Bind(2, sequence);
  if (drop.Step() == SQLITE_DONE) return absl::OkStatus();
  return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
}

absl::StatusOr<absl::Duration> LogDatabase::SeenTime() const {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use read(writer_->statements.at(kSeenTime));
  const int step = read.Step();
  if (step == SQLITE_ROW) return absl::Milliseconds(static_cast<int64_t>(read.Number(0)));
  if (step == SQLITE_DONE) return absl::ZeroDuration();
  return DatabaseError(writer_->database, absl::StrCat("read ", path_));
}

absl::Status LogDatabase::PutSeenTime(absl::Duration seen) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use put(writer_->statements.at(kPutSeenTime));
  put.Bind(1, static_cast<uint64_t>(absl::ToInt64Milliseconds(seen)));
  if (put.Step() == SQLITE_DONE) return absl::OkStatus();
  return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
}

absl::StatusOr<int> LogDatabase::BeginWork(const std::string& session, const std::string& work) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use begin(writer_->statements.at(kBeginWork));
  begin.Bind(1, absl::string_view(session));
  begin.Bind(2, absl::string_view(work));
  int times = 0;
  int step = SQLITE_ROW;
  while ((step = begin.Step()) == SQLITE_ROW) times = static_cast<int>(begin.Number(0));
  if (step != SQLITE_DONE) {
    return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
  }
  if (times > 0) return times;
  return absl::NotFoundError(absl::StrCat("no log of ", session));
}

absl::Status LogDatabase::EndWork(const std::string& session, const std::string& work) {
  std::lock_guard<std::mutex> lock(write_mutex_);
  Use end(writer_->statements.at(kEndWork));
  end.Bind(1, absl::string_view(session));
  end.Bind(2, absl::string_view(work));
  if (end.Step() == SQLITE_DONE) return absl::OkStatus();
  return DatabaseError(writer_->database, absl::StrCat("write to ", path_));
}

absl::Status LogDatabase::Check() const {
  std::lock_guard<std::mutex> lock(read_mutex_);
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(reader_->database, "PRAGMA integrity_check(1)", -1, &statement, nullptr) !=
      SQLITE_OK) {
    return DatabaseError(reader_->database, absl::StrCat("check ", path_));
  }
  std::string said;
  {
    Use check(statement);
    if (check.Step() == SQLITE_ROW) said = check.Bytes(0);
  }
  sqlite3_finalize(statement);
  if (said == "ok") return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(path_, " is damaged: ", said));
}

absl::Status LogDatabase::CopyTo(const std::string& path) const {
  {
    std::lock_guard<std::mutex> lock(read_mutex_);
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(reader_->database, "VACUUM INTO ?1", -1, &statement, nullptr) !=
        SQLITE_OK) {
      return DatabaseError(reader_->database, absl::StrCat("copy ", path_));
    }
    int step = SQLITE_ROW;
    {
      Use copy(statement);
      copy.Bind(1, absl::string_view(path));
      step = copy.Step();
    }
    absl::Status failed = step == SQLITE_DONE
                              ? absl::OkStatus()
                              : DatabaseError(reader_->database, absl::StrCat("write to ", path));
    sqlite3_finalize(statement);
    if (!failed.ok()) return failed;
  }
  const FileDescriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!file.ok()) return FileError("cannot open", path);
  return SyncData(file.get(), path);
}

}  // namespace vantage::store
