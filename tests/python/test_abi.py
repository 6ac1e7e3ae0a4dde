"""The ctypes description of the C interface agrees with a C compiler."""
import ctypes
import inspect
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from deform import _abi

SOURCE = pathlib.Path(os.environ["DEFORM_SOURCE"])
INCLUDE = SOURCE / "libdeform" / "include"


def structs():
    return [kind for _, kind in inspect.getmembers(_abi, inspect.isclass)
            if issubclass(kind, ctypes.Structure) and kind.__name__.startswith("dfm_")]


class Abi(unittest.TestCase):
    def test_every_function_of_the_headers_is_there(self):
        said = set()
        for header in sorted((INCLUDE / "deform").glob("*.h")):
            said |= set(re.findall(r"^DFM_API [^;{]*?\b(dfm_\w+)\(", header.read_text(), re.M))
        self.assertGreater(len(said), 200)
        self.assertEqual(said - set(_abi.FUNCTIONS), set())

    def test_structs_laid_out_as_in_c(self):
        lines = []
        for kind in structs():
            lines.append(f'printf("{kind.__name__} %zu\\n", sizeof({kind.__name__}));')
            for name, *_ in kind._fields_:
                lines.append(f'printf("{kind.__name__}.{name} %zu\\n", offsetof({kind.__name__}, {name}));')
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "layout.c"
            program.write_text("#include <deform/deform.h>\n#include <deform/model.h>\n"
                               "#include <deform/toi.h>\n#include <deform/rigid.h>\n#include <stdio.h>\n"
                               "int main(void) {\n" + "\n".join(lines) + "\nreturn 0; }\n")
            binary = program.with_suffix("")
            subprocess.run([os.environ.get("CC", "cc"), "-std=c99", f"-I{INCLUDE}", program, "-o", binary],
                           check=True)
            said = subprocess.run([binary], check=True, capture_output=True, text=True).stdout
        expected = dict(line.split() for line in said.splitlines())
        found = {}
        for kind in structs():
            found[kind.__name__] = str(ctypes.sizeof(kind))
            for name, *_ in kind._fields_:
                found[f"{kind.__name__}.{name}"] = str(getattr(kind, name).offset)
        self.assertEqual(found, expected)
        self.assertGreater(len(structs()), 40)


if __name__ == "__main__":
    unittest.main()
