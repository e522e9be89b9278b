#include "nephele/modeling/felt/detail/functions.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/cloud_shapes.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/knives.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::felt {

namespace {

using S = ScalarField;

CloudSpecies speciesCalled(const std::string& name) {
  std::string all;
  for (const CloudSpecies species : cloudSpecies()) {
    if (speciesName(species) == name) return species;
    all += (all.empty() ? "" : ", ") + std::string(speciesName(species));
  }
  throw CallError(Code::outOfRange, "there is no species '" + name + "'", "there are " + all);
}

void addSolids(Registry& r) {
  r.add("scalarfield sphere(vector center, float radius)", "Distance to a sphere, positive inside.",
        "scalarfield s = sphere((0,0,0), 1);", [](const Vec3d& center, double radius) {
          return sphere(finite("center", center), finite("radius", radius));
        });
  r.add(
      "scalarfield box(vector center, vector lengths)", "Distance to a box along the axes, positive inside.",
      "scalarfield b = box((0,0,0), (2,1,1));", [](const Vec3d& center, const Vec3d& lengths) {
        return box(Box{finite("center", center - lengths * 0.5), finite("lengths", center + lengths * 0.5)});
      });
  r.add("scalarfield plane(vector point, vector normal)",
        "Distance to a plane, positive where the normal points.",
        "scalarfield above = plane((0,0,0), (0,1,0));", [](const Vec3d& point, const Vec3d& normal) {
          return plane(finite("point", point), finite("normal", normal));
        });
  r.add("scalarfield torus(vector center, vector axis, float radius, float tube)",
        "Distance to a ring, positive inside: from its centre to the middle of the tube it is `radius`, the "
        "tube is `tube` thick to each side.",
        "scalarfield ring = torus((0,0,0), (0,1,0), 1, 0.25);",
        [](const Vec3d& center, const Vec3d& axis, double radius, double tube) {
          return torus({finite("center", center), finite("axis", axis), finite("radius", radius),
                        finite("tube", tube)});
        });
  r.add("scalarfield cone(vector apex, vector base, float radius)",
        "Distance to a cone with a flat base, positive inside.",
        "scalarfield c = cone((0,1,0), (0,0,0), 0.5);",
        [](const Vec3d& apex, const Vec3d& base, double radius) {
          return cone({finite("apex", apex), finite("base", base), finite("radius", radius)});
        });
  r.add("scalarfield capsule(vector a, vector b, float radius)", "Distance to a thick line, positive inside.",
        "scalarfield c = capsule((0,0,0), (0,1,0), 0.3);", [](const Vec3d& a, const Vec3d& b, double radius) {
          return capsule(finite("a", a), finite("b", b), finite("radius", radius));
        });
  r.add("scalarfield ellipsoid(vector center, vector radii)",
        "An ellipsoid, positive inside; a distance near its surface.",
        "scalarfield e = ellipsoid((0,0,0), (1,0.5,1));", [](const Vec3d& center, const Vec3d& radii) {
          return ellipsoid(finite("center", center), finite("radii", radii));
        });
  r.add("scalarfield cloudshape(string species = \"mediocris\", int seed = 0, float size = 1)",
        "A cumulus without detail that stands on y = 0: humilis, mediocris or congestus.",
        "scalarfield base = cloudshape(\"congestus\", seed = 4);",
        [](const std::string& species, std::int64_t seed, double size) {
          return cloudShape({speciesCalled(species), seedOf(seed), finite("size", size)}).level;
        });
}

void addCombinations(Registry& r) {
  r.add("scalarfield union(scalarfield a, scalarfield b)", "Inside either.",
        "scalarfield two = union(sphere((0,0,0), 1), sphere((1,0,0), 1));",
        [](const S& a, const S& b) { return unionOf(a, b); });
  r.add("scalarfield intersection(scalarfield a, scalarfield b)", "Inside both.",
        "scalarfield lens = intersection(sphere((0,0,0), 1), sphere((1,0,0), 1));",
        [](const S& a, const S& b) { return intersection(a, b); });
  r.add("scalarfield cutout(scalarfield a, scalarfield b)", "Inside `a` but not inside `b`.",
        "scalarfield moon = cutout(sphere((0,0,0), 1), sphere((0.5,0,0), 0.8));",
        [](const S& a, const S& b) { return cutout(a, b); });
  r.add("scalarfield blend(scalarfield a, scalarfield b, float radius)", "Inside either, joined by a fillet.",
        "scalarfield smooth = blend(sphere((0,0,0), 1), sphere((1.5,0,0), 1), 0.4);",
        [](const S& a, const S& b, double radius) { return blend(a, b, finite("radius", radius)); });
  r.add("scalarfield shell(scalarfield l, float thickness)", "The skin of a shape, half of it to each side.",
        "scalarfield skin = shell(sphere((0,0,0), 1), 0.1);",
        [](const S& l, double thickness) { return shell(l, finite("thickness", thickness)); });
  r.add("scalarfield dilate(scalarfield l, scalarfield distance)",
        "A shape grown by a distance, which may vary.",
        "scalarfield larger = dilate(sphere((0,0,0), 1), 0.2);",
        [](const S& l, const S& distance) { return dilate(l, distance); });
  r.add(
      "scalarfield roughplane(vector point, vector normal, float amplitude, float frequency, int octaves = "
      "4, float roughness = 0.5, int seed = 0)",
      "A plane with hills of that rms, as a knife that breaks.",
      "scalarfield knife = roughplane((0,0,0), (0,1,0), 0.05, 3);",
      [](const Vec3d& point, const Vec3d& normal, double amplitude, double frequency, std::int64_t octaves,
         double roughness, std::int64_t seed) {
        RoughnessOptions options;
        options.amplitude = finite("amplitude", amplitude);
        options.noise.frequency = finite("frequency", frequency);
        options.noise.seed = seedOf(seed);
        options.octaves = inRange("octaves", octaves, 1, 32);
        options.roughness = finite("roughness", roughness);
        return roughKnife({finite("point", point), finite("normal", normal)}, options).field;
      });
}

}  // namespace

void addShapeFunctions(Registry& r) {
  r.group("shapes");
  addSolids(r);
  addCombinations(r);
}

}  // namespace nephele::felt
