#include "nephele/levelset/felt/flow_functions.h"

#include "nephele/levelset/felt/domain_samples.h"
#include "nephele/levelset/flow/projection.h"
#include "nephele/modeling/felt/diagnostic.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"

namespace nephele::felt {

namespace {

Walls wallsNamed(const std::string& name) {
  if (name == "periodic") return Walls::periodic;
  if (name == "closed") return Walls::closed;
  throw CallError(Code::outOfRange, "walls is \"" + name + "\", and may be \"periodic\" or \"closed\"");
}

/// With the samples that caches have.
ProjectionBox boxOf(const Domain& region, Walls walls) {
  return {Lattice::of(sampleToWorld(region)), Vec3i(region.cells()), walls};
}

VectorField mapped(const VectorField& v, const Affine& map) {
  return MatrixField(map.linear) * v + VectorField(map.translation);
}

/// What `flow` is in a box, outside of it: the same again and again where it is periodic, else what is at the
/// nearest point of a wall.
VectorField continued(const VectorField& flow, const ProjectionBox& box) {
  const VectorField sample = memo(mapped(position(), box.lattice.worldToIndex));
  std::vector<ScalarField> inside;
  for (int axis = 0; axis < 3; ++axis) {
    const ScalarField at = component(sample, axis);
    const auto length = static_cast<float>(box.cells[axis]);
    // Points of a wall are not outside, where there are no derivatives.
    constexpr float kRounding = 1e-3f;
    inside.push_back(box.walls == Walls::closed ? clamp(at, -kRounding, length + kRounding)
                                                : at - length * floor(at * (1 / length)));
  }
  return compose(flow, mapped(vectorField(inside[0], inside[1], inside[2]), box.lattice.indexToWorld));
}

}  // namespace

void addFlowFunctions(Registry& r) {
  r.group("flows");
  r.add("vectorfield tdivfree(vectorfield velocity, domain region, string walls = \"periodic\")",
        "The velocity without its divergent part, sampled at the corners of the cells of `region`, where "
        "central differences over a cell find no divergence then. What leaves through a face enters through "
        "the one "
        "opposite, and outside of `region` the flow is the same again; with walls = \"closed\" nothing flows "
        "through the faces, and outside the flow is that of the nearest point of a wall.",
        "domain region = domain((-1,-1,-1), (2,2,2), (0,0,0), 0.1, 0.1, 0.1);\n"
        "vectorfield flow = tdivfree(perlin(2) * (0,1,0), region, \"closed\");",
        [](const Context& context, const VectorField& velocity, const Domain& region,
           const std::string& walls) {
          // Three components as grids, and three as plain numbers while they are made.
          requireRoom(region, 4, context);
          const ProjectionBox box = boxOf(region, wallsNamed(walls));
          return continued(withoutDivergence(velocity, box, *context.progress), box);
        })
      .isSampled = true;
}

}  // namespace nephele::felt
