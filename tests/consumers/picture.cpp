// A baked ball becomes a mesh and an image.
#include <nephele/levelset/grid/bake.h>
#include <nephele/levelset/mesh/marching_cubes.h>
#include <nephele/modeling/shape/shapes.h>
#include <nephele/render/image/image.h>

#include <cmath>

int main() {
  using namespace nephele;
  const auto grid = bakeGrid(sphere({0, 0, 0}, 1.0f),
                             {.voxelSize = 0.1f, .box = {{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}});
  const Mesh mesh = marchingCubes(*grid);
  for (const Vec3d& p : mesh.positions)
    if (std::abs(length(p) - 1.0) > 0.01) return 1;
  const Image image;
  return mesh.positions.empty() || image.width < 0 ? 1 : 0;
}
