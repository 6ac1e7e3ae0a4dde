#!/bin/sh
# fresh.sh -- lets the doors configure again where CMake would refuse to continue: in a build folder that was
# configured for another source folder (the tree was moved or copied) or by another generator than Ninja.
# Objects stay.
set -eu
cd "$(dirname "$0")/.."
for name in release bench fuzz asan tsan; do
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
