"""How far a study is, on standard error: on a terminal a line that is renewed, else one every ten seconds."""
from __future__ import annotations

import sys
import time


def clock(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


class Progress:
    def __init__(self, total: int, shown: bool):
        self.total, self.shown = total, shown
        self.terminal = sys.stderr.isatty()
        self.begun = self.last = time.monotonic()
        self.done = self.failed = 0

    def add(self, failed: bool) -> None:
        self.done += 1
        self.failed += failed
        now = time.monotonic()
        if not self.shown or now - self.last < (0.2 if self.terminal else 10) and self.done < self.total:
            return
        self.last = now
        left = (now - self.begun) / self.done * (self.total - self.done)
        text = f"{self.done} of {self.total} runs, {self.failed} failed, {clock(left)} left"
        end = "" if self.terminal and self.done < self.total else "\n"
        print(("\r\033[K" if self.terminal else "") + text, end=end, file=sys.stderr, flush=True)
