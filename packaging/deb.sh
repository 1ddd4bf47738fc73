#!/usr/bin/env bash
# Makes the Debian package for machines like this one: program, manual pages, completions, udev rules, sample profiles.
#
#   packaging/deb.sh [PROGRAM]
#
# PROGRAM is a built epirig; without it, it is built. The package is target/packages/epirig_VERSION-1_ARCHITECTURE.deb. DEBFULLNAME and DEBEMAIL name who makes it.
# Needs dpkg-dev and binutils (Debian).
set -euo pipefail
program=${1:+$(realpath "$1")}
cd "$(dirname "$0")/.."

for tool in dpkg-deb dpkg-shlibdeps dpkg-architecture strip; do
  command -v "$tool" > /dev/null || { echo "$tool is missing: apt-get install dpkg-dev binutils" >&2; exit 1; }
done
if [ -z "$program" ]; then
  cargo build --release --locked --bin epirig
  program=$(realpath "${CARGO_TARGET_DIR:-target}/release/epirig")
fi

packages=$PWD/target/packages
version=$("$program" --version | cut -d ' ' -f 2)-1
architecture=$(dpkg-architecture -q DEB_HOST_ARCH)
maintainer="${DEBFULLNAME:-The epirig developers} <${DEBEMAIL:-}>"
# The same commit and program give the same bytes.
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/debian/epirig
umask 022
mkdir -p "$packages" "$root/DEBIAN"

install -D -m 755 "$program" "$root/usr/bin/epirig"
strip --strip-unneeded --remove-section=.comment --remove-section=.note "$root/usr/bin/epirig"

"$program" --quiet manual --out "$root/usr/share/man/man1" > /dev/null
gzip --best --no-name "$root"/usr/share/man/man1/*.1

# completion SHELL FILE
completion() {
  mkdir -p "$(dirname "$root/$2")"
  "$program" completions "$1" > "$root/$2"
}
completion bash usr/share/bash-completion/completions/epirig
completion zsh usr/share/zsh/vendor-completions/_epirig
completion fish usr/share/fish/vendor_completions.d/epirig.fish

install -D -m 644 calib/70-epirig.rules "$root/usr/lib/udev/rules.d/70-epirig.rules"

# Debian's checker takes words of readers in Rust for those of C libraries.
mkdir -p "$root/usr/share/lintian/overrides"
printf 'epirig: embedded-library %s [usr/bin/epirig]\n' libyaml zlib > "$root/usr/share/lintian/overrides/epirig"

documents=$root/usr/share/doc/epirig
install -D -m 644 -t "$documents/examples" calib/*.toml
install -m 644 README.md "$documents"
gzip --best --no-name < CHANGELOG.md > "$documents/changelog.gz"
gzip --best --no-name < THIRD-PARTY.txt > "$documents/THIRD-PARTY.txt.gz"
gzip --best --no-name > "$documents/changelog.Debian.gz" << END
epirig ($version) unstable; urgency=medium

  * Version ${version%-1}; changelog.gz says what is new.

 -- $maintainer  $(LC_ALL=C date --utc --date "@$SOURCE_DATE_EPOCH" '+%a, %d %b %Y %H:%M:%S %z')
END
cat - LICENSE-MIT > "$documents/copyright" << 'END'
epirig is licensed under the MIT licence or the Apache License 2.0, at your
option. On Debian systems, the Apache License 2.0 is the file
/usr/share/common-licenses/Apache-2.0. The MIT licence is below.

The program contains other packages, under their own licences. They are in
/usr/share/doc/epirig/THIRD-PARTY.txt.gz; "epirig licences" prints them, too.

END

# The libraries that the program loads, and since which version they have what it calls.
printf 'Source: epirig\n\nPackage: epirig\nArchitecture: any\n' > "$work/debian/control"
depends=$(cd "$work" && dpkg-shlibdeps -O debian/epirig/usr/bin/epirig | sed -n 's/^shlibs:Depends=//p')
cat > "$root/DEBIAN/control" << END
Package: epirig
Version: $version
Architecture: $architecture
Maintainer: $maintainer
Installed-Size: $(du --apparent-size --block-size=1024 --summarize "$root/usr" | cut -f 1)
${depends:+Depends: $depends
}Suggests: ffmpeg
Section: science
Priority: optional
Description: height maps from a camera on a linear stage
 epirig runs a capture rig: a camera and a motorised linear stage. It
 calibrates the rig, and computes from its frames disparity, height in mm and
 the standard uncertainty of both. It also measures from photographs that were
 taken along a line, and simulates rigs.
END
(cd "$root" && find usr -type f -print0 | LC_ALL=C sort --zero-terminated | xargs --null md5sum > DEBIAN/md5sums)

package=epirig_${version}_$architecture.deb
find "$root" -newermt "@$SOURCE_DATE_EPOCH" -exec touch --no-dereference --date="@$SOURCE_DATE_EPOCH" {} +
dpkg-deb --root-owner-group -Zxz --build "$root" "$work/$package" > /dev/null
cp "$work/$package" "$packages/.$package.part"
mv "$packages/.$package.part" "$packages/$package"
echo "$packages/$package"
