#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/cloud/advect.h"
#include "nephele/modeling/cloud/cumulo.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/cloud/nacelle.h"
#include "nephele/modeling/cloud/obstacle.h"
#include "nephele/modeling/cloud/surface_point.h"
#include "nephele/modeling/felt/detail/functions.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"

namespace nephele::felt {

namespace {

using S = ScalarField;
using V = VectorField;

AdvectOptions oneStep(double dt) {
  return {.dt = finite("dt", dt), .steps = 1, .rule = TraceRule::euler};
}

S ramped(const S& f, const Array& places, const Array& values) {
  if (places->size() != values->size())
    throw CallError(Code::outOfRange, "there are " + std::to_string(places->size()) + " places and " +
                                          std::to_string(values->size()) + " values");
  std::vector<RampStop> stops;
  for (std::size_t i = 0; i < places->size(); ++i)
    stops.push_back(
        {finite("places", (*places)[i].as<double>()), finite("values", (*values)[i].as<double>())});
  return ramp(f, std::move(stops));
}

/// Layers one by one as the notes have them, without a grid.
S layered(const S& base, const Array& displacements, std::int64_t iterations) {
  SurfacePointOptions options;
  options.steps = inRange("iterations", iterations, 0, 64);
  S sum = base;
  for (const Value& displacement : *displacements) {
    const S before = memo(sum);
    sum = before + compose(abs(displacement.as<S>()), surfacePoint(before, options));
  }
  return sum;
}

}  // namespace

void addCloudFunctions(Registry& r) {
  r.group("clouds");
  r.add("vectorfield levelsetsurface(scalarfield l, int iterations = 5)",
        "The point of the surface of a level set that belongs to a place, found by at most so many steps.",
        "vectorfield surface = levelsetsurface(sphere((0,0,0), 1), 3);",
        [](const S& l, std::int64_t iterations) {
          SurfacePointOptions options;
          options.steps = inRange("iterations", iterations, 0, 64);
          return surfacePoint(l, options);
        });
  r.add("scalarfield cumulo(scalarfield base, scalarfield[] displacements, int iterations = 5)",
        "`base` with layers of displacement, each read at the surface of the sum before it. Nothing is "
        "sampled, so that every layer costs many times the one before: sample the sum into a cache for more "
        "than two.",
        "scalarfield cloud = cumulo(sphere((0,0,0), 1), [0.1 * perlin(4), 0.05 * perlin(9)]);",
        [](const S& base, const Array& displacements, std::int64_t iterations) {
          return layered(base, displacements, iterations);
        });
  r.add("vectorfield nacelle(scalarfield object, scalarfield reference, int iterations = 3)",
        "The warp field between two shapes: object(x) = reference(nacelle(x)). Guarded where the formula of "
        "the notes divides by zero.",
        "vectorfield map = nacelle(sphere((0,0,0), 1.3), sphere((0,0,0), 1));",
        [](const S& object, const S& reference, std::int64_t iterations) {
          NacelleOptions options;
          options.steps = inRange("iterations", iterations, 1, 20);
          return nacelle(object, reference, options);
        });
  r.add("scalarfield advect(scalarfield f, vectorfield velocity, float dt)",
        "`f` carried along for a step, semi-Lagrangian: f(x - velocity(x) dt).",
        "scalarfield moved = advect(mask(sphere((0,0,0), 1)), (1,0,0), 0.5);",
        [](const S& f, const V& velocity, double dt) { return advect(f, velocity, oneStep(dt)); });
  r.add("vectorfield advect(vectorfield f, vectorfield velocity, float dt)",
        "`f` carried along for a step: a velocity by itself, or a map of space.",
        "vectorfield map = advect(identity(), curlnoise(), 0.1);",
        [](const V& f, const V& velocity, double dt) { return advect(f, velocity, oneStep(dt)); });
  r.add(
      "scalarfield maccormack(scalarfield f, vectorfield velocity, float dt)",
      "`advect` with errors of second order: half of what a step there and back again loses is given back, "
      "as far as values stay between those about the place that `advect` reads. Costs eleven times as much.",
      "scalarfield moved = maccormack(mask(sphere((0,0,0), 1), 0.2), (1,0,0), 0.5);",
      [](const S& f, const V& velocity, double dt) { return macCormack(f, velocity, finite("dt", dt)); });
  r.add("vectorfield maccormack(vectorfield f, vectorfield velocity, float dt)",
        "`advect` with errors of second order.",
        "vectorfield map = maccormack(identity(), curlnoise(), 0.1);",
        [](const V& f, const V& velocity, double dt) { return macCormack(f, velocity, finite("dt", dt)); });
  r.add("vectorfield reflected(vectorfield velocity, scalarfield object, float retained = 1)",
        "The velocity turned back where it flows into an object: with `retained` 1 it is thrown back, with 0 "
        "it sticks, and only what runs along the surface is left.",
        "vectorfield flow = reflected((1,0,0), sphere((0,0,0), 1), 0.2);",
        [](const V& velocity, const S& object, double retained) {
          if (!(retained >= 0 && retained <= 1))
            throw CallError(Code::outOfRange,
                            "retained is " + numberText(retained) + ", and may be from 0 to 1");
          return reflected(velocity, object, {.retained = static_cast<float>(retained)});
        });
  r.add("vectorfield traceback(vectorfield velocity, float dt, int steps = 1)",
        "The map from where matter is after so many steps to where it was before them, by the midpoint rule.",
        "scalarfield moved = compose(mask(sphere((0,0,0), 1)), traceback(curlnoise(), 0.1, 4));",
        [](const V& velocity, double dt, std::int64_t steps) {
          return traceBack(velocity, {.dt = finite("dt", dt), .steps = inRange("steps", steps, 0, 10000)});
        });
  r.add("scalarfield ramp(scalarfield f, float[] places, float[] values)",
        "`f` through a polyline: at each place its value, in proportion between, constant beyond.",
        "scalarfield profile = ramp(identity().y, [0, 0.2, 1], [0, 1, 0.6]);",
        [](const S& f, const Array& places, const Array& values) { return ramped(f, places, values); });
}

void addModelingFunctions(Registry& registry) {
  addValueFunctions(registry);
  addArithmetic(registry);
  addFieldArithmetic(registry);
  addNumberFunctions(registry);
  addFieldFunctions(registry);
  addNoiseFunctions(registry);
  addShapeFunctions(registry);
  addCloudFunctions(registry);
}

}  // namespace nephele::felt
