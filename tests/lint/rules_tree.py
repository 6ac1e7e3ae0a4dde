"""Rules about the tree: where things lie, what a text file looks like, what never stands in one."""
import json
import posixpath
import re

from tree import CODE, line_of, without_comments

TOP = {"CMakeLists.txt", "libdeform", "plugins", "bindings", "examples", "tests", "cmake",
       "README.md", "CONTRIBUTING.md", "SECURITY.md", "LICENSE", "CHANGELOG.md", "CMakePresets.json",
       "Makefile", "pyproject.toml"}
BELOW = {
    "libdeform": {"CMakeLists.txt", "include", "src", "schema", "doc"},
    "libdeform/include": {"deform"},
    "libdeform/src": {"core", "math", "geometry", "mesh", "plugin", "body", "dynamics", "contact", "friction",
                      "broad", "narrow", "ccd", "plan", "state", "step", "world", "cut", "snapshot", "scene",
                      "api"},
    "libdeform/doc": {"README.md", "concepts", "reference", "models", "laws", "howto", "decisions", "images"},
    "bindings": {"CMakeLists.txt", "cli", "render", "rigid_host", "ode", "bullet", "python", "tools", "live",
                 "view", "serve", "web"},
    "tests": {"CMakeLists.txt", "README.md", "support", "data", "unit", "analytic", "stability", "api",
              "plugin", "gpu", "determinism", "adapters", "fuzz", "lint", "bench", "abi", "render", "python",
              "serve", "ports", "contact_problems"},
}
PLUGIN_FOLDER = re.compile(r"plugins/(CMakeLists\.txt|(model|friction|solver|template)_[a-z0-9_]+)$")
MAX_LINES = 800


def layout(tree):
    """The folders of the house and no others."""
    entries = {"/".join(p.split("/")[:depth]) for p in tree.paths for depth in range(1, p.count("/") + 2)}
    for entry in sorted(entries):
        parent, _, name = entry.rpartition("/")
        if not parent:
            if name not in TOP and not name.startswith("."):
                yield (entry, 1, f"does not belong at the top; only these do: {', '.join(sorted(TOP))} and "
                                 f"dotfiles")
        elif parent in BELOW and name not in BELOW[parent]:
            yield entry, 1, f"does not belong in {parent}/; only these do: {', '.join(sorted(BELOW[parent]))}"
        elif parent == "plugins" and not PLUGIN_FOLDER.match(entry):
            yield (entry, 1, "a plugin's folder is called model_NAME, friction_NAME, solver_NAME or "
                             "template_NAME")
        ours = entry.startswith(("libdeform/src", "plugins", "bindings", "tests"))
        if name != name.lower() and ours and name.endswith(CODE):
            yield entry, 1, "file names are snake_case"


def text(tree):
    """Long files, tabs, trailing spaces, line ends, marks of unfinished work."""
    for path in tree.paths:
        content = tree.text(path)
        if content is None or path.startswith(("examples/data/", "tests/data/", "tests/bench/results/")):
            continue
        code = path.endswith((*CODE, ".py", ".cmake", "CMakeLists.txt", ".sh"))
        lines = content.split("\n")
        if code and len(lines) > MAX_LINES + 1:
            yield (path, 1, f"has {len(lines) - 1} lines; at most {MAX_LINES}: divide it by what its parts "
                            f"are about")
        if content and not content.endswith("\n"):
            yield path, len(lines), "the last line does not end"
        for number, line in enumerate(lines, 1):
            if "\r" in line:
                yield path, number, "carriage return; lines end with a line feed alone"
                break
            if "\t" in line and path != "Makefile":
                yield path, number, "tab; indent with spaces"
            if line != line.rstrip():
                yield path, number, "space at the end of the line"
            if code and re.search(r"\b(TODO|FIXME|XXX|HACK)\b", line) and not path.startswith("tests/lint/"):
                yield path, number, "a mark of unfinished work; finish it or write an issue"


def paths(tree):
    """Nothing names a place on somebody's machine, nor the folder that lies beside some checkouts."""
    machine = re.compile(r"(?<![\w./])/(home|root|work|Users|mnt)/|(?<=/)\.lib" r"rary\b|[A-Z]:\\\\|"
                         r"\.\./shared\b")
    for path in tree.paths:
        content = tree.text(path)
        if content is None or path.startswith("tests/lint/"):
            continue
        for match in machine.finditer(content):
            yield path, line_of(content, match.start()), f"names a place on one machine: {match.group(0)}"


def scenes(tree):
    """A shipped scene stands on files of the repository alone."""
    file = re.compile(r'"([^"\n]+\.(?:msh|mesh|obj|off|ply|stl|vtk|vtu|vtp|csv))"')
    for path in tree.select("examples/", "bindings/", ext=(".json",)):
        content = tree.text(path)
        for match in file.finditer(content) if '"deform-scene"' in content else ():
            if posixpath.normpath(posixpath.join(posixpath.dirname(path), match.group(1))) not in tree.paths:
                yield (path, line_of(content, match.start()),
                       f"names {match.group(1)}, which is not in the repository; ship it, or make it")


