#!/bin/bash
# Two network namespaces as two hosts with names, addresses and caches of their own: 2 ranks, one on each, that know
# each other by TCP alone. The content digest must be that of one process. Root; says so and exits 77 where it may not.
#   bench/scale/two_hosts.sh                     FEELER, TASK, FAMILY
set -uo pipefail
FEELER=$(realpath "${FEELER:-build/feeler}")
TASK=${TASK:-plug}
FAMILY=${FAMILY:-2..6x2..6x2..5}
OUT=${OUT:-$(mktemp -d)}
mkdir -p "$OUT"
a=feeler-a-$$ b=feeler-b-$$
if ! ip netns add "$a" 2> /dev/null; then
  echo "skipped: network namespaces need root and CAP_SYS_ADMIN"
  exit 77
fi
trap 'ip netns del "$a"; ip netns del "$b" 2> /dev/null' EXIT
ip netns add "$b"
ip link add fa netns "$a" type veth peer name fb netns "$b" || exit 2
for host in "$a fa 1" "$b fb 2"; do
  read -r name link number <<< "$host"
  ip -n "$name" addr add "10.77.0.$number/24" dev "$link"
  ip -n "$name" link set "$link" up
  ip -n "$name" link set lo up
done
# In place of ssh: a shell in the namespace of the host, under its name, with a cache and a session folder of its own.
cat > "$OUT/enter" << SH
#!/bin/bash
while [ "\${1#-}" != "\$1" ]; do shift; done
case \$1 in 10.77.0.1) name=$a;; 10.77.0.2) name=$b;; *) exit 2;; esac
shift
export TMPDIR=$OUT/\$name FEELER_CACHE_DIR=$OUT/\$name/cache
mkdir -p "\$FEELER_CACHE_DIR"
exec ip netns exec "\$name" unshare --uts sh -c "hostname \$name; \$*"
SH
chmod +x "$OUT/enter"
digest() { "$FEELER" db info "$1" --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["content_digest"])'; }
command="preprocess --task $TASK --family $FAMILY"
"$FEELER" $command --out "$OUT/whole.db" > /dev/null 2>&1 || exit 2
"$OUT/enter" 10.77.0.1 mpirun --allow-run-as-root --host 10.77.0.1:1,10.77.0.2:1 -n 2 \
  --mca plm_rsh_agent "$OUT/enter" --mca btl tcp,self --mca btl_tcp_if_include 10.77.0.0/24 \
  --mca oob_tcp_if_include 10.77.0.0/24 --mca pml ob1 \
  "$FEELER" $command --json --out "$OUT/hosts.db" > "$OUT/hosts.json" 2> "$OUT/log"
code=$?
[ "$code" -eq 0 ] || { cat "$OUT/log"; exit 1; }
python3 -c 'import json, sys; print([(r["rank"], r["host"], r["done"]) for r in json.load(open(sys.argv[1]))["ranks"]])' \
  "$OUT/hosts.json"
one=$(digest "$OUT/whole.db") two=$(digest "$OUT/hosts.db")
echo "one process $one, two hosts $two"
[ "$one" = "$two" ]
