#!/usr/bin/env bash
# get_blender.sh [DIR]: prints the path of a real Blender for the tests, and sets one up in DIR if there is none.
#
# $BLENDER, if set, is taken as it is. Otherwise Debian sid, which has Blender 5.2, is unpacked into DIR (2 GB, a minute or two; needs root
# and debootstrap on a Debian machine), and DIR/blender runs it there: it sees the current folder and /tmp at their usual paths.
set -euo pipefail
if [ -n "${BLENDER:-}" ]; then command -v "$BLENDER"; exit; fi
dir=$(realpath -m "${1:-${XDG_CACHE_HOME:-$HOME/.cache}/vlp-bpt/blender}")
packages=(blender python3-cattr python3-requests python3-numpy) # Debian's Blender does not name what its extension manager imports
fail() { echo "get_blender.sh: $1" >&2; exit 1; }

if [ ! -e "$dir/ready" ]; then
  [ "$(id -u)" = 0 ] || fail "setting up a Blender needs root; or name an installed one: BLENDER=/path/to/blender"
  command -v debootstrap >/dev/null || fail "debootstrap is missing: apt-get install debootstrap; or name an installed Blender: BLENDER=/path/to/blender"
  mirror=$( (grep -rhoE '(https?|file)://[^ ]+/debian/?( |$)' /etc/apt/sources.list /etc/apt/sources.list.d 2>/dev/null || true) | sed -n '1s/ *$//p')
  rm -rf "$dir"
  mkdir -p "$dir"
  {
    debootstrap --variant=minbase sid "$dir/root" "${mirror:-http://deb.debian.org/debian}"
    chroot "$dir/root" apt-get -o Acquire::Check-Valid-Until=false update -q
    DEBIAN_FRONTEND=noninteractive chroot "$dir/root" apt-get install -y -q --no-install-recommends "${packages[@]}"
    chroot "$dir/root" apt-get clean
  } >"$dir/log" 2>&1 || { tail -5 "$dir/log" >&2; fail "setting up Blender failed; the whole log is in $dir/log"; }
  touch "$dir/ready"
fi

cat >"$dir/blender" <<'WRAPPER'
#!/usr/bin/env bash
# Runs the Blender of the tree beside this file, in a mount namespace of its own.
root=$(dirname "$(realpath "$0")")/root
exec unshare --mount bash -euc '
  root=$1 here=$2; shift 2
  mount -t proc proc "$root/proc"
  mount --bind /dev "$root/dev"
  for folder in /tmp "$here"; do mkdir -p "$root$folder"; mount --bind "$folder" "$root$folder"; done
  exec chroot "$root" /usr/bin/env -u PYTHONPATH -u PYTHONHOME -u LD_LIBRARY_PATH -u LD_PRELOAD \
    HOME=/root LANG=C.UTF-8 PATH=/usr/bin:/bin bash -c "cd \"\$1\"; shift; exec blender \"\$@\"" _ "$here" "$@"
' _ "$root" "$PWD" "$@"
WRAPPER
chmod +x "$dir/blender"
echo "$dir/blender"
