"""Draws what coupling_study wrote: python3 coupling_study.py FOLDER OUT.png"""
import csv
import sys
from collections import defaultdict

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

STYLE = {"exact": ("black", "-"), "barycentric": ("tab:blue", "-"), "mls": ("tab:green", None),
         "thesis": ("tab:red", None)}
DASH = {1.5: "-", 3.0: "--", 4.5: ":", 0.0: "-"}


def label(name, support):
    return name if support == 0 else f"{name} {support:g}"


def main(folder, out):
    with open(folder + "/coupling_study.csv") as f:
        study = list(csv.DictReader(f))
    lines = defaultdict(list)
    with open(folder + "/coupling_profile.csv") as f:
        for row in csv.DictReader(f):
            lines[row["coupling"], float(row["support"])].append((float(row["angle_deg"]),
                                                                  float(row["radius"])))

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 4), width_ratios=(1.5, 1, 1))
    for (name, support), points in lines.items():
        color, dash = STYLE[name]
        left.plot(*zip(*sorted(points)), color=color, linestyle=dash or DASH[support],
                  label=label(name, support), linewidth=2.5 if name == "exact" else 1.2)
    left.set(xlim=(-90, 90), xlabel="angle from the pole that is poked, degrees",
             ylabel="distance from the center / R", title="a bump of 0.2 R on the ball")
    left.legend(fontsize=7, ncol=4, loc=(0.04, 0.22))

    names = [label(r["coupling"], float(r["support"])) for r in study]
    colors = [STYLE[r["coupling"]][0] for r in study]
    middle.barh(names, [float(r["twist_rough_rms_deg"]) for r in study], color=colors)
    middle.set(xlabel="degrees, root mean square", title="roughness under a twist")
    middle.invert_yaxis()
    right.barh(names, [1e3 * float(r["tip_m"]) for r in study], color=colors)
    right.set(xlabel="mm", title="tip of a bar pulled through its surface", xlim=(20, 28))
    right.invert_yaxis()
    figure.tight_layout()
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    main(*sys.argv[1:])
