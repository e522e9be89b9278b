#include "apps/options/field_sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/cloud/attribute_field.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
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

/// The values of an attribute, wherever they are.
ScalarField attributeRange(const Mesh& mesh, const std::string& name) {
  Interval range{0, 0};
  for (const MeshAttribute& attribute : mesh.attributes)
    if (attribute.name == name && !attribute.values.empty()) {
      const auto [low, high] = std::minmax_element(attribute.values.begin(), attribute.values.end());
      range = {*low, *high};
    }
  return functionField([](const Vec3f&) { return 0.0f; }, {.range = [range](const Box&) { return range; }});
}

ScalarField madeOf(const FieldValue& value, const ExpressionNames& names, double longestSide) {
  try {
    return evaluated(value.option, value.expression, {felt::Kind::scalarField}, names, longestSide)
        .as<ScalarField>();
  } catch (const felt::ScriptError& error) {
    // Short forms have no places of their own to point at.
    const felt::Diagnostic& first = error.diagnostics().front();
    if (!value.isTypedAsExpression && value.place) throw value.place->fault(first.code, first.message);
    if (!value.isTypedAsExpression) throw Error(value.option + ": " + first.message);
    if (value.place) throw value.place->moved(error, 1);
    throw;
  }
}

/// Expressions may be anything; what the rest relies on is that they stay within what is allowed.
void requireAllowed(const FieldValue& value, const Interval& range) {
  if (!value.isTypedAsExpression) return;
  const auto [unit, low, high, lowIsAllowed] = value.quantity;
  const bool isFinite = std::isfinite(range.min) && std::isfinite(range.max);
  if (isFinite && double(range.min) >= low && double(range.max) <= high &&
      (lowIsAllowed || double(range.min) > low))
    return;
  const std::string what = fmt::format("may be from {:g} to {:g}, allowed: {}", range.min, range.max,
                                       value.quantity.allowed()),
                    hint = "clamp(..., LOW, HIGH) keeps it within";
  if (value.place) throw value.place->fault(felt::Code::outOfRange, "this " + what, hint);
  throw Error(fmt::format("{}: '{}' {}; {}", value.option, value.text, what, hint));
}

}  // namespace

FieldSources::FieldSources(const Mesh& shape, const Options& options, const Run& run)
    : shape_(shape),
      options_(options),
      run_(run),
      box_(run.box(boundingBox(shape))),
      longestSide_(run.longestSide(boundingBox(shape))),
      names_(namesOfShape(
          {.along = [this](const Vec3f& direction) { return along(direction); },
           .facing = [this](const Vec3f& direction) { return facing(direction); },
           .mask = [this](const std::string& path, const std::string& grid) { return mask(path, grid); },
           .attribute = [this](const std::string& name,
                               bool hasSpheres) { return attribute(name, hasSpheres); },
           .time = double(run.frame().value_or(0)),
           .seed = options.seed})) {}

ScalarField FieldSources::field(const FieldValue& value) {
  if (value.constant) return float(value.constant->inWorldUnits(value.quantity.unit, longestSide_));
  option_ = value.option;
  const ScalarField result = madeOf(value, names_, longestSide_);
  if (!value.isTypedAsExpression) return result;
  const Interval range = result.range(box_.expanded(float(options_.reach)));
  requireAllowed(value, range);
  // Far away, where nobody asks, it may be anything; what grows layers wants bounds for all of space.
  return std::isfinite(result.range(Box::everywhere()).magnitude()) ? result
                                                                    : clamp(result, range.min, range.max);
}

double FieldSources::bound(const FieldValue& value, const Mesh& mesh, int seed, const Run& run) {
  const Box box = run.box(boundingBox(mesh));
  const double longestSide = run.longestSide(boundingBox(mesh));
  if (value.constant) return value.constant->inWorldUnits(value.quantity.unit, longestSide);
  const auto share = [](float lowest) {
    return functionField([](const Vec3f&) { return 0.0f; }, {.range = [lowest](const Box&) {
                           return Interval{lowest, 1};
                         }});
  };
  const ExpressionNames names =
      namesOfShape({.along = [&](const Vec3f&) { return share(0); },
                    .facing = [&](const Vec3f&) { return share(-1); },
                    .mask = [&](const std::string&, const std::string&) { return share(0); },
                    .attribute = [&](const std::string& name, bool) { return attributeRange(mesh, name); },
                    .time = double(run.frame().value_or(0)),
                    .seed = seed});
  const Interval range = madeOf(value, names, longestSide).range(box.expanded(float(longestSide) / 2));
  requireAllowed(value, range);
  return double(range.max);
}

ScalarField FieldSources::once(const std::string& key, const std::function<ScalarField()>& make) {
  if (const auto found = made_.find(key); found != made_.end()) return found->second;
  return made_.emplace(key, make()).first->second;
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

ScalarField FieldSources::facing(const Vec3f& direction) {
  return once(fmt::format("facing {} {} {}", direction.x, direction.y, direction.z), [&] {
    run_.begin("directions");
    return facingField(
        shape_, direction,
        {.voxelSize = lookUpVoxel(options_.voxelSize, longestSide_), .band = float(options_.reach)}, run_);
  });
}

ScalarField FieldSources::mask(const std::string& path, const std::string& gridName) {
  return once("mask " + path + "\n" + gridName, [&] {
    const VdbGrid grid = readScalarGrid(path, gridName);
    const VdbGridInfo info = describe(grid);
    const auto bricks = namingFile(path, [&] { return toBricks(grid); });
    const bool isLevelSet = info.gridClass == VdbGridInfo::Class::levelSet;
    const Box shape = boundingBox(shape_), active = activeBox(info, bricks->indexToWorld()),
              common = active.intersection(shape);
    const std::string outside = fmt::format("; outside its grid it counts as {:g}",
                                            isLevelSet ? 0.0 : std::clamp(bricks->background(), 0.0f, 1.0f));
    if (common.isEmpty())
      run_.note(fmt::format(
          "warning: {}: mask {}: grid '{}' has no active voxel near the shape: it holds {}, the shape {}{}",
          option_, path, info.name, active.isEmpty() ? "none" : cornersOf(active), cornersOf(shape),
          outside));
    else if (const double share = volumeOf(common) / volumeOf(shape); share < 0.995)
      run_.note(fmt::format("{}: mask {}: the active voxels of grid '{}' span {:.0f} % of the shape's box{}",
                            option_, path, info.name, 100 * share, outside));
    const ScalarField field = gridField(bricks);
    return isLevelSet ? smoothstep(-bricks->voxelSize(), bricks->voxelSize(), field) : clamp(field, 0, 1);
  });
}

ScalarField FieldSources::attribute(const std::string& name, bool hasSpheres) {
  return once(fmt::format("attribute {} {}", hasSpheres ? "spheres" : "closest", name), [&] {
    run_.begin("attribute " + name);
    using Spread = AttributeFieldOptions::Spread;
    return attributeField(shape_, name,
                          {.spread = hasSpheres ? Spread::spheres : Spread::closest,
                           .voxelSize = lookUpVoxel(options_.voxelSize, longestSide_),
                           .band = float(options_.reach)},
                          run_);
  });
}

}  // namespace nephele::apps
