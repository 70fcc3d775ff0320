#!/bin/bash
# Random ranks killed: a small family is begun on 3 ranks again and again, one of them (rank 0 too) is killed after a
# random while, and the command goes on until the family is whole; then from the start, until KILLS have hit. Every
# finished file must have the content digest of a run without ranks, and verify.
# The while is up to what a run takes that nobody disturbs.
#   KILLS=100 bench/scale/kill_ranks.sh          FEELER, TASK, FAMILY, RANKS, SEED
set -uo pipefail
FEELER=$(realpath "${FEELER:-build/feeler}")
KILLS=${KILLS:-100}
TASK=${TASK:-plug}
FAMILY=${FAMILY:-2..6x2..6x2..5}
RANKS=${RANKS:-3}
RANDOM=${SEED:-1}
MPIRUN=${MPIRUN:-"mpirun --allow-run-as-root --oversubscribe"}
OUT=${OUT:-$(mktemp -d)}
mkdir -p "$OUT"
digest() { "$FEELER" db info "$1" --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["content_digest"])'; }

"$FEELER" preprocess --task "$TASK" --family "$FAMILY" --out "$OUT/whole.db" > /dev/null 2>&1 || exit 2
whole=$(digest "$OUT/whole.db")
begin=$(date +%s%N)
$MPIRUN -n "$RANKS" "$FEELER" preprocess --task "$TASK" --family "$FAMILY" --out "$OUT/calm.db" > "$OUT/log" 2>&1 || exit 2
whole_ms=$((($(date +%s%N) - begin) / 1000000))
[ "$(digest "$OUT/calm.db")" = "$whole" ] || { echo "ranks that nobody kills make something else"; exit 1; }
kills=0 runs=0 files=0 begun=0
declare -a of_rank
while [ "$kills" -lt "$KILLS" ]; do
  file=$OUT/ranks.db
  rm -f "$file" "$file"*
  while true; do
    runs=$((runs + 1))
    # Each rank leaves its process id under its number.
    rm -f "$OUT"/pid.*
    timeout 300 $MPIRUN -n "$RANKS" sh -c \
      'echo $$ > "$0/pid.$OMPI_COMM_WORLD_RANK"; shift 0; exec "$@"' "$OUT" \
      "$FEELER" preprocess --task "$TASK" --family "$FAMILY" --out "$file" > "$OUT/log" 2>&1 &
    job=$!
    if [ "$kills" -lt "$KILLS" ]; then
      pause_ms=$(((RANDOM * 32768 + RANDOM) % whole_ms))
      sleep "$((pause_ms / 1000)).$(printf '%03d' $((pause_ms % 1000)))"
      victim=$((RANDOM % RANKS))
      if [ -s "$OUT/pid.$victim" ] && kill -9 "$(cat "$OUT/pid.$victim")" 2> /dev/null; then
        kills=$((kills + 1))
        [ ! -s "$file" ] || begun=$((begun + 1))
        of_rank[victim]=$((${of_rank[victim]:-0} + 1))
      fi
    fi
    wait "$job"
    code=$?
    [ "$code" -eq 124 ] && { echo "a run hung for 300 s; see $OUT/log"; exit 1; }
    [ "$code" -eq 0 ] && break
  done
  files=$((files + 1))
  if [ "$(digest "$file")" != "$whole" ] || ! "$FEELER" db verify "$file" > /dev/null 2>&1; then
    echo "after $kills kills $file is not what a run without ranks makes"
    exit 1
  fi
done
echo "$kills kills (by rank: ${of_rank[*]}; $begun with the file begun) in $runs runs of up to $whole_ms ms;" \
  "$files files, each with digest $whole"
