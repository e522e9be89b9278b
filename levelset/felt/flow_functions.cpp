#include "nephele/levelset/felt/flow_functions.h"

#include "nephele/levelset/flow/projection.h"
#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::felt {

namespace {

Walls wallsNamed(const std::string& name) {
  if (name == "periodic") return Walls::periodic;
  if (name == "closed") return Walls::closed;
  throw CallError(Code::outOfRange, "walls is \"" + name + "\", and may be \"periodic\" or \"closed\"");
}

/// The centres of the cells of `region`, which are stretched or squeezed to fill it.
ProjectionBox boxOf(const Domain& region, Walls walls) {
  requireValid(region);
  const auto cells = region.cells();
  Affine samples = region.toWorld();
  for (int axis = 0; axis < 3; ++axis) {
    const auto edge = static_cast<float>(region.lengths[axis] / double(cells[axis]));
    for (int row = 0; row < 3; ++row) samples.linear(row, axis) *= edge;
  }
  samples.translation = samples(Vec3f(0.5f, 0.5f, 0.5f));
  return {Lattice::of(samples), Vec3i(cells), walls};
}

}  // namespace

void addFlowFunctions(Registry& r) {
  r.group("flows");
  r.add(
      "vectorfield tdivfree(vectorfield velocity, domain region, string walls = \"periodic\")",
      "The velocity without its divergent part, sampled at the centres of the cells of `region`: central "
      "differences over a cell find no divergence there. What leaves through a face enters through the one "
      "opposite; with walls = \"closed\" nothing flows through the faces. Outside of `region` the result is "
      "0.",
      "domain region = domain((-1,-1,-1), (2,2,2), (0,0,0), 0.1, 0.1, 0.1);\n"
      "vectorfield flow = tdivfree(perlin(2) * (0,1,0), region, \"closed\");",
      [](const Context& context, const VectorField& velocity, const Domain& region,
         const std::string& walls) {
        return withoutDivergence(velocity, boxOf(region, wallsNamed(walls)), *context.progress);
      });
}

}  // namespace nephele::felt
