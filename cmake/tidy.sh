#!/bin/sh
# tidy.sh JOBS [FILE...]: clang-tidy with the checks of .clang-tidy on these files, or on the library and its
# plugins. It reads how clang compiles them; gcc has options that it does not know.
set -eu
cd "$(dirname "$0")/.."
command -v clang-tidy >/dev/null || { echo "clang-tidy is not installed"; exit 77; }
jobs=$1
shift
cmake --preset clang -DDEFORM_TESTS=ON -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >/dev/null
[ $# -gt 0 ] || set -- $(git ls-files 'libdeform/src/*.cpp' 'plugins/*.cpp')
printf '%s\n' "$@" | xargs -P "$jobs" -n 1 clang-tidy --quiet -p build/clang
