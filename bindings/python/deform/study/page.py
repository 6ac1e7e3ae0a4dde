"""A study as one HTML page: no other file, nothing from the network."""
from __future__ import annotations

import base64
from html import escape
from typing import Any, Mapping, Sequence

from .tables import shown, titled

STYLE = ("body{font:15px/1.45 sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}"
         "table{border-collapse:collapse;font-size:13px}td,th{padding:2px 10px;text-align:right;"
         "border-bottom:1px solid #ddd}th{position:sticky;top:0;background:#fff}img{max-width:100%}"
         ".failed td{color:#a33}td.said{text-align:left}.rows{max-height:32em;overflow:auto}")


def table(rows: Sequence[Mapping[str, Any]], columns: Sequence[str], units: Mapping[str, str]) -> str:
    head = "".join(f"<th>{escape(titled(name, units))}</th>" for name in columns)
    lines = []
    for row in rows:
        cells = "".join(f'<td{" class=said" if name == "said" else ""}>{escape(shown(row.get(name)))}</td>'
                        for name in columns)
        lines.append(f'<tr{" class=failed" if row.get("state") == "failed" else ""}>{cells}</tr>')
    return f'<div class=rows><table><tr>{head}</tr>{"".join(lines)}</table></div>'


def page(title: str, sentences: Sequence[str], figures: Mapping[str, bytes], tables: Sequence[str]) -> bytes:
    said = "".join(f"<p>{escape(text)}</p>" for text in sentences)
    drawn = "".join(f'<p><img alt="{escape(name)}" src="data:image/png;base64,'
                    f'{base64.b64encode(data).decode()}"></p>' for name, data in figures.items())
    return (f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
            f'<style>{STYLE}</style><h1>{escape(title)}</h1>{said}{drawn}{"".join(tables)}</html>\n').encode(
                errors="replace")
