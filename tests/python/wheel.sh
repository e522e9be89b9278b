#!/bin/sh
# Builds the wheel and imports it with nothing else of this project on the path.
# Usage: wheel.sh PYTHON BUILD_FOLDER
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$1" "$root/apps/python/build_wheel.py" "$folder" "$2" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
"$1" -m zipfile -e "$folder"/nephele-*.whl "$folder/site"
cd "$folder"
env PYTHONPATH="$folder/site" "$1" -c '
import nephele
assert nephele.__file__.startswith("'"$folder"'"), nephele.__file__
picture = nephele.render(nephele.cloud(nephele.ls2shape(nephele.sphere((0, 0, 0), 1), 24), resolution=32), size=(16, 12))
assert picture.array.shape == (12, 16, 4)'
echo "wheel: good"
