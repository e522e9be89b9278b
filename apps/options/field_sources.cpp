#include "apps/options/field_sources.h"

#include <fmt/format.h>

#include <algorithm>

#include "nephele/levelset/cloud/attribute_field.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::apps {
namespace {

/// Voxel of the grids on which the surface is looked up. Parameters change over bumps, not within one; a
/// finer grid would cost more than the cloud.
float lookUpVoxel(double voxelSize, double longestSide) {
  return float(std::clamp(6 * voxelSize, longestSide / 96, longestSide / 64));
}

/// World box of the active voxels.
Box activeBox(const VdbGridInfo& info, const Affine& indexToWorld) {
  Box box;
  if (info.activeVoxels == 0) return box;
  for (int corner = 0; corner < 8; ++corner)
    box = box.including(indexToWorld({float(corner & 1 ? info.indexMax.x : info.indexMin.x),
                                      float(corner & 2 ? info.indexMax.y : info.indexMin.y),
                                      float(corner & 4 ? info.indexMax.z : info.indexMin.z)}));
  return box;
}

double volumeOf(const Box& box) {
  const Vec3f size = box.size();
  return double(size.x) * double(size.y) * double(size.z);
}

std::string cornersOf(const Box& box) {
  return fmt::format("({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g})", box.min.x, box.min.y, box.min.z, box.max.x,
                     box.max.y, box.max.z);
}

}  // namespace

FieldSources::FieldSources(const Mesh& shape, const Options& options, const Run& run)
    : shape_(shape),
      options_(options),
      run_(run),
      box_(run.box(boundingBox(shape))),
      longestSide_(run.longestSide(boundingBox(shape))) {}

ScalarField FieldSources::field(const FieldValue& value) {
  ScalarField result = rampOf(value);
  for (const FieldValue& factor : value.factors) result = result * field(factor);
  return result;
}

ScalarField FieldSources::rampOf(const FieldValue& value) {
  std::vector<RampStop> stops;
  for (const FieldValue::Stop& stop : value.stops)
    stops.push_back({float(stop.at), float(stop.amount.inWorldUnits(value.quantity.unit, longestSide_))});
  if (value.source == FieldValue::Source::constant) return stops.front().value;
  try {
    return ramp(placesOf(value), stops);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", value.option, error.what()));
  }
}

ScalarField FieldSources::placesOf(const FieldValue& value) {
  using Source = FieldValue::Source;
  if (value.source == Source::along) return along(value.direction);
  if (value.source == Source::noise) return noise(value);
  const Vec3f& d = value.direction;
  const std::string key =
      value.source == Source::facing ? fmt::format("facing {} {} {}", d.x, d.y, d.z)
      : value.source == Source::mask
          ? "mask " + value.path + "\n" + value.grid
          : fmt::format("attribute {} {}", value.hasSpheres ? "spheres" : "closest", value.attribute);
  if (const auto found = made_.find(key); found != made_.end()) return found->second;
  const ScalarField made = value.source == Source::facing ? facing(d)
                           : value.source == Source::mask ? mask(value)
                                                          : attribute(value);
  return made_.emplace(key, made).first->second;
}

ScalarField FieldSources::along(const Vec3f& direction) const {
  double low = 0, high = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = double(direction[axis]) * double(box_.min[axis]);
    const double b = double(direction[axis]) * double(box_.max[axis]);
    low += std::min(a, b);
    high += std::max(a, b);
  }
  return plane(direction * float(low), direction) / float(high - low);
}

ScalarField FieldSources::noise(const FieldValue& value) const {
  constexpr float kRms = 1.5f;
  const auto frequency = float(value.frequency.inWorldUnits(Quantity::Unit::frequency, longestSide_));
  return smoothstep(
      -kRms, kRms,
      fractalSum({.octaves = value.octaves, .frequency = frequency, .seed = std::uint32_t(options_.seed)}));
}

ScalarField FieldSources::facing(const Vec3f& direction) {
  run_.begin("directions");
  return facingField(
      shape_, direction,
      {.voxelSize = lookUpVoxel(options_.voxelSize, longestSide_), .band = float(options_.reach)}, run_);
}

ScalarField FieldSources::mask(const FieldValue& value) {
  const VdbGrid grid = readScalarGrid(value.path, value.grid);
  const VdbGridInfo info = describe(grid);
  const auto bricks = namingFile(value.path, [&] { return toBricks(grid); });
  const bool isLevelSet = info.gridClass == VdbGridInfo::Class::levelSet;
  const Box shape = boundingBox(shape_), active = activeBox(info, bricks->indexToWorld()),
            common = active.intersection(shape);
  const std::string outside = fmt::format("; outside its grid it counts as {:g}",
                                          isLevelSet ? 0.0 : std::clamp(bricks->background(), 0.0f, 1.0f));
  if (common.isEmpty())
    run_.note(fmt::format(
        "warning: {}: mask {}: grid '{}' has no active voxel near the shape: it holds {}, the shape {}{}",
        value.option, value.path, info.name, active.isEmpty() ? "none" : cornersOf(active), cornersOf(shape),
        outside));
  else if (const double share = volumeOf(common) / volumeOf(shape); share < 0.995)
    run_.note(fmt::format("{}: mask {}: the active voxels of grid '{}' span {:.0f} % of the shape's box{}",
                          value.option, value.path, info.name, 100 * share, outside));
  const ScalarField field = gridField(bricks);
  return isLevelSet ? smoothstep(-bricks->voxelSize(), bricks->voxelSize(), field) : field;
}

ScalarField FieldSources::attribute(const FieldValue& value) {
  run_.begin("attribute " + value.attribute);
  using Spread = AttributeFieldOptions::Spread;
  return attributeField(shape_, value.attribute,
                        {.spread = value.hasSpheres ? Spread::spheres : Spread::closest,
                         .voxelSize = lookUpVoxel(options_.voxelSize, longestSide_),
                         .band = float(options_.reach)},
                        run_);
}

}  // namespace nephele::apps
