// Where a request leads: to a file of the page, or to an RPC. Decided by its head alone, and
// without calling anybody.
#ifndef VANTAGE_SERVER_WEB_ROUTER_H_
#define VANTAGE_SERVER_WEB_ROUTER_H_

#include <string>
#include <variant>
#include <vector>

#include "server/web/connect/call_request.h"
#include "server/web/http/message.h"
#include "server/web/page_files.h"

namespace vantage::web {

struct RouterOptions {
  // Full names of the services that are there.
  std::vector<std::string> services;
  // Origins whose pages may call, beside the page itself: 'https://crew.example'. Where callers are
  // not told apart they also name the hosts that this server may be asked for.
  std::vector<std::string> allowed_origins;
  // Callers have to show who they are.
  bool identified = false;
};

// Thread safe.
class Router {
 public:
  Router(RouterOptions options, PageFiles page);

  // A call whose message is in the body; or the answer, whatever the body is. The answer carries
  // what CORS asks for.
  std::variant<CallRequest, Response> Route(const Request& head) const;

  // Adds to an answer what lets the page of an allowed origin read it.
  void Permit(const Request& head, Response& answer) const;

 private:
  bool Allows(const std::string& origin) const;
  // Whether a page of that origin came from this server.
  bool SameOrigin(const Request& head, const std::string& origin) const;
  bool KnownHost(const Request& head) const;
  std::variant<CallRequest, Response> RouteCall(
      const Request& head, const google::protobuf::MethodDescriptor& method) const;

  const RouterOptions options_;
  const RpcDirectory rpcs_;
  const PageFiles page_;
};

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_ROUTER_H_
