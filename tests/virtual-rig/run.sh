#!/usr/bin/env bash
# Runs the tests of tests/virtual-rig on a virtual rig: a QEMU guest with the kernel's own camera driver `vivid` and its
# own USB serial driver `ftdi_sio`, so that epirig meets the real V4L2 and tty interfaces without any hardware. So it does with
# `uvcvideo`, whose camera the tests play over USB/IP (`vhci_hcd`).
#
#   tests/virtual-rig/run.sh [FILTER]          runs the tests whose names contain FILTER, by default all
#   tests/virtual-rig/run.sh --build [FILTER]  makes the guest only
#   tests/virtual-rig/run.sh --boot            runs the guest as it was made
#
# Everything lies in target/virtual-rig/ and is used again; nothing is installed. QEMU, the kernel and the guest's few programs
# are Debian's. Exit code 0: every test passed; 1: not; 77: something cannot be had, said in a line that begins with SKIPPED.
#
#   debs/ host/ guest/    packages; unpacked for this machine; unpacked for the guest
#   console.log           what the guest wrote in the last run
#   out/                  files that its tests sent out: the lines between `BEGIN FILE name` and `END FILE name`
#
# Epirig and its tests are those of the common build in target/release.
#
# EPIRIG_RIG_LIMIT_S is the longest that the guest may run, 3000 by default.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
part=
case ${1:-} in --build | --boot) part=$1 && shift ;; esac
filter=${1:-}
limit_s=${EPIRIG_RIG_LIMIT_S:-3000}
usb_serial_number=virtual-stage
mkdir -p "$root/target/virtual-rig"
# Relative names from here on: the path of a socket may have 107 characters at most.
cd "$root/target/virtual-rig"
mkdir -p debs host guest out

say() { echo "virtual rig: $*"; }
skip() { echo "SKIPPED: the virtual rig does not run: $*"; exit 77; }
fail() { say "$*"; exit 1; }

# --- Packages -------------------------------------------------------------------------------------------------------------

