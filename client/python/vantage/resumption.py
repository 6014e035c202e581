"""Whether and when to go on after a link broke."""

from __future__ import annotations

import random
import time
from typing import Callable, Optional

from vantage.errors import VantageError


class Backoff:
    """Doubles from 0.2 s to 10 s, spread by a quarter either way so that many clients do not come
    back at the same moment."""

    def __init__(self) -> None:
        self._current = 0.2

    def next(self, asked: Optional[float] = None) -> float:
        """Seconds to wait now; at least what the server asked for."""
        wait = max(self._current * random.uniform(0.75, 1.25), asked or 0)
        self._current = min(2 * self._current, 10.0)
        return wait

    def reset(self) -> None:
        """Notes a success: the next wait is the shortest again."""
        self._current = 0.2


class Resumption:
    """give_up_after: s, counted from the last progress; wait: waits so many seconds."""

    def __init__(self, give_up_after: float, wait: Callable[[float], None] = time.sleep) -> None:
        self._give_up_after = give_up_after
        self._wait = wait
        self._backoff = Backoff()
        self._last_progress = time.monotonic()

    def progress(self) -> None:
        self._last_progress = time.monotonic()
        self._backoff.reset()

    def after_break(self, failure: VantageError) -> None:
        """Waits, and returns when a new attempt makes sense; else raises the failure at once."""
        if not failure.transient or time.monotonic() - self._last_progress > self._give_up_after:
            raise failure
        self._wait(self._backoff.next(failure.retry_seconds))


class LoadingWait:
    """Patience, s, with a server that has to load the model of a job first. Of one call, all its
    attempts."""

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._since: Optional[float] = None

    def after(self, failure: VantageError) -> bool:
        """True, after a wait, where that is why the call failed, and it is to be made again."""
        if failure.reason != "MODEL_LOADING":
            return False
        now = time.monotonic()
        self._since = now if self._since is None else self._since
        if now - self._since > self._patience:
            return False
        time.sleep(min(5.0, max(0.05, failure.retry_seconds or 1.0)))
        return True
