#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {
namespace {

constexpr int kScorePage = 100'000;

// Keeps the entries of one page of a column.
void Cut(size_t skip, size_t limit, google::protobuf::RepeatedField<float>& column) {
  const auto size = static_cast<size_t>(column.size());
  const size_t begin = std::min(skip, size);
  const size_t end = std::min(begin + limit, size);
  column.Truncate(static_cast<int>(end));
  column.erase(column.begin(), column.begin() + static_cast<std::ptrdiff_t>(begin));
}

}  // namespace

absl::StatusOr<v1::GetPlanResponse> GetPlan(const session::TenantSessions& sessions,
                                            const v1::GetPlanRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "plans", "name");
  if (!session.ok()) return session.status();
  // The map of a plan that has ended does not change: an index is a place in it.
  const std::string list = absl::StrCat(request.name(), "/scores");
  absl::StatusOr<Page> page =
      ReadPage(request.score_map_page_size(), request.score_map_page_token(), list, kScorePage,
               kScorePage, "score_map_page_size", "score_map_page_token");
  if (!page.ok()) return page.status();
  size_t skip = 0;
  if (!page->after.empty() && !absl::SimpleAtoi(page->after, &skip)) {
    return contract::UnknownPageToken("score_map_page_token");
  }
  absl::StatusOr<v1::Plan> plan = (*session)->plans().Get(request.name());
  if (!plan.ok()) return plan.status();
  v1::GetPlanResponse response;
  *response.mutable_plan() = *std::move(plan);
  const bool ended = response.plan().has_end_time() && response.plan().has_result();
  if (request.view() != v1::PLAN_VIEW_FULL || !ended) return response;

  absl::StatusOr<v1::PlanResult> full = (*session)->plans().GetFullResult(request.name());
  if (!full.ok()) return full.status();
  v1::ScoreMap& map = *full->mutable_score_map();
  const auto size = static_cast<size_t>(map.x_size());
  if (!page->after.empty() && skip >= size) {
    return contract::UnknownPageToken("score_map_page_token");
  }
  if (skip < size && page->limit < size - skip) {
    response.set_next_score_map_page_token(NextPageToken(list, absl::StrCat(skip + page->limit)));
  }
  for (auto* column : {map.mutable_x(), map.mutable_y(), map.mutable_z(), map.mutable_score(),
                       map.mutable_score_lower(), map.mutable_score_upper()}) {
    Cut(skip, page->limit, *column);
  }
  *response.mutable_plan()->mutable_result() = *std::move(full);
  return response;
}

absl::StatusOr<v1::ListPlansResponse> ListPlans(const session::TenantSessions& sessions,
                                                const v1::ListPlansRequest& request) {
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  // A plan in the basic view has up to 200 views of about 1 KiB: a page fits in one message.
  return ListOfSession<v1::ListPlansResponse>(
      sessions, request, "plans", 200,
      [&](session::Session& session, const std::string& after, size_t limit, bool& more) {
        return session.plans().List(after, limit, more, request);
      },
      [](v1::ListPlansResponse& response) { return response.mutable_plans(); });
}

}  // namespace vantage::rpc::handlers
