#!/usr/bin/env bash
# Writes src/bindings.rs anew from the kernel's header linux/videodev2.h.
#
#   crates/v4l2-sys-mit/generate.sh [OPTION OF CLANG...]     such as --target=aarch64-linux-gnu -isystem FOLDER
#
# It needs bindgen (cargo install bindgen-cli), libclang, and the kernel's header (Debian: libclang-dev, linux-libc-dev).
#
# The kinds of codec controls are opaque: only pointers to them occur, and each kernel adds fields to some of them.
set -euo pipefail
cd "$(dirname "$0")"
header=$(mktemp --suffix=.h)
trap 'rm -f "$header"' EXIT
echo '#include <linux/videodev2.h>' > "$header"
bindgen --allowlist-file '.*/linux/(videodev2|v4l2-common)\.h' --opaque-type 'v4l2_ctrl_[a-z0-9]+_.*' \
  --allowlist-type time_t --no-layout-tests --no-doc-comments --use-core --rust-target 1.82 --output src/bindings.rs "$header" -- "$@"
