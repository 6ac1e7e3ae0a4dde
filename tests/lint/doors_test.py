#!/usr/bin/env python3
"""cmake/fresh.sh: a build folder of a tree that was moved, or of another generator, is configured again; one
that fits, and one that the user made, stay as they are. cmake/setup.sh on a system that is not Debian's names
the packages and the programs that are missing; on Debian it takes the names that the distribution has.

doors_test.py SOURCE_DIR
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

FRESH, SETUP, LIST, FORM = "cmake/fresh.sh", "cmake/setup.sh", "cmake/deps.txt", "cmake/format.sh"


class Doors(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="deform doors ü ")
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name) / "tree"
        (self.root / "cmake").mkdir(parents=True)
        for name in (FRESH, SETUP, LIST, FORM):
            shutil.copy(SOURCE / name, self.root / name)

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

    def set_up_elsewhere(self, *programs, **scripts):
        """On a system that has a few programs of a shell and these; without dpkg, if it is not among them."""
        folder = self.root.parent / "bin"
        folder.mkdir(exist_ok=True)
        for program in ("sed", "dirname", "tr", "grep"):
            if not (folder / program).exists():
                (folder / program).symlink_to(shutil.which(program))
        for program, script in [*((program, "") for program in programs), *scripts.items()]:
            (folder / program.replace("_", "-")).write_text(f"#!/bin/sh\n{script}\n")
            (folder / program.replace("_", "-")).chmod(0o755)
        return subprocess.run([self.root / SETUP, "doors"], env={"PATH": str(folder)}, capture_output=True,
                              text=True)

    def test_another_system(self):
        bare = self.set_up_elsewhere("cmake", "cc")
        self.assertEqual(bare.returncode, 1)
        self.assertIn("deform: not found: ninja c++; install them", bare.stderr)
        ready = self.set_up_elsewhere("ninja", "c++")
        self.assertEqual(ready.returncode, 0)
        self.assertIn("not a Debian system", ready.stderr)
        self.assertIn("libeigen3-dev", ready.stderr)
        self.configured("release", self.root)
        self.assertEqual(self.set_up_elsewhere().stderr, "")

    def test_names_between_bars(self):
        """The first that is installed or that apt knows; if there is none, apt says so of the last."""
        (self.root / LIST).write_text("doors  new|old    one\ndoors  later|now  two\n"
                                      "doors  gone|lost  three\ndoors  g++|cc     four\n")
        told = self.set_up_elsewhere(dpkg_query="echo installed old", id="echo 1000",
                                     apt_cache='case $2 in now | g++ | cc) echo "$2";; esac')
        self.assertEqual(told.returncode, 1)
        self.assertIn("sudo apt-get install -y --no-install-recommends now lost g++\n", told.stderr)
        self.assertEqual(told.stdout.splitlines()[1:], ["  now: two", "  lost: three", "  g++: four"])

    def test_a_moved_tree(self):
        build = self.configured("release", self.root.parent / "where it was")
        self.assertIn("build/release was configured by Ninja for", self.fresh())
        self.assertEqual(self.names(build), ["object.o"])

    def test_a_moved_tree_whose_wheel_was_built(self):
        for name in ("wheel", "clang", "static_clang"):
            build = self.configured(name, self.root.parent / "where it was")
            self.assertIn(f"build/{name} was configured by Ninja for", self.fresh())
            self.assertEqual(self.names(build), ["object.o"])

    def test_form_of_no_repository(self):
        version = re.search(r"^version=(\S+)$", (self.root / FORM).read_text(), re.M)[1]
        tool = self.root / f"build/tools/clang-format-{version}/clang_format/data/bin/clang-format"
        tool.parent.mkdir(parents=True)
        tool.symlink_to(shutil.which("true"))
        check = [self.root / FORM, "check"]
        self.assertNotEqual(subprocess.run(check, capture_output=True).returncode, 0)
        subprocess.run(["git", "-C", self.root, "init", "--quiet"], check=True)
        self.assertEqual(subprocess.run(check, capture_output=True).returncode, 0)

    def test_another_generator(self):
        build = self.configured("asan", self.root, "Unix Makefiles")
        self.assertIn("build/asan was configured by Unix Makefiles", self.fresh())
        self.assertEqual(self.names(build), ["object.o"])

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_a_tree_of_somebody_else(self):
        self.root.chmod(0o555)
        self.addCleanup(self.root.chmod, 0o755)
        done = subprocess.run([self.root / FRESH], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("is not writable for", done.stderr)

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
