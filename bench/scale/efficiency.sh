#!/bin/bash
# Ranks against threads: A (one process, --jobs 2), B (2 ranks) and C (8 ranks) in turn, ROUNDS times, on two cores.
#   bench/scale/efficiency.sh preprocess --task pipe-into-elbow --family ...   (a database: its content digest)
#   bench/scale/efficiency.sh run --task plug --db out/plug.db --episodes 1000 (records: all but measured times)
# Prints a line a run: what, wall seconds, CPU seconds of all processes, and what the outputs come to; then the ratios.
# FEELER, ROUNDS (2), RANKS ("2 8"), OUT (a scratch folder), NICE (e.g. -10, of the session's autogroup; root).
set -euo pipefail
FEELER=$(realpath "${FEELER:-build/feeler}")
ROUNDS=${ROUNDS:-2}
RANKS=${RANKS:-"2 8"}
OUT=${OUT:-$(mktemp -d)}
MPIRUN=${MPIRUN:-"mpirun --allow-run-as-root --oversubscribe"}
mkdir -p "$OUT"
[ -z "${NICE:-}" ] || echo "$NICE" > /proc/self/autogroup
what=$1
if [ "$what" = preprocess ]; then ending=db; else ending=jsonl; fi

content() {  # of an output
  if [ "$ending" = db ]; then
    "$FEELER" db info "$1" --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["content_digest"])'
  else
    python3 -c '
import hashlib, json, sys
digest = hashlib.sha256()
for line in open(sys.argv[1]):
    record = json.loads(line)
    record.pop("timing")
    digest.update(json.dumps(record, sort_keys=True).encode())
print(digest.hexdigest()[:32])' "$1"
  fi
}

measure() {  # name command...
  local name=$1 file="$OUT/$1.$ending"
  shift
  rm -f "$file" "$file".*
  local TIMEFORMAT="%R %U %S"
  { time "$@" --out "$file" > "$OUT/$name.log" 2>&1; } 2> "$OUT/$name.time"
  read -r wall user system < "$OUT/$name.time"
  echo "$name $wall $(echo "$user + $system" | bc) $(content "$file")" | tee -a "$OUT/runs"
}

: > "$OUT/runs"
for _ in $(seq "$ROUNDS"); do
  measure jobs-2 "$FEELER" "$@" --jobs 2
  for ranks in $RANKS; do measure "ranks-$ranks" $MPIRUN -n "$ranks" "$FEELER" "$@"; done
done
python3 - "$OUT/runs" <<'PY'
import sys
runs = {}
contents = set()
for line in open(sys.argv[1]):
    name, wall, cpu, content = line.split()
    runs.setdefault(name, []).append((float(wall), float(cpu)))
    contents.add(content)
best = {name: (min(w for w, _ in of), min(c for _, c in of)) for name, of in runs.items()}
base = best["jobs-2"]
for name, (wall, cpu) in best.items():
    print(f"{name}: least {wall:.1f} s wall, {cpu:.1f} s CPU; throughput {base[0] / wall:.3f} of jobs-2 by wall, "
          f"{base[1] / cpu:.3f} by CPU")
print("outputs", "are equal" if len(contents) == 1 else "DIFFER")
sys.exit(len(contents) != 1)
PY
