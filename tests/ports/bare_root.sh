#!/bin/sh
# bare_root.sh FOLDER SUITE [MIRROR or option of mmdebstrap..] -- the last commit on another Debian or Ubuntu
# with nothing installed: `make demo`, then the smoke test with warnings as errors, whose hash is the same
# everywhere. It needs root, mmdebstrap, the network, gigabytes. FOLDER is kept: chroot into it for more.
set -eu
source=$(realpath "$(dirname "$0")/../..")
root=$(realpath -m "$1") suite=$2
shift 2
clone="$root/srv/a clone"
mmdebstrap --variant=minbase --include=apt,ca-certificates,git,make "$suite" "$root" "$@"
git clone -q "$source" "$clone"
exec unshare --mount sh -euc '
  for folder in proc dev sys; do mount --rbind "/$folder" "$0/$folder"; done
  cp /etc/resolv.conf "$0/etc/resolv.conf"
  exec chroot "$0" sh -euc "cd \"/srv/a clone\" && make demo && cmake --preset release -DDEFORM_WERROR=ON &&
    cmake --build --preset release --target determinism_smoke_test &&
    build/release/bin/determinism_smoke_test"
' "$root"
