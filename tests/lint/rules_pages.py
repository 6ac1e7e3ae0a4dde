"""Rules about pages: what is cited is here, every page is in the reading order, and every scene key is on
one."""
import json
import posixpath
import re

from tree import CODE, line_of

PAGES = "libdeform/doc/"
HISTORY = (PAGES + "decisions/",)  # may name pages that are gone
SUBJECT_WORDS = 1200  # of a page of decisions
CHANGE_WORDS, ALL_WORDS = 3000, 120000  # of the change log, of all pages with it


def slugs(text):
    """Anchors that a page's headings have."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
            for heading in re.findall(r"^#+ (.*)$", text, re.M)}


def links(tree):
    """A link leads to a file and heading that exist."""
    for path in tree.select("", ext=(".md",)):
        content = tree.text(path)
        for match in re.finditer(r"\]\(([^)\s]+)\)", content):
            target, _, anchor = match.group(1).partition("#")
            if re.match(r"[a-z]+:", target):
                continue
            file = posixpath.normpath(posixpath.join(posixpath.dirname(path), target)) if target else path
            if file not in tree.paths and not any(p.startswith(file + "/") for p in tree.paths):
                yield path, line_of(content, match.start()), f"the link {match.group(1)} leads nowhere"
            elif anchor and anchor not in slugs(tree.text(file) or ""):
                yield path, line_of(content, match.start()), f"{file} has no heading #{anchor}"


def citations(tree):
    """Comments, messages and pages name only documents of the repository."""
    ends = {path[i + 1:] for path in tree.paths if path.endswith(".md")
            for i in [-1, *(k for k, c in enumerate(path) if c == "/")]}
    numbers = {m.group(1) for p in tree.paths if (m := re.match(PAGES + r"decisions/(\d{4})", p))}
    for path in tree.select("", ext=(*CODE, ".py", ".txt", ".cmake", ".json", ".md")):
        if path.startswith(("tests/lint/", "tests/data/", "examples/data/", *HISTORY)):
            continue
        content = tree.text(path)
        # a name in quotes is a file that is read
        for match in re.finditer(r"(?<![\w./*:}-])[\w./-]*\w\.md\b(?!\")", content):
            if not {match.group(0),
                    posixpath.normpath(posixpath.join(posixpath.dirname(path),
                                                      match.group(0)))} & (ends | set(tree.paths)):
                yield (path, line_of(content, match.start()),
                       f"{match.group(0)} is not in the repository; say it in a page here and cite that")
        for match in re.finditer(r"decisions?[ /](\d{4})\b", content):
            if match.group(1) not in numbers:
                yield path, line_of(content, match.start()), f"there is no decision {match.group(1)}"


def reading_order(tree):
    """Every page is in the list of pages; a page of decisions is a subject of theirs; all are short."""
    order = PAGES + "README.md"
    if order not in tree.paths:
        return
    listed = {posixpath.normpath(PAGES + target.partition("#")[0])
              for target in re.findall(r"\]\(([^)\s]+)\)", tree.text(order))}
    for path in tree.select(PAGES, ext=(".md",)):
        if path != order and not path.startswith(PAGES + "decisions/") and path not in listed:
            yield path, 1, f"is not in {order}; say there in a line what it answers"
    index = PAGES + "decisions/README.md"
    entries = tree.text(index) if index in tree.paths else None
    for path in tree.select(PAGES + "decisions/", ext=(".md",)):
        name = posixpath.basename(path)
        if path == index or entries is None:
            continue
        if f"]({name})" not in entries:
            yield path, 1, f"is no subject of {index}; change the page of the subject instead"
        words = len(tree.text(path).split())
        if words > SUBJECT_WORDS:
            yield path, 1, f"has {words} words, a subject at most {SUBJECT_WORDS}; drop what no longer holds"
    changes = len(tree.text("CHANGELOG.md").split())
    if changes > CHANGE_WORDS:
        yield "CHANGELOG.md", 1, f"has {changes} words, at most {CHANGE_WORDS}; drop what users need not know"
    words = changes + sum(len(tree.text(path).split()) for path in tree.select(PAGES, ext=(".md",)))
    if words > ALL_WORDS:
        yield order, 1, f"all pages have {words} words of at most {ALL_WORDS}; take out what you put in"


def results(tree):
    """A page names every table of figures."""
    said = "".join(tree.text(path) for path in tree.select("", ext=(".md",)))
    for path in tree.select("tests/bench/results/", ext=(".csv",)):
        if path.rpartition("/")[2] not in said:
            yield path, 1, "is in no page: name it beside its figures, or delete it"


def pictures(tree):
    """Every picture is in the gallery, followed by what makes it: a script or a scene of the repository, at
    the head if not there."""
    gallery = PAGES + "reference/gallery.md"
    content = tree.text(gallery) if gallery in tree.paths else ""
    parts = re.split(r"!\[[^\]]*\]\(\.\./images/([\w.]+)\)", content)
    shown = dict(zip(parts[1::2], parts[2::2]))
    for path in tree.paths:
        if not path.startswith(PAGES + "images/") or not path.endswith(".png"):
            continue
        name = path.rpartition("/")[2]
        named = ([m for m in re.findall(r"(?<![\w./])[\w./-]+\.(?:py|json)\b", text) if m in tree.paths]
                 for text in (shown.get(name, ""), parts[0]))
        makers = next(filter(None, named), [])
        if name not in shown:
            yield path, 1, f"is not in {gallery}; show it there and say what makes it"
        elif not makers:
            yield gallery, 1, f"names nothing in the repository that makes {name}: a script or a scene"
        for maker in makers:
            stem = name[:-len(".png")]
            if maker.startswith(PAGES) and not maker.endswith(f"/{stem}.py") and name not in tree.text(maker):
                yield gallery, 1, f"{maker} does not make {name}"


def names(tree):
    """A source file or public name that a page writes as code is there, so that pages follow when files
    move."""
    files = {path.rpartition("/")[2] for path in tree.paths}
    headers = "".join(tree.text(path) for path in tree.paths if "/include/" in path and path.endswith(CODE))
    for path in tree.select("", ext=(".md",)):
        if path.startswith(HISTORY):
            continue
        content = re.sub(r"^```.*?^```", lambda m: re.sub(r"[^\n]", " ", m.group(0)), tree.text(path),
                         flags=re.M | re.S)
        for code in re.finditer(r"`[^`]+`", content):
            for match in re.finditer(r"(?<![\w*{}./-])(?:[\w-]+/)*([a-z0-9_]+\.(?:cpp|hpp|h|c|py))\b|"
                                     r"\b(dfm_[a-z0-9_]+|DFM_[A-Z0-9_]+)", code.group(0)):
                file, name = match.groups()
                line = line_of(content, code.start() + match.start())
                if file and file not in files:
                    yield path, line, f"there is no file {file}"
                if name and name.rstrip("_") not in headers:
                    yield path, line, f"{name} is in no public header"


def walks(tree):
    """Where a page says `function` in `file`, that file is there and has the function."""
    for path in tree.select("", ext=(".md",)):
        if path.startswith(HISTORY):
            continue
        content = tree.text(path)
        said = re.compile(r"`([\w:]+)(?:\(\))?`\s+in\s+`([\w./-]+\.(?:cpp|hpp|h|c|py))`")
        for match in said.finditer(content):
            name, file = match.group(1).rpartition(":")[2], match.group(2)
            named = [p for p in tree.paths if ("/" + p).endswith("/" + file)]
            if not any(re.search(rf"\b{name}\b", tree.text(p) or "") for p in named):
                yield path, line_of(content, match.start()), f"{match.group(1)} is not in {file}"


def scene_keys(tree):
    """Each key of a scene is in code on some page, unless its feature does not exist yet."""
    schema = "libdeform/schema/deform-scene.schema.json"
    if schema not in tree.paths:
        return
    written = set()
    for path in tree.select(PAGES, ext=(".md",)):
        if not path.startswith(HISTORY):
            for code in re.findall(r"^```.*?^```|`[^`\n]+`", tree.text(path), flags=re.M | re.S):
                written |= set(re.findall(r"\w+", code))
    for kind, what in json.loads(tree.text(schema))["$defs"].items():
        for key, value in what.get("properties", {}).items():
            if key not in written and value.get("description") != "not available yet":
                line = line_of(tree.text(schema), tree.text(schema).index(f'"{key}"'))
                yield (schema, line, f"no page names the key \"{key}\" of \"{kind}\"; describe it in "
                       f"{PAGES}reference/scenes.md")


def shipped(tree):
    """A law or model of the library has a page, a line on the page that compares them, and a place in the
    tests that run all of them."""
    lists = {"laws": ("libdeform/doc/laws/choosing.md", "tests/support/cover_rows.h",
                      "tests/support/law_bytes.h"),
             "models": ("libdeform/doc/models/compared.md", "tests/support/cover_rows.h")}
    for path in tree.select("plugins/friction_", "plugins/model_"):
        kind = "laws" if path.startswith("plugins/friction_") else "models"
        for match in re.finditer(r'"org\.deform\.(\w+)"', tree.text(path)):
            name, line = match.group(1), line_of(tree.text(path), match.start())
            if f"{PAGES}{kind}/{name}.md" not in tree.paths:
                yield path, line, f"there is no page {PAGES}{kind}/{name}.md (CONTRIBUTING.md, How to add)"
            for needed in lists[kind]:
                if needed in tree.paths and not re.search(rf"\b{name}\b", tree.text(needed)):
                    yield path, line, f"{name} is not in {needed} (CONTRIBUTING.md, How to add)"


def fuzzers(tree):
    """The table of SECURITY.md has the fuzz programs that are built, and their inputs in `make soak`."""
    page, lists = "SECURITY.md", "tests/fuzz/CMakeLists.txt"
    if page not in tree.paths or lists not in tree.paths:
        return
    readers = re.findall(r"foreach\(reader (.*)\)", tree.text(lists))
    built = {(name, int(inputs)) for names, inputs in re.findall(r"^ *deform_add_fuzz\((\S+) \w+ (\d+)",
                                                                 tree.text(lists), re.M)
             for name in names.replace("${reader}", " ".join(readers)).split()}
    said = {(name, int(re.match(r"[\d,]+", inputs)[0].replace(",", "")))
            for names, inputs in re.findall(r"^\| (`fuzz_.*?) \| .* \| (.*) \|$", tree.text(page), re.M)
            for name in re.findall(r"`(?:fuzz_)?(\w+)`", names)}
    for name, inputs in sorted(built ^ said):
        yield page, 1, f"fuzz_{name} with {inputs} inputs is in this table or in {lists}, not in both"


RULES = {"fuzzers": fuzzers, "walks": walks, "names": names, "scene_keys": scene_keys, "shipped": shipped,
         "links": links, "citations": citations,
         "reading_order": reading_order, "pictures": pictures, "results": results}
