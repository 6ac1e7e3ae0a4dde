"""The pages of the repository as a folder for the generator. Files keep their places, so that relative links
hold; what is linked and is no page (a source file, a folder) becomes one.
"""
import pathlib
import posixpath
import re

from headers import Reference, page
from wrappers import cpp_pages, python_pages

ORDER = "libdeform/doc/README.md"
FRONT = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"]
HEADERS = ["libdeform/include/deform", "bindings/ode/include/deform", "bindings/bullet/include/deform"]
PYTHON = "bindings/python/deform"
LANGUAGES = {".c": "c", ".h": "c", ".cpp": "cpp", ".hpp": "cpp", ".py": "python", ".json": "json",
             ".sh": "sh", ".txt": "cmake", ".cmake": "cmake", ".csv": "text", ".map": "text", ".in": "text"}
LINK = re.compile(r"(\]\()([^)\s]+)(\))")
ITEM = re.compile(r"( *)(?:[-*]|\d+\.) +(?=\S)")


def prose(text, change):
    """The text with change() applied to what is not in a fenced block."""
    parts = re.split(r"^( *```.*?^ *```[^\n]*\n?)", text, flags=re.M | re.S)
    return "".join(part if i % 2 else change(part) for i, part in enumerate(parts))


def dialect(text):
    """Repositories' Markdown to the generator's: a list needs an empty line before it, what belongs to an
    item four columns for each level, and a bare address its brackets."""
    def change(part):
        out, levels = [], []   # columns at which the text of the open items begins
        for line in part.split("\n"):
            item, blank = ITEM.match(line), not (out and out[-1].strip())
            indent, rest = len(line) - len(line.lstrip(" ")), line.lstrip(" ")
            if item and (levels or indent < 4):
                while levels and indent < levels[-1]:
                    levels.pop()
                if not levels and not blank and not ITEM.match(out[-1]):
                    out.append("")
                line = " " * 4 * len(levels) + rest
                levels.append(item.end())
            elif rest and levels:
                while blank and levels and indent < levels[-1]:
                    levels.pop()
                inner = indent - levels[-1] if blank and levels else 0
                line = " " * (4 * len(levels) + inner if levels else indent) + rest
            out.append(line)
        return re.sub(r"(?<![<(\[`\"\w])(https?://[^\s)>,;]*[^\s)>,;.:])", r"<\1>", "\n".join(out))
    return prose(text, change)


def order(text):
    """[(section, [(title, target, what it answers)])] of the reading order; a section in groups has
    (group, [..]) in place of pages."""
    sections, pages = [], []
    for line in text.split("\n"):
        heading = re.match(r"(##|###) (?:\d+\. )?(.*)", line)
        if heading:
            pages = []
            (sections if heading.group(1) == "##" else sections[-1][1]).append((heading.group(2), pages))
        elif sections and line.startswith(("|", "[")):
            answers = line.strip("| ").rpartition(" | ")[2]
            pages.extend((title, target, answers)
                         for title, target in re.findall(r"\[([^\]]+)\]\(([^)\s]+)\)", line))
    return sections


