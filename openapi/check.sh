#!/usr/bin/env bash
# Shows that openapi.json is what others take it for, on a filled server:
#   valid by a validator of others · a Python and a TypeScript client made from it compile and answer ·
#   schemathesis, bounded in examples and time, finds nothing.
# usage: bash openapi/check.sh [PROGRAM]      the built `locution`; target/release/locution unless said
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
# The folder may be kept between runs, so that nothing is fetched twice.
tools=${LOCUTION_CHECK_TOOLS:-$work/tools}
mkdir -p "$tools"
[ -x "$tools/venv/bin/python" ] || python3 -m venv "$tools/venv"
"$tools/venv/bin/pip" install --quiet --disable-pip-version-check -r openapi/check/requirements.txt
bin="$tools/venv/bin"
cp clients/typescript/package.json clients/typescript/package-lock.json "$tools/"
(cd "$tools" && npm ci --silent --no-audit --no-fund)

step "valid OpenAPI 3.1"
"$bin/openapi-spec-validator" openapi/openapi.json

step "a filled server"
"$program" simulate --world clients/cli/worlds/office.yaml --wander 60 --seed 3 --out "$work/drive" >/dev/null
"$program" serve --address 127.0.0.1:0 --data-directory "$work/data" >"$work/serve.log" 2>&1 &
server=$!
for _ in $(seq 100); do
    url=$(sed -n 's/^listening on //p' "$work/serve.log")
    [ -n "$url" ] && break
    sleep 0.1
done
[ -n "$url" ] || { cat "$work/serve.log" >&2; exit 1; }
"$program" replay --url "$url" --site office --run drive "$work/drive.log" >/dev/null 2>&1
curl --silent --show-error --fail -X POST "$url/v1/sites/office/builds?wait=true" >/dev/null

step "a Python client, made and used"
(cd "$work" && "$bin/openapi-python-client" generate --path "$OLDPWD/openapi/openapi.json" --meta none \
    --output-path "$work/locution_api" --config "$OLDPWD/openapi/check/python.yaml" >/dev/null)
cp openapi/check/use_client.py "$work/"
(cd "$work" && "$bin/mypy" --no-error-summary --follow-imports=silent use_client.py && "$bin/python" use_client.py "$url")

step "a TypeScript client, made and used"
"$tools/node_modules/.bin/openapi-typescript" openapi/openapi.json --output "$work/schema.ts" >/dev/null
cmp "$work/schema.ts" clients/typescript/src/schema.ts || {
    echo "clients/typescript/src/schema.ts is stale: run npm run generate there" >&2
    exit 1
}
mkdir "$work/typescript"
ln -s "$tools/node_modules" "$work/typescript/node_modules"
cp -r clients/typescript/{package.json,tsconfig.json,src,example} "$work/typescript/"
(cd "$work/typescript" && node_modules/.bin/tsc && node dist/example/matches.js "$url" office)

step "schemathesis"
"$bin/schemathesis" --config-file openapi/check/schemathesis.toml run openapi/openapi.json --url "$url" \
    --max-examples "${LOCUTION_CHECK_EXAMPLES:-15}" --max-time ${LOCUTION_CHECK_SECONDS:-150} --seed 1
kill -0 "$server" || { echo "the server did not survive" >&2; tail -50 "$work/serve.log" >&2; exit 1; }
! grep -i panicked "$work/serve.log"
step "done"
