#!/usr/bin/env python3
"""Speed at equal error and error at equal speed, from rows of run_scenes.py.

  fronts.py FILE.csv [--page PAGE] [--picture PNG]

The error of a run is the largest of its quantities': percent of what is expected; um/s where 0 is expected.
Two tables: the least processor time per simulated second with which each engine stays within an error, over
its meshes and settings; the least error that each has within a processor time. Others have every run. The
picture has all runs with each engine's front. With --page the tables take the place of what stands between
the marks `<!-- scenes -->` and `<!-- end of scenes -->`. What an engine was calibrated with does not count:
the coarse beam of Jolt.
"""
import math

import speed

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
BUDGETS = (0.03, 0.1, 0.3, 1, 3, 10)


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


def bold_least(cells):
    """Cells (value or None, text): the least in bold."""
    least = min((v for v, _ in cells if v is not None), default=None)
    return ["**%s**" % t if v is not None and v == least else t for v, t in cells]


def tables(rows):
    engines = list(dict.fromkeys(r["engine"] for r in rows))
    cannot = {(r["engine"], r["case"]): r["note"] for r in rows if r["configuration"] == "none"}
    head = "| " + " | ".join(engines) + " |\n|" + "---|" * (2 + len(engines)) + "\n"
    text = "Least processor time (s per simulated s) within an error:\n\n| question | error at most " + head
    for case, quantities, unit, levels in QUESTIONS:
        found = runs(rows, case, quantities)
        for level in levels:
            cells = []
            for engine in engines:
                good = [r for r in found if r[0] == engine and r[4] <= level]
                if good:
                    r = min(good, key=lambda x: x[3])
                    cells.append((r[3], "%.3g (%s, %d)" % (r[3], r[1], r[2])))
                else:
                    cells.append((None, "cannot" if (engine, case) in cannot else "never"))
            text += "| %s | %g %s | %s |\n" % (name_of(case, quantities), level, unit,
                                              " | ".join(bold_least(cells)))
    text += "\nLeast error within a processor time:\n\n| question | s per simulated s " + head
    for case, quantities, unit, _ in QUESTIONS:
        if len(quantities) > 1 and "creep_um_per_s" in quantities:
            continue
        found = runs(rows, case, quantities)
        for budget in BUDGETS:
            cells = []
            for engine in engines:
                good = [r for r in found if r[0] == engine and r[3] <= budget and math.isfinite(r[4])]
                if good:
                    r = min(good, key=lambda x: x[4])
                    shown = "%.2g" % r[4] if r[4] >= 1e-3 else "0"
                    cells.append((round(r[4], 3), "%s %s" % (shown, unit)))
                else:
                    cells.append((None, "cannot" if (engine, case) in cannot else "-"))
            if any(v is not None for v, _ in cells):
                text += "| %s | %g | %s |\n" % (name_of(case, quantities), budget,
                                               " | ".join(bold_least(cells)))
    return text + "\n" + all_runs(rows)


def shown(row):
    """What was measured, bold outside its band; a motion without oscillation has no period."""
    if row["verdict"] not in ("pass", "fail"):
        return speed.table.shown(row)
    value = float(row["measured"])
    nothing = row["expected"] == "0" and abs(value) < 1e-3
    text = "none" if math.isinf(value) else "0" if nothing else "%.3g" % value
    return text if row["verdict"] == "pass" else "**%s**" % text


def all_runs(rows):
    """Every run: cost and what it measured, bold outside the band."""
    by, order = {}, {}
    for row in rows:
        if row["configuration"] == "none":
            continue
        by.setdefault((row["case"], row["parameters"], row["engine"], row["configuration"]), []).append(row)
        order.setdefault(row["case"], {}).update({row["quantity"]: row} if row["quantity"] else {})
    text = "Every run; bold outside the band:\n"
    for case, quantities in order.items():
        text += "\n| %s | cells | s per s | %s |\n|%s\n" % (
            case, " | ".join(quantities), "---|" * (3 + len(quantities)))
        text += "| *to be* | | | %s |\n" % " | ".join(
            "%.4g to %.4g" % (float(r["low"]), float(r["high"])) for r in quantities.values())
        for (name, parameters, engine, configuration), told in by.items():
            if name != case:
                continue
            cells = []
            for quantity in quantities:
                row = next((r for r in told if r["quantity"] in (quantity, "")), None)
                cells.append(shown(row) if row else "-")
            text += "| %s, %s | %s | %s | %s |\n" % (engine, configuration, parameters.split("=")[1],
                                                    told[0]["cost"], " | ".join(cells))
    return text


def picture(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    shown = [q for q in QUESTIONS if q[:2] not in (("gripper", ("rise", "creep_um_per_s")),
                                                   ("beam", ("sag", "period")), ("pair", ("dip",)))]
    figure, axes = plt.subplots(2, math.ceil(len(shown) / 2), figsize=(13.5, 6.6), dpi=80, squeeze=False)
    for axis, (case, quantities, unit, levels) in zip(axes.flat, shown):
        found = [r for r in runs(rows, case, quantities) if math.isfinite(r[3]) and math.isfinite(r[4])]
        for engine in COLORS:
            mine = sorted((r[3], max(r[4], 1e-3)) for r in found if r[0] == engine)
            axis.loglog([c for c, _ in mine], [e for _, e in mine], "o", ms=4, alpha=0.6,
                        color=COLORS[engine], label=engine)
            front, least = [], math.inf
            for cost, e in mine:
                if e < least:
                    front, least = [*front, (cost, e)], e
            axis.step([c for c, _ in front], [e for _, e in front], where="post", color=COLORS[engine],
                      lw=1.4)
        for level in levels:
            axis.axhline(level, color="k", lw=0.6, ls=":")
        axis.set_title(name_of(case, quantities), fontsize=10)
        axis.grid(True, alpha=0.25)
        axis.set_ylabel("error (%s)" % unit, fontsize=8)
        axis.set_xlabel("processor time per simulated second (s)", fontsize=8)
    for axis in axes.flat[len(shown):]:
        axis.axis("off")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=len(labels), fontsize=9)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    figure.savefig(path)


if __name__ == "__main__":
    speed.report(__doc__, tables, picture, (BEGIN, END))
