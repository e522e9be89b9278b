// Vertex attributes for a mesh that was made from another: by equal positions, else by closest point.
#include "nephele/levelset/mesh/detail/vertex_attributes.h"

#include <limits>

#include "nephele/levelset/mesh/surface_values.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

Mesh withVertexAttributesOf(const Mesh& source, Mesh target) {
  target.attributes.clear();
  std::vector<const MeshAttribute*> attributes;
  for (const MeshAttribute& a : source.attributes)
    if (a.domain == MeshAttribute::Domain::vertex) attributes.push_back(&a);
  if (attributes.empty()) return target;

  std::vector<Vec3d> positions = source.positions;
  positions.insert(positions.end(), target.positions.begin(), target.positions.end());
  const std::vector<std::uint32_t> first = firstEqualPosition(positions);
  const std::size_t sourceCount = source.positions.size(), count = target.positions.size();

  struct Origin {
    std::uint32_t vertices[3];
    Vec3d weights;
  };
  std::vector<Origin> origins(count);
  const NearestOnMesh nearest(source);
  parallelFor(count, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      if (const std::uint32_t same = first[sourceCount + v]; same < sourceCount) {
        origins[v] = {{same, same, same}, {1, 0, 0}};
        continue;
      }
      const auto hit = nearest.nearest(Vec3f(target.positions[v]), std::numeric_limits<float>::infinity());
      const auto face = source.face(hit ? hit->triangle : 0);
      origins[v] = {
          {face[0], face[1], face[2]},
          barycentrics(hit ? Vec3d(hit->point) : source.positions[face[0]], source.positions[face[0]],
                       source.positions[face[1]], source.positions[face[2]])};
    }
  });
  for (const MeshAttribute* a : attributes) {
    const auto width = std::size_t(a->width);
    MeshAttribute carried{a->name, a->domain, a->width, std::vector<float>(count * width)};
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t k = 0; k < width; ++k) {
        double sum = 0;
        // A weight of 0 keeps what is not finite at that corner out.
        for (int i = 0; i < 3; ++i)
          if (origins[v].weights[i] > 0)
            sum += origins[v].weights[i] * double(a->values[origins[v].vertices[i] * width + k]);
        carried.values[v * width + k] = float(sum);
      }
    target.attributes.push_back(std::move(carried));
  }
  return target;
}

}  // namespace nephele::detail
