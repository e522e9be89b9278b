#include <fmt/format.h>

#include <atomic>
#include <cmath>

#include "nephele/levelset/cloud/attribute_field.h"
#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/felt/detail/functions.h"
#include "nephele/levelset/felt/domain_samples.h"
#include "nephele/levelset/felt/field_extent.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/base/octant.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::felt {

namespace {

using S = ScalarField;
using ShapePtr = std::shared_ptr<const Shape>;

constexpr int kFewestVoxels = 4, kMostVoxels = 4096;
/// What closes a shape at the faces of a domain: so far below any value that the surface stays in the face.
constexpr float kFarOutside = -1e30f;

ShapePtr shapeOf(Mesh mesh, std::string name) {
  if (mesh.faceCount() == 0)
    throw CallError(Code::failed,
                    "the field is nowhere above 0 where it was sampled, so that there is no shape",
                    "shapes are where a field is above 0");
  return std::make_shared<const Shape>(Shape{std::move(mesh), std::move(name)});
}

/// Whether an edge that the surface crosses ends at a value that a constant stands for.
bool isCutShort(const BrickGrid& grid, float band) {
  const std::vector<PlacedBrick> placed = placedBricks(grid);
  std::atomic<bool> found = false;
  parallelFor(placed.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end && !found; ++b) {
      const Interval& range = grid.ranges()[std::size_t(placed[b].pool)];
      if (range.min > 0 || range.max <= 0) continue;
      const float* brick = grid.brick(placed[b].pool);
      for (int s = 0; s < kBrickSamples; ++s) {
        const Vec3i at{s % kBrickSide, s / kBrickSide % kBrickSide, s / (kBrickSide * kBrickSide)};
        const float v = brick[sampleOffset(at)];
        for (int axis = 0; axis < 3; ++axis) {
          Vec3i beside = at;
          ++beside[axis];
          const float w = brick[sampleOffset(beside)];
          if ((v > 0) != (w > 0) && (std::abs(v) == band || std::abs(w) == band)) found = true;
        }
      }
    }
  });
  return found;
}

/// The share of a box in which ranges leave open whether `level` is within the band.
double unsettledShare(const S& level, const Box& box, const Interval& band, int splits) {
  const Interval range = level.range(box);
  if (range.min > band.max || range.max < band.min) return 0;
  if (splits == 0) return 1;
  const S local = level.restrictedTo(box);
  double share = 0;
  for (int part = 0; part < 8; ++part)
    share += unsettledShare(local, octant(box, part), band, splits - 1) / 8;
  return share;
}

/// @throws CallError if the samples that the band may need take more memory than is allowed.
void requireRoomForSurface(const S& level, const BakeOptions& options, const Context& context) {
  // Parts of the box are told apart down to some 16 voxels.
  constexpr double kMaking = 1.5, kVoxels = 16;
  constexpr int kMostSplits = 7;
  const Vec3f size = options.box.size() * (1 / options.voxelSize);
  const double dense = double(size.x + 8) * (size.y + 8) * (size.z + 8) / kBrickSamples * BrickGrid::kVolume *
                       sizeof(float) * kMaking;
  const double longest = double(options.box.longestSide() / options.voxelSize);
  const int splits = std::clamp(int(std::log2(longest / kVoxels)), 0, kMostSplits);
  requireBytes(dense * unsettledShare(level, options.box, options.band, splits),
               fmt::format("a surface in {:.0f} x {:.0f} x {:.0f} cells", size.x + 1, size.y + 1, size.z + 1),
               "ask for fewer cells", context);
}

/// The samples of a level set that its surface needs. Values beyond a band are constants: one of two voxels
/// suits distances, and where a field is steeper it grows until it holds all that stands beside the surface.
std::shared_ptr<BrickGrid> samplesOfSurface(const S& level, BakeOptions options, float voxel,
                                            const Context& context) {
  constexpr float kVoxels = 2, kGrowth = 8;
  for (float band = kVoxels * voxel;; band *= kGrowth) {
    options.band = {-band, band};
    requireRoomForSurface(level, options, context);
    auto grid = bakeGrid(level, options, *context.progress);
    if (!std::isfinite(band) || !isCutShort(*grid, band)) return grid;
  }
}

ShapePtr surfaceWithin(const Context& context, const S& level, const Domain& domain) {
  requireValid(domain);
  const auto cells = domain.cells();
  const Vec3f last(float(cells.x), float(cells.y), float(cells.z));
  const Affine toWorld = sampleToWorld(domain);
  const Lattice lattice = Lattice::of(toWorld);
  const auto grid = samplesOfSurface(transformed(level, inverse(toWorld)),
                                     {.voxelSize = 1,
                                      .box = {{0.5f, 0.5f, 0.5f}, last - Vec3f(0.5f, 0.5f, 0.5f)},
                                      .background = kFarOutside},
                                     lattice.voxelSize, context);
  grid->setLattice(lattice);
  return shapeOf(marchingCubes(*grid, 0, *context.progress), "surface");
}

