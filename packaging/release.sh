#!/usr/bin/env bash
# Builds what a release consists of into a folder, each with its checksum:
#   the program for this machine, its .deb where cargo-deb is installed, the Python wheel, the OpenAPI document.
# usage: bash packaging/release.sh [FOLDER]      dist unless said
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-dist}
rm -rf "$folder"
mkdir -p "$folder"
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
target=$(rustc -vV | sed -n 's/^host: //p')

cargo build --release --locked --package locution-cli
name="locution-$version-$target"
mkdir "$folder/$name"
cp target/release/locution README.md LICENSE CHANGELOG.md packaging/locution.service packaging/locution.toml "$folder/$name/"
target/release/locution man >"$folder/$name/locution.1"
for shell in bash zsh fish; do
    target/release/locution completions "$shell" >"$folder/$name/locution.$shell"
done
# The same files give the same bytes, whoever builds and whenever.
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime=@"$(git log -1 --format=%ct)" \
    -C "$folder" -cf - "$name" | gzip -n >"$folder/$name.tar.gz"
rm -r "${folder:?}/$name"

if cargo deb --version >/dev/null 2>&1; then
    cargo deb --no-build --package locution-cli --output "$folder/"
else
    echo "no .deb: cargo install cargo-deb" >&2
fi
if python3 -c 'import build' 2>/dev/null; then
    python3 -m build --wheel --outdir "$folder" clients/python
else
    echo "no wheel: pip install build" >&2
fi
cp openapi/openapi.json "$folder/locution-$version-openapi.json"
(cd "$folder" && sha256sum -- * >SHA256SUMS)
ls -l "$folder"
