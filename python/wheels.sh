#!/usr/bin/env bash
# Wheels of the Python package for Linux on x86_64 and aarch64, on any machine:
#
#   python/wheels.sh FOLDER
#
# They run on glibc 2.17 (2014) and later, and on Python 3.10 and later. zig links them, for either machine.
set -euo pipefail
folder=$(realpath -m "${1:?usage: python/wheels.sh FOLDER}")
cd "$(dirname "$0")"

tools=$(mktemp -d)
trap 'rm -rf "$tools"' EXIT
python3 -m venv "$tools"
"$tools/bin/pip" install --quiet 'maturin[zig]>=1.13,<2'
export PATH="$tools/bin:$PATH"

for machine in x86_64 aarch64; do
  target=$machine-unknown-linux-gnu
  rustup target add "$target" || echo "rustup cannot add $target; if the compiler has no library for it, the build says so" >&2
  # What the stubs are written from is not needed in a wheel.
  maturin build --release --locked --strip --zig --target "$target" --compatibility manylinux2014 --out "$folder"
done
