#!/usr/bin/env bash
# Tries packages and archives, each in a folder that holds nothing else and is the root of the program's file system.
#
#   packaging/try.sh FILE...        .deb and .tar.gz, as packaging/deb.sh and packaging/static.sh make them
#
# A package is installed, measured with, and removed. Beside it are the files of the packages that it depends on, and no others. An archive
# has nothing beside it. A program for another architecture runs in QEMU's emulator of user programs (Debian: qemu-user-static).
# Exits with 77 if that is missing.
set -euo pipefail

# Only root may change the root of a file system; others are root in a space of their own.
if [ "$(id -u)" != 0 ]; then exec unshare --user --map-root-user --mount "$0" "$@"; fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

fail() {
  echo "$*" >&2
  exit 1
}

# measures ROOT COMMAND...: the program prints its version, looks for devices, and measures a simulated tile.
measures() {
  local root=$1 version
  shift
  version=$(env -i /usr/sbin/chroot "$root" "$@" --version)
  [ "$version" = "epirig $expected" ] || fail "it says that it is \"$version\", and its file's name epirig $expected"
  # It has drivers for cameras and ports, and finds none here: exit code 3.
  local devices=0 told
  told=$(env -i /usr/sbin/chroot "$root" "$@" devices 2>&1) || devices=$?
  [ "$devices" = 3 ] && [[ $told == *"no camera found in /dev/video* (V4L2)"* ]] || fail "it does not look for cameras: $told"
  env -i /usr/sbin/chroot "$root" "$@" demo --size 128 --frames 11 --out /demo
  for result in disparity.png height_mm.tiff match.json; do
    [ -s "$root/demo/results/$result" ] || fail "the measurement left no $result"
  done
  rm -r "$root/demo"
}

# The packages that a list of dependencies names, and those that these depend on, one a line. They must be installed here.
needed() {
  local open=$1 done='' name
  while [ -n "$open" ]; do
    name=$(sed 's/^[ ,]*\([a-z0-9.+-]*\).*/\1/' <<< "$open")
    open=$(sed 's/^[ ,]*[^,]*,\?//' <<< "$open")
    if [ -z "$name" ] || [[ " $done " == *" $name "* ]]; then continue; fi
    done+=" $name"
    open+=,$(dpkg-query --show --showformat '${Depends}' "$name")
  done
  tr ' ' '\n' <<< "$done" | sed '/^$/d'
}

try_package() {
  local package=$1 root=$work/root names file
  expected=$(dpkg-deb --field "$package" Version)
  expected=${expected%-*}
  [ "$(dpkg-deb --field "$package" Architecture)" = "$(dpkg --print-architecture)" ] ||
    { echo "SKIPPED: $package is for another architecture"; missing=1; return; }
  mkdir -p "$root/var/lib/dpkg/"{info,updates}
  names=$(needed "$(dpkg-deb --field "$package" Depends)")
  echo "beside it:" $names
  for name in $names; do
    # dpkg compares versions with these.
    dpkg-query --status "$name"
    echo
  done > "$root/var/lib/dpkg/status"
  # Where /lib leads to /usr/lib, packages may name either.
  for merged in lib lib64; do
    if [ -L "/$merged" ]; then ln -s "usr/$merged" "$root/$merged" && mkdir -p "$root/usr/$merged"; fi
  done
  dpkg-query --listfiles $names | while read -r file; do
    if [ -f "$file" ]; then echo ".$(realpath "$(dirname "$file")")/$(basename "$file")"; fi
  done | sort --unique | tar --create --directory / --files-from - | tar --extract --no-same-owner --directory "$root"
  (cd "$root" && find . | LC_ALL=C sort) > "$work/before"
  dpkg --root="$root" --log=/dev/null --install "$package"
  (cd "$root" && md5sum --quiet --check <(dpkg-deb --ctrl-tarfile "$package" | tar --extract --to-stdout ./md5sums))
  measures "$root" /usr/bin/epirig
  # What belongs to it beside the program.
  for file in usr/share/man/man1/epirig.1.gz usr/share/man/man1/epirig-stage-move.1.gz usr/lib/udev/rules.d/70-epirig.rules \
    usr/share/bash-completion/completions/epirig usr/share/zsh/vendor-completions/_epirig \
    usr/share/fish/vendor_completions.d/epirig.fish usr/share/doc/epirig/copyright usr/share/doc/epirig/THIRD-PARTY.txt.gz; do
    [ -s "$root/$file" ] || fail "the package has no $file"
  done
  # A sample profile is one that the program takes.
  env -i /usr/sbin/chroot "$root" /usr/bin/epirig plan --rig /usr/share/doc/epirig/examples/sim.toml
  dpkg --root="$root" --log=/dev/null --purge epirig
  (cd "$root" && find . | LC_ALL=C sort) > "$work/after"
  diff "$work/before" "$work/after" | sed -n 's/^> //p' | grep -v '^./var/lib/dpkg/' > "$work/left" || true
  [ ! -s "$work/left" ] || fail "removed, the package leaves:" "$(cat "$work/left")"
  echo "$package: installed, measured, removed"
}

try_archive() {
  local archive=$1 root=$work/root target emulator=()
  target=$(basename "$archive" .tar.gz)
  expected=${target##*-v}
  target=${target#epirig-}
  mkdir -p "$root"
  tar --extract --file "$archive" --directory "$root" --strip-components=1 --no-same-owner
  local machine=${target%%-*}
  if [ "$machine" != "$(uname -m)" ]; then
    if ! command -v "qemu-$machine-static" > /dev/null; then
      echo "SKIPPED: $archive is for $machine; install qemu-user-static to try it here"
      missing=1
      return
    fi
    # It is linked statically, so that it needs nothing beside it.
    cp "$(command -v "qemu-$machine-static")" "$root/emulator"
    emulator=(/emulator)
  fi
  measures "$root" "${emulator[@]}" /epirig
  echo "$archive: unpacked, measured${emulator[*]:+ (in an emulator of $machine)}"
}

missing=0
for file in "$@"; do
  case $file in
    *.deb) try_package "$(realpath "$file")" ;;
    *.tar.gz) try_archive "$(realpath "$file")" ;;
    *) fail "$file: neither .deb nor .tar.gz" ;;
  esac
  rm -rf "$work/root"
done
[ "$missing" = 0 ] || exit 77