def readme(tree):
    """The program that README.md shows is the example, to the letter, and short. Its blocks of code fit into
    a window of 1440 px (cmake/docs/theme/style.css)."""
    example = "examples/01_hello.c"
    if "README.md" not in tree.paths or example not in tree.paths:
        yield "README.md", 1, f"README.md and {example} must both be there"
        return
    columns = 106
    for block in re.finditer(r"^```\w*\n(.*?)^```", tree.text("README.md"), re.M | re.S):
        for k, line in enumerate(block[1].split("\n")):
            if len(line) > columns:
                yield ("README.md", line_of(tree.text("README.md"), block.start(1)) + k,
                       f"{len(line)} columns of code; a window of 1440 px shows {columns}")
    blocks = re.findall(r"^```c\n(.*?)^```", tree.text("README.md"), re.M | re.S)
    program = tree.text(example)
    if program not in blocks:
        yield "README.md", 1, f"no ```c block equals {example}; copy the file into it"
    if program.count("\n") > 50:
        yield example, 51, f"has {program.count(chr(10))} lines; the front page holds 50"


def guides(tree):
    """A guide with a folder of files beside it shows nothing that does not stand in one of them, to the
    letter. Neither does a block below a line that names its example, as (`examples/01_hello.c`):"""
    for path in tree.select("libdeform/doc/", ext=(".md",)):
        content = tree.text(path)
        for block in re.finditer(r"\(`(examples/[\w.]+)`\):\n\n```\w+\n(.*?)^```", content, re.M | re.S):
            if block[1] not in tree.paths or block[2] not in tree.text(block[1]):
                yield (path, line_of(content, block.start(2)),
                       f"this block stands not in {block[1]}; copy it from there")
    for path in tree.select("libdeform/doc/howto/", ext=(".md",)):
        folder = path[:-len(".md")] + "/"
        files = [tree.text(p) for p in tree.paths if p.startswith(folder)]
        content = tree.text(path)
        if not files:
            continue
        for block in re.finditer(r"^```(c|cpp|cmake)\n(.*?)^```", content, re.M | re.S):
            if not any(block.group(2) in file for file in files):
                yield (path, line_of(content, block.start()),
                       f"this block stands in no file of {folder}; copy it from there")


def _alternatives(pattern):
    """The alternatives of a regular expression, those of its groups too: those of a|b(c|d) are a, bc, bd."""
    group = re.search(r"(?<!\\)\(((?:[^()\\]|\\.)*)\)(?![?*+])", pattern)
    depth, cuts = 0, [-1]
    for match in re.finditer(r"\\.|[()|]", pattern):
        depth += {"(": 1, ")": -1}.get(match.group(0), 0)
        if match.group(0) == "|" and depth == 0:
            cuts.append(match.start())
    if len(cuts) > 1:
        for start, end in zip(cuts, [*cuts[1:], len(pattern)]):
            yield from _alternatives(pattern[start + 1:end])
    elif group:
        for inner in group.group(1).split("|"):
            yield from _alternatives(pattern[:group.start()] + inner + pattern[group.end():])
    else:
        yield pattern


def presets(tree):
    """Each part of a name by which a test preset chooses tests is in the name of a test."""
    path = "CMakePresets.json"
    names = set()
    for source in tree.select("tests/", ext=("_test.cpp",)):
        content = without_comments(tree.text(source))
        folder, suites = source.split("/")[1], {}
        for prefix, suite in re.findall(r"INSTANTIATE_TEST_SUITE_P\(\s*(\w+),\s*(\w+)", content):
            suites.setdefault(suite, []).append(prefix + "/")
        for suite, name in re.findall(r"\bTEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)", content):
            names |= {f"{folder}.{prefix}{suite}.{name}" for prefix in suites.get(suite, [""])}
    for preset in json.loads(tree.text(path)).get("testPresets", []):
        for side in preset.get("filter", {}).values():
            parts = (part.partition("/")[0] for part in _alternatives(side.get("name", "")))
            for part in dict.fromkeys(parts):  # without parameters, which follow a slash
                if not any(map(re.compile(part).search, names)):
                    line = next((n for n, text in enumerate(tree.text(path).split("\n"), 1)
                                 if f'"name": "{preset["name"]}"' in text), 1)
                    yield (path, line, f"preset {preset['name']}: no test has {part} in its name; write the "
                                       f"present name, or leave it out")


RULES = {"layout": layout, "text": text, "paths": paths, "scenes": scenes, "readme": readme, "guides": guides,
         "presets": presets}
