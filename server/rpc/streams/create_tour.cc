#include <utility>

#include "server/contract/out_of_memory.h"
#include "server/rpc/handlers/lookup.h"
#include "server/rpc/streams/pumped_writer.h"
#include "server/rpc/streams/streams.h"

namespace vantage::rpc {
namespace {

class TourStream final : public PumpedWriter<v1::CreateTourResponse> {
 public:
  TourStream(const RpcDependencies& dependencies, std::shared_ptr<RpcCall> call,
             grpc::CallbackServerContext* context, std::shared_ptr<session::Session> session,
             std::shared_ptr<session::TourRun> run)
      : PumpedWriter(dependencies, std::move(call), context),
        session_(std::move(session)),
        run_(std::move(run)) {}

 protected:
  Step Produce(v1::CreateTourResponse& message, absl::Status& status) override {
    session::TourRun::News news = run_->Take();
    if (news.ended && !news.status.ok()) {
      status = news.status;
      return Step::kFinish;
    }
    if (!news.tour.has_value() && !news.ended) return Step::kIdle;
    // The last tour is told again where it was taken before the end came.
    if (news.tour.has_value()) newest_ = *std::move(news.tour);
    *message.mutable_tour() = newest_;
    message.set_last(news.ended);
    return news.ended ? Step::kWriteLast : Step::kWrite;
  }

  void Started() override {
    const std::weak_ptr<PumpedWriter> self = weak_from_this();
    run_->Tell([self] {
      if (const auto stream = self.lock()) stream->Notify();
    });
  }
  void Stopped() override {
    run_->Tell(nullptr);
    run_->Stop();
  }

 private:
  const std::shared_ptr<session::Session> session_;
  const std::shared_ptr<session::TourRun> run_;
  v1::Tour newest_;
};

}  // namespace

grpc::ServerWriteReactor<v1::CreateTourResponse>* CreateTour(const RpcDependencies& dependencies,
                                                             const std::shared_ptr<RpcCall>& call,
                                                             grpc::CallbackServerContext* context,
                                                             const v1::CreateTourRequest& request) {
  using Refused = RefusedStream<grpc::ServerWriteReactor<v1::CreateTourResponse>>;
  const auto session = FindForWork(call->sessions(), request);
  if (!session.ok()) return new Refused(*call, session.status(), context);
  auto run = contract::UnlessOutOfMemory([&] { return (*session)->tours().Create(request); });
  if (!run.ok()) return new Refused(*call, run.status(), context);
  return BeginStream<TourStream>(dependencies, call, context, *session, *std::move(run));
}

}  // namespace vantage::rpc
