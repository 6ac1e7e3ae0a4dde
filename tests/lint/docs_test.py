#!/usr/bin/env python3
"""What `make docs` gives its generator, which is not needed here: docs_test.py SOURCE"""
import json
import pathlib
import posixpath
import re
import shutil
import subprocess
import sys
import unittest

ROOT = pathlib.Path(sys.argv.pop() if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[2])
sys.path.insert(0, str(ROOT / "cmake/docs"))
import headers  # noqa: E402
import stage  # noqa: E402
import wrappers  # noqa: E402

HEADER = """/* deform/a.h -- things. More. */
#ifndef DEFORM_A_H
#define DEFORM_A_H
/* ---- of one kind ---------------- */
/** Says a_b * c. @param n,m how many
 * of them
 * @return dfm_kind; DFM_A_ONE.
 * Threads: Any thread. */
DFM_API int dfm_say(int n, void (*f)(int k), int m);

/* A remark. */

enum { DFM_A_ONE = 1, DFM_A_TWO = 2 }; /* behind */
typedef struct dfm_kind {
  int a; /* "; }" */
} dfm_kind;
static inline int dfm_sum(int a) {
  if (a) { return 1; }
  return 0;
}
#define DFM_LIMIT 3u /* most */
#define DFM_HIDDEN_ 4
#endif
"""


class Headers(unittest.TestCase):
    def test_each_declaration_has_its_comment_and_code(self):
        intro, entries = headers.parse(HEADER)
        self.assertEqual(intro, "deform/a.h -- things. More.")
        self.assertEqual([e.name for e in entries],
                         [None, "dfm_say", None, "DFM_A_*", "dfm_kind", "dfm_sum", "DFM_LIMIT"])
        self.assertEqual(entries[1].code, "DFM_API int dfm_say(int n, void (*f)(int k), int m);")
        self.assertEqual(entries[3].code, "enum { DFM_A_ONE = 1, DFM_A_TWO = 2 };  /* behind */")
        self.assertIn('/* "; }" */', entries[4].code)
        self.assertEqual(entries[5].code, "static inline int dfm_sum(int a);")

    def test_comment_becomes_markdown(self):
        page = headers.Reference({"a.h": HEADER}).pages()["api/a_h.md"]
        for part in ("**Of one kind**", r"Says a\_b \* c.", "\n- `n,m`: how many of them\n",
                     "**Returns**: [`dfm_kind`](a_h.md#dfm_kind); [`DFM_A_ONE`](a_h.md#dfm_a_).",
                     "**Threads**: Any thread."):
            self.assertIn(part, page)


WRAPPER = """// deform/a.hpp -- more. Things.
#include <span>
namespace deform {
// Says a_b.
template <class E, class T = std::array<int, 2>>
class Kind : public Handle<int> {
 public:
  Kind() = default;
  // n: how many.
  auto say(int n) const { if (n) { return E::done(dfm_say(n, nullptr, 0)); } return none(); }
  int raw() const noexcept { return raw_; }  // as in C
 private:
  int hidden();
  int raw_ = 0;
};
inline int sum(int a) { return dfm_sum(a); }
}  // namespace deform
"""


class Wrappers(unittest.TestCase):
    def setUp(self):
        self.reference = headers.Reference({"a.h": HEADER})

    def test_class_has_its_members_and_what_they_call(self):
        page = wrappers.cpp_pages({"a.hpp": WRAPPER}, self.reference)["api/a_hpp.md"]
        for part in ("# a.hpp\n\nMore. Things.", "## `Kind`\n\nSays a\\_b.",
                     "| `auto say(int n) const;` | n: how many. Calls [`dfm_say`](a_h.md#dfm_say). |",
                     "| `int raw() const noexcept;` | as in C |", "## `sum`"):
            self.assertIn(part, page)
        for part in ("hidden", "raw_ =", "Kind();"):
            self.assertNotIn(part, page)

    def test_every_name_of_the_python_package_is_described(self):
        pages = "".join(wrappers.python_pages(ROOT / stage.PYTHON, self.reference).values())
        names = re.search(r"__all__ = \[(.*?)\]", (ROOT / stage.PYTHON / "__init__.py").read_text(), re.S)
        for name in re.findall(r'"(\w+)"', names.group(1)):
            self.assertIn(f"## `{name}`", pages)
        for part in ("### `World.step`", "World.step(dt: float) -> Trouble", "World.contacts: np.ndarray"):
            self.assertIn(part, pages)