# Brings apt's lists up to date, once: they are missing in a fresh container, and old ones name packages that are gone.
lists_are_fresh=
refresh_lists() {
  [ -z "$lists_are_fresh" ] && [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null || return
  lists_are_fresh=yes
  apt-get update -qq >> apt.log 2>&1
}

# shellcheck disable=SC2329  # this and the next are called by name
alone() { echo "$@"; }
# The packages, and what they need that this machine lacks.
# shellcheck disable=SC2329
with_libraries() {
  echo "$@"
  apt-get install --simulate --no-install-recommends "$@" | awk '$1 == "Inst" { print $2 }'
}

# Fetches what `$resolve packages...` names into debs/partial.
download() {
  local resolve=$1 packages
  shift
  rm -rf debs/partial && mkdir debs/partial && packages=$("$resolve" "$@" 2>> apt.log | tr ' ' '\n' | sort -u) || return
  # shellcheck disable=SC2086  # names of packages have no spaces
  (cd debs/partial && apt-get download -qq $packages >> ../../apt.log 2>&1)
}

# fetch GROUP alone|with_libraries PACKAGE...: debs/GROUP appears only when it is complete.
fetch() {
  local group=$1
  shift
  [ ! -d "debs/$group" ] || return 0
  command -v apt-get > /dev/null || skip "there is no apt-get to fetch $group with"
  say "fetching $group"
  download "$@" || { refresh_lists && download "$@"; } || skip "apt-get cannot fetch $group; see $PWD/apt.log"
  mv debs/partial "debs/$group"
}

# unpack GROUP FOLDER [PATTERN...]: FOLDER appears only when it is complete.
unpack() {
  local group=$1 folder=$2 deb
  shift 2
  [ ! -d "$folder" ] || return 0
  rm -rf "$folder.partial" && mkdir "$folder.partial"
  for deb in "debs/$group"/*.deb; do
    dpkg-deb --fsys-tarfile "$deb" | tar -x -C "$folder.partial" --wildcards "$@"
  done
  mv "$folder.partial" "$folder"
}

# The kernel's package has its version in its name and so moves; without lists, the one that is already here will do.
kernel_package() {
  apt-cache depends linux-image-amd64 2>> apt.log | awk '$1 == "Depends:" && $2 ~ /^linux-image-[0-9]/ && !n++ { print $2 }' || true
}
find_kernel() {
  local here_already=(debs/linux-image-*)
  kernel=$(kernel_package)
  [ -n "$kernel" ] || kernel=$(basename "${here_already[-1]}")
  [ "$kernel" != 'linux-image-*' ] || { refresh_lists && kernel=$(kernel_package); } || true
  [[ $kernel == linux-image-[0-9]* ]] || skip "apt knows no linux-image-amd64; see $PWD/apt.log"
}

fetch_kernel() {
  find_kernel
  if [ ! -d "debs/$kernel" ]; then rm -rf debs/linux-image-* guest/linux-image-*; fi
  fetch "$kernel" alone "$kernel"
  unpack "$kernel" "guest/$kernel" '*/boot/vmlinuz-*' '*/kernel/drivers/media/*' '*/kernel/drivers/usb/*'
  linux=guest/$kernel/vmlinux
  # Unpacked here once it starts sooner than the guest could unpack it each time.
  if [ ! -e "$linux" ] && ! python3 "$here/vmlinux.py" "guest/$kernel"/boot/vmlinuz-* "$linux"; then
    linux=$(echo "guest/$kernel"/boot/vmlinuz-*)
  fi
}

# Sets `qemu`: the command, with the folders of its libraries, modules and firmware if it is not installed.
fetch_qemu() {
  qemu=(qemu-system-x86_64)
  [[ $("${qemu[@]}" -device help 2>&1) != *usb-serial* ]] || return 0
  fetch qemu-system-x86 with_libraries qemu-system-x86
  unpack qemu-system-x86 host/qemu
  local usr=host/qemu/usr lib=host/qemu/usr/lib/x86_64-linux-gnu
  qemu=(env LD_LIBRARY_PATH="$lib:host/qemu/lib/x86_64-linux-gnu" QEMU_MODULE_DIR="$lib/qemu" "$usr/bin/qemu-system-x86_64"
    -L "$usr/share/qemu" -L "$usr/share/seabios" -L "$usr/lib/ipxe/qemu" -L /usr/share/qemu -L /usr/share/seabios)
  # Libraries that another machine had when it filled this folder may be missing here.
  [[ $("${qemu[@]}" -device help 2>> apt.log) == *usb-serial* ]] || skip "QEMU does not start; remove $PWD/debs/qemu-system-x86 and $PWD/host/qemu; see $PWD/apt.log"
}

fetch_guest_programs() {
  fetch guest-programs with_libraries busybox-static v4l-utils
  unpack guest-programs guest/programs
}

# --- Programs, initramfs, guest -------------------------------------------------------------------------------------------

# Sets `epirig` and `tests`, the paths of the two programs; one run of cargo makes both, as tests depend on the program. The packages
# are those of a build of everything, which then need no other one; EPIRIG_LIGHT has more options of that.
build() {
  (
    cd "$root"
    # shellcheck disable=SC2086  # several words
    CARGO_TARGET_DIR="$root/target" cargo test --release --workspace --locked ${EPIRIG_LIGHT:-} --test virtual-rig --no-run \
      --message-format json-render-diagnostics
  ) > built.json
  epirig=$(executable bin epirig)
  tests=$(executable test virtual-rig)
}
executable() {
  local path
  path=$(sed -n "s/.*\"kind\":\[\"$1\"\].*\"name\":\"$2\".*\"executable\":\"\([^\"]*\)\".*/\1/p" built.json)
  [ -x "$path" ] || fail "cargo names no executable of $2" >&2
  echo "$path"
}

# The names that the guest must report: the tests run here too, where they only list themselves.
list_tests() {
  "$tests" --list ${filter:+"$filter"} | sed -n 's/: test$//p' | sort > listed
  "$tests" --list --ignored ${filter:+"$filter"} | sed -n 's/: test$//p' | sort > ignored
  comm -23 listed ignored > expected
  [ -s expected ] || fail "no test that is not ignored has '$filter' in its name"
}

pack_initramfs() {
  local programs=guest/programs
  echo "$filter" > filter
  python3 "$here/initramfs.py" initramfs.cpio --modules "guest/$kernel" --libraries "$programs/usr/lib/x86_64-linux-gnu" \
    --load vivid --load xhci_pci --load ftdi_sio --load vhci_hcd --load uvcvideo \
    "/init=$here/guest.sh" "/etc/filter=filter" "/bin/busybox=$(ls "$programs"/{usr/,}bin/busybox 2> /dev/null)" \
    "/bin/v4l2-ctl=$programs/usr/bin/v4l2-ctl" "/bin/epirig=$epirig" "/bin/virtual_rig=$tests"
}

# One processor, in software: /dev/kvm may be there and of no use. Its clock counts instructions, 2 ns each, and jumps over the time
# in which the guest only waits (`sleep=off`): a busy machine makes the guest late in our time, but not in its own. ttyS0 is the
# console. What is written to the USB serial port (for epirig) is read from ttyS1 (for a test that plays the stage), through a socket
# with both ends in QEMU.
boot() {
  rm -f stage.sock
  timeout --foreground --kill-after 10 "$limit_s" "${qemu[@]}" -nodefaults -no-user-config -display none -no-reboot \
    -accel tcg -icount shift=1,sleep=off -machine pc -cpu max -smp 1 -m 1024 \
    -kernel "$linux" -initrd initramfs.cpio -append "console=ttyS0 quiet panic=-1" \
    -chardev socket,id=usb,path=stage.sock,server=on,wait=off -chardev socket,id=uart,path=stage.sock \
    -serial stdio -serial chardev:uart \
    -device qemu-xhci -device "usb-serial,chardev=usb,id=stage,serial=$usb_serial_number" < /dev/null
}

run_guest() {
  local status=0
  boot 2>&1 | tee console.log | sed -u '/BEGIN FILE /,/END FILE /d' || status=${PIPESTATUS[0]}
  case $status in
    0) ;;
    124 | 137) say "the guest had not ended after $limit_s s (EPIRIG_RIG_LIMIT_S) and was killed" ;;
    *) say "QEMU ended with code $status" ;;
  esac
}

make_guest() {
  SECONDS=0
  fetch_kernel
  fetch_qemu
  fetch_guest_programs
  local fetch_s=$SECONDS
  build
  list_tests
  pack_initramfs
  say "fetching took $fetch_s s, building $((SECONDS - fetch_s)) s"
}

run_tests() {
  fetch_kernel
  fetch_qemu
  SECONDS=0
  run_guest
  local verdict=0
  python3 "$here/judge.py" console.log expected out || verdict=1
  say "$(wc -l < ignored) ignored; the guest took $SECONDS s; $PWD/console.log"
  return $verdict
}

[ "$(uname -sm)" = "Linux x86_64" ] || skip "it needs Linux on x86_64, this is $(uname -sm)"
for tool in python3 dpkg-deb tar timeout; do
  command -v "$tool" > /dev/null || skip "there is no $tool"
done
: > apt.log
case $part in
  '')
    make_guest
    run_tests
    ;;
  --build) make_guest ;;
  --boot) run_tests ;;
esac
