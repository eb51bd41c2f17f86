#!/usr/bin/env bash
# Proves the Python package against a real server: generated bodies current, types, style, tests with bags and notebook,
# package for ROS 2 tested, wheel built and used. Takes about three minutes.
# usage: bash clients/python/check.sh [PROGRAM]      the built `locution`; target/release/locution unless said
set -euo pipefail
cd "$(dirname "$0")"
LOCUTION_BINARY=$(realpath "${1:-../../target/release/locution}")
export LOCUTION_BINARY
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
step() { printf -- '-- %s (%ss)\n' "$1" "$SECONDS"; }

step "tools"
# The folder may be kept between runs, so that nothing is fetched twice.
venv=${LOCUTION_CHECK_TOOLS:-$work}/python
[ -x "$venv/bin/python" ] || python3 -m venv "$venv"
PATH="$venv/bin:$PATH"
python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
step "generated bodies are current"
bash generate.sh --check
step "style"
ruff check .
ruff format --check --quiet .
step "types, strictly"
mypy
mypy --strict examples/make_bag.py
step "tests"
timeout 300 python -m pytest -q
step "the package for ROS 2, without ROS"
(cd ../ros2/locution_ros && ruff check . && ruff format --check --quiet . && mypy && timeout 200 python -m pytest -q)
step "wheel"
python -m build --wheel --outdir "$work/dist" . >"$work/build.log" 2>&1 || { cat "$work/build.log" >&2; exit 1; }
python -m venv "$work/clean"
"$work/clean/bin/pip" install --quiet --disable-pip-version-check "$work"/dist/*.whl
(cd "$work" && clean/bin/python -c 'import locution; locution.Client().site("office"); print("the wheel imports")')
unzip -l "$work"/dist/*.whl | grep -q locution/py.typed
step "done"
