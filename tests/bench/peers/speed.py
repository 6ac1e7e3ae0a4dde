#!/usr/bin/env python3
"""Speed at equal error and error at equal speed, from rows of the friction benchmark.

  speed.py FILE.csv [--page PAGE] [--picture PNG]

A case is equally exact where every quantity lies in its band. The table has for each case and engine the
configuration that gets there for the least processor time per simulated second, and those that do not get
there at any; in bold the least time and all within a factor of two of it. The picture has every
configuration: its error in half bands over its cost. With --page the table takes the place of what stands
between the page's marks.
"""
import argparse
import csv
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "friction"))
import table
from found import shown

LEVEL = 2  # ratio of two times that is not significant
COLORS = {"deform": "#2f6db3", "mujoco": "#c8553d", "bullet": "#3b8f5c"}


def runs(rows):
    """{(case, parameters): {(engine, configuration): (error in half bands, cost)}}; inf where it broke."""
    out = {}
    for row in rows:
        if row["verdict"] == "not_run" or row["configuration"] == "none":
            continue
        key, who = (row["case"], row["parameters"]), (row["engine"], row["configuration"])
        error, cost = math.inf, float(row["cost"] or "nan")
        if row["verdict"] in ("pass", "fail"):
            value, low, high = (float(row[k]) for k in ("measured", "low", "high"))
            # bands from 0 on, as those of creep: 0 is best
            middle, half = (0.0, high) if low == 0 else (0.5 * (low + high), 0.5 * (high - low))
            error = abs(value - middle) / half if math.isfinite(value) else math.inf
        before = out.setdefault(key, {}).get(who, (0.0, cost))
        out[key][who] = (max(before[0], error), cost)
    return out


def bold_least(cells, level):
    """Cells (value or None, text): the least in bold, and what is within a factor `level` of it."""
    least = min((v for v, _ in cells if v is not None), default=None)
    return ["**%s**" % t if v is not None and v <= level * least else t for v, t in cells]


def speed_table(rows):
    cases = runs(rows)
    engines = list(dict.fromkeys(who[0] for by in cases.values() for who in by))
    lines = ["| case | " + " | ".join(engines) + " |", "|" + "---|" * (1 + len(engines))]
    for (case, parameters), by in cases.items():
        cells = []
        for engine in engines:
            passed = [(cost, name) for (e, name), (error, cost) in by.items() if e == engine and error <= 1]
            if passed:
                cost, name = min(passed)
                cells.append((cost, "%.3g (%s)" % (cost, shown(name))))
            else:
                run = any(e == engine for e, _ in by)
                cells.append((None, "not at any setting run" if run else "not run"))
        lines.append("| %s %s | %s |" % (case, parameters, " | ".join(bold_least(cells, LEVEL))))
    return "\n".join(lines) + "\n"



def picture(rows, path):
    try:
        import matplotlib
    except ModuleNotFoundError:
        sys.exit("speed.py: this python3 does not find the module 'matplotlib'; install it, or leave out "
                 "--picture")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import matplotlib.ticker
    by_name = {}
    for (case, _), by in runs(rows).items():
        by_name.setdefault(case, []).extend((*who, *what) for who, what in by.items())
    figure, axes = plt.subplots(2, math.ceil(len(by_name) / 2), figsize=(13.5, 6.4), dpi=80, squeeze=False)
    for axis, (case, points) in zip(axes.flat, by_name.items()):
        for engine, configuration, error, cost in points:
            if math.isfinite(cost):
                axis.loglog(cost, min(max(error, 1e-4), 1e4), "o", ms=5, alpha=0.7,
                            color=COLORS.get(engine, "#7a7a7a"), label=engine)
        axis.axhline(1, color="k", lw=0.8, ls=":")
        axis.set_ylim(4e-5, 2.5e4)
        low, high = (math.log10(x) for x in axis.get_xlim())
        axis.set_xlim(10 ** math.floor(low), 10 ** math.ceil(high))  # a label at each end
        axis.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        axis.set_title(case, fontsize=10)
        axis.grid(True, alpha=0.25)
        axis.set_xlabel("processor time per simulated second (s)", fontsize=8)
    for axis in axes.flat[len(by_name):]:
        axis.axis("off")
    for axis in axes[:, 0]:
        axis.set_ylabel("error (half bands; dotted: passes)", fontsize=8)
    handles = {}
    for axis in axes.flat:
        for handle, label in zip(*axis.get_legend_handles_labels()):
            handles.setdefault(label, handle)
    figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=len(handles), fontsize=9)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    figure.savefig(path)


def report(doc, tables, draw, marks):
    """The command line of this script and of fronts.py: tables printed or put into a page, the picture."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("--page")
    parser.add_argument("--picture")
    given = parser.parse_args()
    with open(given.file, newline="") as f:
        rows = list(csv.DictReader(f))
    if given.picture:
        draw(rows, given.picture)
    if given.page:
        table.into_page(given.page, tables(rows), marks)
    else:
        print(tables(rows), end="")


if __name__ == "__main__":
    report(__doc__, speed_table, picture, (table.BEGIN, table.END))
