#!/usr/bin/env python3
"""Speed at equal error, from rows of run_scenes.py.

  fronts.py FILE.csv [--page PAGE] [--runs PAGE] [--pictures FOLDER]

The error of a run is the largest of its quantities': percent of what is expected; um/s where 0 is expected.
The table of --page: the least processor time per simulated second with which each engine stays within an
error, over its meshes and settings. That of --runs: the settings found by search. They take the place of what
stands between the marks `<!-- scenes -->` and `<!-- end of scenes -->`; without a page they are printed. A
picture per scene has all runs. What an engine was calibrated with does not count: the coarse beam of Jolt.
"""
import argparse
import csv
import math
import os

import speed
from found import FOUND, shown

BEGIN, END = "<!-- scenes -->\n", "<!-- end of scenes -->\n"
COLORS = {**speed.COLORS, "jolt": "#8a63b8"}
# what is compared: case, quantities, unit, errors at which the engines are compared
QUESTIONS = [("beam", ("sag",), "%", (30, 10, 3)), ("beam", ("sag", "period"), "%", (30, 10, 5)),
             ("beam", ("sag", "period", "kept"), "%", (30, 10)),
             ("slope_hold", ("creep_um_per_s",), "um/s", (100, 1)), ("pair", ("dip",), "%", (20, 5)),
             ("pair", ("dip", "drag"), "%", (20, 10)), ("stack", ("shortening",), "%", (20, 5)),
             ("stack", ("creep_um_per_s",), "um/s", (1000, 100)), ("gripper", ("rise",), "%", (2, 1)),
             ("gripper", ("rise", "creep_um_per_s"), "% and um/s", (2, 1))]
CALIBRATED = ("beam", 400)  # scenes_jolt.py


def error(row):
    if row["verdict"] not in ("pass", "fail"):
        return math.inf
    value, expected = float(row["measured"]), float(row["expected"])
    if not math.isfinite(value):
        return math.inf
    return abs(value - expected) if expected == 0 else 100 * abs(value / expected - 1)


def runs(rows, case, quantities):
    """[(engine, configuration, cells, cost, error)] of a case."""
    by = {}
    for row in rows:
        if row["case"] == case and row["configuration"] != "none":
            who = (row["engine"], row["configuration"], int(row["parameters"].split("=")[1]))
            if who[0] == "jolt" and (case, who[2]) == CALIBRATED:
                continue
            by.setdefault(who, {})[row["quantity"]] = row
    out = []
    for who, told in by.items():
        worst = max(error(told[q]) if q in told else math.inf for q in quantities)
        cost = max(float(row["cost"] or "inf") for row in told.values())
        out.append((*who, cost, worst))
    return out


def name_of(case, quantities):
    plain = {"creep_um_per_s": "creep"}
    return "%s: %s" % (case, ", ".join(plain.get(q, q) for q in quantities))


def heads(rows):
    """Engines, what they cannot run, the rest of a table's head."""
    engines = list(dict.fromkeys(r["engine"] for r in rows))
    cannot = {(r["engine"], r["case"]): r["note"] for r in rows if r["configuration"] == "none"}
    return engines, cannot, "| " + " | ".join(engines) + " |\n|" + "---|" * (2 + len(engines)) + "\n"


def least_time(rows):
    engines, cannot, head = heads(rows)
    text = "Least processor time (s per simulated s) within an error:\n\n| question | error at most " + head
    for case, quantities, unit, levels in QUESTIONS:
        found = runs(rows, case, quantities)
        answers = {}
        for level in levels:
            cells = []
            for engine in engines:
                good = [r for r in found if r[0] == engine and r[4] <= level]
                if good:
                    r = min(good, key=lambda x: x[3])
                    cells.append((r[3], "%.3g (%s, %d)" % (r[3], shown(r[1]), r[2])))
                else:
                    cells.append((None, "cannot" if (engine, case) in cannot else "never"))
            answers.setdefault(" | ".join(speed.bold_least(cells, speed.LEVEL)), []).append("%g" % level)
        for answer, of in answers.items():  # levels with the same answer share a row
            text += "| %s | %s %s | %s |\n" % (name_of(case, quantities), ", ".join(of), unit, answer)
    return text


def settings_found(rows):
    text = "| scene | cells | engine | settings |\n|---|---|---|---|\n"
    cells = {}
    for r in rows:
        if r["configuration"] == FOUND and r["quantity"]:
            found = cells.setdefault((r["case"], r["engine"], r["note"]), {})
            found[r["parameters"].split("=")[1]] = None
    return text + "".join("| %s | %s | %s | %s |\n" % (case, ", ".join(found), engine, note)
                          for (case, engine, note), found in cells.items())


def pictures(rows, folder):
    """peers_SCENE.png: error, that of the worst quantity in half bands, over processor time."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    top, low = 300.0, 3e-3
    by_scene = {}
    for (case, named), by in speed.runs(rows).items():
        for (engine, configuration), (error, cost) in by.items():
            if math.isfinite(cost) and not (engine == "jolt" and (case, int(named[6:])) == CALIBRATED):
                by_scene.setdefault(case, []).append((engine, configuration, named, error, cost))
    for case, found in by_scene.items():
        finest = max((r[2] for r in found), key=lambda named: int(named[6:]))
        figure, axis = plt.subplots(figsize=(7.2, 3.8), dpi=80)
        for engine, configuration, named, error, cost in found:
            shape = "*" if configuration == FOUND else "x" if error > top else "o"
            axis.plot(cost, min(max(error, low), top), shape, ms=11 if shape == "*" else 6, alpha=0.75,
                      color=COLORS[engine], mfc=COLORS[engine] if named == finest else "none",
                      label=engine)
        axis.axhspan(low / 2, 1, color="k", alpha=0.06, lw=0)
        axis.set(xscale="log", yscale="log", ylim=(low / 2, top * 2), title=case,
                 xlabel="processor time per simulated second (s)", ylabel="error (half bands)")
        axis.grid(True, alpha=0.25)
        handles = dict(zip(*reversed(axis.get_legend_handles_labels())))
        figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=len(handles), fontsize=9)
        figure.tight_layout(rect=(0, 0.07, 1, 1))
        figure.savefig(os.path.join(folder, "peers_%s.png" % case))
        plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("--page")
    parser.add_argument("--runs")
    parser.add_argument("--pictures", metavar="FOLDER")
    given = parser.parse_args()
    with open(given.file, newline="") as f:
        rows = list(csv.DictReader(f))
    if given.pictures:
        pictures(rows, given.pictures)
    times, found = least_time(rows), settings_found(rows)
    if given.page:
        speed.table.into_page(given.page, times, (BEGIN, END))
    if given.runs:
        speed.table.into_page(given.runs, found, (BEGIN, END))
    if not given.page and not given.runs:
        print(times + "\n" + found, end="")


if __name__ == "__main__":
    main()