class Pages(unittest.TestCase):
    def test_list_has_an_empty_line_before_it_and_four_columns_inside(self):
        self.assertEqual(stage.dialect("Text:\n- a\n  b\n  1. c\n\n     d\n\nEnd\n"),
                         "Text:\n\n- a\n    b\n    1. c\n\n        d\n\nEnd\n")

    def test_code_stays_as_it_is(self):
        text = "Text:\n\n```\nx:\n- https://a.b\n```\n\n    - c\n"
        self.assertEqual(stage.dialect(text), text)

    def test_bare_address_becomes_a_link(self):
        self.assertEqual(stage.dialect("See https://a.b/c."), "See <https://a.b/c>.")


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.stage = stage.Stage(ROOT)

    def test_every_public_function_is_described(self):
        for path in [p for folder in stage.HEADERS for p in (ROOT / folder).glob("*.h")]:
            text = headers.TOKEN.sub(" ", path.read_text())
            for name in re.findall(r"DFM_API[^;{]*?\b(dfm_\w+)\s*\(", text):
                self.assertIn(name, self.stage.reference.places)

    def test_every_page_is_there(self):
        pages = {p.relative_to(ROOT).as_posix() for p in (ROOT / "libdeform/doc").rglob("*.md")}
        self.assertEqual(pages - set(self.stage.files), set())

    def test_every_link_leads_to_a_file(self):
        for path, text in self.stage.files.items():
            if isinstance(text, bytes):
                continue
            targets = []
            stage.prose(text, lambda part: targets.extend(m[2] for m in stage.LINK.finditer(part)) or part)
            for target in targets:
                target = target.partition("#")[0]
                if target and not re.match(r"[a-z]+:", target):
                    there = posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
                    self.assertIn(there, self.stage.files, f"{path}: {target}")

    def test_front_page_leads_to_the_demo_and_the_reference(self):
        for target in ("libdeform/doc/howto/webassembly.md", "api/index.md"):
            self.assertIn(f"]({target})", self.stage.files["README.md"])

    def test_contents_follow_the_reading_order(self):
        sections = [next(iter(entry)) for entry in self.stage.nav]
        self.assertEqual(sections[:3], ["Reading order", "Overview", "First steps"])

        def check(pages):
            if isinstance(pages, str):
                self.assertIn(pages, self.stage.files)
            else:
                for entry in pages:
                    check(next(iter(entry.values())))
        check(self.stage.nav)
        reference = next(entry["Reference"] for entry in self.stage.nav if "Reference" in entry)
        groups = {next(iter(entry)): next(iter(entry.values())) for entry in reference}
        self.assertIn({"lugre": "libdeform/doc/laws/lugre.md"}, groups["Friction laws"])
        for name, pages in groups.items():
            self.assertIsInstance(pages, list, name)
            self.assertLess(len(pages), 12, name)

    @unittest.skipUnless(shutil.which("node"), "runs the script of the search")
    def test_search_finds_what_users_type_at_its_page(self):
        pages, titles = [], {}

        def name(entries):
            for entry in entries:
                for title, to in entry.items():
                    if isinstance(to, str):
                        titles[to] = title
                    else:
                        name(to)
        name(self.stage.nav)
        for path, text in self.stage.files.items():
            if not path.endswith(".md"):
                continue
            place = re.sub(r"(README)?\.md$", lambda m: "index.html" if m[1] else ".html", path)
            parts = re.split(r"^#+ +(.*)$", text, flags=re.M)
            pages.append({"location": place, "title": titles.get(path, parts[1] if parts[1:] else path),
                          "text": text, "answers": self.stage.answers.get(path, "")})
            pages += [{"location": f"{place}#{i}", "title": title, "text": words, "answers": ""}
                      for i, (title, words) in enumerate(zip(parts[1::2], parts[2::2]))]
        wanted = {"restart": "concepts/snapshots", "installation": "howto/packages",
                  "drag mouse": "howto/viewer", "cut": "concepts/cutting", "budget": "concepts/budget",
                  "snapshots": "concepts/snapshots", "mesh file": "reference/mesh_files"}
        script = ("let s=require(process.argv[1]), i = JSON.parse(require('fs').readFileSync(0));"
                  "console.log(JSON.stringify(i.queries.map(q=>s.rank(i.pages, q.split(' '))[0].location)))")
        said = subprocess.run(["node", "-e", script, str(ROOT / "cmake/docs/theme/search.js")],
                              input=json.dumps({"pages": pages, "queries": list(wanted)}), text=True,
                              capture_output=True, check=True).stdout
        for found, (query, page) in zip(json.loads(said), wanted.items()):
            self.assertEqual(found.partition("#")[0], f"libdeform/doc/{page}.html", query)


if __name__ == "__main__":
    unittest.main()
