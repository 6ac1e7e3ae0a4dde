#!/usr/bin/env python3
"""Runs the friction benchmark with one engine and writes a row per case and configuration.

  run.py deform [--command build/release/bin/deform] [--only CASE] [--law LAW] [--out FILE.csv]
  run.py mujoco | run.py bullet          other engines, by the scripts beside this one; any NAME with an
                                         entry_NAME.py here or in --entries

Where search.py has found better settings than those that an entry names, they run as `found by search`.

A row: engine, version, configuration, case, its parameters, quantity, measured, expected, low, high, verdict
(pass, fail, too_slow, error, or not_run where an engine has no such law), cost (seconds of processor time per
simulated second), note. A row is written as soon as its case is done; rows that FILE already holds are not
run again, so a stopped run continues where it was.
"""
import argparse
import csv
import importlib
import io
import math
import os
import sys
import tempfile

import cases
import found

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), *[os.pardir] * 3)
COLUMNS = ["engine", "version", "configuration", "case", "parameters", "quantity", "measured", "expected",
           "low", "high", "verdict", "cost", "note"]
MISSING = "%s: this python3 does not find the module '%s'; install it, or take the python3 that has it"
PARAMETERS = ["mu", "mu_S", "mu_C", "share", "ratio"]


def parameters(case):
    return " ".join("%s=%g" % (key, case[key]) for key in PARAMETERS if key in case)


def verdict(value, low, high):
    return "pass" if math.isfinite(value) and low <= value <= high else "fail"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("engine", metavar="ENGINE", help="NAME of an entry_NAME.py")
    parser.add_argument("--entries", help="another folder that has entries")
    parser.add_argument("--command", default=os.path.join(ROOT, "build", "release", "bin", "deform"),
                        help="the deform command: runs our cases, makes the meshes of all entries (that of "
                             "this checkout, as `make demo` builds it)")
    parser.add_argument("--only", action="append", help="one case by name; may be given again")
    parser.add_argument("--most", type=int, default=cases.MOST_SECONDS,
                        help="seconds of processor time for a case")
    parser.add_argument("--configuration", help="one configuration of the engine (for deform: a law)")
    parser.add_argument("--out", help="CSV to write or to continue; without it the rows are printed")
    parser.add_argument("--found", default=found.TABLE, help="table of search.py")
    given = parser.parse_args()
    found.TABLE = given.found
    cases.MOST_SECONDS = given.most
    make = entry_of(given.engine, given.entries)
    given.command = command_of(given.command)
    given.out = given.out and os.path.abspath(given.out)
    done = {tuple(r[c] for c in COLUMNS[:5]) for r in rows_of(given.out)}
    with tempfile.TemporaryDirectory() as work:
        try:
            entry = make(given.command, work)
        except ModuleNotFoundError as error:
            sys.exit(MISSING % (given.engine, error.name))
        for case in cases.cases():
            if given.only and case["name"] not in given.only:
                continue
            lacks = getattr(entry, "lacks", lambda _: {})(case)
            for configuration in [*configurations_of(entry, case, parameters(case)), *lacks] or ["none"]:
                head = dict(zip(COLUMNS, [entry.name, entry.version, configuration, case["name"],
                                          parameters(case)]))
                if tuple(head.values()) in done or (given.configuration
                                                    and configuration != given.configuration):
                    continue
                rows = ([{"verdict": "not_run", "note": lacks[configuration]}] if configuration in lacks
                        else measured_rows(entry, case, configuration, parameters(case)))
                rows = [{**head, **row} for row in rows]
                if given.out:
                    append(given.out, COLUMNS, *rows)
                for row in rows:
                    shown = ("engine", "configuration", "case", "parameters", "quantity", "measured", "low",
                             "high", "verdict", "note")
                    print("%-8s %-14s %-16s %-14s %-16s %12s  [%s, %s]  %s %s" %
                          tuple(row.get(k, "") for k in shown), flush=True)


def configurations_of(entry, case, named):
    """Those that an entry names, and `found by search` where there is something."""
    names = [name for name in entry.configurations(case) if name != found.FOUND]
    return [*names, found.FOUND] if names and found.settings(entry, case, named) else names


def entry_of(engine, folder):
    """The class Entry of entry_ENGINE.py; in one sentence what there is where there is none."""
    folders = ([os.path.abspath(folder)] if folder else []) + [os.path.dirname(os.path.abspath(__file__))]
    sys.path[:0] = folders
    try:
        return importlib.import_module("entry_" + engine).Entry
    except ModuleNotFoundError as error:
        if error.name != "entry_" + engine:
            sys.exit(MISSING % (engine, error.name))
        known = sorted(n[6:-3] for d in folders if os.path.isdir(d) for n in os.listdir(d)
                       if n.startswith("entry_") and n.endswith(".py"))
        sys.exit("there is no entry_%s.py in %s; there are: %s" % (engine, " or ".join(folders),
                                                                   ", ".join(known)))


def measured_rows(entry, case, configuration, named):
    if configuration == "none":
        why = getattr(entry, "why_not", lambda _: "no law with " + case["law"])(case)
        return [{"verdict": "not_run", "note": why}]
    note = {}
    if configuration == found.FOUND:
        given = found.settings(entry, case, named)
        entry.settings, note = {**type(entry).settings, found.FOUND: given}, {"note": found.told(given)}
    try:
        values, cost = entry.run(case, configuration)
    except cases.TooSlow as error:
        return [{"verdict": "too_slow", "note": str(error)}]
    except RuntimeError as error:
        return [{"verdict": "error", "note": str(error).replace("\n", " ")[:200]}]
    return [{**row, **note} for row in judged(case, values, cost)]


def judged(case, values, cost):
    rows = []
    for quantity, (expected, low, high) in case["answer"].items():
        if quantity not in values:
            rows.append({"quantity": quantity, "verdict": "not_run", "note": "the engine does not tell it"})
            continue
        value = values[quantity]
        rows.append({"quantity": quantity, "measured": "%.6g" % value, "expected": "%.6g" % expected,
                     "low": "%.6g" % low, "high": "%.6g" % high,
                     "verdict": verdict(value, low, high), "cost": "%.3g" % cost})
    return rows


def command_of(path):
    path = os.path.abspath(path)
    if not os.access(path, os.X_OK):
        sys.exit("%s: no such command; build it with `make demo`, or name another with --command" % path)
    return path


def rows_of(path):
    if not path or not os.path.exists(path):
        return []
    with open(path) as f:
        return list(csv.DictReader(f))


def append(path, columns, *rows):
    """Rows at the end of a table that may not be there yet, in one write: a run that is stopped leaves all of
    a case or nothing."""
    fresh = not os.path.exists(path) or os.path.getsize(path) == 0
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    if fresh:
        writer.writeheader()
    writer.writerows(rows)
    with open(path, "a", newline="") as f:
        f.write(text.getvalue())


if __name__ == "__main__":
    main()
