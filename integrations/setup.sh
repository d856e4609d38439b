# shellcheck shell=bash
# For the scripts test.sh of these folders, which source it: a scratch folder with a prefix, the C library in that
# prefix, and the tool gip.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
prefix=$scratch/prefix

fail() {
    printf 'failed: %s\n' "$*" >&2
    exit 1
}
# Ends the script where something is not installed.
needs() {
    for program in "$@"; do
        command -v "$program" >/dev/null || {
            printf 'skipped: there is no %s\n' "$program"
            exit 0
        }
    done
}
# Runs a command whose output matters only if it fails.
quietly() { "$@" >"$scratch/log" 2>&1 || fail "$*: $(<"$scratch/log")"; }

install_library() {
    quietly make --silent --directory "$root/bindings/c" install PREFIX="$prefix" LIBDIR="$prefix/lib"
    export PKG_CONFIG_PATH=$prefix/lib/pkgconfig
}
# Puts the tool into the path: that of the variable GIP, or one that is built here.
install_tool() {
    if [ -z "${GIP:-}" ]; then
        cargo build --quiet --locked --release --features cli --bin gip --manifest-path "$root/Cargo.toml"
        GIP=${CARGO_TARGET_DIR:-$root/target}/release/gip
    fi
    install -D "$GIP" "$prefix/bin/gip"
    export PATH=$prefix/bin:$PATH
}
