#!/usr/bin/python3 -IS
"""A compiler launcher (CMAKE_CXX_COMPILER_LAUNCHER) for tests that build the library once more: a file of the
tree whose command is the one that has compiled it already is not compiled again; its object is taken from
there. Where the command is another one, the compiler runs. So such a test sees every command, every link and
every installed file of its build, and costs no minutes.

The environment says where: READY (a folder that prepare() has filled). Source and build folder of the tree
that is being built are told from the command and the folder that it runs in, or by READY_BUILD.
"""
import os
import sys

# Warnings change no object, and 64 bits are what this compiler makes anyway.
PASSED_OVER = ("-W", "-w", "-MD", "-m64", "-pipe", "-fdiagnostics")
UNDONE = ("-ffast-math", "-fno-math-errno", "-fno-trapping-math")  # by -fno-fast-math, where it stands later


def source_of(command):
    """The tree of the compiled file; of files compiled together that of the headers."""
    for word in reversed(command):
        for room in ("/libdeform/src/", "/plugins/", "/bindings/"):
            if room in word and word.startswith("/") and "/Unity/" not in word:
                return word[:word.rindex(room)]
    headers = [word for word in command if word.startswith("-I/") and word.endswith("/libdeform/include")]
    return headers[0][2:-len("/libdeform/include")] if headers else "-"


def needs(command, source, build):
    """(file below the source tree or the build folder, what its object depends on, object, dependency file)
    of a command; None where it compiles nothing of the tree."""
    flags, target, file, depends = [], None, None, None
    words = iter(command)
    for word in words:
        if word == "-o":
            target = next(words)
        elif word == "-c":
            file = next(words)
        elif word == "-MF":
            depends = next(words)
        elif word in ("-MT", "-isystem"):
            other = next(words)
            flags += [word + other] if word == "-isystem" else []
        elif word == "-fno-fast-math":
            flags = [flag for flag in flags if flag not in UNDONE]
        elif word.startswith("-") and not word.startswith(PASSED_OVER):
            flags.append(word)
    tree = next((tree for tree in (build, source) if file and file.startswith(tree + "/")), None)
    if not tree or not target:
        return None
    file = file[len(tree) + 1:]
    # put in order last: where the trees lie must not decide about it
    text = " ".join(sorted({flag.replace(build, "BUILD").replace(source, "SOURCE") for flag in flags}))
    return file, text, target, depends


def settings(build, *wanted):
    """Arguments of CMake that make the commands of another tree those of the build."""
    import pathlib
    cache = (pathlib.Path(build) / "CMakeCache.txt").read_text().split("\n")
    wanted = wanted or ("CMAKE_BUILD_TYPE:", "CMAKE_C_COMPILER:", "CMAKE_CXX_COMPILER:", "DEFORM_UNITY:")
    return ["-D" + line for line in cache if line.startswith(wanted)]


def prepare(folder, source, build):
    """Fills the folder from a build that has compiled everything: a file per source, of lines `object` and
    `what it depends on`."""
    import json
    import pathlib
    import shlex
    rows = {}
    for entry in json.loads((pathlib.Path(build) / "compile_commands.json").read_text()):
        found = needs(shlex.split(entry["command"]), str(source), str(build))
        if found:
            made = pathlib.Path(entry["directory"]) / found[2]
            if made.exists():
                rows.setdefault(found[0].replace("/", "!"), []).append(f"{made}\n{found[1]}\n")
    folder.mkdir(parents=True)
    for name, lines in rows.items():
        (folder / name).write_text("".join(lines))
    return {"READY": str(folder), "CMAKE_C_COMPILER_LAUNCHER": os.path.abspath(__file__),
            "CMAKE_CXX_COMPILER_LAUNCHER": os.path.abspath(__file__)}


def main():
    command = sys.argv[1:]
    found = needs(command, source_of(command), os.environ.get("READY_BUILD") or os.getcwd())
    if found:
        file, text, target, depends = found
        try:
            with open(os.environ["READY"] + "/" + file.replace("/", "!")) as rows:
                lines = rows.read().split("\n")
        except FileNotFoundError:
            lines = []
        for made, of in zip(lines[::2], lines[1::2]):
            if of == text:
                if os.path.lexists(target):
                    os.unlink(target)
                os.symlink(made, target)
                if depends:
                    with open(depends, "w") as out:
                        out.write(f"{target}:\n")
                return
        if file.startswith(("libdeform/", "plugins/")):
            with open(os.environ["READY"] + "/compiled", "a") as out:
                out.write(f"{file}\n  asked: {text}\n" + "".join(f"  ready: {of}\n" for of in lines[1::2]))
    os.execvp(command[0], command)


if __name__ == "__main__":
    main()
