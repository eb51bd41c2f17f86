#!/usr/bin/env bash
# Shows that the page is what it is said to be, before a real server:
#   its types are right · the files in the binary are those that its sources make · a browser clicks through all of it.
# Takes about two and a half minutes on two busy cores.
# usage: bash clients/page/check.sh [PROGRAM] [PICTURES]
#   PROGRAM   the built `locution`; target/release/locution unless said
#   PICTURES  a folder for the README's pictures; none are taken unless said
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/release/locution}")
pictures=${2:+$(realpath "$2")}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
step() { printf -- '-- %s (%ss)\n' "$1" "$SECONDS"; }

step "tools"
for tool in node npm; do
    command -v "$tool" >/dev/null || { echo "$tool is missing" >&2; exit 1; }
done
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$browser" ]; then
    [ "$(id -u)" = 0 ] || { echo "chromium is missing" >&2; exit 1; }
    apt-get update -qq && apt-get install -qq -y --no-install-recommends chromium >/dev/null
    browser=$(command -v chromium)
fi
# The folder may be kept between runs, so that nothing is fetched twice.
tools=${LOCUTION_CHECK_TOOLS:-$work/tools}/page
mkdir -p "$tools" "$work/clients"
cp clients/page/package.json clients/page/package-lock.json "$tools/"
(cd "$tools" && npm ci --silent --no-audit --no-fund)
cp -r clients/typescript "$work/clients/"
mkdir "$work/clients/page"
cp -r clients/page/{package.json,tsconfig.json,build.mjs,src,test} "$work/clients/page/"
ln -s "$tools/node_modules" "$work/clients/page/node_modules"

step "types"
(cd "$work/clients/page" && node_modules/.bin/tsc --noEmit)

step "the files in the binary are current"
(cd "$work/clients/page" && node build.mjs "$work/built")
diff -rq "$work/built" server/assets/ui || {
    echo "server/assets/ui is stale: run npm run build in clients/page" >&2
    exit 1
}

step "a browser clicks through it"
(cd "$work/clients/page" && PAGE_PROGRAM=$program PAGE_BROWSER=$browser PAGE_PICTURES=$pictures PAGE_BUILT=$work/built/ \
    PAGE_WORLD=$OLDPWD/clients/cli/worlds/office.yaml timeout 300 node --test --test-reporter=spec --test-concurrency=1 test/*.test.mjs)
step "done"
