#!/usr/bin/env python3
"""Looks for the settings with which an engine does best, case by case: a rival at its defaults says little.

  search.py ENGINE --out FILE.csv [--scenes [--fine]] [--only CASE] [--parameters "mu=0.5"] [--trials 40]
            [--seconds 120] [--most 20]

Tried for each case: the settings of the entry's `BEGIN`, those with names; then, in turns, a draw at random
from its `SEARCH` (key to values, None: as it comes) and twice the best so far with one, two or three keys
drawn anew. --scenes: the scenes of ../peers on their coarse meshes, else the cases of the friction benchmark.

A row per trial goes to --out: settings, what was measured, score (how far the worst quantity lies from the
middle of its band, in half bands: up to 1 passes), cost, processor time used. Of two trials within the bands
the cheaper is better, else the nearer. A case ends after --trials, or when its trials have used --seconds; a
trial ends after --most seconds, or earlier where it is hopeless. A stopped search continues, and more
trials can be asked for later. run.py and run_scenes.py run the best as `found by search`.
"""
import argparse
import importlib
import json
import math
import os
import random
import resource
import sys
import tempfile
import time

import cases
import found
import run

COLUMNS = ["engine", "version", "case", "parameters", "settings", "measured", "score", "cost", "used", "note"]


def score(case, values):
    worst = 0.0
    for quantity, (_, low, high) in case["answer"].items():
        value = values.get(quantity, math.inf)
        # bands from 0 on, as those of creep: 0 is best
        middle, half = (0.0, high) if low == 0 else (0.5 * (low + high), 0.5 * (high - low))
        worst = max(worst, abs(value - middle) / half if math.isfinite(value) else math.inf)
    return worst


def proposals(begin, space, draw, best):
    """Settings to try, without end: `best()` is the best so far."""
    yield from begin
    turn = 0
    while True:
        turn += 1
        if turn % 3 == 1:
            given, keys = {}, list(space)
        else:
            given, keys = dict(best()), draw.sample(list(space), min(len(space), draw.choice((1, 1, 2, 3))))
        for key in keys:
            value = draw.choice(space[key])
            given.pop(key, None)
            if value is not None:
                given[key] = value
        yield given


def used_now():
    """Processor time of this process and of what it called, s."""
    return time.process_time() + resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime


def searched(entry, case, named, known, given):
    """Runs the trials of a case that are not known yet."""
    head = {"engine": entry.name, "version": entry.version, "case": case["name"], "parameters": named}
    tried = {row["settings"]: row for row in known if all(row[k] == v for k, v in head.items())}
    space = entry.space(case) if hasattr(entry, "space") else entry.SEARCH

    def best():
        row = found.best(tried.values())
        return json.loads(row["settings"]) if row else {}

    draw = random.Random("%s %s %s" % (entry.name, case["name"], named))
    begin = [*getattr(entry, "BEGIN", []), *type(entry).settings.values()]
    for number, settings in enumerate(proposals(begin, space, draw, best)):
        spent = sum(float(row["used"]) for row in tried.values())
        if len(tried) >= given.trials or spent >= given.seconds or number > 20 * given.trials:
            break
        key = json.dumps(settings, sort_keys=True)
        if key in tried or not getattr(entry, "possible", lambda _: True)(settings):
            continue
        entry.settings = {**type(entry).settings, found.FOUND: settings}
        begun = used_now()
        try:
            values, cost = entry.run(case, found.FOUND)
            row = {"measured": json.dumps(values), "score": "%.4g" % score(case, values),
                   "cost": "%.3g" % cost}
        except (RuntimeError, ValueError) as error:
            row = {"score": "inf", "note": str(error).replace("\n", " ")[:120]}
        tried[key] = {"measured": "", "cost": "", **head, "settings": key, **row,
                      "used": "%.3g" % (used_now() - begun)}
        run.append(given.out, COLUMNS, tried[key])
        print("%-12s %-8s %8s %s %s" % (case["name"], named, row["score"], key,
                                        row.get("measured", row.get("note", ""))), flush=True)
    row = found.best(tried.values())
    if row:
        print("best: %s %s, score %s, %s s per s: %s" % (case["name"], named, row["score"], row["cost"],
                                                        found.told(json.loads(row["settings"]))), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("engine", metavar="ENGINE")
    parser.add_argument("--entries")
    parser.add_argument("--command", default=os.path.join(run.ROOT, "build", "release", "bin", "deform"))
    parser.add_argument("--scenes", action="store_true")
    parser.add_argument("--fine", action="store_true", help="the scenes on their fine meshes")
    parser.add_argument("--only", action="append", help="one case by name; may be given again")
    parser.add_argument("--parameters", help="as they stand in the rows; without it all of the case")
    parser.add_argument("--trials", type=int, default=40)
    parser.add_argument("--seconds", type=float, default=120)
    parser.add_argument("--most", type=int, default=20)
    parser.add_argument("--out", required=True)
    given = parser.parse_args()
    given.out, given.command = os.path.abspath(given.out), run.command_of(given.command)
    if given.scenes:
        sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "peers"))
        import scenes
        make = importlib.import_module("scenes_" + given.engine).Entry
        coarse = scenes.coarse_cases()
        todo = [(case, "cells=%d" % case["cells"]) for case in scenes.cases()
                if (case in coarse) != given.fine]
        scenes.MOST_SECONDS = given.most
    else:
        make = run.entry_of(given.engine, given.entries)
        todo = [(case, run.parameters(case)) for case in cases.cases()]
        cases.MOST_SECONDS = given.most
    if not hasattr(make, "SEARCH"):
        sys.exit("%s: its entry has no SEARCH" % given.engine)
    with tempfile.TemporaryDirectory() as work:
        try:
            entry = make(given.command, work)
        except ModuleNotFoundError as error:
            sys.exit(run.MISSING % (given.engine, error.name))
        for case, named in todo:
            if (given.only and case["name"] not in given.only) or given.parameters not in (None, named) or (
                    not entry.configurations(case)):
                continue
            searched(entry, case, named, run.rows_of(given.out), given)


if __name__ == "__main__":
    main()
