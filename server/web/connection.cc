#include "server/web/connection.h"

#include <algorithm>
#include <utility>

#include <boost/asio/post.hpp>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/web/connect/envelope.h"
#include "server/web/connect/error.h"

namespace vantage::web {
namespace {

// What a client may send ahead while it is answered; then nothing is read until the answer is out.
constexpr size_t kMaxAhead = 64 << 10;
// Of a body that nobody wants: so much is thrown away, so that the client reads the answer rather
// than notice that its connection broke.
constexpr size_t kMaxThrownAway = 1 << 20;
// A body's bytes in either direction for which the client has Patience::body.
constexpr size_t kStep = 64 << 10;
// JSON is longer than the message: bytes are in base64 there, and numbers in words.
constexpr int64_t kJsonToMessage = 2;
// JSON of more bytes is read one body at a time: a megabyte may take half a second, and who sends
// it need not have shown who they are. This much takes 9 ms at most.
constexpr size_t kQuickJson = 16 << 10;
// Answers up to this size are always sent.
constexpr size_t kSmallAnswer = 64 << 10;

grpc::Status TooMuchAtOnce() {
  return OwnError(contract::Retryable(
      absl::StatusCode::kResourceExhausted, "SERVER_BUSY",
      "requests and answers by the web take all the memory they may; try again", absl::Seconds(1)));
}

grpc::Status TooLarge(int64_t most) {
  return OwnError(
      absl::ResourceExhaustedError(absl::StrCat("a request takes ", most, " bytes at most")));
}

}  // namespace

Connection::Connection(Common& common, std::unique_ptr<Wire> wire,
                       const boost::asio::any_io_executor& executor, std::string peer,
                       std::shared_ptr<void> place)
    : common_(common),
      wire_(std::move(wire)),
      executor_(executor),
      place_(std::move(place)),
      timer_(executor) {
  arrival_.peer = std::move(peer);
  arrival_.by_web = true;
}

Connection::~Connection() {
  // Only where memory ended.
  if (upstream_ != nullptr) upstream_->Cancel();
}

void Connection::Begin() {
  Arm(common_.patience.head);
  if (!wire_->encrypted()) return Rest();
  wire_->Handshake([self = shared_from_this()](const boost::system::error_code& error) {
    if (error || self->state_ == State::kClosed) return self->Close();
    self->arrival_.certificate = self->wire_->PeerCertificate();
    self->Rest();
  });
}

void Connection::End(bool at_once) {
  boost::asio::post(executor_, [self = shared_from_this(), at_once] {
    self->ending_ = true;
    const bool busy = self->state_ == State::kCalling || self->state_ == State::kWriting ||
                      self->state_ == State::kBody;
    if (at_once || !busy) self->Close();
  });
}

void Connection::Arm(std::chrono::milliseconds patience) {
  const uint64_t number = ++armed_;
  timer_.expires_after(patience);
  timer_.async_wait([weak = weak_from_this(), number](const boost::system::error_code& error) {
    const std::shared_ptr<Connection> self = weak.lock();
    if (!error && self != nullptr && self->armed_ == number) self->Close();
  });
}

void Connection::Disarm() {
  ++armed_;
  timer_.cancel();
}

void Connection::Close() {
  if (state_ == State::kClosed) return;
  state_ = State::kClosed;
  closed_ = true;
  Disarm();
  wire_->Close();
  if (upstream_ != nullptr) upstream_->Cancel();
  upstream_ = nullptr;
  taken_in_.Reset();
  given_out_.Reset();
}

// Reads all the time, since that alone shows that a client has left.
void Connection::Read() {
  if (reading_ || state_ == State::kClosed || came_.size() >= kMaxAhead) return;
  reading_ = true;
  wire_->Read(part_.data(), part_.size(),
              [self = shared_from_this()](const boost::system::error_code& error, size_t bytes) {
                self->OnRead(error, bytes);
              });
}

void Connection::OnRead(const boost::system::error_code& error, size_t bytes) {
  reading_ = false;
  if (state_ == State::kClosed) return;
  if (error) return Close();
  if (state_ == State::kLeaving) {
    thrown_away_ += bytes;
    if (thrown_away_ > kMaxThrownAway) return Close();
    return Read();
  }
  came_.append(part_.data(), bytes);
  if (state_ == State::kHead) Advance();
  if (state_ == State::kBody) AdvanceBody();
  Read();
}

// The head of the next request.
void Connection::Advance() {
  if (came_.empty()) return;
  if (!reader_.begun()) Arm(common_.patience.head);
  const absl::StatusOr<size_t> used = reader_.Take(came_);
  if (!used.ok()) {
    head_.keep_alive = false;
    const int status = absl::IsResourceExhausted(used.status()) ? 431
                       : absl::IsUnimplemented(used.status())   ? 501
                                                                : 400;
    return Answer(TextResponse(status, used.status().message()));
  }
  came_.erase(0, *used);
  if (!reader_.has_head()) return;
  std::variant<CallRequest, Response> leads_to = common_.router.Route(reader_.head());
  if (auto* response = std::get_if<Response>(&leads_to); response != nullptr) {
    // A body that nobody reads would be taken for the next request.
    response->close = response->close || !reader_.done();
    head_ = reader_.Finish();
    return Answer(*response);
  }
  call_ = std::get<CallRequest>(std::move(leads_to));
  BeginBody();
}

void Connection::BeginBody() {
  state_ = State::kBody;
  body_mark_ = kStep;
  Arm(common_.patience.body);
  const std::string* expect = reader_.head().Find("expect");
  if (expect != nullptr && absl::EqualsIgnoreCase(*expect, "100-continue") && came_.empty() &&
      !reader_.done() && reader_.announced().value_or(0) <= static_cast<uint64_t>(MostBytes())) {
    state_ = State::kWriting;
    return Write("HTTP/1.1 100 Continue\r\n\r\n", nullptr, [this] {
      state_ = State::kBody;
      Arm(common_.patience.body);
      AdvanceBody();
    });
  }
  AdvanceBody();
}

// Of the request's body.
int64_t Connection::MostBytes() const {
  return (call_.json ? kJsonToMessage : 1) * common_.message_bytes +
         static_cast<int64_t>(call_.stream ? kEnvelopeBytes : 0);
}

void Connection::AdvanceBody() {
  const int64_t most = MostBytes();
  const auto refuse = [this](const grpc::Status& why) {
    Response answer = ErrorAnswer(call_, why);
    answer.close = true;
    head_ = reader_.Finish();
    AnswerCall(std::move(answer));
  };
  const absl::StatusOr<size_t> used = reader_.done() ? size_t{0} : reader_.Take(came_);
  if (!used.ok()) return refuse(OwnError(absl::InvalidArgumentError(used.status().message())));
  came_.erase(0, *used);
  const auto came = static_cast<int64_t>(reader_.body_bytes());
  const auto announced = static_cast<int64_t>(
      std::min<uint64_t>(reader_.announced().value_or(0), static_cast<uint64_t>(most) + 1));
  if (std::max(came, announced) > most) return refuse(TooLarge(most));
  const int64_t steps = (came + static_cast<int64_t>(kStep)) / static_cast<int64_t>(kStep);
  const int64_t wanted =
      announced > 0 ? announced : std::min(most, steps * static_cast<int64_t>(kStep));
  if (came > 0 && !taken_in_.GrowTo(common_.budget, std::max(came, wanted))) {
    return refuse(TooMuchAtOnce());
  }
  if (reader_.done()) return Call();
  if (reader_.body_bytes() >= body_mark_) {
    body_mark_ = reader_.body_bytes() + kStep;
    Arm(common_.patience.body);
  }
}

UpstreamRequest Connection::MakeUpstreamRequest(std::string message) const {
  UpstreamRequest request{call_.path(), common_.seal.Metadata(arrival_), call_.timeout,
                          std::move(message)};
  const auto pass_on = [&](const std::vector<std::string>& names) {
    for (const Field& field : head_.fields) {
      if (std::find(names.begin(), names.end(), field.name) != names.end()) {
        request.metadata.emplace(field.name, field.value);
      }
    }
  };
  pass_on(common_.passed_on);
  if (absl::StartsWith(arrival_.peer, "unix:")) pass_on(common_.passed_on_by_proxy);
  return request;
}

void Connection::Call() {
  Disarm();
  state_ = State::kCalling;
  head_ = reader_.Finish();
  std::string body = std::move(head_.body);
  head_.body.clear();
  if (!call_.json || body.size() <= kQuickJson)
    return CallWith(ReadMessage(call_, std::move(body)));
  // The body counts as taken in until it is read, also where the client has left by then.
  boost::asio::post(
      common_.one_at_a_time, [self = shared_from_this(), call = call_, text = std::move(body),
                              kept = std::make_shared<ByteBudget::Share>(std::move(taken_in_))] {
        if (self->closed_) return;
        absl::StatusOr<std::string> message = ReadMessage(call, text);
        boost::asio::post(self->executor_, [self, kept, read = std::move(message)]() mutable {
          if (self->state_ == State::kClosed) return;
          self->taken_in_ = std::move(*kept);
          self->CallWith(std::move(read));
        });
      });
}

void Connection::CallWith(absl::StatusOr<std::string> message) {
  if (!message.ok()) {
    Response answer = ErrorAnswer(call_, OwnError(message.status()));
    return AnswerCall(std::move(answer));
  }
  if (call_.timeout.has_value() && call_.timeout->count() == 0) {
    Response answer = ErrorAnswer(
        call_, OwnError(absl::DeadlineExceededError("the call had no time left when it came")));
    return AnswerCall(std::move(answer));
  }
  const UpstreamRequest request = MakeUpstreamRequest(*std::move(message));
  return call_.stream ? CallForStream(request) : CallOnce(request);
}

void Connection::CallOnce(const UpstreamRequest& request) {
  upstream_ = CallUnary(
      common_.server, request,
      [self = shared_from_this()](const grpc::Status& status, std::string message) {
        boost::asio::post(self->executor_, [self, status, answer = std::move(message)]() mutable {
          self->OnAnswer(status, std::move(answer));
        });
      });
}

void Connection::OnAnswer(const grpc::Status& status, std::string message) {
  if (state_ == State::kClosed) return;
  upstream_ = nullptr;
  taken_in_.Reset();
  absl::StatusOr<Response> answer =
      status.ok() ? UnaryAnswer(call_, std::move(message)) : ErrorAnswer(call_, status);
  if (!answer.ok()) answer = ErrorAnswer(call_, OwnError(answer.status()));
  const size_t bytes = answer->body->size();
  if (bytes > kSmallAnswer && !given_out_.GrowTo(common_.budget, static_cast<int64_t>(bytes))) {
    answer = ErrorAnswer(call_, TooMuchAtOnce());
  }
  AnswerCall(*std::move(answer));
}

void Connection::CallForStream(const UpstreamRequest& request) {
  const uint64_t number = ++streams_;
  Response beginning = StreamBeginning(call_);
  common_.router.Permit(head_, beginning);
  common_.count_answer(beginning.status);
  upstream_ = CallStream(
      common_.server, request,
      [self = shared_from_this()](std::string message) {
        self->common_.turns.Wait([self, part = std::move(message)](Turns::Turn turn) {
          boost::asio::post(self->executor_,
                            [self, part, kept = std::move(turn)] { self->OnMessage(part); });
        });
      },
      [self = shared_from_this(), number](const grpc::Status& status) {
        boost::asio::post(self->executor_, [self, number, status] {
          // Unless this end of it ended it before.
          if (self->state_ != State::kClosed && self->streams_ == number) self->EndStream(status);
        });
      });
  state_ = State::kWriting;
  Write(ChunkedHead(beginning, KeepsAlive()), nullptr, [this] {
    taken_in_.Reset();
    state_ = State::kCalling;
    upstream_->Next();
  });
}

void Connection::OnMessage(const std::string& message) {
  if (state_ == State::kClosed) return;
  if (TooOld()) {
    return EndStream({grpc::StatusCode::UNAVAILABLE, "this connection is too old: call again"});
  }
  absl::StatusOr<std::string> enveloped = StreamMessage(call_, message);
  if (!enveloped.ok()) return EndStream(OwnError(enveloped.status()));
  state_ = State::kWriting;
  Write(ChunkOf(*enveloped), nullptr, [this] {
    state_ = State::kCalling;
    upstream_->Next();
  });
}

void Connection::EndStream(const grpc::Status& status) {
  ++streams_;
  if (upstream_ != nullptr) upstream_->Cancel();
  upstream_ = nullptr;
  state_ = State::kWriting;
  Write(absl::StrCat(ChunkOf(StreamEnd(status)), kLastChunk), nullptr,
        [this] { KeepsAlive() ? Rest() : Leave(); });
}

void Connection::AnswerCall(Response response) {
  common_.router.Permit(head_, response);
  Answer(response);
}

void Connection::Answer(const Response& response) {
  state_ = State::kWriting;
  common_.count_answer(response.status);
  const bool on = KeepsAlive() && !response.close;
  Write(HeadOf(response, on), head_.method == "HEAD" ? nullptr : response.body,
        [this, on] { on ? Rest() : Leave(); });
}

void Connection::Write(std::string text, std::shared_ptr<const std::string> body,
                       std::function<void()> then) {
  text_ = std::move(text);
  body_ = std::move(body);
  written_ = 0;
  then_ = std::move(then);
  WriteOn();
}

void Connection::WriteOn() {
  if (state_ == State::kClosed) return;
  absl::string_view rest;
  if (written_ < text_.size()) {
    rest = absl::string_view(text_).substr(written_, kStep);
  } else if (body_ != nullptr && written_ < text_.size() + body_->size()) {
    rest = absl::string_view(*body_).substr(written_ - text_.size(), kStep);
  }
  if (rest.empty()) {
    Disarm();
    text_ = std::string();
    body_ = nullptr;
    const std::function<void()> then = std::exchange(then_, nullptr);
    return then();
  }
  Arm(common_.patience.body);
  wire_->Write(rest,
               [self = shared_from_this()](const boost::system::error_code& error, size_t bytes) {
                 if (error) return self->Close();
                 self->written_ += bytes;
                 self->WriteOn();
               });
}

// Between two requests.
void Connection::Rest() {
  if (ending_) return Close();
  given_out_.Reset();
  taken_in_.Reset();
  reader_ = RequestReader();
  head_ = Request();
  call_ = CallRequest();
  state_ = State::kHead;
  if (came_.empty()) {
    Arm(common_.crowded ? common_.patience.idle / 10 : common_.patience.idle);
  } else {
    // What was sent ahead; in its turn, since others wait, too.
    Arm(common_.patience.head);
    boost::asio::post(executor_, [self = shared_from_this()] {
      if (self->state_ == State::kHead) self->Advance();
      self->Read();
    });
  }
  Read();
}

// Lets the client read what it was told before its connection is gone.
void Connection::Leave() {
  if (ending_) return Close();
  state_ = State::kLeaving;
  Arm(common_.patience.farewell);
  came_.clear();
  wire_->EndWriting([self = shared_from_this()] { self->Read(); });
  Read();
}

bool Connection::TooOld() const {
  return common_.identified && std::chrono::steady_clock::now() - since_ > common_.patience.age;
}

bool Connection::KeepsAlive() const {
  return head_.keep_alive && !head_.http_1_0 && !common_.draining && !TooOld();
}

}  // namespace vantage::web