ShapePtr surface(const Context& context, const S& level, std::int64_t resolution) {
  const int voxels = inRange("resolution", resolution, kFewestVoxels, kMostVoxels);
  const Box box = extentOf(level, *context.progress);
  const float voxel = box.longestSide() / float(voxels);
  const auto grid =
      samplesOfSurface(level, {.voxelSize = voxel, .box = box.expanded(2 * voxel)}, voxel, context);
  return shapeOf(marchingCubes(*grid, 0, *context.progress), "surface");
}

/// @throws CallError if a level set of that mesh takes more memory than is allowed.
void requireRoomForBand(const Mesh& solid, double voxelSize, const Context& context) {
  // What is made of a level set is there beside it.
  requireBytes(2 * estimateLevelSetBytes(solid, {.voxelSize = voxelSize}), "the level set of the shape",
               "use larger voxels", context);
}

S distanceTo(const Context& context, const Shape& shape, double voxelSize, const Mesh& solid) {
  const double reach = double(boundingBox(solid).longestSide()) / 2;
  if (!(voxelSize < reach / 2))
    throw CallError(
        Code::outOfRange,
        fmt::format("voxel is {:g}, and must be below a quarter of the shape's longest side, {:g}", voxelSize,
                    reach / 2));
  requireRoomForBand(solid, voxelSize, context);
  const S level = namingFile(shape.name, [&] {
    return meshDistance(solid, {.voxelSize = voxelSize, .exteriorBand = reach, .interiorBand = reach},
                        *context.progress);
  });
  return endingAt(level, boundingBox(solid).expanded(static_cast<float>(voxelSize)), 1);
}

/// A field is no distance, which the width of a cut is measured by: that from its surface is.
Knife bladeOf(const S& field, const Mesh& solid, double voxel, float kerf, const Context& context) {
  if (!(kerf > 0)) return field;
  const auto samples = sampledBlade(field, boundingBox(solid), voxel, kerf, *context.progress);
  const Mesh blade = marchingCubes(*samples, 0.0f, *context.progress);
  return blade.faceCount() == 0 ? Knife{field} : solidKnife(blade, voxel, kerf, *context.progress);
}

std::vector<Value> cut(const Context& context, const Shape& shape, const Array& knives,
                       std::int64_t resolution, double kerf) {
  const int voxels = inRange("resolution", resolution, kFewestVoxels, kMostVoxels);
  const Mesh solid = solidOf(shape, context);
  const double voxel = double(boundingBox(solid).longestSide()) / voxels;
  requireRoomForBand(solid, voxel, context);
  Knives blades;
  for (const Value& knife : *knives)
    blades.fields.push_back(bladeOf(knife.as<S>(), solid, voxel, static_cast<float>(kerf), context));
  const auto level = toBricks(meshToLevelSet(solid, {.voxelSize = voxel}, *context.progress));
  CutOptions options;
  options.kerf = static_cast<float>(kerf);
  std::vector<Value> pieces;
  for (Piece& piece : cutIntoMeshes(*level, blades, options, *context.progress).pieces) {
    std::string name = shape.name + " ";
    for (const bool side : piece.code.sides) name += side ? '+' : '-';
    pieces.emplace_back(shapeOf(std::move(piece.mesh), std::move(name)));
  }
  return pieces;
}

ShapePtr withAttribute(const Shape& shape, const std::string& name, const S& f) {
  Shape result = shape;
  const std::size_t count = result.mesh.positions.size();
  std::vector<float> x(count), y(count), z(count), values(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f p = toFloat(result.mesh.positions[i]);
    x[i] = p.x, y[i] = p.y, z[i] = p.z;
  }
  f.eval({x, y, z}, values);
  if (const auto part = attributePart(shape.mesh, name)) {
    MeshAttribute& attribute = result.mesh.attributes[part->attribute];
    const auto width = std::size_t(attribute.width);
    for (std::size_t i = 0; i < count; ++i)
      attribute.values[i * width + std::size_t(part->component)] = values[i];
    return std::make_shared<const Shape>(std::move(result));
  }
  std::erase_if(result.mesh.attributes, [&](const MeshAttribute& old) { return old.name == name; });
  result.mesh.attributes.push_back({name, MeshAttribute::Domain::vertex, 1, std::move(values)});
  return std::make_shared<const Shape>(std::move(result));
}

