"""The files that the rules look at, and text helpers that several rules share."""
import pathlib
import re
import shutil
import subprocess

CODE = (".c", ".cpp", ".h", ".hpp", ".inl")


class Tree:
    """Text files below root: what git tracks, so that a stray file in the checkout is not judged; without
    git, everything but build/, out/ and dot folders."""

    def __init__(self, root):
        self.root = pathlib.Path(root)
        self.paths = sorted(p for p in self._list() if (self.root / p).is_file())
        self._text = {}

    def _list(self):
        if (self.root / ".git").exists() and shutil.which("git"):
            out = subprocess.run(["git", "-c", "safe.directory=*", "-C", self.root, "ls-files", "-c", "-z"],
                                 capture_output=True, text=True)
            if out.returncode == 0:
                return [p for p in out.stdout.split("\0") if p]
        skipped = {"build", "out", ".git", "__pycache__"}
        found = (p.relative_to(self.root) for p in self.root.rglob("*"))
        return [str(p) for p in found if not skipped & set(p.parts)]

    def text(self, path):
        """Contents, or None where the file is not text."""
        if path not in self._text:
            data = (self.root / path).read_bytes()
            try:
                self._text[path] = None if b"\0" in data else data.decode("utf-8")
            except UnicodeDecodeError:
                self._text[path] = None
        return self._text[path]

    def select(self, *prefixes, ext=CODE):
        """Text files below any of the prefixes with one of the endings."""
        return [p for p in self.paths if p.startswith(prefixes) and p.endswith(tuple(ext))
                and self.text(p) is not None]


def without_comments(text, strings=False):
    """C and C++ source with comments (and, if asked, string contents) blanked; lines stay where they are."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)

    def blank(match):
        token = match.group(0)
        if token.startswith(("//", "/*")):
            return re.sub(r"[^\n]", " ", token)
        return '"' + " " * (len(token) - 2) + '"' if strings and token[0] == '"' else token

    return pattern.sub(blank, text)


def line_of(text, offset):
    return text.count("\n", 0, offset) + 1


def includes(text):
    """(line, quote, name) of each #include."""
    for match in re.finditer(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"\n]+)[>"]', without_comments(text),
                             re.M):
        yield line_of(text, match.start()), match.group(1), match.group(2)
