#!/usr/bin/env bash
# Builds the wheel, installs it into a fresh environment, and runs the tests on what is installed there.
#   python/test.sh [PYTEST ARGUMENTS]
# WHEEL names a wheel that is built already; MATURIN_ARGS changes how one is built (default: --release);
# GAPSCOPE names the command to compare with (default: built here); VENV names an environment that is there already.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if [ -z "${VENV:-}" ]; then
    VENV="$work/venv"
    python3 -m venv "$VENV"
fi
bin="$VENV/bin"
if [ -z "${WHEEL:-}" ]; then
    "$bin/pip" install --quiet "maturin>=1.7,<2"
fi
# What the tests need comes while the wheel is built. Byte code of all of it would take as long as the rest of the installation,
# and most is never imported.
needed() {
    "$bin/pip" install --quiet --no-compile numpy pytest
    # Some tests need more; without it they say that they are skipped.
    local more=(mujoco pandas polars matplotlib fmpy mcap nbclient ipykernel)
    "$bin/pip" install --quiet --no-compile "${more[@]}" && return
    for one in "${more[@]}"; do
        "$bin/pip" install --quiet --no-compile "$one" || echo "$one does not install here: its tests are skipped"
    done
}
needed &
installs=$!
if [ -z "${WHEEL:-}" ]; then
    (cd "$here" && "$bin/maturin" build --out "$work/wheels" ${MATURIN_ARGS:---release})
    WHEEL="$(echo "$work"/wheels/*.whl)"
fi
if [ -z "${GAPSCOPE:-}" ]; then
    (cd "$here/.." && cargo build --release -p gapscope --features all-formats)
    GAPSCOPE="${CARGO_TARGET_DIR:-$here/../target}/release/gapscope"
fi
export GAPSCOPE
wait "$installs"
"$bin/pip" install --quiet --no-compile "$WHEEL"
# From elsewhere, so that the sources cannot be found instead of the wheel.
cd "$work"
"$bin/python" -m pytest -q -p no:cacheprovider "$here/tests" "$@"
