#!/usr/bin/env python3
"""The lint's own test: a small good tree is clean, and each bad change to it is found by the rule that is
meant for it."""
import os
import pathlib
import subprocess
import tempfile
import unittest

import kernel_objects
import lint

HELLO = "int main(void) { return 0; }\n"
HEADER = """#ifndef DEFORM_BASE_H
#define DEFORM_BASE_H
#define DFM_VERSION_MAJOR 0
#define DFM_VERSION_MINOR 1
#define DFM_VERSION_PATCH 0
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
/** Says hello. Threads: Any thread. Since 0.1. */
DFM_API int dfm_hello(void);
/** As above, louder. Threads: Any thread. Since 0.1. */
DFM_API int dfm_hello_loud(void);
#ifdef __cplusplus
}
#endif
#endif
"""
GOOD = {
    "README.md": f"# Title\n\n```c\n{HELLO}```\n",
    "LICENSE": "MIT\n", "CHANGELOG.md": "# Changes\n",
    "CMakePresets.json": '{"testPresets": [{"name": "base"}, {"name": "asan", "filter": {"exclude": '
                         '{"name": "it\\\\.Tree\\\\.(Finds_|IsSorted$)|Wide/.*_(a|b)$"}}}]}\n',
    "Makefile": "all:\n\techo\n",
    "SECURITY.md": "| program | reads | in `make soak` |\n|---|---|---|\n"
                   "| `fuzz_obj`, `ply` | a mesh | 5,000 each |\n| `fuzz_law` | laws | 300 |\n",
    "tests/fuzz/CMakeLists.txt": "deform_add_fuzz(law law 300)\nforeach(reader obj ply)\n"
                                 "  deform_add_fuzz(${reader} mesh 5000 ${seeds})\nendforeach()\n",
    "CMakeLists.txt": "# no -ffast-math here\nadd_compile_options(-ffp-contract=off -mno-fma)\n",
    ".ci/run": "#!/bin/sh\n",
    "examples/01_hello.c": HELLO,
    "examples/scenes/ball.json": '{"format": "deform-scene", "bodies": [{"mesh": "../data/ball.msh"}]}\n',
    "examples/data/ball.msh": "ball\n",
    "libdeform/include/deform/base.h": HEADER,
    "libdeform/include/deform/deform.h": '#ifndef DEFORM_DEFORM_H\n#define DEFORM_DEFORM_H\n'
                                         '#include "deform/base.h"\n#endif\n',
    "libdeform/include/deform/deform.hpp": "inline int hello() { return dfm_hello() + dfm_hello_loud(); }\n",
    "libdeform/src/core/error.h": "#pragma once\n#include <string>\n",
    "libdeform/src/math/elementary.h": "#pragma once\ninline double exp_check(double x) { return "
                                       "std::exp(x); }\n",
    "libdeform/src/broad/tree.cpp": '#include "core/error.h"\n'
                                    '// std::pow( and Eigen:: in a comment say nothing\nint log(int);\n',
    "libdeform/src/broad/list.cpp": (
        "A::A() : a_(1), b_{2} {}\nenum { B, C = 2 };\nvoid f(int a, int b) {\n"
        "  for (int i = 0, j = 1; i < j; ++i, --j) g(i, j);\n  std::map<int, std::vector<A *>> m, n;\n"
        "  const A *const p = h(a, b), *const q = p;\n"
        "  auto l = [&](int c, int d) { return k<A, B>(c, d); };\n"
        "  A x = {1, 2}, y{3, 4};\n  if (a) return A{1, 2};\n}\n"),
    "libdeform/src/api/scene.cpp": '#include "scene/reader.h"\n',
    "libdeform/src/scene/reader.h": "#pragma once\n#include <nlohmann/json.hpp>\n"
                                    "using json = nlohmann::json;\n",
    "plugins/model_msm/model_msm.cpp": '#include "deform/plugin.h"\n#include "spring.h"\n#include <vector>\n',
    "plugins/model_msm/spring.h": "#pragma once\n",
    "plugins/friction_b/b.cpp": '#include "../friction_common/curve.h"\nchar id[] = "org.deform.bee";\n',
    "libdeform/doc/laws/bee.md": "# bee\n", "tests/support/law_bytes.h": "// bee\n",
    "plugins/friction_common/curve.h": "#pragma once\n",
    "plugins/model_common/half.h": "#pragma once\n",
    "plugins/model_msm/spring_kernel_avx2.cpp": "#include <immintrin.h>\n#include \"spring.h\"\n"
                                                "#include \"../model_common/half.h\"\nnamespace {\n"
                                                "inline double half(double x) { return x / 2; }\n}\n",
    "bindings/cli/main.cpp": '#include <CLI/CLI.hpp>\n#include "deform/deform.h"\n',
    "libdeform/doc/howto/engine.md": "# Engine\n\n```c\nint x;\n```\n",
    "libdeform/doc/howto/engine/engine.c": "int w;\nint x;\nint y;\n",
    "libdeform/doc/howto/cpp.md": "```c\nint nowhere;\n```\n",
    "libdeform/doc/README.md": "# Pages\n\n`dfm_hello`, `tree.cpp`, `core/error.h` "
                               "[engine](howto/engine.md#engine), [c++](howto/cpp.md), [top](#pages), "
                               "[gallery](reference/gallery.md), [scenes](reference/scenes.md), "
                               "[bee](laws/bee.md), "
                               "[out](https://example.org/a.md)\n",
    "libdeform/doc/decisions/0001-handles.md": "# 0001 Handles\n",
    "libdeform/doc/decisions/README.md": "# Decisions\n\n- [0001](0001-handles.md) Handles\n",
    "libdeform/doc/reference/scenes.md": "`time.step`: s\n",
    "libdeform/schema/deform-scene.schema.json": '{"$defs": {"time": {"properties": {"step": {}, "later": '
                                                 '{"description": "not available yet"}}}, "word": {}}}\n',
    "libdeform/doc/reference/gallery.md": "![b](../images/b.png)\n\n`libdeform/doc/images/b.py`\n",
    "libdeform/doc/images/b.png": "b\n", "libdeform/doc/images/b.py": "", "libdeform/doc/images/d.py": "",
    "libdeform/src/core/page.h": "#pragma once\n// doc/howto/cpp.md, howto/engine.md, decision 0001\n",
    "tests/unit/tree_test.cpp": '#include "broad/tree.h"\nTEST(Tree, Finds_All) {}\n'
                                'TEST_F(Tree, IsSorted) {}\nTEST_P(Forest, Finds_) {}\n'
                                'INSTANTIATE_TEST_SUITE_P(Wide, Forest, All);\n',
    "tests/api/hello_test.cpp": '#include "deform/deform.h"\n#include "support.h"\n',
}
# rule: [(file, text that is appended, or replaces it where it starts with "=")]
BAD = {
    "layout": [("notes.txt", "=x\n"), ("src/main.cpp", "=int x;\n"),
               ("libdeform/src/utils/a.h", "=#pragma once\n"), ("plugins/msm/a.c", "=\n"),
               ("tests/misc/a_test.cpp", "=\n"), ("libdeform/src/core/Error.h", "=#pragma once\n"),
               ("docs/index.md", "=x\n")],
    "text": [("libdeform/src/core/error.h", "int x;\n" * 801), ("README.md", "word \n"),
             ("libdeform/src/core/error.h", "\tint x;\n"),
             ("README.md", "no end"),
             ("CHANGELOG.md", "a\r\n"),
             ("libdeform/src/core/error.h", "// TODO later\n")],
    "columns": [("libdeform/src/core/error.h", "// " + "x" * 108 + "\n"), ("Makefile", "#" * 111 + "\n"),
                (".ci/run", "#" * 111 + "\n"), ("CMakeLists.txt", "#" * 111 + "\n"),
                ("libdeform/src/core/error.h", 'const char *a = R"(' + "x" * 100 + ')";\n')],
    "ranges": [("libdeform/src/core/error.h", "bool x = std::ranges::partition(a);\n")],
    "subjects": [("libdeform/src/core/error.h", "// Of a body.\n"),
                 ("libdeform/src/core/error.h", "/** Of a piece. */\n")],
    "statements": [("libdeform/src/broad/tree.cpp", f"void f() {{ {chain} }}\n") for chain in (
        "a = 1, b = 2;", "return a = 1, true;", "if (a < b) a = 1, ++b;",
        "for (int i = 0; i < 3; ++i) f(i), g(i);",
        "s.x[2 * i].clear(), s.y.clear();", "const auto g = [&](int k) { a = k, b = k; };",
        "else *a += 1, *b = 2;", "a::b(1), c<int>(2);", "switch (a) { case 1: a = 1, b = 2; }",
        "return std::pair<int, int>(1, 2), true;", "p->a = {1, 2}, p->b = 3;",
        "}\n#define TRY(call) \\\n  if ((call) < 0) return puts(said()), 1\n{")],
    "paths": [("README.md", "see /home/me/deform\n"), ("CMakeLists.txt", "set(X /root/x)\n"),
              ("README.md", "../.lib" + "rary/a\n"),
              ("examples/01_hello.c", '// "/wo' + 'rk/main"\n'), ("README.md", "../sha" + "red/meshes\n")],
    "scenes": [("examples/scenes/ball.json",
                '={"format": "deform-scene", "bodies": [{"mesh": "%s"}]}\n' % mesh)
               for mesh in ("../data/gone.msh", "../../../ball.stl", "/ball.msh")],
    "readme": [("README.md", "```\n" + "x" * 107 + "\n```\n"),
               ("examples/01_hello.c", "// more\n"), ("README.md", "=# Title\n"),
               ("examples/01_hello.c", "\n" * 60)],
    "guides": [("libdeform/doc/howto/engine.md", "```c\nint z;\n```\n"),
               ("libdeform/doc/howto/engine.md", "```cmake\nproject(x)\n```\n"),
               ("libdeform/doc/howto/cpp.md", "As here (`examples/01_hello.c`):\n\n```c\nint z;\n```\n")],
    "links": [("README.md", "[x](libdeform/doc/gone.md)\n"),
              ("README.md", "[x](libdeform/doc/howto/engine.md#gone)\n"),
              ("libdeform/doc/README.md", "[x](#gone)\n")],
    "citations": [("libdeform/src/core/error.h", "// design.md section 2\n"),
                  ("libdeform/src/core/error.h", "// doc/concepts/cpp.md\n"),
                  ("README.md", "decision 0002\n"),
                  ("libdeform/src/core/error.h", "// doc/decisions/0002\n")],
    "names": [("README.md", "`dfm_gone()`\n"), ("README.md", "in `broad/gone.cpp`\n"),
              ("libdeform/doc/howto/cpp.md", "`DFM_GONE`\n")],
    "shipped": [("plugins/friction_c/c.c", '=char id[] = "org.deform.sea";\n'),
                ("tests/support/law_bytes.h", "=// none\n")],
    "scene_keys": [("libdeform/doc/reference/scenes.md", "=step is no code\n"),
                   ("libdeform/schema/deform-scene.schema.json",
                    '={"$defs": {"time": {"properties": {"step": {}, "stop": {"type": "number"}}}}}\n')],
    "pictures": [("libdeform/doc/images/c.png", "=c\n"),
                 ("libdeform/doc/reference/gallery.md", "=![b](../images/b.png)\n\n`b.py`\n"),
                 ("libdeform/doc/reference/gallery.md",
                  "=![b](../images/b.png)\n\n`libdeform/doc/images/d.py`\n")],
    "reading_order": [("libdeform/doc/concepts/new.md", "=# New\n"),
                      ("libdeform/doc/decisions/0002-more.md", "=# 0002 More\n"),
                      ("libdeform/doc/decisions/0001-handles.md", "=" + "word " * 1201),
                      ("CHANGELOG.md", "=" + "word " * 3001),
                      ("libdeform/doc/README.md", "word " * 120000)],
    "results": [("tests/bench/results/gone.csv", "=a,b\n")],
    "stages": [("libdeform/src/step/a.cpp", "=bool stage_a(World &w);\nbool stage_b(World &w) { return "
                                            "stage_a(w); }\n")],
    "layers": [("libdeform/src/core/error.h", '#include "math/vec3.h"\n'),
               ("libdeform/src/broad/tree.cpp", '#include "narrow/pair.h"\n'),
               ("libdeform/src/broad/tree.cpp", '#include "../core/error.h"\n'),
               ("libdeform/src/scene/reader.h", '#include "api/as_status.h"\n'),
               ("libdeform/src/mesh/a.h", '=#include "plugin/loader.h"\n'),
               ("libdeform/src/plan/a.h", '=#include <state/world.h>\n'),
               ("libdeform/src/contact/a.h", '=#include "dynamics/dynamics.h"\n')],
    "systems": [("bindings/cli/main.cpp", "#include <sys/socket.h>\n"),
                ("libdeform/src/core/error.h", "#include <dlfcn.h>\n"),
                ("libdeform/src/core/error.h", "auto p = std::filesystem::path(name);\n"),
                ("bindings/cli/main.cpp", "auto s = path.string();\n")],
    "public_only": [("bindings/cli/main.cpp", '#include "core/error.h"\n'),
                    ("tests/api/hello_test.cpp", '#include "core/error.h"\n'),
                    ("examples/01_hello.c", '#include "../libdeform/src/core/error.h"\n'),
                    ("tests/analytic/a_test.cpp", '=#include "broad/tree.cpp"\n')],
    "plugin_includes": [("plugins/model_msm/spring.h", '#include "deform/world.h"\n'),
                        ("plugins/model_msm/spring.h", '#include "core/error.h"\n'),
                        ("plugins/model_msm/spring.h", "#include <deform/base.h>\n"),
                        ("plugins/friction_a/a.c", '=#include "../model_msm/spring.h"\n'),
                        ("plugins/model_msm/spring.h", '#include "../friction_common/curve.h"\n')],
    "third_parties": [("libdeform/src/broad/tree.cpp", "#include <Eigen/Core>\n"),
                      ("bindings/cli/main.cpp", "#include <nlohmann/json.hpp>\n"),
                      ("libdeform/src/core/error.h", "using V = Eigen::Vector3d;\n"),
                      ("libdeform/include/deform/base.h", "#include <GL/gl.h>\n"),
                      ("libdeform/src/core/error.h", "#include <spdlog/spdlog.h>\n"),
                      ("bindings/cli/main.cpp", "#include <png.h>\n")],
    "numbers": [("CMakeLists.txt", "add_compile_options(-ffast-math)\n"),
                ("CMakePresets.json", '{"f": "-Ofast"}\n'), ("Makefile", "X = -mfma\n"),
                ("libdeform/src/broad/tree.cpp", "double f(double a) { return std::fma(a, a, a); }\n"),
                ("plugins/model_msm/spring_kernel_avx2.cpp", "__m256d f(__m256d a) { return "
                                                             "_mm256_fmadd_pd(a, a, a); }\n"),
                ("plugins/model_msm/spring_kernel_avx2.cpp", "__m256 f(__m256 a) { return "
                                                             "_mm256_rsqrt_ps(a); }\n"),
                ("CMakeLists.txt", "add_compile_options(-march=native)\n"),
                ("libdeform/src/broad/tree.cpp", '#pragma GCC optimize("fast-math")\n')],
    "libm": [("libdeform/src/broad/tree.cpp", "double f(double a) { return std::pow(a, 3); }\n"),
             ("plugins/model_msm/spring.h", "double y = sin(1.0);\n"),
             ("libdeform/src/math/vec3.h", "=double y = cbrt(1.0);\n"),
             ("libdeform/src/step/step.cpp", "=float y = expf(1.0f);\n"),
             ("libdeform/src/step/step.cpp", "=double f(double x) { return exp(x); }\n")],
    "kernels": [("plugins/model_msm/spring.h", "#include <vector>\n"),
                ("plugins/model_common/half.h", "#include <vector>\n"),
                ("plugins/model_msm/spring_kernel_avx2.cpp", "#include <vector>\n"),
                ("plugins/model_msm/spring_kernel.h", "=#include <Eigen/Core>\n"),
                ("plugins/model_msm/spring_kernel_avx2.cpp", "double f(double a) { return std::sqrt(a); }\n"),
                ("plugins/model_msm/spring_kernel_avx512.cpp", "=inline double f(double a) { return a; }\n"),
                ("libdeform/src/broad/box_kernel_avx2.cpp", "=double f(double a) { return a; }\n")],
    "public_headers": [("libdeform/include/deform/base.h", "#include <stdlib.h>\n"),
                       ("libdeform/include/deform/plugin.h", '=#include "deform/base.h"\n'),
                       ("libdeform/include/deform/body.h", "=#pragma once\n"),
                       ("libdeform/include/deform/deform.h", "=#ifndef DEFORM_DEFORM_H\n"
                                                             "#define DEFORM_DEFORM_H\n#endif\n"),
                       ("libdeform/include/deform/base.h", "=#ifndef DEFORM_BASE_H\n#define DEFORM_BASE_H\n"
                                                           "DFM_API int dfm_a(void);\n#endif\n")],
    "plugin_callers": [("libdeform/include/deform/plugin.h", "=enum { DFM_NOBODY = 1 };\n"),
                       ("libdeform/include/deform/plugin.h",
                        "=typedef struct dfm_nobody {\n  int a;\n} dfm_nobody;\n"),
                       ("libdeform/include/deform/plugin.h",
                        "=struct s {\n  void (*nobody)(void *self);\n};\n"),
                       ("libdeform/include/deform/plugin.h", '=#define DFM_EXT_NOBODY "dfm.nobody/1"\n')],
    "cpp_complete": [("libdeform/include/deform/deform.hpp", "=// dfm_hello() and dfm_hello_loud() in a "
                                                             "comment reach nothing\n"),
                     ("libdeform/include/deform/deform.hpp", "=inline int hello() { return dfm_hello(); }\n"),
                     ("bindings/ode/include/deform/ode.h", "=DFM_API int dfm_ode_hello(void);\n")],
    "threads": [("libdeform/include/deform/base.h", "\nDFM_API int dfm_silent(void);\n"),
                ("libdeform/include/deform/base.h", "\n/** Says nothing of threads. */\n"
                                                    "DFM_API int dfm_silent(int a,\n  int b);\n"),
                ("libdeform/include/deform/base.h", "\n/** Both. Threads: Any thread. */\n"
                                                    "DFM_API int dfm_said(void);\n"
                                                    "DFM_API int dfm_silent(void);\n")],
    "presets": [("CMakePresets.json", f'={{"testPresets": [{{"name": "asan", "filter": {{"include": '
                                      f'{{"name": "{name}"}}}}}}]}}\n')
                for name in ("Tree|Gone", "Tree.(Finds|Loses)_", "(Tree|Wide/.*_a|Narrow/.*_a)",
                             "Forest.Finds_$|Tree.Finds_$")],
    "fuzzers": [("SECURITY.md", "| `fuzz_gone` | nothing | 3 |\n"),
                ("SECURITY.md", "=| `fuzz_obj`, `ply` | a mesh | 5,000 each |\n"),
                ("SECURITY.md", "=| `fuzz_obj`, `ply` | a mesh | 6,000 each |\n"
                                "| `fuzz_law` | laws | 300 |\n")],
    "walks": [("README.md", "`explain` in `tree.cpp`\n"), ("README.md", "`log` in\n`gone.cpp`\n")],
    "versions": [
        ("CMakeLists.txt", "project(deform VERSION 0.2.0)\n"), ("CHANGELOG.md", "## 0.2.0 (unreleased)\n"),
        ("libdeform/include/deform/base.h", "/* Since 0.1; this one since 0.2. */\n")],
}


