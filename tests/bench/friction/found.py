"""What search.py found: the best trial of an engine for a case, from a table of trials."""
import csv
import json
import os

FOUND = "found by search"  # the configuration's name in the rows


def shown(configuration):
    """In tables, most cells of which it stands in."""
    return "searched" if configuration == FOUND else configuration


# run.py and run_scenes.py may name another
TABLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "results", "peers_search.csv")


def rank_of(row):
    """What is smaller is better: within all bands for less time, else nearer to the bands; of what is as
    near, to two digits, for less time."""
    return max(1.0, float("%.2g" % float(row["score"]))), float(row["cost"] or "inf")


def best(rows):
    """Of rows of trials the best, None where none was measured."""
    return min((row for row in rows if row["measured"]), key=rank_of, default=None)


def settings(entry, case, parameters):
    """The best settings, None where nothing was searched or one of the entry's own is best."""
    if not hasattr(entry, "settings") or not os.path.exists(TABLE):
        return None
    with open(TABLE, newline="") as f:
        mine = [r for r in csv.DictReader(f) if (r["engine"], r["case"]) == (entry.name, case["name"])]
    row = best([r for r in mine if r["parameters"] == parameters])
    if not row and parameters.startswith("cells="):  # a fine mesh takes over what was found on the coarse one
        row = best([r for r in mine if r["parameters"].startswith("cells=")])
    given = row and json.loads(row["settings"])
    return None if given in (None, *type(entry).settings.values()) else given


def told(given):
    """Settings in one line."""
    plain = {key: next(iter(value.values())) if isinstance(value, dict) else "%.4g" % value
             if isinstance(value, float) else value for key, value in given.items()}
    return "; ".join("%s %s" % pair for pair in sorted(plain.items())) or "all as it comes"
