"""What `make bench-peers` has to run, how far it is, and how long it will take."""
import math
import os
import sys
import time

import scenes
import run  # of the friction benchmark

RESULTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "results")
TABLES = {"scenes": "peers_scenes.csv", "friction": "friction_benchmark.csv"}  # ours: how long a run takes
UNKNOWN = 10.0  # s, for a run that ours do not have
EVERY = 20.0  # s between lines where they go to a file


class Run:
    """One row of the plan: `key` as in the rows, `seconds` of processor time that it will take."""

    def __init__(self, table, engine, configuration, case, named, seconds):
        self.table, self.key, self.seconds = table, (engine, configuration, case["name"], named), seconds


def simulated(case):
    if "span" in case:
        return case["span"][1]
    return case["settle"] + math.atan(1.2 * case["mu"]) / case["rate"]


def expected_of(table, most):
    """{key: seconds of processor time per simulated second}, inf for what is too slow."""
    out = {}
    for row in run.rows_of(os.path.join(RESULTS, TABLES[table])):
        slow = row["verdict"] == "too_slow"
        out[key_of(row)] = math.inf if slow else float(row["cost"] or 0)
    return out


def key_of(row):
    return tuple(row[c] for c in ("engine", "configuration", "case", "parameters"))


def plan(table, engine, cases, most):
    """The runs of an engine in their order. Its constructor is not called: it may need what is not here."""
    module = __import__(("scenes_" if table == "scenes" else "entry_") + engine).Entry
    entry, out = module.__new__(module), []
    known = expected_of(table, most)
    for case in cases:
        named = "cells=%d" % case["cells"] if table == "scenes" else run.parameters(case)
        lacks = getattr(entry, "lacks", lambda _: {})(case)
        for configuration in [*run.configurations_of(entry, case, named), *lacks] or ["none"]:
            cost = known.get((engine, configuration, case["name"], named))
            seconds = UNKNOWN if cost is None else min(cost * simulated(case), most)
            if configuration in lacks or configuration == "none":
                seconds = 0.0
            elif table == "scenes" and seconds < 1:  # run_scenes.SHORT: timed three times
                seconds = 3 * seconds + 0.1
            out.append(Run(table, engine, configuration, case, named, seconds))
    return out


class Progress:
    """Tells what is run now and how long it will take, from the rows that have been written."""

    def __init__(self, chains, folder, workers):
        self.chains, self.folder, self.workers = chains, folder, workers  # {engine: [Run]}
        self.begun, self.at_start = time.time(), self.done()
        self.last, self.told = None, 0.0

    def done(self):
        found = set()
        for engine, chain in self.chains.items():
            for table in dict.fromkeys(r.table for r in chain):
                path = os.path.join(self.folder, "rows", "%s_%s.csv" % (table, engine))
                found.update((table, *key_of(row)) for row in run.rows_of(path))
        return found

    def line(self, under_way, ended=()):
        """One line; engines under way and those that are through."""
        done = self.done()
        left, now, count, total, fresh = {}, [], 0, 0, 0.0
        for engine, chain in self.chains.items():
            open_ = [r for r in chain if (r.table, *r.key) not in done]
            total, count = total + len(chain), count + len(chain) - len(open_)
            fresh += sum(r.seconds for r in chain if (r.table, *r.key) in done - self.at_start)
            if engine not in ended and open_:
                left[engine] = sum(r.seconds for r in open_)
            if engine in under_way and open_:
                now.append("%s: %s %s, %s" % (engine, open_[0].key[2], open_[0].key[3], open_[0].key[1]))
        took = time.time() - self.begun
        # how much longer than expected it takes here; at first nothing is known
        pace = max(0.2, took * min(self.workers, len(self.chains)) / fresh) if fresh > 20 else 1.5
        seconds = pace * max(max(left.values(), default=0), sum(left.values()) / self.workers)
        return "; ".join(["%d of %d runs, about %d min left" % (count, total, math.ceil(seconds / 60)), *now])

    def tell(self, under_way, ended):
        text = self.line(under_way, ended)
        if sys.stdout.isatty():
            print("\r\033[Kbench-peers: " + text[:110], end="", flush=True)
        elif text != self.last and time.time() - self.told > EVERY:
            print("bench-peers: " + text, flush=True)
            self.told = time.time()
        self.last = text
