#include "nephele/levelset/cut/knives.h"

#include "nephele/levelset/mesh/mesh_distance.h"

namespace nephele {

Knife solidKnife(const Mesh& solid, double voxelSize, float kerf, const Progress& progress) {
  const double band = 0.5 * double(kerf) + 4 * voxelSize;
  return {
      meshDistance(solid, {.voxelSize = voxelSize, .exteriorBand = band, .interiorBand = band}, progress)};
}

std::vector<Knife> asFields(const Knives& knives, double voxelSize, float kerf, const Progress& progress) {
  std::vector<Knife> fields;
  for (const BladePlane& plane : knives.planes) fields.push_back(flatKnife(plane));
  for (const RoughBlade& blade : knives.rough) fields.push_back(roughKnife(blade.plane, blade.roughness));
  const std::size_t firstSolid = fields.size();
  for (std::size_t i = 0; i < knives.solids.size(); ++i) {
    const Mesh& solid = knives.solids[i];
    std::size_t same = 0;
    while (knives.solids[same].positions != solid.positions || knives.solids[same].corners != solid.corners)
      ++same;
    if (same < i)
      fields.push_back(fields[firstSolid + same]);
    else
      fields.push_back(solidKnife(solid, voxelSize, kerf, progress));
  }
  fields.insert(fields.end(), knives.fields.begin(), knives.fields.end());
  return fields;
}

}  // namespace nephele
