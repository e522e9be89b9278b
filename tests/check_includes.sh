#!/bin/sh
# Who may include whom: parts run modeling <- levelset <- render <- apps, the rooms inside a part run one way, what lies in a
# room's detail/ stays in that room and out of its public headers, and heavy libraries are seen where they belong.
set -u
cd "$(dirname "$0")/.."
failed=0

# Every room, and the rooms that it may include; tests and apps may include all.
rooms='
modeling/base
modeling/field    modeling/base
modeling/noise    modeling/base modeling/field
modeling/shape    modeling/base modeling/field modeling/noise
modeling/cloud    modeling/base modeling/field modeling/noise modeling/shape
modeling/felt     modeling/base modeling/field modeling/noise modeling/shape modeling/cloud
levelset/grid     modeling
levelset/mesh     modeling levelset/grid
levelset/io       modeling levelset/grid levelset/mesh
levelset/cloud    modeling levelset/grid levelset/mesh levelset/io
levelset/flow     modeling levelset/grid levelset/mesh levelset/io
levelset/cut      modeling levelset/grid levelset/mesh levelset/io
levelset/warp     modeling levelset/grid levelset/mesh levelset/io
levelset/felt     modeling levelset
render/image      modeling levelset
render/scene      modeling levelset render/image
render/volume     modeling levelset render/image render/scene
render/light      modeling levelset render/image render/scene render/volume
render/march      modeling levelset render/image render/scene render/volume render/light
render/preview    modeling levelset render/image render/scene render/volume render/light render/march
render/session    modeling levelset render/image render/scene render/volume render/light render/march render/preview
render/felt       modeling levelset render
'

grep -rn --include='*.h' --include='*.cpp' '^ *#include *"' modeling levelset render apps tests |
  ROOMS="$rooms" awk '
    function fail(message) {
      print "error: " at ": " message " (" included ")"; bad = 1
    }
    function roomOf(path,  part) { split(path, part, "/"); return part[1] "/" part[2] }
    BEGIN {
      count = split(ENVIRON["ROOMS"], line, "\n")
      for (i = 1; i <= count; ++i) {
        size = split(line[i], word, " ")
        for (k = 1; k <= size; ++k) may[word[1], word[k]] = 1
        if (size) known[word[1]] = 1
      }
    }
    {
      split($0, field, ":")
      file = field[1]; at = field[1] ":" field[2]
      included = $0; sub(/^[^"]*"/, "", included); sub(/".*/, "", included)
      from = roomOf(file); isRoom = from in known; part = substr(from, 1, index(from, "/") - 1)
      if ((part == "modeling" || part == "levelset" || part == "render") && !isRoom) fail("not in a room")
      target = included; sub(/^nephele\//, "", target)
      if (included !~ /^nephele\//) {
        if (included ~ /^(modeling|levelset|render)\//) fail("include it as nephele/...")
        if (isRoom && included ~ /^(apps|tests)\//) fail("a library must not include from apps/ or tests/")
        next
      }
      to = roomOf(target)
      if (!(to in known)) fail("no such room")
      if (isRoom && from != to && !((from, to) in may) && !((from, substr(to, 1, index(to, "/") - 1)) in may))
        fail(from " must not include from " to)
      if (index(target, "/detail/") && from != to) {
        mirrored = file; sub(/^tests\//, "", mirrored)
        if (mirrored == file) fail("detail/ of another room")
      }
      if (isRoom && index(target, "/detail/") && file ~ /\.h$/ && !index(file, "/detail/"))
        fail("a public header must not include detail/")
    }
    END { exit bad }' || failed=1

# onlyIn PATTERN PLACES MEANING
onlyIn() {
  if grep -rnE --include='*.h' --include='*.cpp' "#include *<($1)" modeling levelset render apps | grep -vE "^($2)"; then
    echo "error: $3" >&2
    failed=1
  fi
}

onlyIn '(openvdb|nanovdb)/' 'levelset/io/|levelset/grid/openvdb_|levelset/(mesh|cloud)/.*\.cpp' 'OpenVDB is for levelset/io, what bridges to it, and .cpp files that use a tool of it'
onlyIn 'CGAL/' 'levelset/(mesh|cut)/' 'CGAL is for levelset/mesh and levelset/cut alone'
onlyIn 'OpenMesh/' 'levelset/(mesh|warp)/' 'OpenMesh is for levelset/mesh and levelset/warp alone'
onlyIn 'embree' 'levelset/mesh/|render/scene/' 'Embree is for levelset/mesh and render/scene alone'
onlyIn 'OpenColorIO' 'render/image/' 'OpenColorIO is for render/image alone'
onlyIn '(OpenEXR|Imf|Imath)' 'render/image/' 'OpenEXR is for render/image alone'
onlyIn '(CLI|toml\+\+)/' 'apps/' 'CLI11 and toml++ are for apps/ alone'
onlyIn '(fftw3|kissfft)' 'modeling/noise/|levelset/flow/' 'Fourier transforms are for modeling/noise and levelset/flow alone'

[ "$failed" -eq 0 ] && echo "include directions: good"
exit "$failed"
