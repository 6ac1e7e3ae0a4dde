#!/usr/bin/env python3
"""Runs the friction benchmark with one engine and writes a row per case and configuration.

  run.py deform [--command build/release/bin/deform] [--only CASE] [--law LAW] [--out FILE.csv]
  run.py mujoco | run.py bullet          other engines, by the scripts beside this one

A row: engine, version, configuration, case, its parameters, quantity, measured, expected, low, high, verdict (pass, fail, error, or not_run where an
engine has no such law), cost (wall seconds per simulated second), note. A row is written as soon as its case is done; rows that FILE already
holds are not run again, so a run that was stopped goes on where it was.
"""
import argparse
import csv
import importlib
import math
import os
import sys
import tempfile

import cases

COLUMNS = ["engine", "version", "configuration", "case", "parameters", "quantity", "measured", "expected", "low", "high", "verdict", "cost", "note"]
PARAMETERS = ["mu", "mu_S", "mu_C", "share", "ratio"]


def parameters(case):
    return " ".join("%s=%g" % (key, case[key]) for key in PARAMETERS if key in case)


def verdict(value, low, high):
    return "pass" if math.isfinite(value) and low <= value <= high else "fail"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("engine", choices=["deform", "mujoco", "bullet"])
    parser.add_argument("--command", default="build/release/bin/deform", help="the deform command: runs our cases, makes the meshes of all entries")
    parser.add_argument("--only", help="one case by name")
    parser.add_argument("--configuration", help="one configuration of the engine (for deform: a law)")
    parser.add_argument("--out", help="CSV to write or to go on with; without it the rows are printed")
    given = parser.parse_args()
    done, file = set(), None
    if given.out:
        fresh = not os.path.exists(given.out)
        if not fresh:
            with open(given.out) as f:
                done = {tuple(r[c] for c in COLUMNS[:5]) for r in csv.DictReader(f)}
        file = open(given.out, "a", newline="")
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        if fresh:
            writer.writeheader()
    with tempfile.TemporaryDirectory() as work:
        entry = importlib.import_module("entry_" + given.engine).Entry(given.command, work)
        for case in cases.cases():
            if given.only and case["name"] != given.only:
                continue
            for configuration in entry.configurations(case) or ["none"]:
                head = dict(zip(COLUMNS, [entry.name, entry.version, configuration, case["name"], parameters(case)]))
                if tuple(head.values()) in done or (given.configuration and configuration != given.configuration):
                    continue
                rows = measured_rows(entry, case, configuration)
                for row in rows:
                    row = {**head, **row}
                    if file:
                        writer.writerow(row)
                        file.flush()
                    shown = ("engine", "configuration", "case", "parameters", "quantity", "measured", "low", "high", "verdict", "note")
                    print("%-8s %-14s %-16s %-14s %-16s %12s  [%s, %s]  %s %s" % tuple(row.get(k, "") for k in shown), flush=True)


def measured_rows(entry, case, configuration):
    if configuration == "none":
        return [{"verdict": "not_run", "note": "no law with " + case["law"]}]
    try:
        values, cost = entry.run(case, configuration)
    except RuntimeError as error:
        return [{"verdict": "error", "note": str(error).replace("\n", " ")[:200]}]
    rows = []
    for quantity, (expected, low, high) in case["answer"].items():
        if quantity not in values:
            rows.append({"quantity": quantity, "verdict": "not_run", "note": "the engine does not tell it"})
            continue
        value = values[quantity]
        rows.append({"quantity": quantity, "measured": "%.6g" % value, "expected": "%.6g" % expected, "low": "%.6g" % low, "high": "%.6g" % high,
                     "verdict": verdict(value, low, high), "cost": "%.3g" % cost})
    return rows


if __name__ == "__main__":
    sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
    main()
