"""Pages of the API reference for the classes of the C++ headers and for the Python package: each member as it
is declared, with the comment or docstring that it has, and the C functions that it calls.
"""
import ast
import pathlib
import re

from headers import slug

COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])+'", re.S)
CLASS = re.compile(r"(?:class|struct)\s+(?:\[\[\w+\]\]\s*)?(\w+)\b(?!\s*[;<&*])[^;{(]*$")


def words(lines):
    """Text of // comments, line by line."""
    return "\n".join(re.sub(r"^// ?", "", line.strip()) for line in lines)


class Member:
    """name; code: its declaration without a body; comment; calls: C functions of its body; members: of a
    class."""

    def __init__(self, name, code, comment, calls=(), members=None):
        self.name, self.code, self.comment, self.calls, self.members = name, code, comment, calls, members


def _behind(text, start):
    """Where the block that opens at start ends."""
    depth, i = 0, start
    while i < len(text):
        token = COMMENT.match(text, i)
        if token:
            i = token.end()
            continue
        depth += (text[i] == "{") - (text[i] == "}")
        i += 1
        if depth == 0:
            return i
    return len(text)


def _bare(head):
    """A declaration without what makes it a template."""
    while head.startswith("template <"):
        depth = 0
        for i, c in enumerate(head):
            depth += (c == "<") - (c == ">")
            if c == ">" and depth == 0:
                head = head[i + 1:].lstrip()
                break
    return head


def _name(head, inside):
    """What a declaration is called; None for what is no part of the interface."""
    found = re.search(r"(\boperator\s*(?:\w+|\(\)|[^\w\s(]+)|~?\b\w+)\s*\(", head)
    if not found or re.match(r"(?:using|typedef|static_assert|namespace|friend|requires)\b", head):
        return None
    name = found.group(1)
    hidden = name.startswith("~") or name.endswith("_") or name == "end"   # end: what Unique calls
    return None if hidden or (name == inside and "default" in head) else name


def parse(text, inside=None):
    """Classes and functions of a header, or the public members of a class, in the order of the file."""
    out, comment, i, start = [], [], 0, 0
    public = True
    depth = 0
    while i < len(text):
        token = COMMENT.match(text, i)
        if token:
            if not text[start:i].strip():
                line = token.group(0)
                comment = comment + [line] if line.startswith("//") and not line.startswith("// ---") else []
                start = token.end()
            i = token.end()
            continue
        c = text[i]
        if c == "\n" and not text[start:i].strip():
            if text[i:].split("\n", 2)[1:2] == [""]:
                comment = []
            start = i + 1
        elif c == "#" and not text[start:i].strip():
            i = re.compile(r"(?:[^\n\\]|\\.)*", re.S).match(text, i).end()
            start, comment = i, []
            continue
        elif c in "()":
            depth += (c == "(") - (c == ")")
        elif depth == 0 and c == ":" and re.fullmatch(r"\s*(public|private|protected)", text[start:i]):
            public, start, comment = text[start:i].strip() == "public", i + 1, []
        elif depth == 0 and c == "}":
            start, comment = i + 1, []
        elif depth == 0 and c in "{;":
            head = re.sub(r"\s+", " ", COMMENT.sub(" ", text[start:i])).strip()
            end = _behind(text, i) if c == "{" else i + 1
            if c == "{" and re.match(r"(?:inline )?namespace\b|extern\b", head):
                end = i + 1  # what stands in it stands here
                if re.match(r"namespace (?:detail|values|exceptions)\b", head):
                    end = _behind(text, i)
            elif public and (kind := CLASS.match(_bare(head))) and c == "{":
                members = parse(text[i + 1:end - 1], kind.group(1))
                out.append(Member(kind.group(1), head, words(comment), (), members))
            elif public and (name := _name(_bare(head), inside)):
                head = re.sub(r"(\)[^():]*?) ?: .*", r"\1", head)
                body = text[i:end]
                # The first block may be that of an initializer.
                while c == "{" and end < len(text) and text[end:].lstrip()[:1] == "{":
                    end = _behind(text, end + text[end:].index("{"))
                calls = list(dict.fromkeys(re.findall(r"\bdfm_\w+(?=\s*[(,])", body)))
                behind = re.compile(r"[ \t]*(//[^\n]*)").match(text, end)
                if behind:
                    comment, end = comment + [behind.group(1)], behind.end()
                out.append(Member(name, head + ";", words(comment), calls))
            i = start = end
            comment = []
            continue
        i += 1
    return out


