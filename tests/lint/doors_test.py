#!/usr/bin/env python3
"""cmake/fresh.sh: a build folder of a tree that was moved, or of another generator, is configured again; one
that fits, and one that the user made, stay as they are.

doors_test.py SOURCE_DIR
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

FRESH = "cmake/fresh.sh"


class Doors(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="deform doors ü ")
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name) / "tree"
        (self.root / "cmake").mkdir(parents=True)
        shutil.copy(SOURCE / FRESH, self.root / FRESH)

    def configured(self, name, source, generator="Ninja"):
        """What a configured build folder holds, as far as it matters here."""
        build = self.root / "build" / name
        (build / "CMakeFiles").mkdir(parents=True)
        (build / "build.ninja").touch()
        (build / "object.o").touch()
        (build / "CMakeCache.txt").write_text(
            f"CMAKE_GENERATOR:INTERNAL={generator}\nCMAKE_HOME_DIRECTORY:INTERNAL={source}\n")
        return build

    def fresh(self):
        return subprocess.run([self.root / FRESH], check=True, capture_output=True, text=True).stdout

    def names(self, build):
        return sorted(path.name for path in build.iterdir())

    def test_a_moved_tree(self):
        build = self.configured("release", self.root.parent / "where it was")
        self.assertIn("build/release was configured by Ninja for", self.fresh())
        self.assertEqual(self.names(build), ["object.o"])

    def test_another_generator(self):
        build = self.configured("asan", self.root, "Unix Makefiles")
        self.assertIn("build/asan was configured by Unix Makefiles", self.fresh())
        self.assertEqual(self.names(build), ["object.o"])

    def test_what_stays(self):
        link = self.root.parent / "link"
        link.symlink_to(self.root)
        kept = [self.configured("release", self.root), self.configured("bench", link),
                self.configured("mine", "/elsewhere")]
        self.assertEqual(self.fresh(), "")
        for build in kept:
            self.assertEqual(len(self.names(build)), 4)


if __name__ == "__main__":
    SOURCE = pathlib.Path(sys.argv.pop(1))
    unittest.main()
