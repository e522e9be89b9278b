#pragma once

namespace nephele::apps {

/// How much time a picture may take.
enum class Quality { draft, good, final };

/// What a quality stands for, where the options that say the same are not given.
struct QualityChoices {
  /// Rays per pixel, and those of pictures that are blurred by a lens or by motion.
  int samples, blurredSamples;
  /// Longest step in voxels.
  float stepVoxels;
  /// As --adaptive; of pictures that are marched and not deep.
  float adaptiveThreshold;
  /// Of the path tracer.
  int pathsPerPixel;
  /// Octaves::order: the light is solved for in 24, 48 or 80 directions.
  int lightOrder;

  static constexpr QualityChoices of(Quality quality) {
    switch (quality) {
      case Quality::draft:
        return {1, 16, 2.0f, 0.1f, 16, 4};
      case Quality::final:
        return {16, 256, 0.5f, 0.0f, 1024, 8};
      default:
        return {4, 64, 1.0f, 0.0f, 64, 6};
    }
  }
};

}  // namespace nephele::apps
