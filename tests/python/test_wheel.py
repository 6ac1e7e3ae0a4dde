"""The wheel from this build, installed into a fresh environment, used in another folder: demo, ten lines,
plugins, command, picture. No registry is asked: NumPy is the system's."""
import importlib.util
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock
import zipfile

SOURCE = pathlib.Path(os.environ["DEFORM_SOURCE"])
GUIDE = SOURCE / "libdeform" / "doc" / "howto" / "python.md"


def clean():
    """Nothing of this build or of its caller's Python."""
    drop = re.compile(r"DEFORM_|PYTHON|LD_LIBRARY_PATH|VIRTUAL_ENV|PIP_")
    return {k: v for k, v in os.environ.items() if not drop.match(k)}


class Wheel(unittest.TestCase):
    def test_installed_elsewhere(self):
        began = time.monotonic()
        with tempfile.TemporaryDirectory(suffix=" with space") as name:
            folder = pathlib.Path(name)
            # the system's pip, where it has one: a venv's own takes seconds to unpack
            has = importlib.util.find_spec("pip") and sys.prefix == sys.base_prefix
            own = ["--without-pip"] if has else []
            make = [sys.executable, "-m", "venv", "--system-site-packages", *own, folder / "venv"]
            subprocess.run(make, check=True, env=clean())
            python = folder / "venv" / "bin" / "python"
            pip = [python, "-m", "pip", "--disable-pip-version-check", "-q"]
            subprocess.run([*pip, "wheel", SOURCE, "--no-deps", "--no-index", "-w", folder / "dist",
                            "--config-settings", f"prebuilt={os.environ['DEFORM_BUILD']}"], check=True,
                           env=clean())
            wheel, = (folder / "dist").iterdir()
            self.assertRegex(wheel.name, r"^deform-\d+\.\d+\.\d+-py3-none-(many)?linux\w+\.whl$")
            (folder / "other").mkdir()
            installing = time.monotonic()
            subprocess.run([*pip, "install", "--no-index", wheel], check=True, env=clean())
            said = subprocess.run([python, "-m", "deform", "demo"], cwd=folder / "other", capture_output=True,
                                  text=True, env=clean())
            demo = time.monotonic() - installing
            self.assertEqual(said.returncode, 0, said.stderr)
            self.assertRegex(said.stdout, r"picture deform_demo.two_cylinders\.png")
            pictures = sorted((folder / "other" / "deform_demo").rglob("*.png"))
            self.assertIn("two_cylinders.png", [picture.name for picture in pictures])
            for picture in pictures:
                self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
                self.assertGreater(picture.stat().st_size, 1000, picture)
            runs = json.loads((folder / "other" / "deform_demo" / "summary.json").read_text())["runs"]
            self.assertLess(runs["with friction"]["upper"]["moved_m"], 0.3)
            self.assertGreater(runs["without friction"]["upper"]["moved_m"], 1)
            first = re.search(r"^```python\n(.*?)^```", GUIDE.read_text(), re.M | re.S).group(1)
            program = folder / "other" / "ten lines.py"
            program.write_text(first + "import numpy\nprint(deform.__file__, len(world.context.types))\n")
            done = subprocess.run([python, program], cwd=folder / "other", capture_output=True, text=True,
                                  env=clean())
            self.assertEqual(done.returncode, 0, done.stderr)
            last = done.stdout.splitlines()[-1]
            self.assertIn(str(folder / "venv"), last)
            self.assertGreater(int(last.split()[-1]), 10)  # laws and models, loaded from the package's folder
            self.assertEqual((folder / "other" / "ball.png").read_bytes()[:4], b"\x89PNG")
            first_picture = time.monotonic() - began
            print(f"pip install and the demo with its picture: {demo:.1f} s, aim 60 s; "
                  f"environment, wheel and both programs: {first_picture:.1f} s")
            shutil.copy(SOURCE / "tests" / "python" / "test_law.py", folder / "other")
            law = "import test_law; print(test_law.Bristle().check(only=['F01', 'F02']).column('result'))"
            said = subprocess.run([python, "-c", law], cwd=folder / "other", capture_output=True, text=True,
                                  env=clean())
            self.assertEqual(said.stdout.strip(), "['pass', 'pass']", said.stderr)
            version = subprocess.run([folder / "venv" / "bin" / "deform", "--version"], capture_output=True,
                                     text=True, env=clean(), check=True).stdout
            self.assertIn(re.search(r"-([\d.]+)-py3", wheel.name).group(1), version)
            # other words of python -m deform are those of the command
            plan = ("import runpy, sys; from deform._library import demo_scene; sys.argv[1:] = "
                    "['explain', str(demo_scene())]; runpy.run_module('deform', run_name='__main__')")
            said = subprocess.run([python, "-c", plan], cwd=folder / "other", capture_output=True, text=True,
                                  env=clean())
            self.assertIn("org.deform.coulomb", said.stdout, said.stderr)
            study = subprocess.run([folder / "venv" / "bin" / "deform", "sweep", "none.json"], text=True,
                                   capture_output=True, env=clean(), cwd=folder / "other")
            self.assertEqual(study.stderr, "deform: none.json: cannot be opened: No such file or directory\n")
            # by an interpreter without the package, whose folder must not hide the standard library
            packages, = (folder / "venv" / "lib").glob("python*/site-packages")
            (packages / "argparse.py").write_text("raise SystemExit('not the standard library')")
            other = subprocess.run([packages / "deform" / "native" / "bin" / "deform", "sweep", "none.json"],
                                   text=True, capture_output=True, cwd=folder / "other",
                                   env={**clean(), "DEFORM_PYTHON": sys.executable})
            self.assertEqual(other.stderr, study.stderr)
            with zipfile.ZipFile(wheel) as zipped:
                files = zipped.namelist()
                inside, = (json.loads(zipped.read(name)) for name in files if name.endswith(".spdx.json"))
            self.assertIn(("CONTAINS", "SPDXRef-libpng16-16"), {
                (row["relationshipType"], row["relatedSpdxElement"]) for row in inside["relationships"]})
            for needed in ("deform/py.typed", "deform/native/bin/deform-cost",
                           "deform/native/lib/libdeform.so.0", "deform/native/include/deform/plugin.h",
                           "deform/demo.py", "deform/native/share/deform/data/cylinder_slim.msh"):
                self.assertIn(needed, files)

    def test_tag_names_the_oldest_system_that_has_what_is_asked_for(self):
        sys.path.insert(0, str(SOURCE / "bindings" / "python"))
        self.addCleanup(sys.path.pop, 0)
        import wheel_backend
        for version, first in (("GLIBC_2.2.5", 28), ("GLIBC_2.36", 36), ("GLIBCXX_3.4", 28),
                               ("GLIBCXX_3.4.30", 35), ("GLIBCXX_3.4.999", None), ("CXXABI_1.3.13", 34),
                               ("GCC_12.0.0", 35), ("ZLIB_1.2.9", 28), ("GLIBC_PRIVATE", None)):
            self.assertEqual(wheel_backend._oldest(version), first, version)
        library = pathlib.Path(os.environ["DEFORM_LIBRARY"])
        self.assertRegex(wheel_backend._tag([("lib/libdeform.so.0", library)]),
                         r"^py3-none-manylinux_2_\d\d_\w+$")
        with tempfile.TemporaryDirectory() as name:  # what nobody else has
            source, other = pathlib.Path(name) / "a.c", pathlib.Path(name) / "libother.so"
            source.write_text("int a;")
            subprocess.run([os.environ["CC"], "-shared", "-Wl,-soname,libother.so", source, "-o", other],
                           check=True)
            made = pathlib.Path(name) / "libb.so"
            subprocess.run([os.environ["CC"], "-shared", "-Wl,--no-as-needed", source, other, "-o", made],
                           check=True)
            both = [("lib/libb.so", made), (f"lib/{other.name}", other)]
            self.assertIn("manylinux", wheel_backend._tag(both))
            self.assertRegex(wheel_backend._tag(both[:1]), r"^py3-none-linux_\w+$")
            english = wheel_backend.asked_of_system(library)  # also for those who speak another language
            self.assertTrue(english[1])
            french = pathlib.Path(name) / "objdump"
            french.write_text(f"#!/bin/sh\n{shutil.which('objdump')} \"$@\" | if [ \"$LC_ALL\" = C ]\n"
                              f"then cat; else sed 's/required from/requis par/'; fi\n")
            french.chmod(0o755)
            with unittest.mock.patch.dict(os.environ, LC_ALL="fr_FR.UTF-8",
                                          PATH=f"{name}:{os.environ['PATH']}"):
                self.assertEqual(wheel_backend.asked_of_system(library), english)

    def test_no_symbol_is_newer_than_the_oldest_system(self):
        """manylinux_2_34: RHEL 9 and what is younger. A newer glibc than Debian 12's gives newer symbols to
        every program."""
        if float(os.confstr("CS_GNU_LIBC_VERSION").split()[1]) > 2.36:
            self.skipTest("a glibc newer than Debian 12's")
        sys.path.insert(0, str(SOURCE / "bindings" / "python"))
        self.addCleanup(sys.path.pop, 0)
        import wheel_backend
        build = pathlib.Path(os.environ["DEFORM_BUILD"])
        files = [path for place in ("lib/*.so*", "lib/deform/plugins-*/*.so", "bin/deform*")
                 for path in build.glob(place) if path.is_file() and not path.is_symlink()]
        self.assertGreater(len(files), 25)
        for path in files:
            for version in wheel_backend.asked_of_system(path)[1]:
                self.assertLessEqual(wheel_backend._oldest(version) or 99, 34,
                                     f"{path} needs {version}: objdump -T {path} | grep {version}")

    def test_a_release_build_of_this_tree_is_packed(self):
        sys.path.insert(0, str(SOURCE / "bindings" / "python"))
        self.addCleanup(sys.path.pop, 0)
        import wheel_backend
        with tempfile.TemporaryDirectory() as name, unittest.mock.patch.object(
                wheel_backend, "ROOT", pathlib.Path(name)):
            self.assertIsNone(wheel_backend.release_build())
            build = pathlib.Path(name) / "build" / "release"
            build.mkdir(parents=True)
            for place, kind, shared, libdir, taken in (
                    ("/moved", "Release", "ON", "lib", False), (name, "Debug", "ON", "lib", False),
                    (name, "Release", "OFF", "lib", False),
                    (name, "Release", "ON", "lib/x86_64-linux-gnu", False),
                    (name, "Release", "ON", "lib", True)):
                (build / "CMakeCache.txt").write_text(
                    f"CMAKE_BUILD_TYPE:STRING={kind}\nCMAKE_HOME_DIRECTORY:INTERNAL={place}\n"
                    f"DEFORM_SHARED:BOOL={shared}\nCMAKE_INSTALL_LIBDIR:PATH={libdir}\n")
                self.assertEqual(wheel_backend.release_build(), build if taken else None)
            (build / "lib" / "x86_64-linux-gnu").mkdir(parents=True)
            (build / "lib" / "x86_64-linux-gnu" / "libdeform.so.0").touch()
            with self.assertRaisesRegex(SystemExit, "installs no libdeform.so to lib"):
                list(wheel_backend.native_files(build))
            commands = []
            with unittest.mock.patch.object(wheel_backend, "_run", lambda *words: commands.append(words)):
                for settings, used in (({}, build), ({"prebuilt": "no"}, build.parent / "wheel"),
                                       ({"cmake": "-DX=1"}, build.parent / "wheel")):
                    commands.clear()
                    wheel_backend._installed(pathlib.Path(name) / "prefix", settings)
                    configured = [words for words in commands if "-S" in words]
                    self.assertEqual(len(configured), int(used != build))
                    self.assertIn(used, commands[-1])

    def test_without_a_build_it_configures_one(self):
        sys.path.insert(0, str(SOURCE / "bindings" / "python"))
        self.addCleanup(sys.path.pop, 0)
        import wheel_backend
        with tempfile.TemporaryDirectory(suffix=" with space") as name:
            build = pathlib.Path(name) / "build"
            wheel_backend.configure(build, {"cmake": "-DDEFORM_RENDER=OFF"})
            cache = (build / "CMakeCache.txt").read_text()
            for entry in ("DEFORM_RENDER:BOOL=OFF", "CMAKE_DISABLE_FIND_PACKAGE_HDF5:PATH=ON",
                          "DEFORM_TESTS:BOOL=OFF", "DEFORM_ODE:STRING=OFF",
                          "DEFORM_BULLET:STRING=OFF", "CMAKE_INSTALL_LIBDIR:PATH=lib"):
                self.assertIn(entry, cache.replace(":UNINITIALIZED=", ":PATH="))
            targets = subprocess.run(["cmake", "--build", build, "--target", "help"], check=True,
                                     capture_output=True, text=True).stdout
            for target in ("deform_tools", "deform_python_native"):
                self.assertIn(target, targets)
            with self.assertRaisesRegex(SystemExit, "is no build folder of this tree"):
                wheel_backend.build_wheel(name, {"prebuilt": name})


if __name__ == "__main__":
    unittest.main()
