#!/usr/bin/env python3
"""Can what was linked with a library of ABI 1 start with the one that is built here? SONAME, and every symbol
with its version, against what baseline/LIBRARY.abi keeps (abidw); abidiff compares, where abigail-tools is
installed. Symbols may be added. Types are compared by baseline.py, whose headers have them all: the library
is looked at as it is installed, stripped.

built.py READELF STORED_DIR LIBRARY...           compares; exit 77 where abidiff was not there
built.py READELF STORED_DIR LIBRARY... --self    spoils what is stored in ways that must be found
built.py READELF STORED_DIR LIBRARY... --write   stores again: once per version, before its release
"""
import atexit
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# Each changes what is stored once, and must be found.
SPOILT = [("a function that is gone", r"(<elf-symbol name='dfm_)(\w+)('.*type='func-type')", r"\1gone_\2\3"),
          ("another version", r"(<elf-symbol name='dfm_\w+' version=')DEFORM\w*_0", r"\1DEFORM_X"),
          ("another SONAME", r"soname='(\w+)\.so\.0'", r"soname='\1.so.9'")]


def run(*argv, fine=(0,)):
    done = subprocess.run([str(a) for a in argv], capture_output=True, text=True)
    if done.returncode not in fine:
        sys.exit(" ".join(map(str, argv)) + f" failed:\n{done.stdout}{done.stderr}")
    return done.stdout, done.returncode


def soname(readelf, library):
    return re.search(r"soname: \[([^\]]+)\]", run(readelf, "-d", library)[0]).group(1)


def differences(readelf, text, library, abidiff):
    """Sentences: what a program that knows the stored library lacks in this one."""
    out = []
    stored, now = re.search(r"soname='([^']+)'", text).group(1), soname(readelf, library)
    if stored != now:
        out.append(f"{library} is called {now}, and was {stored}: no program that is built finds it")
    if abidiff:
        with tempfile.NamedTemporaryFile("w", suffix=".abi") as file:
            file.write(text)
            file.flush()
            # 4: something changed, additions as well; 8: what is built is broken by it
            said, code = run(abidiff, file.name, library, fine=(0, 4, 8, 12))
        if code & 8 or re.search(r"[1-9]\d* Removed", said):
            out.append(said)
    return out


def main():
    readelf, folder, *libraries = sys.argv[1:]
    mode = libraries.pop() if libraries[-1].startswith("--") else ""
    abidiff, failed = shutil.which("abidiff"), False
    scratch = pathlib.Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, scratch)
    for built in map(pathlib.Path, libraries):
        library = scratch / built.name
        run("strip", "-o", library, built)
        stored = pathlib.Path(folder) / f"{library.name.split('.')[0]}.abi"
        if mode == "--write":
            run("abidw", "--no-show-locs", "--no-corpus-path", "--no-comp-dir-path",
                "--no-elf-needed", "--drop-undefined-syms", "--out-file", stored, library)
            continue
        text = stored.read_text()
        if mode == "--self":
            for what, pattern, by in SPOILT:
                spoilt, n = re.subn(pattern, by, text, count=1)
                if n != 1:
                    sys.exit(f"{what}: nothing to spoil in {stored}")
                if not differences(readelf, spoilt, library, abidiff) and (abidiff or "SONAME" in what):
                    sys.exit(f"{what}: not found")
                print(f"{library.name}: {what}: found")
            continue
        for sentence in differences(readelf, text, library, abidiff):
            print(sentence)
            failed = True
    if failed:
        print("A function that is gone or has another version breaks programs that are built: take it back "
              "(libdeform/doc/reference/abi.md).")
    return 1 if failed else 0 if abidiff or mode else 77


if __name__ == "__main__":
    sys.exit(main())
