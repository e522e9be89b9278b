#pragma once

#include "nephele/modeling/base/mesh.h"
#include "nephele/render/image/image.h"

namespace nephele {

/// A hare that sits up, looking along +x; closed, 20000 triangles, 2.2 units high.
Mesh hareMesh();

/// A clownfish that looks along +x, 2 units long; closed, of quads, with texture coordinates as a globe has.
Mesh clownfishMesh();
/// What is painted on it.
Image clownfishTexture(int width, int height);

/// A whale that looks along +x, 2.6 units long; closed, 20000 triangles, with texture coordinates in charts
/// that each look one way.
Mesh whaleMesh();

}  // namespace nephele