class Stage:
    """files: {path in the folder: str or bytes}; nav: the generator's table of contents; answers: {path: the
    question that the page answers}, by which the search finds it."""

    def __init__(self, root):
        self.root = pathlib.Path(root)
        headers = {path.name: path.read_text() for folder in HEADERS
                   for path in sorted((self.root / folder).glob("*.h"))}
        self.reference = Reference(headers)
        wrappers = {path.name: path.read_text() for folder in HEADERS
                    for path in sorted((self.root / folder).glob("*.hpp"))}
        python = python_pages(self.root / PYTHON, self.reference)
        self.files = {**self.reference.pages(), **cpp_pages(wrappers, self.reference), **python}
        self.answers = {}
        self.wanted = [*FRONT, ORDER]
        done = set()
        while self.wanted:
            path = self.wanted.pop()
            if path not in done:
                done.add(path)
                self._take(path)
        self.nav = self._nav(headers, wrappers, python)

    def _take(self, path):
        here = self.root / path
        if here.is_dir():
            self.files[posixpath.join(path, "index.md")] = self._folder(path)
        elif path.endswith(".md"):
            self.files[path] = dialect(self._page(path, here.read_text()))
        elif here.suffix in LANGUAGES:
            text = here.read_text()
            self.files[path + ".md"] = f"# {path}\n\n````{LANGUAGES[here.suffix]}\n{text}````\n"
        else:
            self.files[path] = here.read_bytes()

    def _staged(self, path):
        """Where a file of the repository stands in the folder; it is put there."""
        if path == HEADERS[0]:
            return "api/index.md"
        here = self.root / path
        self.wanted.append(path)
        if here.is_dir():
            readme = posixpath.join(path, "README.md")
            if (self.root / readme).exists():
                self.wanted[-1] = readme
                return readme
            return posixpath.join(path, "index.md")
        return path + ".md" if here.suffix in LANGUAGES else path

    def _page(self, path, text):
        folder = posixpath.dirname(path)

        def link(match):
            target, mark, anchor = match.group(2).partition("#")
            if not target or re.match(r"[a-z]+:", target):
                return match.group(0)
            there = posixpath.normpath(posixpath.join(folder, target))
            if not (self.root / there).exists():
                raise SystemExit(f"{path}: the link {match.group(2)} leads nowhere")
            to = posixpath.relpath(self._staged(there), folder or ".")
            return match.group(1) + to + mark + anchor + match.group(3)

        def name(match):
            place = self.reference.places.get(match.group(1))
            up = posixpath.relpath("api", folder or ".")
            return f"[`{match.group(1)}`]({up}/{place})" if place else match.group(0)

        def change(part):
            part = LINK.sub(link, part)
            lines = [line if line.startswith("#") else re.sub(r"(?<!\[)`(dfm_\w+)`(?!\])", name, line)
                     for line in part.split("\n")]
            return "\n".join(lines)
        return prose(text, change)

    def _folder(self, path):
        rows = []
        for entry in sorted((self.root / path).iterdir()):
            if entry.name.startswith((".", "__")):
                continue
            to = posixpath.relpath(self._staged(posixpath.join(path, entry.name)), path)
            title = entry.name
            if entry.suffix == ".md":
                title = re.sub(r"^#+ *", "", entry.read_text().split("\n", 1)[0])
            rows.append(f"- [{title}]({to})")
        return f"# {path}\n\n" + "\n".join(rows) + "\n"

    def _nav(self, headers, wrappers, python):
        nav = [{"Reading order": ORDER}]
        base = posixpath.dirname(ORDER)

        def entry(row):
            if len(row) == 2:
                return {row[0]: [entry(inner) for inner in row[1]]}
            title, target, answers = row
            path = self._staged(posixpath.normpath(posixpath.join(base, target)))
            self.answers[path] = answers
            return {title: path}
        nav.extend(map(entry, order((self.root / ORDER).read_text())))
        nav.insert(-1, {"Headers": [{"all headers": "api/index.md"},
                                    *({name: "api/" + page(name)} for name in [*headers, *wrappers])]})
        modules = sorted(set(python) - {"api/python.md"})
        nav.insert(-1, {"Python": [{"all names": "api/python.md"},
                                   *({re.sub(r".*python_|\.md$", "", path): path} for path in modules)]})
        nav.append({"Project": [{pathlib.Path(p).stem.capitalize(): p} for p in FRONT]})
        return nav

    def write(self, folder):
        """Writes what has changed and removes what is gone."""
        folder = pathlib.Path(folder)
        for path, content in self.files.items():
            here = folder / path
            data = content if isinstance(content, bytes) else content.encode()
            here.parent.mkdir(parents=True, exist_ok=True)
            if not here.exists() or here.read_bytes() != data:
                here.write_bytes(data)
        for old in folder.rglob("*"):
            if old.is_file() and old.relative_to(folder).as_posix() not in self.files:
                old.unlink()
