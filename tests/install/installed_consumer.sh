#!/usr/bin/env bash
# The library as others see it. Laws:
# - the consumer project configures, builds and runs from an installed prefix without opening a file of the source or
#   build tree (traced);
# - the next move on a robot links neither MuJoCo nor EGL nor OpenCV;
# - it inserts on the plug and on a pipe, from the database and the bundle beside it;
# - a version or a component that is not there is refused in words; a prefix without models says what it looked for.
# usage: installed_consumer.sh BUILD_DIR SOURCE_DIR
set -euo pipefail
build=$(realpath "$1")
source_dir=$(realpath "$2")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix
fail() { echo "installed_consumer: $*" >&2; exit 1; }

cmake --install "$build" --prefix "$prefix" >"$work/install.log"
cp -r "$source_dir/examples/consumer" "$work/consumer"
mkdir -p "$work/home"
export HOME=$work/home FEELER_CACHE_DIR=$work/cache
unset FEELER_MODELS FEELER_DATA_DIR

feeler=$prefix/bin/feeler
trace() { strace -f -q -e trace=open,openat,execve -o "$work/trace.$((traces++))" "$@"; }
traces=0
cd "$work"
trace "$feeler" preprocess --task plug --family 3x3x3 --out plug.db >/dev/null 2>preprocess.log || { cat preprocess.log >&2; fail "preprocess"; }
trace "$feeler" preprocess --task pipe-into-elbow --family 2x2x2x2 --out pipe.db >/dev/null 2>preprocess.log || { cat preprocess.log >&2; fail "preprocess of the pipe"; }

trace cmake -S consumer -B b -DCMAKE_PREFIX_PATH="$prefix" >configure.log 2>&1 || { cat configure.log >&2; fail "configure"; }
trace cmake --build b >build.log 2>&1 || { tail -50 build.log >&2; fail "build"; }
trace b/next_move plug.db || fail "next_move on the plug"
trace b/next_move pipe.db || fail "next_move on the pipe"
trace b/step_environment || fail "step_environment"
trace b/own_policy || fail "own_policy"

opened=$(cat trace.* | grep -v ENOENT | grep -E "\"($source_dir|$build)/" | head -5 || true)
[ -z "$opened" ] || fail "opened in the source or build tree: $opened"
if ldd b/next_move | grep -iE 'mujoco|EGL|opencv'; then fail "next_move links a simulator"; fi

# pkg-config alone builds a program: its paths follow the prefix.
pc=$(dirname "$(find "$prefix" -name feeler-core.pc)")
printf '#include "feeler/core/random.h"\n#include "feeler/version.h"\nint main() { return feeler::RandomStream(1, 2, "pc").Uniform(0.0, 1.0) < 0.0; }\n' >pc.cpp
PKG_CONFIG_PATH=$pc sh -c 'g++ -std=c++20 pc.cpp -o pc $(pkg-config --cflags --libs feeler-core)' >pc.log 2>&1 && ./pc ||
  { cat pc.log >&2; fail "a build by pkg-config"; }

refused() {  # PATTERN LINE-OF-CMAKE
  mkdir -p refused
  printf 'cmake_minimum_required(VERSION 3.25)\nproject(refused LANGUAGES CXX)\n%s\n' "$2" >refused/CMakeLists.txt
  if cmake -S refused -B refused/b -DCMAKE_PREFIX_PATH="$prefix" >refused.log 2>&1; then fail "accepted: $2"; fi
  tr -s ' \n' ' ' <refused.log | grep -q "$1" || { cat refused.log >&2; fail "no \"$1\" in the message of: $2"; }
}
refused 'version: 0\.1\.0' 'find_package(feeler 9 REQUIRED)'
refused 'choose of: core, planner' 'find_package(feeler REQUIRED COMPONENTS gripper)'

mv "$prefix/share/feeler" "$work/away"
if "$feeler" task list >out.log 2>&1; then fail "a prefix without models lists tasks"; fi
grep -q "looked for .*share/feeler/models" out.log || { cat out.log >&2; fail "no word of what was looked for"; }
mv "$work/away" "$work/elsewhere"
FEELER_MODELS=$work/elsewhere/models "$feeler" task list | grep -q plug || fail "FEELER_MODELS is not used"
echo "installed_consumer: all laws hold"
