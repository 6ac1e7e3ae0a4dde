#!/bin/sh
# setup.sh SET... -- installs the packages of those sets of deps.txt that are missing, and nothing where all
# are there. As another user than root it prints the line to run and stops: a build has no business with
# somebody's password. On other systems it names the packages until the tree is configured.
set -eu
list=$(dirname "$0")/deps.txt
rows=$(for set in "$@"; do sed -n "s/^$set  *//p" "$list"; done)
names=$(echo "$rows" | sed 's/ .*//')
if ! command -v dpkg-query >/dev/null; then
  lacks=
  for program in cmake ninja cc c++; do
    command -v $program >/dev/null || lacks="$lacks $program"
  done
  if [ -n "$lacks" ] || [ ! -e "$(dirname "$0")/../build/release/build.ninja" ]; then
    echo "deform: this is not a Debian system; make sure that it has what these packages hold:" $names >&2
  fi
  [ -z "$lacks" ] || { echo "deform: not found:$lacks; install them, then call make again" >&2; exit 1; }
  exit 0
fi
present=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' $(echo $names | tr '|' ' ') 2>/dev/null |
  sed -n 's/^installed //p' || true)
is_present() { echo "$present" | grep -qx "$1"; }
# Of names between bars the first that is installed or that apt knows, else the last.
chosen() {
  for name in $(echo "$1" | tr '|' ' '); do
    if is_present "$name" || [ -n "$(apt-cache madison "$name" 2>/dev/null)" ]; then break; fi
  done
  echo "$name"
}
look() {
  missing=
  for name in $names; do
    case $name in *'|'*) name=$(chosen "$name") ;; esac
    case "$missing " in *" $name "*) continue ;; esac
    is_present "$name" || missing="$missing $name"
  done
}
look
[ -n "$missing" ] || exit 0

echo "deform: missing Debian packages:"
for name in $missing; do
  echo "$rows" | sed -n "s/^\([^ ]*|\)\{0,1\}$name\(|[^ ]*\)\{0,1\}  */  $name: /p"
done
install="apt-get install -y --no-install-recommends"
if [ "$(id -u)" != 0 ]; then
  echo "deform: installing them needs root; run this line, then call make again:" >&2
  echo "  sudo $install$missing" >&2
  exit 1
fi
export DEBIAN_FRONTEND=noninteractive
if ! apt-get update -q; then
  echo "deform: apt-get update failed; check network and /etc/apt/sources.list" >&2
  exit 1
fi
look   # now that apt knows what there is
$install$missing || { echo "deform: apt could not install:$missing; see its message above" >&2; exit 1; }
