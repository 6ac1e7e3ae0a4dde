"""Rules about the form of code that hold where no clang-format is installed: width of a line, one statement
each, comments that begin with what they are about."""
import re

from tree import CODE, line_of

MAX_COLUMNS = 110
SCRIPTS = (".py", ".cmake", ".sh", "CMakeLists.txt", "Makefile", ".ci/run")
TOKEN = re.compile(r'//(?:[^\n\\]|\\.|\\\n)*|/\*.*?\*/|^[ \t]*#(?:[^\n\\]|\\\n|\\.)*|'
                   r'R"(?P<mark>[^\s()\\]{0,16})\(.*?\)(?P=mark)"'
                   r'|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|[\w.]+|\s+|::|->|&&|[^\s\w]', re.S | re.M)
HEAD = re.compile(r"^(?:else\b|do\b|(?:if|while|for|switch|EACH_LANE)\s*(?:constexpr\s*)?\(\)|"
                  r"case\b[^:]*:(?!:)|default\s*:|"
                  r"\w+\s*:(?!:)|\[\[\w+\]\])\s*")
TYPED = re.compile(r"^(?:const|constexpr|static|auto|unsigned|using|typedef|template|struct|class|union|enum|"
                   r"extern|inline|"
                   r"thread_local|friend|public|private|protected|int|double|float|bool|char|void|long|short|"
                   r"signed|"
                   r"namespace|operator|alignas)\b|^::?[\w:.]+|"
                   r"^[\w:.]+(?:<>)?(?:::\w+(?:<>)?)*\s*(?:[*&]+\s*(?:const\s+)?|\s)\w")


def columns(tree):
    """No line is wider than a page beside another."""
    for path in tree.paths:
        content = tree.text(path)
        if content is None or not path.endswith((*CODE, *SCRIPTS)):
            continue
        for number, line in enumerate(content.split("\n"), 1):
            if len(line) > MAX_COLUMNS:
                yield path, number, f"{len(line)} columns; at most {MAX_COLUMNS}"


def _is_chain(statement):
    """Parts joined by the comma operator; brackets in the text are empty already."""
    while HEAD.match(statement):
        statement = HEAD.sub("", statement, count=1)
    for _ in range(4):
        statement = re.sub(r"(?<=\w)\s*<[^<>;=&|+]*>", "", statement)
    if "," not in statement:
        return False
    if re.match(r"(?:co_return|return|throw|delete)\b", statement):
        return True
    return not TYPED.match(statement)


def _is_value(before):
    """Braces behind this text are part of a statement: an initializer or the body of a lambda, no block."""
    if re.search(r"\[\]\s*(?:\(\))?[^()\[\]{}=;]*$", before) and not re.search(r"\w\[\]$", before):
        return True
    if re.search(r"\b(?:struct|class|enum|union|namespace|extern)\b[^=()]*$", before):
        return False
    return bool(re.search(r"(?:[=,(>\]]|\breturn|\w)$", before)) and not re.search(
        r"\b(?:const|noexcept|override|final|else|do|try)$", before)


def chains(source):
    """(offset, statement) of each statement that is a chain by comma."""
    # statements that hold the present bracket; the present one, and where it begins
    outer, text, start = [], "", None
    for match in TOKEN.finditer(source):
        token = match.group(0)
        if token.startswith(("//", "/*")):
            continue
        if token.lstrip().startswith("#"):
            body = re.sub(r"^\s*#\s*define\s+\w+(?:\([^)]*\))?", "", token.replace("\\\n", "  "))
            if body != token and re.search(r"\b(?:do|if|return)\b", body):
                yield from ((match.start() + at, chain) for at, chain in chains(body + ";"))
            continue
        if token.isspace():
            text += " " if text else ""
            continue
        if token in "([{":
            outer.append((token, text, match.start() if start is None else start))
            text, start = "", None
        elif token in ")]}" and outer:
            bracket, text, start = outer.pop()
            if bracket == "{" and not _is_value(text.rstrip()):
                text, start = "", None
            else:
                text += bracket + token
        elif token == ";" and not (outer and outer[-1][0] != "{"):
            if _is_chain(text.strip()):
                yield start, text.strip()
            text, start = "", None
        else:
            start = match.start() if start is None else start
            text += '""' if token[0] in "\"'R" and len(token) > 1 and token[-1] in "\"'" else token


def statements(tree):
    """One statement each: no chains by comma, such as `a = 1, b = 2;` or `return a = 1, true;`."""
    for path in tree.paths:
        if path.endswith(CODE) and tree.text(path) is not None:
            for offset, statement in chains(tree.text(path)):
                yield (path, line_of(tree.text(path), offset),
                       f"several statements joined by commas; write one each: {statement[:60]}")


def subjects(tree):
    """A comment begins with what a thing is or does, not with "Of", which leaves that to the reader."""
    for path in tree.paths:
        content = tree.text(path)
        if path.endswith(CODE) and not path.startswith("tests/") and content is not None:
            for match in re.finditer(r"^[ \t]*(?://|/?\*+) Of [a-z]", content, re.M):
                yield (path, line_of(content, match.start()),
                       'a comment begins with "Of"; begin with what the thing is or does')


RULES = {"columns": columns, "statements": statements, "subjects": subjects}
