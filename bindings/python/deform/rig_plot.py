"""Draws the rows of `deform friction`: python3 -c THIS ROWS.csv OUT.png KIND TITLE. Exit 3: matplotlib is
missing; 4: OUT.png cannot be written, standard output says why."""
import csv
import io
import os
import sys
from typing import Any, Mapping

UNITS = {"t": "time (s)", "x": "displacement (m)", "v": "velocity (m/s)", "F": "friction force (N)",
         "z": "bristle (m)", "Fn": "normal force (N)",
         "F_elastic": "elastic force (N)", "rate": "force rate (N/s)", "F_ba": "break-away force (N)",
         "Fx": "Fx (N)", "Fy": "Fy (N)",
         "zx": "bristle x (m)", "zy": "bristle y (m)"}
# Pairs of columns, one panel each.
PANELS = {
    "bias_sine_force": [("t", "x"), ("t", "v"), ("t", "F"), ("x", "F")],
    "sine_velocity": [("t", "F"), ("v", "F"), ("x", "F")],
    "spring_pull": [("t", "x"), ("t", "v"), ("t", "F")],
    "force_ramps": [("rate", "F_ba")],
    "displacement_path": [("x", "F")],
    "circle_velocity": [("t", "Fx"), ("t", "Fy"), ("Fx", "Fy")],
    "turn_velocity": [("t", "Fx"), ("t", "Fy"), ("Fx", "Fy")],
    "sine_velocity_sine_load": [("t", "F_elastic"), ("t", "Fn"), ("Fn", "F_elastic")],
}


def draw(columns: Mapping[str, Any], kind: str, title: str) -> Any:
    """A matplotlib Figure; ImportError where matplotlib is missing."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    panels = [pair for pair in PANELS.get(kind, []) if pair[0] in columns and pair[1] in columns]
    if not panels:
        names = list(columns)
        panels = [(names[0], name) for name in names[1:]]
    wide = 2 if len(panels) in (2, 4) else min(3, len(panels))
    high = -(-len(panels) // wide)
    with rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(4.2 * wide, 3.0 * high + 0.3), dpi=100)
        for place, (across, up) in enumerate(panels, 1):
            axis = figure.add_subplot(high, wide, place)
            axis.plot(columns[across], columns[up], "o-" if kind == "force_ramps" else "-", color="#2f6db3",
                      linewidth=1.2, markersize=4)
            if kind == "force_ramps":
                axis.set_xscale("log")
            axis.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4))
            axis.set_xlabel(UNITS.get(across, across))
            axis.set_ylabel(UNITS.get(up, up))
            axis.grid(True, alpha=0.25)
        figure.suptitle(title, fontsize=10)
        figure.tight_layout()
    return figure


def main() -> None:
    try:
        import matplotlib.figure
    except Exception:
        sys.exit(3)
    rows, out, kind, title = sys.argv[1:5]
    with open(rows, newline="") as file:
        table = list(csv.DictReader(file))
    picture = io.BytesIO()
    columns = {name: [float(row[name]) for row in table] for name in table[0]}
    draw(columns, kind, title).savefig(picture, format="png")
    try:
        with open(out + ".part", "wb") as file:
            file.write(picture.getvalue())
        os.replace(out + ".part", out)
    except OSError as error:
        print(error.strerror)
        sys.exit(4)


if __name__ == "__main__":
    main()
