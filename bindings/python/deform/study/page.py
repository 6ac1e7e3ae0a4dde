"""A study as one HTML page: no other file, nothing from the network."""
from __future__ import annotations

import base64
from html import escape
from typing import Mapping, Sequence

from .._command import Table
from .tables import titled

STYLE = ("body{font:15px/1.45 sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}"
         "table{border-collapse:collapse;font-size:13px}td,th{padding:2px 10px;text-align:right;"
         "border-bottom:1px solid #ddd}th{position:sticky;top:0;background:#fff}img{max-width:100%}"
         ".failed td{color:#a33}td.said{text-align:left}.rows{max-height:32em;overflow:auto}")


def page(title: str, sentences: Sequence[str], figures: Mapping[str, bytes], rows: Table,
         units: Mapping[str, str]) -> bytes:
    said = "".join(f"<p>{escape(text)}</p>" for text in sentences)
    drawn = "".join(f'<p><img alt="{escape(name)}" src="data:image/png;base64,'
                    f'{base64.b64encode(data).decode()}"></p>' for name, data in figures.items())
    table = rows.table_html([titled(name, units) for name in rows.columns])
    return (f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
            f'<style>{STYLE}</style><h1>{escape(title)}</h1>{said}{drawn}<div class=rows>{table}'
            '</div></html>\n').encode(errors="replace")
