#!/usr/bin/env bash
# Builds the stage's firmware for the Arduino Uno, and the plant that runs it without one.
#
#   firmware-protocol/uno/build.sh        writes target/uno/stage-uno.elf and target/uno/plant
#
# Rust for AVR comes from Debian's rustc-web and rust-web-src (another compiler than the one that builds epirig); they are
# unpacked under target/uno, not installed. gcc-avr, avr-libc, libsimavr-dev and libelf-dev are installed if that is allowed.
# Where a package cannot be had it says so in a line that begins with SKIPPED and ends with exit code 77.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=$(cd "$here/../.." && pwd)/target/uno
mkdir -p "$out"

skip() { echo "SKIPPED: the Uno firmware is not built: $*"; exit 77; }

need=()
command -v avr-gcc > /dev/null || need+=(gcc-avr avr-libc)
[ -e /usr/include/simavr/sim_avr.h ] || need+=(libsimavr-dev libelf-dev)
if [ ${#need[@]} -gt 0 ]; then
  command -v apt-get > /dev/null || skip "${need[*]} are missing, and there is no apt-get"
  { apt-get update -qq && apt-get install -y -qq "${need[@]}"; } > "$out/apt.log" 2>&1 || skip "apt-get cannot install ${need[*]}; see $out/apt.log"
fi

rust=$out/rust
if [ ! -x "$rust/usr/bin/rustc" ]; then
  command -v apt-get > /dev/null || skip "there is no apt-get to fetch rustc-web with"
  debs=$out/debs
  rm -rf "$debs" "$rust" && mkdir -p "$debs" "$rust"
  # The compiler with its libraries; names carry versions that move with security updates.
  mapfile -t packages < <(apt-cache depends --recurse --no-recommends --no-suggests --no-conflicts --no-breaks --no-replaces \
    --no-enhances rustc-web 2>> "$out/apt.log" | grep -E '^(rustc-web|libstd-rust-web|libllvm)' | sort -u)
  (cd "$debs" && apt-get download -qq rust-web-src "${packages[@]}") >> "$out/apt.log" 2>&1 || skip "rustc-web or rust-web-src cannot be fetched; see $out/apt.log"
  for deb in "$debs"/*.deb; do dpkg -x "$deb" "$rust"; done
  rm -rf "$debs"
fi

(
  cd "$here"
  export RUSTC_BOOTSTRAP=1 RUSTC="$rust/usr/bin/rustc" RUSTFLAGS="-C target-cpu=atmega328p"
  export LD_LIBRARY_PATH="$rust/usr/lib/x86_64-linux-gnu${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
  unset CARGO_BUILD_TARGET CARGO_ENCODED_RUSTFLAGS RUSTUP_TOOLCHAIN RUSTC_WRAPPER
  cargo build --release --locked -Zbuild-std=core --target avr-none --target-dir "$out/cargo"
)
cp "$out/cargo/avr-none/release/stage-firmware-uno.elf" "$out/stage-uno.elf"
cc -O2 -Wall -Wextra -o "$out/plant" "$here/plant.c" -lsimavr -lelf -lutil
avr-size "$out/stage-uno.elf"
