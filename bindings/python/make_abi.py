#!/usr/bin/env python3
"""Writes deform/_abi.py and deform/_abi_functions.py, the C interface as ctypes has it, from the public
headers: constants and structs; the argument and result types of every function.

make_abi.py INCLUDE_DIR OUT.py           writes OUT.py and, beside it, OUT_functions.py
make_abi.py INCLUDE_DIR OUT.py --check   exit 1 where the two are not what would be written
"""
import pathlib
import re
import sys
import textwrap

HEADERS = ("plugin base id math world body contact attach surface mesh scene obstacle law material model "
           "rigid toi debug query callback sensor cut tool").split()
SCALARS = {"double": "f64", "float": "f32", "uint64_t": "u64", "uint32_t": "u32", "int32_t": "i32",
           "uint8_t": "u8", "size_t": "usize", "bool": "flag", "int": "cint", "dfm_status": "i32"}
HEAD = '''"""The C interface of libdeform for ctypes. Written by make_abi.py from the public headers: change
those."""
from ctypes import (Structure as _Structure, c_bool as flag, c_char_p as text,
                    c_double as f64, c_float as f32, c_int as cint, c_int32 as i32, c_size_t as usize,
                    c_uint8 as u8, c_uint32 as u32, c_uint64 as u64, c_void_p as ptr)
'''
FUNCTIONS_HEAD = '''"""The functions of libdeform for ctypes.

Written by make_abi.py from the public headers: change those.
"""
'''


def plain(source):
    """Without comments and preprocessor lines, on as few lines as there are declarations."""
    source = re.sub(r"/\*.*?\*/|//[^\n]*", " ", source, flags=re.S)
    source = re.sub(r"^[ \t]*#(?:[^\n\\]|\\\n|\\.)*", " ", source, flags=re.M)
    source = re.sub(r'extern "C" \{', " ", source)
    return re.sub(r"\s+", " ", source)


