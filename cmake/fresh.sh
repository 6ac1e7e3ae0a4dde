#!/bin/sh
# fresh.sh -- lets the doors configure again where CMake would refuse to continue: in a build folder that was
# configured for another source folder (the tree was moved or copied) or by another generator than Ninja.
# Objects stay. A folder in which nothing can be built ends with a sentence.
set -eu
cd "$(dirname "$0")/.."
here=$(pwd)
if [ ! -w . ] && [ ! -w build ]; then
  echo "deform: $here is not writable for $(id -un); copy it or build elsewhere: cmake -S $here -B FOLDER" >&2
  exit 1
fi
for name in release dev bench fuzz asan tsan clang static static_clang wasm arm64 windows wheel; do
  cache=build/$name/CMakeCache.txt
  [ -f "$cache" ] || continue
  source=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$cache")
  generator=$(sed -n 's/^CMAKE_GENERATOR:INTERNAL=//p' "$cache")
  if [ "$source" -ef . ] && [ "$generator" = Ninja ]; then
    continue
  fi
  echo "deform: build/$name was configured by $generator for $source; it is configured again"
  rm -rf "$cache" "build/$name/CMakeFiles" "build/$name/build.ninja"
done