def cpp_pages(headers, reference):
    """{path below the site's root: Markdown} of C++ headers. headers: {file name: text}."""
    out = {}
    for header, text in headers.items():
        intro = re.match(r"((?://[^\n]*\n)+)", text)
        said = words(intro.group(1).rstrip().split("\n")) if intro else ""
        said, _, example = said.partition("\n  #include")
        said = re.sub(r"^deform/\S+ -- ", "", said)
        page = [f"# {header}", reference.comment(said[:1].upper() + said[1:]),
                f"```cpp\n  #include{example.split(chr(10) * 2)[0]}\n```" if example else "",
                f"`#include <deform/{header}>`"]
        entries = [m for m in parse(text) if m.members is None or m.members or m.comment]
        for entry in entries:
            page += [f"## `{entry.name}`", reference.comment(entry.comment), f"```cpp\n{entry.code}\n```"]
            if entry.members is None:
                page.append(_calls(entry, reference))
                continue
            rows = []
            for member in entry.members:
                told = " ".join(t for t in (reference.marked(member.comment.replace("\n", " ")),
                                            _calls(member, reference)) if t)
                rows.append(f"| `{member.code.replace('|', chr(92) + '|')}` | {told.replace(' | ', ' ')} |")
            if rows:
                page.append("| member | about |\n|---|---|\n" + "\n".join(rows))
        out["api/" + header.replace(".", "_") + ".md"] = "\n\n".join(t for t in page if t) + "\n"
    return out


def _calls(member, reference):
    functions = {entry.name for _, entries in reference.parsed.values() for entry in entries
                 if entry.code and not entry.code.startswith(("typedef", "struct", "#"))}
    places = [f"[`{name}`]({reference.places[name]})" for name in member.calls if name in functions]
    return "Calls " + ", ".join(places) + "." if places else ""


def _text(docstring, reference):
    """A docstring as Markdown: indented blocks are code, the rest is text."""
    out = []
    for block in re.split(r"\n\s*\n", docstring or ""):
        if block.startswith("    "):
            out.append("```python\n" + re.sub(r"^    ", "", block, flags=re.M) + "\n```")
        else:
            out.append(reference.marked(" ".join(block.split())))
    text = "\n\n".join(out)
    return text.replace("\n```\n\n```python\n", "\n\n")


def _signature(function, of=""):
    arguments = ast.unparse(function.args)
    arguments = re.sub(r"^(?:self|cls)(?:, )?", "", arguments)
    returns = f" -> {ast.unparse(function.returns)}" if function.returns is not None else ""
    return f"{of}{function.name}({arguments}){returns}"


def python_pages(package, reference):
    """{path: Markdown} of a Python package: what its __init__ imports, a page for each module."""
    root = pathlib.Path(package)
    first = ast.parse((root / "__init__.py").read_text())
    offered = next(ast.literal_eval(node.value) for node in first.body if isinstance(node, ast.Assign)
                   and node.targets[0].id == "__all__")
    modules = {}
    for node in first.body:
        if isinstance(node, ast.ImportFrom):
            names = [alias.name for alias in node.names if (alias.asname or alias.name) in offered]
            modules.setdefault(node.module, []).extend(names)
    out, rows = {}, []
    for module, names in modules.items():
        tree = ast.parse((root / f"{module.replace('.', '/')}.py").read_text())
        found = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        module = module.rpartition(".")[2].strip("_")
        title = {"library": "errors and paths"}.get(module, module)
        path = f"python_{module}.md"
        page = [f"# deform: {title}", _text(ast.get_docstring(tree), reference)]
        for name in sorted(names, key=lambda n: found[n].lineno):
            node = found[name]
            rows.append(f"| [`{name}`]({path}#{slug(name)}) | "
                        f"{_text((ast.get_docstring(node) or '').split(chr(10) * 2)[0], reference)} |")
            page.append(f"## `{name}`")
            if isinstance(node, ast.FunctionDef):
                page += [f"```python\n{_signature(node, 'deform.')}\n```",
                         _text(ast.get_docstring(node), reference)]
                continue
            bases = [ast.unparse(base) for base in node.bases]
            begin = next((m for m in node.body
                          if isinstance(m, ast.FunctionDef) and m.name == "__init__"), None)
            head = f"class {name}({', '.join(bases)})" if bases else f"class {name}"
            if begin is not None:
                head += "\n" + _signature(begin).replace("__init__", f"deform.{name}", 1)
            page += [f"```python\n{head}\n```", _text(ast.get_docstring(node), reference)]
            fields = [m for m in node.body
                      if isinstance(m, ast.AnnAssign) and not m.target.id.startswith("_")]
            if fields:
                page.append("```python\n" + "\n".join(ast.unparse(field) for field in fields) + "\n```")
            for member in node.body:
                if not isinstance(member, ast.FunctionDef) or member.name.startswith("_"):
                    continue
                if member.returns is not None and "_abi" in ast.unparse(member.returns):
                    continue  # for the other modules of the package
                marks = [ast.unparse(mark) for mark in member.decorator_list]
                said = _signature(member, f"{name}.")
                if "property" in marks:
                    said = re.sub(r"\(\)", "", said, count=1).replace(" -> ", ": ")
                page += [f"### `{name}.{member.name}`", f"```python\n{said}\n```",
                         _text(ast.get_docstring(member), reference)]
        out["api/" + path] = "\n\n".join(t for t in page if t) + "\n"
    out["api/python.md"] = "\n\n".join([
        "# Python", _text(ast.get_docstring(first), reference),
        "Made from the docstrings of the package.", "| name | about |\n|---|---|\n" + "\n".join(rows)]) + "\n"
    return out
