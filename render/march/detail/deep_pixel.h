#pragma once

#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/march/render_options.h"

namespace nephele::detail {

/// Opacity and colour that a pixel has in front of a depth, as they grow along its rays, turned into samples:
/// tidy, that is sorted and without overlaps.
///
/// With A(z) and C(z) the means of the rays,  alpha = (A(zBack) - A(z)) / (1 - A(z)),  colour likewise.
class DeepPixel {
 public:
  explicit DeepPixel(const DeepOptions& options) : options_(options) {}

  /// Starts a pixel that is the mean of `rayCount` rays.
  void begin(std::size_t rayCount);

  /// Adds a ray's record. Colour of a ray is the sum of gain * light over its result's suns, sky and
  /// emission.
  struct Gains {
    Vec3f suns[MarchScene::kMostLights];
    std::size_t sunCount = 0;
    /// Of every part of it.
    std::vector<Vec3f> sky{};
    bool isGrey = true;
  };
  void add(const MarchRay& ray, const MarchRecord& record, const Gains& gains);
  /// Something opaque at a depth, of which `opacity` and `colour` are seen, behind the record added last; a
  /// ray of its own otherwise.
  void addSurface(float depth, float opacity, const Vec3f& colour);

  /// Samples whose numbers are 16 bit floats, rounded so that the errors of a pixel do not add up.
  std::vector<DeepSample> samples();

  /// Something that one of many paths met at a depth, with what is seen of it.
  struct Event {
    float depth = 0.0f, opacity = 0.0f;
    Vec3f colour{};
  };
  /// The samples of a pixel that is the mean of `pathCount` paths; sorts their events by depth. Between
  /// depths at which single paths met something opacity grows evenly.
  std::vector<DeepSample> samples(std::vector<Event>& events, std::size_t pathCount);

 private:
  struct Knot {
    float z = 0.0f, opacity = 0.0f;
    Vec3f colour{};
  };

  void merge();
  std::vector<DeepSample> cut();
  void close(std::vector<DeepSample>& samples, const FlatPixel& front) const;
  bool fits(std::size_t first, std::size_t last) const;

  DeepOptions options_;
  std::size_t rayCount_ = 1;
  /// Of every ray in turn.
  std::vector<Knot> knots_;
  std::vector<std::size_t> rayEnds_;
  /// Their mean.
  std::vector<Knot> mean_;
  std::vector<float> depths_;
  float brightness_ = 0.0f;
};

}  // namespace nephele::detail
