#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nephele/render/image/image.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/scene/camera.h"

namespace nephele {

class OutputFile;

/// One piece of what lies behind a pixel: from depth z to zBack along the line of sight, with the opacity and
/// the premultiplied colour that it has by itself. Both are spread over it as in a homogeneous medium.
struct DeepSample {
  float z = 0.0f, zBack = 0.0f;
  float alpha = 0.0f;
  Vec3f colour{};
};

/// A picture whose pixels are lists of samples, rows from the top.
struct DeepImage {
  int width = 0, height = 0;
  std::optional<Image::Display> display{};
  std::vector<std::vector<DeepSample>> pixels;

  const std::vector<DeepSample>& at(int x, int y) const { return pixels[std::size_t(y) * width + x]; }
  std::size_t sampleCount() const;
};

/// How close the opacity and colour of deep samples follow the march at every depth.
struct DeepOptions {
  /// Largest error of the opacity in front of any depth, and of the colour as a share of the pixel's.
  /// Samples become as long as it allows. What all samples together give is exact whatever it is.
  float tolerance = 0.004f;
};

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
    Vec3f suns[MarchScene::kMostLights], sky;
    std::size_t sunCount = 0;
    bool isGrey = true;
  };
  void add(const MarchRay& ray, const MarchRecord& record, const Gains& gains);
  /// Something opaque at a depth, of which `opacity` and `colour` are seen, behind the record added last; a
  /// ray of its own otherwise.
  void addSurface(float depth, float opacity, const Vec3f& colour);

  /// Samples whose numbers are 16 bit floats, rounded so that the errors of a pixel do not add up.
  std::vector<DeepSample> samples();

 private:
  struct Knot {
    float z = 0.0f, opacity = 0.0f;
    Vec3f colour{};
  };

  void merge();
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

/// Front to back: what the samples of a pixel look like together; colour and, last, opacity.
struct FlatPixel {
  Vec3f colour{};
  float alpha = 0.0f;
};
FlatPixel flattened(const std::vector<DeepSample>& samples);

/// Writes a deep OpenEXR file: Z and ZBack as floats, A, R, G, B as 16 bit, marked as tidy, attributes as
/// writeExr, but the metadata `version` is called `softwareVersion`. Written beside `path` and renamed.
/// @throws Error naming the path.
void writeDeepExr(const std::string& path, const DeepImage& image, const Camera& camera,
                  const std::map<std::string, std::string>& metadata = {});
/// Writes a picture and its deep form, so that neither is there without the other. @throws Error naming the
/// path of what could not be written; then neither is.
struct ExrPair {
  std::string flat, deep;
};
void writeExrPair(const ExrPair& paths, const Image& flat, const DeepImage& deep, const Camera& camera,
                  const std::map<std::string, std::string>& metadata = {});

/// As the other, into `output`, which the caller commits.
void writeDeepExr(const OutputFile& output, const DeepImage& image, const Camera& camera,
                  const std::map<std::string, std::string>& metadata = {});

/// Reads a deep OpenEXR file made of scan lines, its first part: Z and A are needed, ZBack is Z and colours
/// are 0 where they are missing. Samples are as in the file, whether tidy or not.
/// @throws Error naming the path and what is wrong, also if it would take more than `mostBytes`.
DeepImage readDeepExr(const std::string& path, double mostBytes = 8e9);

}  // namespace nephele
