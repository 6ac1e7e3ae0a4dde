#!/usr/bin/env python3
"""Which source files of a target can be compiled together (DEFORM_UNITY). Prints one line `group file` for
each file that has company; those of a group lie in one folder, except tests.

Two files stay apart where a name that only one of them can see (in an anonymous namespace, static, a macro,
a test) means something else in the other one, and where namespaces that they open have a name in common.
clang-format puts what is declared at file scope in column 0.

unity_groups.py MOST INCLUDE_FOLDERS FILE...   MOST: files of a group; INCLUDE_FOLDERS: separated by ':'
"""
import functools
import pathlib
import re
import sys

WORD = re.compile(r"[A-Za-z_]\w*")
LEADING = re.compile(r"^(template <.*?> (?=\w)|\[\[\w+\]\] |extern \"C\" )+")
TEST = re.compile(r"^TEST(?:_F|_P)?\((\w+), ?(\w+)")
TYPE = re.compile(r"(?:struct|class|union|enum class|enum)\s+(\w+)(?!.*\()|using (\w+) =")
FUNCTION = re.compile(r"[\w:<>,&*\s\[\].]*?[\s&*](\w+)\s*\(")
VALUE = re.compile(r"[\w:<>,&*\s]*?[\s&*](\w+)\s*(\[|=|\{|;)")
folders = []


def declared(line):
    """Names that a line declares at file scope."""
    if test := TEST.match(line):
        return ["_".join(test.groups())]
    line = LEADING.sub("", line)
    if re.match(r"using ([\w:]+;|namespace)|friend |return ", line):
        return []
    constants = WORD.findall(line.split("{")[1]) if line.startswith("enum") and "{" in line else []
    found = TYPE.match(line)
    if not found and not constants and not re.match(r"(constexpr|const)\b[^(]*=", line):
        found = FUNCTION.match(line)
    further = []
    if not found and not constants and (found := VALUE.match(line)):
        further = re.findall(r", (\w+)(?= = |\[|\{)", line[found.end():])
    return constants + ([found.group(1) or found.group(2)] if found else []) + further


class File:
    def __init__(self, path):
        text = re.sub(r"//.*", "", path.read_text())
        self.words = set(WORD.findall(text))
        self.includes = []
        for name in re.findall(r'^#include "([^"]+)"', text, re.M):
            found = [at for folder in [path.parent, *folders] if (at := folder / name).exists()]
            self.includes += [found[0].resolve()] if found else []
        self.internal = set(re.findall(r"^\s*#\s*define (\w+)", text, re.M))
        # other names in a header, or symbols by their names: inline functions of that name may be emitted
        self.renames = bool(re.search(r"^#\s*define.*^#include|\basm\(", text, re.M | re.S))
        self.opens = set(re.findall(r"^using namespace ([\w:]+);", text, re.M))
        self.allocates = bool(re.search(r"^\w.*\boperator (new|delete)\b", text, re.M))
        self.names = set()
        self.own_space = {}   # by namespace: the names that this file declares in it
        spaces = []   # the namespaces that are open here
        for line in path.read_text().splitlines():
            if space := re.match(r"(?:inline )?namespace\s*([\w:]*)\s*\{", line):
                spaces.append(space.group(1))
            elif re.match(r"\}\s*// namespace", line):
                del spaces[-1:]
            elif re.match(r"[A-Za-z_\[]", line):
                own = not all(spaces) or line.startswith(("static ", "TEST", "using "))
                found = declared(line)
                (self.internal if own else self.names).update(found)
                self.own_space.setdefault("::".join(filter(None, spaces)), set()).update(found)
        if path.stem.endswith("_test"):   # a program of its own elsewhere
            self.internal |= self.names

    @functools.cached_property
    def alone(self):
        """Renames what headers declare, or has the program's own operator new."""
        return self.renames or self.allocates or any(read(path).allocates for path in self.headers)

    @functools.cached_property
    def headers(self):
        """Of ours, included directly or not."""
        found, rest = set(), list(self.includes)
        while rest:
            path = rest.pop()
            if path not in found:
                found.add(path)
                rest += read(path).includes
        return found

    @functools.cached_property
    def by_space(self):
        """By namespace: the names that headers of ours declare here."""
        found = {}
        for path in self.headers:
            for space, names in read(path).own_space.items():
                found.setdefault(space, set()).update(names)
        return found

    @functools.cached_property
    def seen(self):
        """Names that headers of ours declare here."""
        return set().union(*(read(path).names for path in self.headers))


@functools.lru_cache(None)
def read(path):
    return File(path)


def hides(one, other):
    """Whether a name of `one` hides what `other` means by it."""
    doubtful = one.internal & (other.seen | other.names)
    if other.opens and one.internal & (one.seen | other.seen):
        return True
    if not doubtful:
        return False
    later = other.headers - one.headers   # what is read behind the name
    return bool(doubtful & other.words) or any(doubtful & read(path).words for path in later)


def ambiguous(one, other):
    """Whether a name that either of them uses is in two of the namespaces that they open."""
    if one.opens == other.opens:
        return False
    found = {}   # by name: a namespace
    for space in one.opens | other.opens:
        names = one.by_space.get(space, set()) | other.by_space.get(space, set())
        for name in names & (one.words | other.words):
            if found.setdefault(name, space) != space:
                return True
    return False


def apart(one, other):
    return (one.alone or other.alone or bool(one.internal & other.internal) or ambiguous(one, other)
            or hides(one, other) or hides(other, one))


def main():
    most = int(sys.argv[1])
    folders.extend(pathlib.Path(folder).resolve() for folder in sys.argv[2].split(":"))
    groups = {}   # name of a folder: list of lists of paths
    for path in sorted(pathlib.Path(name).absolute() for name in sys.argv[3:]):
        of_folder = groups.setdefault("test" if path.stem.endswith("_test") else path.parent.name, [])
        fit = (g for g in of_folder if len(g) < most and not any(apart(read(path), read(p)) for p in g))
        group = next(fit, None)
        if group is None:
            of_folder.append([path])
        else:
            group.append(path)
    for folder, lists in groups.items():
        for paths in filter(lambda paths: len(paths) > 1, lists):
            for path in paths:
                print(re.sub(r"\W", "_", f"{folder}_{paths[0].stem}"), path)


main()
