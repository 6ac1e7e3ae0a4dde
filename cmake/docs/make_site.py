#!/usr/bin/env python3
"""The site: pages of libdeform/doc and the API reference from the headers, with MkDocs, into build/site.
Works from a folder, without a server and without the network.

make_site.py [--root DIR] [--out DIR] [--stage DIR]
"""
import argparse
import json
import logging
import pathlib
import shutil
import sys
import urllib.parse
from html.parser import HTMLParser

import yaml
from mkdocs.commands.build import build
from mkdocs.config import load_config
from pygments.formatters import HtmlFormatter

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from headers import slug  # noqa: E402
from stage import Stage  # noqa: E402

THEME = pathlib.Path(__file__).resolve().with_name("theme")


class Links(HTMLParser):
    """Addresses and anchors of a page."""

    def __init__(self, text):
        super().__init__()
        self.to, self.anchors = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        for key, value in attrs:
            if key in ("href", "src") and value:
                self.to.append(value)
            elif key in ("id", "name") and value:
                self.anchors.add(value)


def broken(site):
    """Links of the site that lead nowhere, or out of the folder by the network."""
    pages = {path: Links(path.read_text()) for path in site.rglob("*.html")}
    for path, page in pages.items():
        for to in page.to:
            parts = urllib.parse.urlsplit(to)
            if parts.scheme:
                continue
            there = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            if not there.is_file():
                yield f"{path.relative_to(site)}: {to} leads nowhere"
            elif parts.fragment and there in pages and parts.fragment not in pages[there].anchors:
                yield f"{path.relative_to(site)}: {to} has no such heading"


def add_live(made, site):
    """The page of `make wasm` where it has been made, and the links to it: README's lead there at once."""
    if not (made / "index.html").is_file():
        return
    shutil.copytree(made, site / "live", dirs_exist_ok=True)
    page = site / "libdeform/doc/howto/webassembly.html"
    name = "<code>live/index.html</code>"
    page.write_text(page.read_text().replace(name, f'<a href="../../../live/index.html">{name}</a>'))
    page = site / "index.html"
    contents, mark, text = page.read_text().partition("<article>")
    text = text.replace('"libdeform/doc/howto/webassembly.html"', '"live/index.html"')
    page.write_text(contents + mark + text)


def main():
    root = pathlib.Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=pathlib.Path, default=root)
    parser.add_argument("--out", type=pathlib.Path, default=root / "build/site")
    parser.add_argument("--stage", type=pathlib.Path, default=root / "build/docs")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    stage = Stage(options.root)
    stage.write(options.stage / "pages")
    config_file = options.stage / "mkdocs.yml"
    config_file.write_text(yaml.safe_dump({
        "site_name": "libdeform", "docs_dir": str((options.stage / "pages").resolve()),
        "site_dir": str(options.out.resolve()), "use_directory_urls": False, "nav": stage.nav,
        "theme": {"name": None, "custom_dir": str(THEME), "locale": "en", "search_index_only": True},
        "plugins": [{"search": {"indexing": "full"}}],
        "markdown_extensions": ["tables", "fenced_code", "sane_lists", "codehilite", "toc"],
    }, sort_keys=False))
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(message)s")
    config = load_config(str(config_file))
    config["mdx_configs"]["codehilite"] = {"guess_lang": False, "css_class": "code"}
    config["mdx_configs"]["toc"] = {"slugify": lambda text, _: slug(text), "permalink": "#"}
    build(config)
    # A page that is opened from a folder may load scripts but no data.
    index = json.loads((options.out / "search/search_index.json").read_text())
    answers = {path[:-len(".md")] + ".html": text for path, text in stage.answers.items()}
    for entry in index["docs"]:
        entry["answers"] = answers.get(entry["location"], "")
    (options.out / "search/index.js").write_text("var pages = " + json.dumps(index["docs"]) + ";\n")
    (options.out / "code.css").write_text(HtmlFormatter(style="friendly").get_style_defs(".code"))
    add_live(options.root / "build/wasm/page", options.out)
    wrong = sorted(broken(options.out))
    count = len(list(options.out.rglob("*.html")))
    print("\n".join(wrong) or f"{options.out}/index.html: {count} pages, every link leads somewhere")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
