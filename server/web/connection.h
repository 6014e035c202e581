// One connection of a client: its requests, one after the other.
#ifndef VANTAGE_SERVER_WEB_CONNECTION_H_
#define VANTAGE_SERVER_WEB_CONNECTION_H_

#include <grpcpp/channel.h>

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/rpc/call/arrival.h"
#include "server/web/byte_budget.h"
#include "server/web/connect/call_request.h"
#include "server/web/http/request_reader.h"
#include "server/web/router.h"
#include "server/web/turns.h"
#include "server/web/upstream.h"
#include "server/web/wire.h"

namespace vantage::web {

// How long connections may take. Links of tablets are slow and break off; whoever says nothing has
// a place that others want.
struct Patience {
  // For a handshake, and from a request's first byte to the end of its head.
  std::chrono::milliseconds head = std::chrono::seconds(10);
  // For each 64 KiB of a body, either way: 2 KiB/s at least.
  std::chrono::milliseconds body = std::chrono::seconds(30);
  // Between two requests; a tenth of it where most places are taken.
  std::chrono::milliseconds idle = std::chrono::seconds(60);
  // For a client to take note that its connection ends.
  std::chrono::milliseconds farewell = std::chrono::seconds(2);
  // After which a connection ends where callers show who they are, since what one showed with its
  // certificate may have been withdrawn.
  std::chrono::milliseconds age = std::chrono::hours(1);
};

// What all connections share; outlives them.
struct Common {
  const Router& router;
  const rpc::WebSeal& seal;
  const std::shared_ptr<grpc::Channel> server;
  // Names of fields that go along as metadata: from everybody, and by a socket of the file system.
  const std::vector<std::string> passed_on;
  const std::vector<std::string> passed_on_by_proxy;
  const int64_t message_bytes;
  const bool identified;
  const Patience patience;
  ByteBudget budget;
  Turns turns;  // of messages of streams
  // Where JSON that is large is read: one body at a time, so that other threads serve the others.
  boost::asio::any_io_executor one_at_a_time;
  std::atomic<bool> crowded{false};   // most places are taken
  std::atomic<bool> draining{false};  // no connection goes on after its answer
  std::function<void(int status)> count_answer;
};

// Everything runs on the wire's executor. It lives while something of it is under way.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  // `peer`: as Arrival has it. `place` ends with the connection.
  Connection(Common& common, std::unique_ptr<Wire> wire,
             const boost::asio::any_io_executor& executor, std::string peer,
             std::shared_ptr<void> place);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void Begin();
  // From any thread: ends it once the answer that is being written is out, or at once.
  void End(bool at_once);

 private:
  enum class State {
    kHandshake,
    kHead,     // of the next request
    kBody,     // of a request that is let in
    kCalling,  // nothing is to be read; whether the client is still there is
    kWriting,
    kLeaving,  // all is said; what still comes is thrown away
    kClosed,
  };

  void Read();
  void OnRead(const boost::system::error_code& error, size_t bytes);
  void Advance();
  void BeginBody();
  void AdvanceBody();
  int64_t MostBytes() const;
  void Call();
  void CallWith(absl::StatusOr<std::string> message);
  void CallOnce(const UpstreamRequest& request);
  void CallForStream(const UpstreamRequest& request);
  void OnAnswer(const grpc::Status& status, std::string message);
  void OnMessage(const std::string& message);
  void EndStream(const grpc::Status& status);
  // Answer() with what the pages of other origins need to read it.
  void AnswerCall(Response response);
  // Answers the request and goes on to the next one, or ends.
  void Answer(const Response& response);
  // Writes `text` and then `body`, and calls `then`.
  void Write(std::string text, std::shared_ptr<const std::string> body, std::function<void()> then);
  void WriteOn();
  void Rest();
  void Leave();
  void Close();

  bool KeepsAlive() const;
  bool TooOld() const;
  UpstreamRequest MakeUpstreamRequest(std::string message) const;
  void Arm(std::chrono::milliseconds patience);
  void Disarm();

  Common& common_;
  const std::unique_ptr<Wire> wire_;
  const boost::asio::any_io_executor executor_;
  const std::shared_ptr<void> place_;
  const std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
  rpc::Arrival arrival_;
  State state_ = State::kHandshake;
  std::atomic<bool> closed_{false};  // for other threads: state_ is kClosed
  bool ending_ = false;

  boost::asio::steady_timer timer_;
  uint64_t armed_ = 0;

  bool reading_ = false;
  std::array<char, 16 << 10> part_{};
  std::string came_;  // and is not used yet
  size_t thrown_away_ = 0;

  // Of the request at hand.
  RequestReader reader_;
  Request head_;
  CallRequest call_;
  size_t body_mark_ = 0;  // at which the client has more time
  ByteBudget::Share taken_in_;
  ByteBudget::Share given_out_;
  std::shared_ptr<Upstream> upstream_;
  uint64_t streams_ = 0;  // that began or ended; tells what comes late

  std::string text_;
  std::shared_ptr<const std::string> body_;
  size_t written_ = 0;  // of both
  std::function<void()> then_;
};

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_CONNECTION_H_
