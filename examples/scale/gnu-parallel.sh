#!/bin/bash
# Shards over ssh with GNU parallel: SHARDS=16 HOSTS=hosts.txt ./gnu-parallel.sh (a line a host: [CORES/][USER@]HOST;
# the same folder and feeler on all). Without HOSTS: on the cores of this machine; without GNU parallel: by xargs.
set -euo pipefail
FEELER=${FEELER:-feeler}
OUT=${OUT:-out}
TASK=${TASK:-plug}
SHARDS=${SHARDS:-4}
mkdir -p "$OUT"
command=("$FEELER" preprocess --task "$TASK" ${FAMILY:+--family "$FAMILY"} --jobs 1 --shard "{}/$SHARDS" --out "$OUT/shard-{}.db")
if command -v parallel > /dev/null; then
  seq "$SHARDS" | parallel ${HOSTS:+--sshloginfile "$HOSTS" --workdir .} --retries 3 "${command[@]}"
else
  seq "$SHARDS" | xargs -P "$(nproc)" -I '{}' "${command[@]}"
fi
shards=()
for i in $(seq "$SHARDS"); do shards+=("$OUT/shard-$i.db"); done
"$FEELER" db merge "${shards[@]}" --out "$OUT/$TASK.db"
