#!/bin/sh
# Installs a build into a folder of its own and builds projects that use it: found by CMake and by pkg-config, with the
# mathematics alone and with all of it; and the mathematics alone from the sources, as a shared library.
# Usage: run.sh BUILD_FOLDER
set -eu
build=$1
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
prefix=$folder/prefix
quietly() { "$@" >"$folder/log" 2>&1 || { tail -n 40 "$folder/log"; exit 1; }; }
fail() { echo "error: $1" >&2; exit 1; }
quietly cmake --install "$build" --prefix "$prefix"
configure() {
  project=$1
  shift
  quietly cmake -G Ninja -S "$here" -B "$folder/$project" -DCMAKE_PREFIX_PATH="$prefix" "$@"
}
asksForMore() { grep -iE '^(OpenVDB|CGAL|OpenEXR|CLI11|tomlplusplus|Ceres|fftw)_DIR|(OpenVDB|FFTW)_.*=/' "$1/CMakeCache.txt"; }

configure modeling -DNEPHELE_ALL_PARTS=OFF
if asksForMore "$folder/modeling"; then fail "the mathematics alone asks for libraries that it does not use"; fi
configure all -DNEPHELE_ALL_PARTS=ON
quietly cmake --build "$folder/all"
"$folder/all/fields"
"$folder/all/picture"
if find "$prefix/include" -path '*/detail/*' | grep .; then fail "private headers are installed"; fi

# By pkg-config, and the sample of the README, which writes a volume.
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name nephele-render.pc)")
export PKG_CONFIG_PATH
compile() { quietly sh -c "c++ -O1 $1 -o $2 \$(pkg-config --cflags --libs $3)"; }
compile "$here/fields.cpp" "$folder/fields" nephele-modeling
"$folder/fields"
sed -n '/^```cpp$/,/^```$/{/^```/!p;}' "$root/README.md" >"$folder/readme.cpp"
compile "$folder/readme.cpp" "$folder/readme" nephele-render
(cd "$folder" && ./readme && test -s cloud.vdb) || fail "the sample of the README writes nothing"

# Module and program run from where they were installed.
"$prefix/bin/nephele" levelset "$root/data/sphere_uv.obj" --resolution 16 -o "$folder/levels.vdb" >/dev/null
if module=$(find "$prefix" -name '_nephele*.so' | grep .); then
  PYTHONPATH=$(dirname "$(dirname "$module")") /usr/bin/python3 -c 'import nephele; assert nephele.sphere((0, 0, 0), 1)((0, 0, 0)) == 1'
fi

configure subfolder -DNEPHELE_ALL_PARTS=OFF -DNEPHELE_SUBFOLDER="$root" -DNEPHELE_PARTS=modeling -DBUILD_SHARED_LIBS=ON -DCMAKE_BUILD_TYPE=Debug
if asksForMore "$folder/subfolder"; then fail "the mathematics alone asks for libraries that it does not use"; fi
quietly cmake --build "$folder/subfolder" --target fields
"$folder/subfolder/fields"
library=$(find "$folder/subfolder" -name 'libnephele_modeling.so.*' -type f)
if nm -DC --defined-only "$library" | grep -v nephele; then fail "the shared library shows names that are not ours"; fi
echo "consumers: good"
