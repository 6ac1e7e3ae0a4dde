#!/usr/bin/env python3
"""The benchmark's rows side by side, as a table of Markdown: table.py FILE.csv... (each as run.py writes it).
A value outside its band is in bold."""
import csv
import sys


def shown(row):
    if row["verdict"] in ("error", "too_slow"):
        return "**" + row["note"].split(" for ")[0] + "**"
    if row["verdict"] == "not_run":
        return "-"
    text = "%.3g" % float(row["measured"]) if abs(float(row["measured"])) >= 1e-3 else "0"
    return text if row["verdict"] == "pass" else "**" + text + "**"


def main():
    rows = [row for name in sys.argv[1:] for row in csv.DictReader(open(name))]
    if not rows:
        sys.exit(__doc__)
    entries, cases, cells = [], [], {}
    for row in rows:
        entry = row["engine"] + " " + row["version"] + ", " + row["configuration"]
        if row["configuration"] == "none":
            continue
        if entry not in entries:
            entries.append(entry)
        key = (row["case"], row["parameters"], row["quantity"])
        if key[2] and key not in cases:
            cases.append(key)
        cells[entry, key] = row
    band = {}
    for (_, key), row in cells.items():
        if row["expected"]:
            band[key] = "%.4g to %.4g" % (float(row["low"]), float(row["high"]))
    print("| case | quantity | passes from | " + " | ".join(entries) + " |")
    print("|" + "---|" * (3 + len(entries)))
    for key in cases:
        values = []
        for entry in entries:
            row = cells.get((entry, key)) or cells.get((entry, (key[0], key[1], "")))
            values.append(shown(row) if row else "-")
        print("| %s %s | %s | %s | %s |" % (key[0], key[1], key[2], band.get(key, ""), " | ".join(values)))


if __name__ == "__main__":
    main()
