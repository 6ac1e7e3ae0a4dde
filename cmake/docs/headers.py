"""Pages of the API reference from the public headers: each declaration with the comment above it, in the
order of the file. Plain /* */ comments count and stand beside members, so the declaration is shown as it is
written.
"""
import re

TOKEN = re.compile(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])+'", re.S)
PAGE = r"\b(?:doc/)?(?:concepts|howto|laws|models|reference)/[\w-]+\.md\b"
PUBLIC = r"(?:dfm|DFM|deform|DEFORM)_\w*[A-Za-z0-9]\b"


class Entry:
    """A declaration or a remark between declarations. name: None for a remark; names: what it declares."""

    def __init__(self, name, names, comment, code):
        self.name, self.names, self.comment, self.code = name, names, comment, code


def words(comment):
    """Text of a comment without its marks, line by line."""
    body = re.sub(r"^/\*+ ?|\s*\*+/$", "", comment.strip())
    return "\n".join(re.sub(r"^\s*\* ?", "", line).rstrip() for line in body.split("\n"))


def _end(text, start):
    """Where the declaration at start ends: behind its `;`, or behind the body of an inline function."""
    depth, function, i = 0, False, start
    while i < len(text):
        token = TOKEN.match(text, i)
        if token:
            i = token.end()
            continue
        c = text[i]
        if c in "({":
            function = function or (c == "(" and depth == 0)
            depth += 1
        elif c in ")}":
            depth -= 1
            if c == "}" and depth == 0 and function and not text[start:].startswith("typedef"):
                return i + 1
        elif c == ";" and depth == 0:
            return i + 1
        i += 1
    return len(text)


def _name(code):
    """(title, names) of a declaration; (None, ..) where it is no part of the interface."""
    bare = TOKEN.sub(" ", code)
    if bare.startswith("#define"):
        name = re.match(r"#define (\w+)", bare).group(1)
        return (name, [name]) if re.fullmatch(PUBLIC, name) else (None, [])
    enum = re.match(r"(?:typedef\s+)?enum\s*\w*\s*\{(.*)\}", bare, re.S)
    if enum:
        names = re.findall(r"\b(DFM_\w+)", enum.group(1))
        names = [n for i, n in enumerate(names) if n not in names[:i]]
        if len(names) == 1:
            return names[0], names
        shared = names[0]
        while not all(n.startswith(shared) for n in names):
            shared = shared[:-1]
        shared = shared[:shared.rfind("_") + 1]
        return (f"{names[0]} to {names[-1]}" if shared == "DFM_" else shared + "*"), names
    for form in (r"typedef\s+struct\s+\w+\s*\{.*\}\s*(\w+)\s*;", r"typedef\s[^;]*\(\s*\*\s*(\w+)\s*\)",
                 r"typedef\s.*?(\w+)\s*;", r"struct\s+(\w+)\s*\{", r"[^({]*?\b(\w+)\s*\("):
        found = re.match(form, bare, re.S)
        if found:
            name = found.group(1)
            return (name, [name]) if re.fullmatch(PUBLIC, name) else (None, [])
    return None, []


def _code(text, start, end):
    """The declaration as written, with the comment behind it; of an inline function the signature."""
    code = text[start:end]
    if code.endswith("}") and not code.startswith(("typedef", "struct", "enum")):
        depth = 0
        for i, c in enumerate(code):
            depth += (c == "(") - (c == ")")
            if c == "{" and depth == 0:
                return code[:i].rstrip() + ";", end
    behind = re.compile(r"[ \t]*(/\*(?:[^*]|\*(?!/))*\*/)[ \t]*(?=\n)").match(text, end)
    if behind:
        return code + "  " + behind.group(1), behind.end()
    return code, end


def parse(text):
    """(introduction, entries) of a header."""
    text = re.sub(r"#ifdef __cplusplus\n(?:extern \"C\" \{|\})\n#endif\n", "", text)
    entries, intro, pending, i = [], None, None, 0
    seen = set()

    def remark():
        if pending is not None:
            entries.append(Entry(None, [], pending, None))

    while i < len(text):
        space = re.compile(r"\s*").match(text, i)
        apart = space.group(0).count("\n") > 1
        i = space.end()
        if i >= len(text):
            break
        if apart:
            remark()
            pending = None
        if text.startswith("/*", i):
            end = text.index("*/", i) + 2
            if intro is None:
                intro = words(text[i:end])
            else:
                remark()
                pending = words(text[i:end])
                if pending.startswith("---"):
                    remark()
                    pending = None
            i = end
            continue
        if text[i] == "#" or text.startswith("//", i):
            end = re.compile(r"(?:[^\n\\]|\\.)*", re.S).match(text, i).end()
            line = text[i:end]
            name, names = _name(line) if re.match(r"#define \w+[ (]\S?", line) else (None, [])
            if name and not name.endswith("_H") and name not in seen:
                seen.add(name)
                entries.append(Entry(name, names, pending or "", line))
                pending = None
            i = end
            continue
        end = _end(text, i)
        code, end = _code(text, i, end)
        name, names = _name(code)
        forward = re.fullmatch(r"typedef\s+struct\s+(\w+)\s+\1\s*;.*", code, re.S)
        if forward and re.search(rf"struct {forward.group(1)} \{{", text):
            name = None
        if name and name not in seen:
            seen.add(name)
            entries.append(Entry(name, names, pending or "", code))
        pending, i = None, end
    remark()
    return intro or "", entries


