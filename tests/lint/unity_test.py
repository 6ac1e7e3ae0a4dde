#!/usr/bin/env python3
"""Files that collide are not compiled together: unity_test.py cmake/unity_groups.py"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = sys.argv.pop() if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2] / "cmake/unity_groups.py"
OWN = "namespace dfm {\nnamespace {\n%s\n}  // namespace\n}  // namespace dfm\n"


class Groups(unittest.TestCase):
    def together(self, one, other, most=9, names=("one.cpp", "other.cpp"), header=""):
        with tempfile.TemporaryDirectory() as folder:
            include, sources = pathlib.Path(folder, "inc"), pathlib.Path(folder, "a room")
            include.mkdir()
            sources.mkdir()
            (include / "seen.h").write_text(header)
            paths = [sources / name for name in names]
            for path, text in zip(paths, (one, other)):
                path.write_text(text)
            done = subprocess.run([sys.executable, "-B", SCRIPT, str(most), str(include), *map(str, paths)],
                                  capture_output=True, text=True, check=True)
            lines = done.stdout.splitlines()
            self.assertIn(lines, ([], [f"{lines[0].split()[0]} {path}" for path in paths] if lines else []))
            return bool(lines)

    def test_files_without_a_common_name_are_together(self):
        self.assertTrue(self.together(OWN % "int a() { return 1; }", OWN % "int b() { return 1; }"))
        self.assertFalse(self.together(OWN % "int a = 1;", OWN % "int b = 1;", most=1))

    def test_a_name_that_both_keep_to_themselves_parts_them(self):
        for line in ("int a(double x) {\n  return 1;\n}", "constexpr double a = 1;",
                     "struct a {\n  int b;\n};", "using a = int;", "enum { z, a };",
                     "const int a[] = {1, 2};",
                     "template <class T> T a(T x) {\n  return x;\n}"):
            self.assertFalse(self.together(OWN % line, OWN % "bool a(int x) { return true; }"), line)
        self.assertFalse(self.together("#define A 1\n", "#define A 2\n"))
        self.assertFalse(self.together("static int a() { return 1; }\n", OWN % "int a = 1;"))

    def test_what_stands_inside_a_function_is_nobodys_affair(self):
        body = "int %s() {\n  const int a = 1;\n  return a;\n}"
        self.assertTrue(self.together(OWN % (body % "b"), OWN % (body % "c")))

    def test_a_name_that_hides_a_header_s_parts_them(self):
        header = "namespace dfm {\nint a(double x);\n}  // namespace dfm\n"
        uses = '#include "seen.h"\n' + OWN % "int b() { return a(1.0); }"
        self.assertFalse(self.together(OWN % "int a(const char *x) { return 2; }", uses, header=header))

    def test_renamed_headers_and_own_allocation_stay_alone(self):
        other = OWN % "int b() { return 1; }"
        self.assertFalse(self.together('#define x y\n#include "seen.h"\n#undef x\n', other))
        self.assertFalse(self.together("void *operator new(size_t n) {\n  return 0;\n}\n", other))
        self.assertFalse(self.together('int f(void) asm("g");\n', other))
        self.assertFalse(self.together('#include "seen.h"\n', other,
                                       header="void *operator new(size_t n) {\n  return 0;\n}\n"))

    def test_tests_of_one_name_stay_apart(self):
        names = ("one_test.cpp", "other_test.cpp")
        test = "TEST(Suite, %s) {\n}\n"
        self.assertTrue(self.together(test % "A", test % "B", names=names))
        self.assertFalse(self.together(test % "A", test % "A", names=names))
        self.assertFalse(self.together("struct Rig {\n};\n", "struct Rig {\n};\n", names=names))


unittest.main()
