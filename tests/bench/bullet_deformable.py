"""Bullet's own deformable world beside libdeform on the scenes of `make bench-peers`: of each scene and mesh
the cheapest run of either engine at one of its named settings that answers every question within its band.
Settings that were found by search are left out: only one of the two was searched on all scenes.

bullet_deformable.py [CSV]    prints the table of concepts/bullet.md from results/peers_scenes.csv, which
peers/bench_peers.py writes: both engines run one after the other on the same machine, one thread each
"""
import collections
import csv
import pathlib
import sys


def best(runs):
    """(cost, setting) of the cheapest run whose verdicts are all `pass`, or why there is none."""
    good = [(max(costs), setting) for setting, (verdicts, costs) in runs.items()
            if set(verdicts) == {"pass"} and costs]
    if good:
        return min(good), ""
    seen = {v for verdicts, _ in runs.values() for v in verdicts}
    return None, "none ends in time" if seen <= {"too_slow", "error"} else "none is right"


def main():
    path = pathlib.Path(sys.argv[1] if len(sys.argv) > 1
                        else pathlib.Path(__file__).parent / "results" / "peers_scenes.csv")
    table = collections.defaultdict(lambda: collections.defaultdict(lambda: ([], [])))
    with open(path, encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["engine"] not in ("deform", "bullet") or row["configuration"] == "found by search":
                continue
            verdicts, costs = table[row["case"], row["parameters"], row["engine"]][row["configuration"]]
            verdicts.append(row["verdict"])
            if row["cost"]:
                costs.append(float(row["cost"]))
    print("| scene | tetrahedra | deform, s | Bullet, s | times |\n|---|---|---|---|---|")
    for case, parameters in dict.fromkeys(key[:2] for key in table):
        cells = []
        found = []
        for engine in ("deform", "bullet"):
            answer, why = best(table[case, parameters, engine])
            found.append(answer)
            cells.append(f"{answer[0]:.3g} ({answer[1]})" if answer else why)
        times = f"{found[1][0] / found[0][0]:.3g}" if all(found) else ""
        print(f"| `{case}` | {parameters.partition('=')[2]} | {' | '.join(cells)} | {times} |")


if __name__ == "__main__":
    main()
