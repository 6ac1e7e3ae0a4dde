#!/usr/bin/env python3
"""Runs the scenes of scenes.py with one engine and writes a row per case, configuration and quantity.

  run_scenes.py ENGINE --out FILE.csv [--command build/release/bin/deform] [--only CASE] [--cells N]
                [--configuration NAME] [--coarse] [--most SECONDS]
  run_scenes.py judge --out FILE.csv        judges the rows of FILE again, after an answer has changed

ENGINE: NAME of a scenes_NAME.py here. Rows have the columns of friction/run.py; those that FILE holds are not
run again. `cost`: seconds of processor time of the steps alone (without reading the mesh) per simulated
second, the least of up to three runs where they are short.
"""
import argparse
import csv
import importlib
import os
import sys
import tempfile

import scenes
import run  # of the friction benchmark

SHORT = 1.0  # s of processor time: what takes less is timed again


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("engine", metavar="ENGINE")
    parser.add_argument("--command", default=os.path.join(run.ROOT, "build", "release", "bin", "deform"))
    parser.add_argument("--only")
    parser.add_argument("--cells", type=int)
    parser.add_argument("--coarse", action="store_true", help="only the coarse mesh of each scene")
    parser.add_argument("--most", type=int, default=scenes.MOST_SECONDS,
                        help="seconds of processor time for a run")
    parser.add_argument("--configuration")
    parser.add_argument("--out", required=True)
    parser.add_argument("--found", default=run.found.TABLE, help="table of search.py")
    given = parser.parse_args()
    run.found.TABLE = given.found
    if given.engine == "judge":
        return judge(given.out)
    scenes.MOST_SECONDS = given.most
    given.command, given.out = run.command_of(given.command), os.path.abspath(given.out)
    try:
        make = importlib.import_module("scenes_" + given.engine).Entry
    except ModuleNotFoundError as error:
        sys.exit(run.MISSING % (given.engine, error.name))
    done = {tuple(r[c] for c in run.COLUMNS[:5]) for r in run.rows_of(given.out)}
    slow = {(r["configuration"], r["case"]) for r in run.rows_of(given.out) if r["verdict"] == "too_slow"
            and r["engine"] == given.engine}
    with tempfile.TemporaryDirectory() as work:
        try:
            entry = make(given.command, work)
        except ModuleNotFoundError as error:
            sys.exit(run.MISSING % (given.engine, error.name))
        for case in scenes.coarse_cases() if given.coarse else scenes.cases():
            if given.only not in (None, case["name"]) or given.cells not in (None, case["cells"]):
                continue
            named = "cells=%d" % case["cells"]
            for configuration in run.configurations_of(entry, case, named) or ["none"]:
                head = dict(zip(run.COLUMNS, [entry.name, entry.version, configuration, case["name"], named]))
                if tuple(head.values()) in done or given.configuration not in (None, configuration):
                    continue
                if (configuration, case["name"]) in slow:
                    rows = [{"verdict": "too_slow", "note": "too slow: on the coarse mesh already"}]
                else:
                    rows = run.measured_rows(entry, case, configuration, named)
                if rows[0]["verdict"] == "too_slow":
                    slow.add((configuration, case["name"]))
                for _ in range(2):
                    cost = float(rows[0].get("cost") or "inf")
                    if cost * case["span"][1] > SHORT:
                        break
                    again = run.measured_rows(entry, case, configuration, named)
                    rows = again if float(again[0].get("cost") or "inf") < cost else rows
                run.append(given.out, run.COLUMNS, *({**head, **row} for row in rows))
                for row in rows:
                    shown = (entry.name, configuration, case["name"], case["cells"], row.get("quantity", ""),
                             row.get("measured", ""), row.get("expected", ""), row["verdict"],
                             row.get("cost", ""), row.get("note", ""))
                    print("%-7s %-18s %-11s %5d %-15s %12s (%s) %s %s %s" % shown, flush=True)


def judge(path):
    answers = {(case["name"], "cells=%d" % case["cells"]): case["answer"] for case in scenes.cases()}
    rows = run.rows_of(path)
    for row in rows:
        if row["quantity"]:
            expected, low, high = answers[row["case"], row["parameters"]][row["quantity"]]
            row.update(expected="%.6g" % expected, low="%.6g" % low, high="%.6g" % high,
                       verdict=run.verdict(float(row["measured"]), low, high))
    with open(path, "w", newline="") as f:
        writer = csv.DictWriter(f, run.COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
