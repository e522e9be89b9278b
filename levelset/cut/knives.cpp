#include "nephele/levelset/cut/knives.h"

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {

Knife solidKnife(const Mesh& solid, double voxelSize, float kerf, const Progress& progress) {
  const double band = 0.5 * double(kerf) + 4 * voxelSize;
  return {
      meshDistance(solid, {.voxelSize = voxelSize, .exteriorBand = band, .interiorBand = band}, progress)};
}

std::shared_ptr<BrickGrid> sampledBlade(const ScalarField& field, const Box& box, double voxelSize,
                                        float kerf, const Progress& progress) {
  const auto voxel = float(voxelSize);
  // The walls of the inner side stand half the kerf further in than those of the field.
  const Box room = box.expanded(0.05f * box.longestSide() + 4 * voxel + 0.5f * kerf);
  const float band = 0.5f * kerf + 3 * voxel;
  return bakeGrid(intersection(field, nephele::box(room)),
                  {.voxelSize = voxel, .box = room.expanded(0.5f * kerf + 2 * voxel), .band = {-band, band}},
                  progress);
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
