#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/cloud/dots.h"
#include "nephele/modeling/field/field.h"
#include "nephele/modeling/noise/noise.h"

/// Wisps: thousands of dots around each of some guide particles, drawn into sheets and threads by noise.
namespace nephele {

/// A particle that a wisp grows on.
struct WispGuide {
  Vec3f position{};
  /// Radius of the wisp's unit sphere, world units, > 0.
  float size = 1.0f;
  /// What the density of the wisp would be if its dots filled that sphere evenly, >= 0.
  float density = 1.0f;
  Vec3f color{1, 1, 1};
  Vec3f velocity{};
};

struct WispOptions {
  /// Dots of each guide, > 0. More make a wisp smoother, not denser.
  std::uint32_t dots = 20000;
  /// How near a step of the random walk stays to where the last one ended, 0 to 1. 0: dots are spread evenly
  /// over all directions; towards 1 they crowd along the ways of the walks; 1: each walk is one dot.
  float correlation = 0.0f;
  /// Dots after which a new walk starts at a random place, > 0.
  std::uint32_t walkLength = 1000;

  /// Radial displacement: a dot is moved to |amplitude * noise|^clump times the guide's size from its centre,
  /// where the noise is read at its random place. Frequencies are cycles per size of the guide.
  float amplitude = 1.0f;
  FractalSumOptions radial{.octaves = 3, .frequency = 1.0f, .lacunarity = 2.0f, .roughness = 0.5f};
  /// Where the radial noise is read: at |u|^thickness along the direction of the random place u, 0 to 1. 0:
  /// on the sphere, so that dots lie on one crumpled sheet; 1: at u itself, so that they fill the wisp.
  float thickness = 0.05f;
  /// >= 0. 0: all dots on the sphere; small: near it; large: most near the centre.
  float clump = 0.6f;
  /// Then all are moved by this much, in sizes of the guide, rms along each axis, by a vector of noises read
  /// at the place that they were moved to: it folds what was a ball into sheets and threads.
  float displacement = 0.5f;
  FractalSumOptions vector{.octaves = 3, .frequency = 1.0f, .lacunarity = 2.0f, .roughness = 0.5f};

  std::uint32_t seed = 0;
  /// Number of the first guide: wisps that are grown part by part are those that are grown at once.
  std::uint64_t firstGuide = 0;
};

/// The dots of every guide, in the order of the guides: `options.dots` of each.
///
/// Walk:       u <- c u + sqrt(1 - c^2) xi, xi normal with variance 1/3 along each axis: so has u, at any c.
/// Sphere:     s = |a n(f u + o)|^clump u / |u|, n a fractal sum of noise, o drawn for each guide.
/// Mapped:     x = position + size (s + d V(g s + p)), V three such noises, p drawn for each guide.
///
/// The noises are the same for all guides, read at places of their own. A dot carries the guide's colour and
/// velocity, and of its mass, density 4/3 pi size^3, an equal share; colours are left out where all guides
/// are white, velocities where all are at rest. The same seed gives the same dots at any thread count. Cost:
/// some 200 ns per dot and core.
/// @throws Error, naming the guide or option, for what is outside its range; Cancelled.
/// Source: Tessendorf, Production Volume Rendering (2008), steps to grow point wisps.
Dots growWisps(std::span<const WispGuide> guides, const WispOptions& options = {},
               const Progress& progress = silent());

/// The box that all but a few of the dots of `guides` lie in. @throws Error as growWisps.
Box wispBox(std::span<const WispGuide> guides, const WispOptions& options = {});

/// Adds `velocity`, read at the positions, to the velocities of the dots.
void addVelocity(Dots& dots, const VectorField& velocity);

}  // namespace nephele
