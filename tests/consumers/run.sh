#!/bin/sh
# Installs a build into a folder of its own and builds projects that use it: with the mathematics alone, and with all of it.
# Usage: run.sh BUILD_FOLDER
set -eu
build=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cmake --install "$build" --prefix "$folder/prefix" >"$folder/log"
configure() { cmake -G Ninja -S "$(dirname "$0")" -B "$folder/$1" -DCMAKE_PREFIX_PATH="$folder/prefix" "$2" >"$folder/log"; }
configure modeling -DNEPHELE_ALL_PARTS=OFF
if grep -iE '^(OpenVDB|CGAL|OpenEXR|CLI11|tomlplusplus)_DIR|OpenVDB_.*PATH=/' "$folder/modeling/CMakeCache.txt"; then
  echo "error: the mathematics alone asks for libraries that it does not use" >&2
  exit 1
fi
configure all -DNEPHELE_ALL_PARTS=ON
cmake --build "$folder/all" >"$folder/log" || { cat "$folder/log"; exit 1; }
"$folder/all/fields"
"$folder/all/picture"
if find "$folder/prefix/include" -path '*/detail/*' | grep .; then
  echo "error: private headers are installed" >&2
  exit 1
fi
echo "consumers: good"