class Lint(unittest.TestCase):
    def tree(self, changes=()):
        root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        files = dict(GOOD)
        for path, text in changes:
            files[path] = text[1:] if text.startswith("=") else files[path] + text
        for path, text in files.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_bytes(text.encode())
        return root

    def test_good_tree_is_clean(self):
        self.assertEqual(lint.check(self.tree()), [])

    def test_each_bad_change_is_found(self):
        for rule, changes in BAD.items():
            for change in changes:
                with self.subTest(rule=rule, file=change[0], text=change[1][:60]):
                    found = [f for f in lint.check(self.tree([change]), [rule]) if change[0] in f
                             or rule in ("readme", "layout")]
                    self.assertTrue(found, "not found")

    def test_every_rule_has_a_bad_case(self):
        self.assertEqual(set(BAD), set(lint.RULES))

    def test_bad_kernel_objects_are_found(self):
        root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        source = ("inline int weak() { return 1; }\nint entry() { return weak(); }\n"
                  "__attribute__((target(\"fma\"))) double fused_avx2(double a) { return __builtin_fma(a, a, "
                  "a); }\n")
        (root / "a_kernel_avx2.cpp").write_text(source)
        target = root / "a_kernel_avx2.cpp.o"
        compiler = os.environ.get("CXX", "c++")
        subprocess.run([compiler, "-O0", "-c", root / "a_kernel_avx2.cpp", "-o", target], check=True)
        found = kernel_objects.check("nm", "objdump", [target])
        self.assertEqual(len(found), 3, found)
        for part in ("weak symbol", "external symbol _Z5entryv", "instruction vfmadd"):
            self.assertIn(part, "".join(found))


if __name__ == "__main__":
    unittest.main()
