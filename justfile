# The commands of CONTRIBUTING.md. `just` lists them.

_list:
    @just --list --unsorted

# The tests
test:
    cargo test --release --workspace

# Tests that take minutes
slow:
    cargo test --release --workspace --test slow -- --ignored

# Lints, as CI has them
lint:
    cargo clippy --all-targets --workspace -- -D warnings

# Formats the code
format:
    cargo fmt --all

# The page of `epirig view`, from web/ into crates/server/page, with its tests
page:
    cd web && npm ci && npm run format:check && npm test && npm run build && npm run test:browser

# Documentation: the book, its links, its commands, its words
docs program="target/release/epirig":
    python3 docs/check.py {{program}}

# The book, to read in target/book
book:
    mdbook build docs

# Kernels and the whole match beside plain references
bench:
    cargo bench --workspace

# The whole match beside OpenCV, pyvale and Numba; see benches/peers/README.md
peers:
    benches/peers/compare.py

# Time and memory of a match over rows, columns, frames and range (needs numpy)
scale:
    python3 benches/scale/measure.py

# Bands on a real Slurm, in namespaces of its own (Debian, as root)
slurm:
    tests/slurm/cluster.sh tests/slurm/check.sh target/release/epirig

# The Uno firmware, and the simulated board that its test runs on (Debian)
firmware:
    firmware-protocol/uno/build.sh

# The tests on real kernel drivers, in a QEMU guest; see TESTING.md
virtual-rig filter="":
    tests/virtual-rig/run.sh {{filter}}

# One fuzz target; see fuzz/README.md
fuzz target="native_frames":
    cargo +nightly fuzz run {{target}}

# What dependencies may be: deny.toml
deny:
    cargo deny check licenses bans sources

# THIRD-PARTY.txt, after each change of dependencies
third-party:
    cargo about generate .ci/third-party.hbs --output-file THIRD-PARTY.txt

# A Debian package for this machine, tried in an empty root
deb:
    packaging/deb.sh
    packaging/try.sh target/packages/*.deb

# Static programs for x86_64 and aarch64, tried in empty roots
static:
    packaging/static.sh && packaging/try.sh target/packages/*.tar.gz

# Format, lints, unit tests, and the tests of the program
quick:
    bash .ci/run quick

# All that a change must pass, as in CI
ci:
    bash .ci/run

# The same in full size, with nothing left out
full:
    bash .ci/run full
