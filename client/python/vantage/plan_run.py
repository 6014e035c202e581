"""A plan that is being made."""

from __future__ import annotations

from types import TracebackType
from typing import Iterator, Optional, Type

from vantage import watch
from vantage.connection import Connection
from vantage.v1 import plan_pb2, plan_service_pb2


class PlanRun:
    """Iterate over it for the ranking as it improves; the last one is the answer.

    As a context manager it cancels the plan when it is left before the plan has ended.
    """

    def __init__(self, connection: Connection, plan: plan_pb2.Plan) -> None:
        self._connection = connection
        self.latest = plan
        """As it was heard of last."""

    @property
    def name(self) -> str:
        """sessions/{session}/plans/{plan}."""
        return str(self.latest.name)

    @property
    def ended(self) -> bool:
        return self.latest.state in watch.ENDED

    def __iter__(self) -> Iterator[plan_pb2.Plan]:
        """Each improvement that arrives, intermediate ones may be left out. Resumes after breaks.
        VantageError."""
        for self.latest in watch.plan_revisions(self._connection, self.name):
            yield self.latest

    def wait(self) -> plan_pb2.Plan:
        """The plan as it ended. `result.outcome` says whether there are views. VantageError."""
        for _ in self:
            pass
        return self.latest

    def full(self) -> plan_pb2.Plan:
        """With patches and the whole map of scores, page after page. VantageError."""
        request = plan_service_pb2.GetPlanRequest(name=self.name, view=plan_service_pb2.PLAN_VIEW_FULL)
        answer = self._connection.call(request)
        plan: plan_pb2.Plan = answer.plan
        while answer.next_score_map_page_token:
            request.score_map_page_token = answer.next_score_map_page_token
            answer = self._connection.call(request)
            more = answer.plan.result.score_map
            for column in ("x", "y", "z", "score", "score_lower", "score_upper"):
                getattr(plan.result.score_map, column).extend(getattr(more, column))
        return plan

    def cancel(self) -> None:
        """Stops it; what it found so far is kept. Harmless when it has ended. VantageError."""
        self.latest = self._connection.call(
            plan_service_pb2.CancelPlanRequest(name=self.name)).plan

    def __enter__(self) -> "PlanRun":
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        if not self.ended:
            self.cancel()