def slug(heading):
    """The anchor that repositories' pages give a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


class Reference:
    """All headers as pages. headers: {file name: text}; folder of the pages: `api`."""

    def __init__(self, headers):
        self.parsed = {name: parse(text) for name, text in headers.items()}
        self.places = {}
        for header, (_, entries) in self.parsed.items():
            for entry in entries:
                for name in entry.names:
                    self.places.setdefault(name, f"{page(header)}#{slug(entry.name)}")

    def marked(self, text, up="../"):
        """Plain text of a comment as Markdown: names become links, and nothing else is a mark."""
        out = []
        for part in re.split(rf"(`[^`\n]+`|{PAGE}|\b(?:dfm|DFM)_\w+)", text):
            if part in self.places:
                out.append(f"[`{part}`]({self.places[part]})")
            elif re.fullmatch(PAGE, part):
                place = part.removeprefix("doc/")
                out.append(f"[{place[:-3]}]({up}libdeform/doc/{place})")
            elif part.startswith("`") or re.fullmatch(r"(?:dfm|DFM)_\w+", part):
                out.append(part if part.startswith("`") else f"`{part}`")
            else:
                out.append(re.sub(r"([\\`*_<\[\]|#])", r"\\\1", part))
        return "".join(out)

    def comment(self, text):
        """A comment: paragraphs, its lists, @param and @return, the rule of threads."""
        text = re.sub(r"(?<=\S)\s+(@(?:param|return)\b)", r"\n\1", text)
        text = re.sub(r"(?<=\S)\s+(Threads: )", r"\n\n\1", text)
        blocks, kind = [], None
        for line in text.split("\n"):
            stripped = line.strip()
            param = re.match(r"@param\s+(\S+)\s*(.*)", stripped)
            if not stripped:
                kind = None
            elif param:
                blocks.append(["- `" + param.group(1) + "`: ", param.group(2)])
                kind = "item"
            elif stripped.startswith("@return"):
                blocks.append(["", "Returns: " + stripped[7:].strip()])
                kind = "text"
            elif stripped.startswith("- "):
                blocks.append(["- ", stripped[2:]])
                kind = "item"
            elif kind:
                blocks[-1][1] += " " + stripped
            else:
                blocks.append(["", stripped])
                kind = "text"
        out, listed = "", False
        for start, body in blocks:
            body = re.sub(r"^(Returns|Threads):", r"**\1**:", self.marked(body))
            out += ("" if start and listed else "\n") + start + body + "\n"
            listed = bool(start)
        return out.strip("\n")

    def pages(self):
        """{path below the site's root: Markdown}."""
        out = {}
        rows = []
        for header, (intro, entries) in self.parsed.items():
            said = re.sub(rf"^deform/{re.escape(header)}\s+--\s+", "", intro)
            said = said if "_" in said.split()[0] else said[:1].upper() + said[1:]
            first = re.split(r"(?<=[.])\s", said.replace("\n", " "), maxsplit=1)[0].rstrip(".")
            rows.append(f"| [{header}]({page(header)}) | {self.marked(first)} |")
            text = [f"# {header}", self.comment(said), f"`#include <deform/{header}>`"]
            for entry in entries:
                if entry.name is None:
                    title = re.match(r"-{3,} (.*?) -{3,}\s*", entry.comment, re.S)
                    rest = entry.comment[title.end():] if title else entry.comment
                    text += [f"**{self.marked(title.group(1).capitalize())}**"] if title else []
                    text += [self.comment(rest)] if rest.strip() else []
                    continue
                text += [f"## `{entry.name}`",
                         self.comment(entry.comment), f"```c\n{entry.code}\n```"]
            out["api/" + page(header)] = "\n\n".join(t for t in text if t) + "\n"
        names = sorted(self.places, key=str.lower)
        groups = {}
        for name in names:
            groups.setdefault("Constants" if name.isupper() else "Functions and types", []).append(
                f"[`{name}`]({self.places[name]})")
        text = ["# Headers",
                "C99, and C++ through the same files. Made from the comments of the public headers.",
                "| header | about |\n|---|---|\n" + "\n".join(rows)]
        for title in sorted(groups, reverse=True):
            text += [f"## {title}", ",\n".join(groups[title])]
        out["api/index.md"] = "\n\n".join(text) + "\n"
        return out


def page(header):
    return header.replace(".", "_") + ".md"
