#!/bin/sh
# Dependencies run modeling <- levelset <- render <- apps, and the mathematics knows no file or grid library.
set -u
cd "$(dirname "$0")/.."
failed=0

# forbid FOLDER PATTERN MEANING
forbid() {
  if grep -rnE "#include *[<\"]($2)" "$1" --include='*.h' --include='*.cpp'; then
    echo "error: $1/ $3" >&2
    failed=1
  fi
}

forbid modeling '(levelset|render|apps)/' 'must not include from the folders that stand on it'
forbid modeling '(openvdb|nanovdb|CGAL|OpenMesh|embree|OpenEXR|Imf|OpenImageIO|assimp)' \
  'must not include grid, mesh or image libraries'
forbid levelset '(render|apps)/' 'must not include from render/ or apps/'
forbid render 'apps/' 'must not include from apps/'

[ "$failed" -eq 0 ] && echo "include directions: good"
exit "$failed"
