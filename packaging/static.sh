#!/usr/bin/env bash
# Makes archives of the program, linked statically: they run on any Linux of their architecture, whatever libraries it has.
#
#   packaging/static.sh [TARGET...]     by default x86_64-unknown-linux-musl and aarch64-unknown-linux-musl
#
# The archives are target/packages/epirig-TARGET-vVERSION.tar.gz, as `bin-dir` of [package.metadata.binstall] in Cargo.toml names them.
# Programs for musl are linked by Rust's own linker, whatever machine they are made on. Other targets need their C library and its linker.
set -euo pipefail
cd "$(dirname "$0")/.."

[ $# != 0 ] || set -- x86_64-unknown-linux-musl aarch64-unknown-linux-musl
packages=$PWD/target/packages
built=${CARGO_TARGET_DIR:-target}
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
folder=$(sed -n 's|^bin-dir = "\(.*\)/{ bin }{ binary-ext }"$|\1|p' Cargo.toml)
# The same commit gives the same bytes.
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
umask 022
mkdir -p "$packages"

for target in "$@"; do
  if [ ! -d "$(rustc --print target-libdir --target "$target")" ] && ! rustup target add "$target"; then
    echo "Rust's standard library for $target is not here; install it (rustup target add $target)" >&2
    exit 1
  fi
  # Paths of the machine that builds stay out of the program.
  flags="-C target-feature=+crt-static -C strip=symbols"
  flags+=" --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=/cargo --remap-path-prefix=$PWD=/epirig"
  case $target in *-musl) flags+=" -C linker=rust-lld -C link-self-contained=yes" ;; esac
  RUSTFLAGS=$flags cargo build --release --locked --bin epirig --target "$target"
  program=$built/$target/release/epirig
  if LC_ALL=C readelf --program-headers "$program" | grep -q INTERP; then
    echo "$program is not linked statically: it asks for a dynamic loader" >&2
    exit 1
  fi
  name=$(sed "s/{ name }/epirig/; s/{ target }/$target/; s/{ version }/$version/" <<< "$folder")
  mkdir -p "$work/$name"
  install -m 755 "$program" "$work/$name/epirig"
  install -m 644 README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT THIRD-PARTY.txt "$work/$name"
  case $target in *-musl) install -m 644 packaging/LICENSE-musl "$work/$name" ;; esac
  install -D -m 644 -t "$work/$name/calib" calib/*
  tar --create --directory "$work" --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" "$name" |
    gzip --best --no-name > "$packages/.$name.part"
  mv "$packages/.$name.part" "$packages/$name.tar.gz"
  echo "$packages/$name.tar.gz"
done
