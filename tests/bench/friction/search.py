#!/usr/bin/env python3
"""Looks for the settings with which an engine does best, case by case: a rival at its defaults says little.

  search.py ENGINE --case NAME [--parameters "mu=0.5"] [--out FILE.csv] [--best FILE.csv]

From the entry's best configuration (`SEARCH_FROM`) one key of its `SEARCH` after the other is tried at every
value, with the best so far of the others: a walk along the coordinates. A row per trial goes to --out: case,
settings, what was measured, and the score: how far the worst quantity lies from the middle of its band, in
half bands (up to 1 passes). --best gets the winner as a row of the benchmark, configuration `tuned`, with its
settings as note. Trials that --out holds are not run again.
"""
import argparse
import json
import math
import os
import sys
import tempfile

import cases
import run

COLUMNS = ["engine", "version", "case", "parameters", "settings", "measured", "score", "cost", "note"]


def score(case, values):
    worst = 0.0
    for quantity, (_, low, high) in case["answer"].items():
        value = values.get(quantity, math.inf)
        # bands from 0 on, as those of creep: 0 is best
        middle, half = (0.0, high) if low == 0 else (0.5 * (low + high), 0.5 * (high - low))
        worst = max(worst, abs(value - middle) / half if math.isfinite(value) else math.inf)
    return worst


def trials(start, grid, judge):
    """The best settings along the coordinates, and their score."""
    best, least = dict(start), judge(start)
    for key, values in grid.items():
        for value in values:
            given = {**best, key: value}
            if given == best:
                continue
            found = judge(given)
            if found < least:
                best, least = given, found
    return best, least


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("engine", metavar="ENGINE")
    parser.add_argument("--entries")
    parser.add_argument("--command", default=os.path.join(run.ROOT, "build", "release", "bin", "deform"))
    parser.add_argument("--case", required=True)
    parser.add_argument("--parameters", help="as they stand in the rows; without it all of the case")
    parser.add_argument("--out", required=True)
    parser.add_argument("--best")
    given = parser.parse_args()
    given.out, given.best = (path and os.path.abspath(path) for path in (given.out, given.best))
    known = run.rows_of(given.out)
    given.command = run.command_of(given.command)
    with tempfile.TemporaryDirectory() as work:
        module = run.entry_of(given.engine, given.entries)
        entry = module(given.command, work)
        if not hasattr(entry, "SEARCH"):
            sys.exit("%s: its entry has no SEARCH" % given.engine)
        for case in cases.cases():
            named = run.parameters(case)
            if case["name"] != given.case or given.parameters not in (None, named):
                continue
            results = {}

            def judge(settings):
                key = json.dumps(settings, sort_keys=True)
                head = {"engine": entry.name, "version": entry.version, "case": case["name"],
                        "parameters": named, "settings": key}
                for row in known:
                    if all(row[k] == v for k, v in head.items()):
                        results[key] = row
                        return float(row["score"])
                entry.settings = {**entry.settings, "tuned": settings}
                try:
                    values, cost = entry.run(case, "tuned")
                    row = {**head, "measured": json.dumps(values), "score": "%.4g" % score(case, values),
                           "cost": "%.3g" % cost}
                except RuntimeError as error:
                    row = {**head, "score": "inf", "note": str(error).replace("\n", " ")[:120]}
                results[key] = row
                run.append(given.out, COLUMNS, row)
                print(row["score"], key, row.get("measured", row.get("note", "")), flush=True)
                return float(row["score"])

            best, least = trials(entry.settings[entry.SEARCH_FROM], entry.SEARCH, judge)
            row = results[json.dumps(best, sort_keys=True)]
            print("best:", least, best, flush=True)
            head = {"engine": entry.name, "version": entry.version, "configuration": "tuned",
                    "case": case["name"], "parameters": named}
            told = [all(old[k] == v for k, v in head.items()) for old in run.rows_of(given.best)]
            if given.best and row.get("measured") and not any(told):
                note = "; ".join("%s %s" % pair for pair in sorted(best.items()))
                for line in run.judged(case, json.loads(row["measured"]), float(row["cost"])):
                    run.append(given.best, run.COLUMNS, {**head, **line, "note": note})


if __name__ == "__main__":
    main()