class Interface:
    def __init__(self, include):
        self.types = dict(SCALARS)
        self.constants, self.structs, self.functions = [], [], []
        for name in HEADERS:
            source = (include / "deform" / f"{name}.h").read_text()
            for constant, value in re.findall(r"^#define (DFM_\w+) (\d+)u?\b", source, re.M):
                self.constants.append([(constant, int(value))])
            self.read(plain(source))

    def read(self, source):
        # inline functions: the library has a symbol that ctypes calls instead
        source = re.sub(r"static inline [^{;]*\{[^}]*\}", " ", source)
        pattern = re.compile(
            r"enum \{(?P<enum>[^}]*)\}"
            r"|typedef struct (?:\w+ )?\{(?P<members>[^}]*)\} ?(?P<struct>\w+);"
            r"|typedef struct \w+ (?P<opaque>\w+);"
            r"|typedef [^;{]*?\(\*(?P<callback>\w+)\)\([^;]*;"
            r"|typedef (?P<base>\w+) (?P<alias>\w+);"
            r"|DFM_API (?P<result>[^;(]*?)(?P<function>dfm_\w+)\((?P<arguments>(?:[^()]|\([^()]*\))*)\);")
        for match in pattern.finditer(source):
            found = match.groupdict()
            if found["enum"] is not None:
                self.enum(found["enum"])
            elif found["struct"]:
                self.types[found["struct"]] = found["struct"]
                self.structs.append((found["struct"], self.members(found["members"])))
            elif found["callback"]:
                self.types[found["callback"]] = "ptr"
            elif found["alias"]:
                self.types[found["alias"]] = self.types[found["base"]]
            elif found["function"]:
                self.function(found)

    def enum(self, text):
        value, group = 0, []
        for part in filter(None, (p.strip() for p in text.split(","))):
            name, _, given = (p.strip() for p in part.partition("="))
            value = int(given.rstrip("uU"), 0) if given else value
            group.append((name, value))
            value += 1
        self.constants.append(group)

    def members(self, text):
        out = []
        for declaration in filter(None, (d.strip() for d in text.split(";"))):
            callback = re.match(r".*?\(\*(\w+)\)\(", declaration)
            if callback:
                out.append((callback.group(1), "ptr"))
                continue
            base, names = re.match(r"((?:const )?\w+) (.*)", declaration).groups()
            for name in names.split(","):
                out.append(self.member(base, name.strip()))
        return out

    def member(self, base, declared):
        stars = declared.count("*")
        bare = declared.replace("*", "").replace("const ", "").strip()
        name, sizes = re.match(r"(\w+)((?:\[\w+\])*)", bare).groups()
        base = base.replace("const ", "")
        kind = ("text" if (base, stars) == ("char", 1) else "ptr") if stars else self.types[base]
        for size in re.findall(r"\[(\w+)\]", sizes):
            kind = f"{kind} * {size}"
        return name, kind

    def argument(self, declared):
        declared = declared.strip()
        if "(*" in declared:
            return "ptr"
        match = re.match(r"(?:const )?(\w+)((?: ?\*| ?const\b)*) ?\w*((?:\[\w*\])*)$", declared)
        base, stars, sizes = match.groups()
        depth = stars.count("*") + sizes.count("[")
        if base == "char" and depth == 1 and declared.startswith("const"):
            return "text"
        return "ptr" if depth else self.types[base]

    def function(self, found):
        result = found["result"].strip()
        kind = "None" if result == "void" else self.argument(result + " x" if "*" not in result else result)
        arguments = [] if found["arguments"].strip() in ("", "void") else [
            self.argument(a) for a in re.split(r",(?![^()]*\))", found["arguments"])]
        self.functions.append((found["function"], kind, arguments))

    def source(self):
        lines = [HEAD]
        for group in self.constants:   # an enumeration on one line where it fits
            joined = ", ".join(name for name, _ in group) + " = " + ", ".join(str(v) for _, v in group)
            lines += [joined] if len(joined) <= 108 else [f"{name} = {value}" for name, value in group]
        for name, members in self.structs:
            # a pair stays on one line
            fields = ", ".join(f'("{member}",{kind})'.replace(" ", "~") for member, kind in members)
            lines.append(f"\n\nclass {name}(_Structure):")
            wrapped = textwrap.wrap(f"_fields_ = [{fields}]", 100, initial_indent="    ",
                                    subsequent_indent="                ", break_long_words=False)
            lines += [re.sub(r'(",)(?=[\w])', r"\1 ", line.replace("~", " ")) for line in wrapped]
        return "\n".join(lines) + "\n"

    def functions_source(self, module):
        """With the names of types that it needs, from the other file."""
        used = sorted({kind for _, result, arguments in self.functions for kind in (result, *arguments)}
                      - {"None"})
        lines = [FUNCTIONS_HEAD]
        lines += textwrap.wrap(f"from .{module} import ({', '.join(used)})", 108,
                               subsequent_indent=" " * len(f"from .{module} import ("))
        lines.append("\n# name: (result, arguments)\nFUNCTIONS = {")
        for name, kind, arguments in self.functions:
            lines += textwrap.wrap(f'"{name}": ({kind}, [{", ".join(arguments)}]),', 108,
                                   initial_indent="    ", subsequent_indent="        ",
                                   break_long_words=False)
        return "\n".join(lines) + "\n}\n"


def main():
    include, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    interface = Interface(include)
    sources = {out: interface.source(),
               out.with_name(f"{out.stem}_functions.py"): interface.functions_source(out.stem)}
    for path, source in sources.items():
        if "--check" not in sys.argv[3:]:
            path.write_text(source)
        elif not path.exists() or path.read_text() != source:
            sys.exit(f"{path} differs from the headers; run bindings/python/make_abi.py {include} {out}")


if __name__ == "__main__":
    main()
