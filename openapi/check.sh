#!/usr/bin/env bash
# Shows that openapi.json is what others take it for, on a filled server:
#   valid by a validator of others · a Python and a TypeScript client made from it compile and answer ·
#   schemathesis finds nothing with every kind of value that the document tells apart, the same in each run;
#   with --fuzz also with random ones, bounded in examples (LOCUTION_CHECK_EXAMPLES) and seconds (LOCUTION_CHECK_SECONDS).
# usage: bash openapi/check.sh [PROGRAM] [--fuzz]      the built `locution`; target/release/locution unless said
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-target/release/locution}")
work=$(mktemp -d)
server=
trap '[ -z "$server" ] || kill "$server" 2>/dev/null || true; rm -rf "$work"' EXIT
step() { printf -- '-- %s (%ss)\n' "$1" "$SECONDS"; }

step "tools"
for tool in python3 node npm; do
    command -v "$tool" >/dev/null || { echo "$tool is missing" >&2; exit 1; }
done
# The folder may be kept between runs; then nothing is fetched again that is still the same.
tools=${LOCUTION_CHECK_TOOLS:-$work/tools}
bin="$tools/venv/bin"
mkdir -p "$tools"
[ -x "$bin/python" ] || python3 -m venv "$tools/venv"
cmp --silent openapi/check/requirements.txt "$tools/requirements.txt" || {
    "$bin/pip" install --quiet --disable-pip-version-check -r openapi/check/requirements.txt
    cp openapi/check/requirements.txt "$tools/"
}
cmp --silent clients/typescript/package-lock.json "$tools/package-lock.json" || {
    cp clients/typescript/package.json "$tools/"
    (cd "$tools" && cp "$OLDPWD/clients/typescript/package-lock.json" . && npm ci --silent --no-audit --no-fund) || {
        rm -f "$tools/package-lock.json"
        exit 1
    }
}

step "valid OpenAPI 3.1"
"$bin/openapi-spec-validator" openapi/openapi.json

step "a filled server"
"$program" simulate --world clients/cli/worlds/office.yaml --wander 60 --seed 3 --out "$work/drive" >/dev/null
"$program" serve --address 127.0.0.1:0 --data-directory "$work/data" >"$work/serve.log" 2>&1 &
server=$!
for _ in $(seq 300); do
    url=$(sed -n 's/^listening on //p' "$work/serve.log")
    [ -n "$url" ] && break
    sleep 0.1
done
[ -n "$url" ] || { cat "$work/serve.log" >&2; exit 1; }
# With a key, since the first one that anybody makes would shut out all that follows.
key=
ask() { # METHOD PATH [BODY]
    curl --silent --show-error --fail -X "$1" "$url$2" ${key:+-H "authorization: Bearer $key"} \
        -H 'content-type: application/json' ${3:+-d "$3"}
}
field() { "$bin/python" -c 'import json, sys; print(json.load(sys.stdin)[sys.argv[1]])' "$1"; }
key=$(ask POST /v1/keys '{"name": "check", "scope": "admin", "sites": ["*"]}' | field secret)
"$program" replay --url "$url" --api-key "$key" --site office --run drive "$work/drive.log" >/dev/null 2>&1
# What the routes with names of the server's own are asked for.
geometry='{"geometry": {"num_ranges": 3, "angle_min_rad": -0.5, "angle_increment_rad": 0.5, "range_max_m": 20}}'
CHECK_JOB=$(ask POST '/v1/sites/office/builds?wait=true' | field id)
CHECK_SESSION=$(ask POST /v1/sites/office/localisations "$geometry" | field id)
export CHECK_JOB CHECK_SESSION
ask POST /v1/keys '{"name": "scratch", "scope": "read", "sites": ["office"]}' >/dev/null
ask PUT /v1/sites/office/runs/scratch "$geometry" >/dev/null
ask PUT /v1/sites/scratch '{}' >/dev/null
for channel in stable scratch; do ask PUT "/v1/sites/office/channels/$channel" '{}' >/dev/null; done

step "a Python client, made and used"
(cd "$work" && "$bin/openapi-python-client" generate --path "$OLDPWD/openapi/openapi.json" --meta none \
    --output-path "$work/locution_api" --config "$OLDPWD/openapi/check/python.yaml" >"$work/generate.log" 2>&1) || {
    cat "$work/generate.log" >&2
    exit 1
}
cp openapi/check/use_client.py "$work/"
(cd "$work" && "$bin/mypy" --no-error-summary --follow-imports=silent use_client.py && "$bin/python" use_client.py "$url" "$key")

step "a TypeScript client, made and used"
"$tools/node_modules/.bin/openapi-typescript" openapi/openapi.json --output "$work/schema.ts" >/dev/null
cmp "$work/schema.ts" clients/typescript/src/schema.ts || {
    echo "clients/typescript/src/schema.ts is stale: run npm run generate there" >&2
    exit 1
}
mkdir "$work/typescript"
ln -s "$tools/node_modules" "$work/typescript/node_modules"
cp -r clients/typescript/{package.json,tsconfig.json,src,example} "$work/typescript/"
(cd "$work/typescript" && node_modules/.bin/tsc && node dist/example/matches.js "$url" office "$key")

schemathesis() {
    "$bin/schemathesis" --config-file openapi/check/schemathesis.toml run openapi/openapi.json --url "$url" \
        --header "Authorization: Bearer $key" --seed 1 "$@"
}
step "schemathesis"
schemathesis --phases examples,coverage --generation-deterministic
if [ "${2:-}" = --fuzz ]; then
    step "schemathesis, at random"
    schemathesis --phases fuzzing,stateful --max-examples "${LOCUTION_CHECK_EXAMPLES:-15}" \
        --max-time "${LOCUTION_CHECK_SECONDS:-60}"
fi
kill -0 "$server" || { echo "the server did not survive" >&2; tail -50 "$work/serve.log" >&2; exit 1; }
if grep -i panicked "$work/serve.log" >&2; then exit 1; fi
step "done"