void addSurfaces(Registry& r) {
  r.add(
      "shape ls2shape(scalarfield f, int resolution = 128)",
      "The surface of a level set, closed, with so many voxels along its longest side. Where the inside is "
      "found by the ranges of the field; where they show no end of it, give a domain.",
      "shape ball = ls2shape(sphere((0,0,0), 1), 32);",
      [](Context& context, const S& f, std::int64_t resolution) { return surface(context, f, resolution); });
  r.add(
      "shape ls2shape(scalarfield f, domain box)",
      "The surface of a level set within a domain, at its cells. What reaches out of the domain is closed at "
      "its faces.",
      "shape dome = ls2shape(sphere((0,0,0), 1), domain((-1.2,0,-1.2), (2.4,1.2,2.4), 0.1));",
      [](Context& context, const S& f, const Domain& box) { return surfaceWithin(context, f, box); });
  r.add("scalarfield shape2ls(shape s, int resolution = 128)",
        "Distance to a shape, positive inside, with so many voxels along its longest side; far from "
        "it the distance to its box. Shapes that are not closed are repaired.",
        "scalarfield level = shape2ls(ls2shape(sphere((0,0,0), 1), 32), 32);",
        [](Context& context, const ShapePtr& s, std::int64_t resolution) {
          const int voxels = inRange("resolution", resolution, kFewestVoxels + 1, kMostVoxels);
          const Mesh solid = solidOf(*s, context);
          return distanceTo(context, *s, double(boundingBox(solid).longestSide()) / voxels, solid);
        });
  r.add("scalarfield shape2ls(shape s, float voxel)",
        "Distance to a shape, positive inside, with voxels of that size near its surface.",
        "scalarfield level = shape2ls(ls2shape(sphere((0,0,0), 1), 32), voxel = 0.1);",
        [](Context& context, const ShapePtr& s, double voxel) {
          return distanceTo(context, *s, double(positive("voxel", voxel)), solidOf(*s, context));
        });
}

}  // namespace

S endingAt(const S& level, const Box& box, float slope) {
  return intersection(level, slope * nephele::box(box));
}

Mesh solidOf(const Shape& shape, const Context& context) {
  RepairedMesh repaired =
      namingFile(shape.name, [&] { return repairMesh(shape.mesh, {}, *context.progress); });
  for (const std::string& what : repaired.repairs) context.progress->note(shape.name + ": " + what);
  return std::move(repaired.mesh);
}

void addMeshFunctions(Registry& r) {
  r.group("surfaces");
  addSurfaces(r);
  r.add(
      "domain bounds(shape s, float margin, float cell)",
      "The box of a shape, grown by a margin on every side, with cells of one size.",
      "shape ball = ls2shape(sphere((0,0,0), 1), 32);\nscalarfield level = bake(shape2ls(ball), bounds(ball, "
      "0.2, 0.1));",
      [](const ShapePtr& s, double margin, double cell) {
        const Box box = boundingBox(s->mesh).expanded(static_cast<float>(margin));
        Domain domain{toDouble(box.min), toDouble(box.size()), {}, {cell, cell, cell}};
        requireValid(domain);
        return domain;
      });
  r.add(
      "scalarfield attribute(shape s, string name)",
      "What the vertices of a shape have under a name, at the nearest point of its surface: \"wetness\", or "
      "\"color.r\".",
      "shape ball = setattribute(ls2shape(sphere((0,0,0), 1), 16), \"wetness\", identity().y);\n"
      "scalarfield wetness = attribute(ball, \"wetness\");",
      [](Context& context, const ShapePtr& s, const std::string& name) {
        return attributeField(triangulated(s->mesh), name, {}, *context.progress);
      });
  r.add("shape setattribute(shape s, string name, scalarfield f)",
        "A shape whose vertices have the values of a field under a name; a .ply file keeps them.",
        "shape ball = setattribute(ls2shape(sphere((0,0,0), 1), 16), \"height\", identity().y);",
        [](const ShapePtr& s, const std::string& name, const S& f) { return withAttribute(*s, name, f); });
  r.add(
      "shape[] cut(shape s, scalarfield[] knives, int resolution = 128, float kerf = 0)",
      "The pieces that knives part a shape into, closed and fitting each other; `kerf` is the width of the "
      "cuts. The shape is cut as a level set with so many voxels along its longest side.",
      "shape[] halves = cut(ls2shape(sphere((0,0,0), 1), 32), [plane((0,0,0), (1,0,0))], 32);",
      [](Context& context, const ShapePtr& s, const Array& knives, std::int64_t resolution, double kerf) {
        return Array(std::make_shared<const std::vector<Value>>(cut(context, *s, knives, resolution, kerf)));
      });
}

}  // namespace nephele::felt
