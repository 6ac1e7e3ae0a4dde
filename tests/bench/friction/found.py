"""What search.py found: the best trial of an engine for a case, from a table of trials."""
import csv
import json
import os

FOUND = "found by search"  # the configuration's name in the rows
# run.py and run_scenes.py may name another
TABLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "results", "peers_search.csv")


def rank(score, cost):
    """What is smaller is better: within all bands for less time, else nearer to the bands."""
    return max(1.0, score), cost


def rank_of(row):
    return rank(float(row["score"]), float(row["cost"] or "inf"))


def best(rows):
    """Of rows of trials the best, None where none was measured."""
    return min((row for row in rows if row["measured"]), key=rank_of, default=None)


def same(case, parameters, row):
    """A scene is searched on its coarse mesh; the fine one takes over what was found there."""
    scene = parameters.startswith("cells=")
    return row["case"] == case["name"] and (row["parameters"].startswith("cells=") if scene
                                            else row["parameters"] == parameters)


def settings(entry, case, parameters):
    """The best settings, None where nothing was searched or one of the entry's own is best."""
    if not hasattr(entry, "settings") or not os.path.exists(TABLE):
        return None
    with open(TABLE, newline="") as f:
        row = best([r for r in csv.DictReader(f) if r["engine"] == entry.name and same(case, parameters, r)])
    given = row and json.loads(row["settings"])
    return None if given in (None, *type(entry).settings.values()) else given


def told(given):
    """Settings in one line."""
    return "; ".join("%s %s" % pair for pair in sorted(given.items())) or "all as it comes"
