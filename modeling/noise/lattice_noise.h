#pragma once

#include <cstdint>

#include "nephele/modeling/noise/perlin_lattice.h"

/// Noises of a lattice on lanes of points. See noise.h for what they compute.
namespace nephele::detail {

enum class LatticeKind { perlin, simplex, value, worley, worleyDifference, gabor };

/// How far each of 16 kinds of change has come at one time: parts of a turn, and the cosine and sine of that
/// angle. Which of the 16 a corner or feature point follows is drawn from its hash.
struct NoiseClock {
  alignas(64) float turn[16];
  alignas(64) float cosine[16];
  alignas(64) float sine[16];
};

/// Turns per unit of time: 16 rates spread from 0 to 1/2, so that a noise has nothing to do with itself a
/// unit later. With a period > 0, each is the nearest whole number of turns per period, at least one, of the
/// upper half two: if all made one, the noise would be its own opposite after half the period.
double clockRate(int index, float period);
NoiseClock noiseClock(float time, float period);

struct LatticeNoise {
  LatticeKind kind = LatticeKind::perlin;
  PerlinLattice lattice;
  /// Without a clock the noise is that of time 0, at less cost.
  bool moves = false;
  NoiseClock clock{};
};

/// What is known about a noise, divided by its rms, in lattice units.
struct LatticeFacts {
  float mean;         ///< Of the raw noise.
  float rms;          ///< Of the raw noise less its mean.
  float low, high;    ///< Bounds of the result.
  float steepest;     ///< No gradient is longer.
  float gradientRms;  ///< Of one component of the gradient. 0 where the gradient jumps.
};
/// Facts of the noise, still or moving.
LatticeFacts latticeFacts(LatticeKind kind, bool moves);

/// The truth: the noise at one point, with its gradient by x, y, z if `gradient` is not null.
float latticeNoiseScalar(const LatticeNoise& noise, const Vec3f& point, Vec3f* gradient);

/// The same for lanes, bit for bit; 64-byte aligned, `count` a multiple of 16. `grads` may be null.
void latticeNoiseLanes(const LatticeNoise& noise, const float* const points[3], float* values,
                       float* const* grads, int count);

// Those of Worley and Gabor noise, for the two above.
float cellNoiseScalar(const LatticeNoise& noise, const Vec3f& point, Vec3f* gradient);
void cellNoiseLanes(const LatticeNoise& noise, const float* const points[3], float* values,
                    float* const* grads, int count);

// Raw noises: constants of the table, which the tests derive again.
/// sqrt(2 2/3 int (1/2 - r^2)^8 r^2 dV): 2 corners per unit volume, independent gradients.
inline constexpr float kSimplexRms = 5.104664853e-3f;
/// sqrt(1/3 (2 int s^2 dt)^3), s the fade curve.
inline constexpr float kValueRms = 0.4004416711f;
/// sqrt(2 / 2 int (1 - r^2)^6 dV): 2 impulses per cell, phases equally likely.
inline constexpr float kGaborRms = 0.5344801919f;
/// Measured over 1.6 10^9 points of 390 000 seeds, standard error below 1e-5: distances to feature points.
inline constexpr float kWorleyMean = 0.520371f, kWorleyRms = 0.172352f;
inline constexpr float kWorleyDifferenceMean = 0.196519f, kWorleyDifferenceRms = 0.158101f;
/// Distances to feature points are cut off here, lattice cells: all that are nearer are found.
inline constexpr float kWorleyReach = 1.5f;
/// Gabor noise is cut off here; measured, 8 of 10^7 values lie beyond.
inline constexpr float kGaborBound = 6.0f;

}  // namespace nephele::detail
