#!/bin/sh
# The form of all C and C++ files: writes it, or with "check" names the files that differ from it. The version
# of clang-format is fixed, since versions differ in details; pip fetches it once into build/tools.
set -eu
cd "$(dirname "$0")/.."
version=23.1.5
tool=build/tools/clang-format-$version
python=/usr/bin/python3   # the set-up's own, as in cmake/DeformPython.cmake
[ -x "$python" ] || python=python3
if [ ! -x $tool/clang_format/data/bin/clang-format ]; then
  if ! "$python" -m pip install --quiet --disable-pip-version-check --no-deps --target $tool \
    "clang-format==$version"; then
    echo "clang-format $version is not to be had: pip could not install it; the form is not checked"
    exit 77
  fi
fi
files=$(mktemp)
trap 'rm -f "$files"' EXIT
git -c safe.directory='*' ls-files -z '*.c' '*.h' '*.cpp' '*.hpp' >"$files"
case ${1:-write} in
  write) xargs -0r $tool/clang_format/data/bin/clang-format -i <"$files" ;;
  check) xargs -0r $tool/clang_format/data/bin/clang-format --dry-run --Werror <"$files" ;;
  *) echo "usage: cmake/format.sh [write|check]"; exit 2 ;;
esac
