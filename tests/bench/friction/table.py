#!/usr/bin/env python3
"""The benchmark's rows side by side, as a table of Markdown: table.py FILE.csv [--page PAGE], rows as run.py
writes them. A value outside its band is in bold. With --page two tables take the place of what stands
between the lines `<!-- table -->` and `<!-- end of table -->`: the engines where every one runs, without the
configurations of LEFT_OUT, and the laws of deform where their verdicts differ."""
import argparse
import csv
import sys

BEGIN, END = "<!-- table -->\n", "<!-- end of table -->\n"
LAWS = ("coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms")
LEFT_OUT = (*LAWS[1:], "recommended", "hard 4 ms", "explicit 4 ms", "implicit 4 ms")


def shown(row):
    if row["verdict"] == "too_slow":
        return "**too slow**"
    if row["verdict"] == "error":
        return "**" + row["note"].split(" for ")[0] + "**"
    if row["verdict"] == "not_run":
        return "no law" if "no law" in row["note"] else "not told"
    text = "%.3g" % float(row["measured"]) if abs(float(row["measured"])) >= 1e-3 else "0"
    return text if row["verdict"] == "pass" else "**" + text + "**"


def table(rows):
    entries, cases, cells, absent = [], [], {}, {}
    for row in rows:
        key = (row["case"], row["parameters"], row["quantity"])
        if row["configuration"] == "none":
            absent[row["engine"], key[:2]] = shown(row)
            continue
        entry = (row["engine"], row["version"], row["configuration"])
        if entry not in entries:
            entries.append(entry)
        if key[2] and key not in cases:
            cases.append(key)
        cells[entry, key] = row
    band = {}
    for (_, key), row in cells.items():
        if row["expected"]:
            band[key] = "%.4g to %.4g" % (float(row["low"]), float(row["high"]))
    head = " | ".join("%s %s, %s" % entry for entry in entries)
    lines = ["| case | quantity | passes from | " + head + " |", "|" + "---|" * (3 + len(entries))]
    for key in cases:
        values = []
        for entry in entries:
            row = cells.get((entry, key)) or cells.get((entry, (key[0], key[1], "")))
            values.append(shown(row) if row else absent.get((entry[0], key[:2]), "-"))
        lines.append("| %s %s | %s | %s | %s |" % (key[0], key[1], key[2], band.get(key, ""),
                                                   " | ".join(values)))
    return "\n".join(lines) + "\n"


def tables(rows):
    """The two tables of the page."""
    partial = {row["case"] for row in rows if row["configuration"] == "none"}
    laws = [row for row in rows if row["configuration"] in LAWS]
    verdicts = {}
    for row in laws:
        verdicts.setdefault(row["case"], set()).add(row["verdict"])
    return "%s\nThe laws of deform where they differ:\n\n%s" % (
        table([row for row in rows if row["configuration"] not in LEFT_OUT and row["case"] not in partial]),
        table([row for row in laws if len(verdicts[row["case"]]) > 1]))


def into_page(path, text, marks=(BEGIN, END)):
    with open(path) as f:
        page = f.read()
    if any(page.count(mark) != 1 for mark in marks):
        sys.exit("%s: there is no place for the table between its two marks" % path)
    begin, end = page.index(marks[0]) + len(marks[0]), page.index(marks[1])
    with open(path, "w") as f:
        f.write(page[:begin] + "\n" + text + "\n" + page[end:])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+")
    parser.add_argument("--page")
    given = parser.parse_args()
    rows = [row for name in given.files for row in csv.DictReader(open(name))]
    if given.page:
        into_page(given.page, tables(rows))
    else:
        print(table(rows), end="")


if __name__ == "__main__":
    main()
