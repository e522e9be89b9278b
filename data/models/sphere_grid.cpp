#include "data/models/sphere_grid.h"

namespace nephele {

Mesh sphereGrid(int columns, int rows, const std::function<Vec3d(double u, double v)>& pointAt) {
  Mesh mesh;
  MeshAttribute uv{"uv", MeshAttribute::Domain::corner, 2, {}};
  mesh.positions.push_back(pointAt(0, 0));
  for (int j = 1; j < rows; ++j) {
    for (int i = 0; i < columns; ++i)
      mesh.positions.push_back(pointAt(double(i) / columns, double(j) / rows));
  }
  mesh.positions.push_back(pointAt(0, 1));
  const auto vertex = [&](int i, int j) {
    if (j == 0) return std::uint32_t(0);
    if (j == rows) return std::uint32_t(mesh.positions.size() - 1);
    return std::uint32_t(1 + (j - 1) * columns + i % columns);
  };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      std::vector<std::uint32_t> face;
      const auto add = [&](double u, int column, int row) {
        face.push_back(vertex(column, row));
        uv.values.insert(uv.values.end(), {float(u / columns), float(double(row) / rows)});
      };
      if (j == 0) add(i + 0.5, i, j);
      if (j > 0) add(i, i, j);
      if (j > 0) add(i + 1, i + 1, j);
      if (j + 1 < rows) add(i + 1, i + 1, j + 1);
      if (j + 1 < rows) add(i, i, j + 1);
      if (j + 1 == rows) add(i + 0.5, i, j + 1);
      mesh.addFace(face);
    }
  }
  mesh.attributes.push_back(uv);
  return mesh;
}

}  // namespace nephele
