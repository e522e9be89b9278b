#include <algorithm>

#include "nephele/levelset/cloud/layers_on_grids.h"
#include "nephele/levelset/felt/detail/functions.h"
#include "nephele/levelset/felt/domain_samples.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/modeling/base/system.h"
#include "nephele/modeling/cloud/nacelle.h"

namespace nephele::felt {

namespace {

using S = ScalarField;
using ShapePtr = std::shared_ptr<const Shape>;

/// As `nephele cloud` grows its layers: on the distance to the mesh, each on a grid of its own.
S grown(const Context& context, const Shape& shape, float voxelSize, const CumuloFractal& fractal) {
  const Mesh solid = solidOf(shape, context);
  const std::vector<CumuloLayer> layers = cumuloLayers(fractal);
  const Box box = boundingBox(solid);
  requireBytes(estimatedCumuloBytes(layers, voxelSize, surfaceArea(solid), box).peak, "the layers",
               "use larger voxels or fewer layers", context);
  const S base = meshDistance(solid,
                              {.voxelSize = voxelSize,
                               .exteriorBand = cumuloExteriorBand(layers, voxelSize),
                               .interiorBand = cumuloInteriorBand(layers, voxelSize)},
                              *context.progress);
  const GriddedCumulo cumulo =
      griddedCumulo(base, layers, {.voxelSize = voxelSize, .box = box, .closestPoint = closestPoint(solid)},
                    *context.progress);
  // Sums of layers are up to twice as steep as distances.
  constexpr float kSlope = 4;
  return endingAt(cumulo.surface, cumulo.box.expanded(voxelSize), kSlope);
}

}  // namespace

void addGriddedCloudFunctions(Registry& r) {
  r.group("clouds");
  r.add(
      "scalarfield cumulo(shape s, float voxel, int layers = 4, scalarfield amplitude = 2.5%, scalarfield "
      "frequency = 4.4x, scalarfield lacunarity = 2.1, scalarfield roughness = 0.55, scalarfield billow = 1, "
      "scalarfield billowscale = 1, string noise = \"perlin\", int seed = 0)",
      "The cloud that `nephele cloud` grows on a shape, as a level set: positive inside, no distance. Every "
      "layer is sampled on a grid that suits it, for a result with voxels of that size. The verb has other "
      "defaults: a roughness of 0.65, a billow of 0.5, and an amplitude that varies. "
      "mask(cumulo(...), thickness) is its density.",
      "scalarfield cloud = cumulo(ls2shape(sphere((0,0,0), 1), 24), 0.1, 2, amplitude = 0.05, frequency = "
      "2);\n"
      "scalarfield density = mask(cloud, 0.1);",
      [](Context& context, const ShapePtr& s, double voxel, std::int64_t layers, const S& amplitude,
         const S& frequency, const S& lacunarity, const S& roughness, const S& billow, const S& billowScale,
         const std::string& noise, std::int64_t seed) {
        CumuloFractal fractal;
        fractal.layers = inRange("layers", layers, 1, kMaxCumuloLayers);
        fractal.noise.kind = noiseKindOf(noise);
        fractal.amplitude = amplitude;
        fractal.frequency = frequency;
        fractal.lacunarity = lacunarity;
        fractal.roughness = roughness;
        fractal.billow = billow;
        fractal.billowScale = billowScale;
        fractal.seed = static_cast<std::uint32_t>(inRange("seed", seed, 0, 2147483647));
        return grown(context, *s, positive("voxel", voxel), fractal);
      });
  r.add(
      "vectorfield nacelle(scalarfield object, scalarfield reference, domain box, int iterations = 3)",
      "The warp field between two shapes, as `nacelle` without a domain, of second order: what the "
      "iterations need of the reference's curvature is sampled on the domain once instead of evaluated each "
      "time.",
      "vectorfield map = nacelle(sphere((0,0,0), 1.3), sphere((0,0,0), 1), domain((-2,-2,-2), (4,4,4), "
      "0.1));",
      [](Context& context, const S& object, const S& reference, const Domain& box, std::int64_t iterations) {
        NacelleOptions options;
        options.steps = inRange("iterations", iterations, 1, 20);
        options.order = 2;
        options.voxel = static_cast<float>(std::min({box.cell.x, box.cell.y, box.cell.z}));
        options.bake = [&](const S& field) { return sampled(field, box, context); };
        return nacelle(object, reference, options);
      });
}

}  // namespace nephele::felt
