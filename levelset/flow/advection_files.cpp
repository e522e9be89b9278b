// Volume files to what advection works on, and back. Scalars and vectors become bricks, vectors one grid for
// each component; what they were is kept beside them, so that results carry the same names and metadata.
//
// The file of a map keeps every brick whole, those beside the matter too: a map that is read back continues
// exactly as the one that was written. Its displacement is 0 where nothing is kept, so that others can
// interpolate it.
#include "nephele/levelset/flow/advection_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "nephele/levelset/grid/brick_growth.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr const char* kMapGrid = "displacement";
constexpr const char* kRestGrid = "rest";
constexpr const char* kMapKind = "map_kind";
constexpr const char* kMapKindValue = "X - x, world units";

/// The label of a grid whose values are now those of `bricks`.
VdbGridLabel labelFor(const VdbGrid& original, const BrickGrid& bricks) {
  VdbGridLabel label = labelOf(original);
  // Fog that is not 0 outside keeps its values; its class comes back with the metadata.
  if (label.gridClass == VdbGridInfo::Class::fogVolume && bricks.background() != 0)
    label.gridClass = VdbGridInfo::Class::unknown;
  return label;
}

/// The bricks of a map, with value(voxel, displacement) at each of their voxels.
template <class Value>
VoxelGrid<Vec3f> voxelsOf(const FlowMap& map, const Value& value) {
  VoxelGrid<Vec3f> result("map", map.lattice, Vec3f{});
  for (const Vec3i& brick : map.bricks) result.add(brick);
  parallelFor(map.bricks.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3i& brick = map.bricks[i];
      const float* own[3];
      for (std::size_t c = 0; c < 3; ++c)
        own[c] = map.displacement[c]->brick(map.displacement[c]->poolIndex(brick));
      Vec3f* target = result.samples(std::int32_t(i));
      for (int z = 0; z < kBrickSide; ++z)
        for (int y = 0; y < kBrickSide; ++y)
          for (int x = 0; x < kBrickSide; ++x) {
            const int o = sampleOffset(x, y, z);
            *target++ = value(brick * kBrickSide + Vec3i{x, y, z}, Vec3f{own[0][o], own[1][o], own[2][o]});
          }
    }
  });
  return result;
}

/// The displacement in a file, or null.
const VdbGrid* mapAmong(const std::vector<VdbGrid>& grids) {
  for (const VdbGrid& grid : grids)
    if (labelOf(grid).name == kMapGrid && valuesOf(grid) == VdbValues::vector &&
        metadataOf(grid, kMapKind) == kMapKindValue)
      return &grid;
  return nullptr;
}

}  // namespace

CarriedGrids carriedGrids(const std::vector<VdbGrid>& grids) {
  CarriedGrids result;
  for (const VdbGrid& grid : grids) {
    if (valuesOf(grid) == VdbValues::vector) {
      for (const VdbGrid& component : vectorComponents(grid)) result.bricks.push_back(toBricks(component));
    } else if (valuesOf(grid) == VdbValues::scalar) {
      result.bricks.push_back(toBricks(grid));
    } else {
      const VdbGridInfo info = describe(grid);
      result.leftOut.push_back(fmt::format("{} ({})", info.name, info.type));
      continue;
    }
    result.originals.push_back(grid);
    if (const Box box = contentBox(grid); !box.isEmpty())
      result.box = result.box.including(box.min).including(box.max);
  }
  if (!result.originals.empty()) requireWritable(result.originals);
  return result;
}

std::vector<VdbGrid> toVdb(const CarriedGrids& like,
                           const std::vector<std::shared_ptr<const BrickGrid>>& bricks) {
  require(bricks.size() == like.bricks.size(), "toVdb: one grid of bricks is needed for each that was read");
  std::vector<VdbGrid> result;
  std::size_t next = 0;
  for (const VdbGrid& original : like.originals) {
    const VdbGridLabel label = labelFor(original, *bricks[next]);
    if (valuesOf(original) == VdbValues::vector) {
      result.push_back(toVdb(VectorGrids{bricks[next], bricks[next + 1], bricks[next + 2]}, label));
      next += 3;
    } else {
      result.push_back(toVdb(*bricks[next], label));
      next += 1;
    }
    copyMetadata(original, result.back());
  }
  return result;
}

std::vector<VdbGrid> toVdb(const FlowMap& map) {
  const auto displacement = [](const Vec3i&, const Vec3f& d) { return d; };
  const auto rest = [&map](const Vec3i& voxel, const Vec3f& d) {
    return d + map.lattice.indexToWorld(Vec3f(voxel));
  };
  return {toVdb(voxelsOf(map, displacement), {.name = kMapGrid, .metadata = {{kMapKind, kMapKindValue}}}),
          toVdb(voxelsOf(map, rest), {.name = kRestGrid})};
}

FlowMap readFlowMap(const std::string& path) {
  const std::vector<VdbGrid> grids = readVdbFile(path);
  const VdbGrid* file = mapAmong(grids);
  if (!file)
    throw Error(
        fmt::format("{}: no map of a flow, which has a grid '{}'; {}", path, kMapGrid, listOf(grids)));
  const VoxelGrid<Vec3f> voxels = toVectorVoxels(*file);
  FlowMap map;
  map.lattice = voxels.lattice();
  detail::GrownBricks grown(3);
  voxels.forEachBrick([&](const Vec3i& brick, std::int32_t number) {
    if (number < 0) return;
    grown.bricks.push_back(brick);
    float* target = grown.samples.samples(grown.samples.add(brick));
    const Vec3f* values = voxels.samples(number);
    for (int i = 0; i < kBrickSamples; ++i)
      for (int c = 0; c < 3; ++c) target[c * kBrickSamples + i] = values[i][c];
  });
  if (grown.bricks.empty()) return map;
  const float zero[3] = {};
  const auto parts = detail::assembleGrids(grown, map.lattice, zero, detail::Beyond::nearest);
  map.displacement = {parts[0], parts[1], parts[2]};
  map.bricks = std::move(grown.bricks);
  std::sort(map.bricks.begin(), map.bricks.end(), comesBefore);
  return map;
}

VectorField readVelocity(const std::string& path, const std::string& name) {
  std::string wanted = name;
  if (wanted.empty()) {
    const std::vector<VdbGrid> grids = readVdbHeaders(path);
    std::vector<std::string> vectors;
    for (const VdbGrid& grid : grids)
      if (valuesOf(grid) == VdbValues::vector) vectors.push_back(labelOf(grid).name);
    for (const std::string usual : {"velocity", "vel", "v"})
      if (std::count(vectors.begin(), vectors.end(), usual) > 0) wanted = usual;
    if (wanted.empty()) {
      if (vectors.empty())
        throw Error(
            fmt::format("{}: no velocity, which is a grid of vectors (vec3s); {}", path, listOf(grids)));
      if (vectors.size() > 1)
        throw Error(fmt::format("{}: several grids of vectors, none called v, vel or velocity; {}; say which",
                                path, listOf(grids)));
      wanted = vectors.front();
    }
  }
  const std::array<VdbGrid, 3> parts = readVectorGrid(path, wanted);
  VectorGrids grids;
  namingFile(path, [&] {
    for (std::size_t c = 0; c < 3; ++c) grids[c] = toBricks(parts[c]);
  });
  return gridField(std::move(grids), Interpolation::trilinear);
}

}  // namespace nephele
