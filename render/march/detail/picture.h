#pragma once

#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "nephele/render/light/baked_light.h"
#include "nephele/render/light/view_light.h"
#include "nephele/render/march/detail/deep_pixel.h"
#include "nephele/render/march/field_march.h"
#include "nephele/render/march/film.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/march/pixel_points.h"
#include "nephele/render/march/render_scene.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/sub_samples.h"
#include "nephele/render/volume/depth_bounds.h"

namespace nephele::detail {

/// One look at a lit volume.
class Picture {
 public:
  /// What a thread needs to work on pixels.
  struct Scratch {
    explicit Scratch(const RenderOptions& options) : deep(options.deep.value_or(DeepOptions{})) {}

    std::vector<MarchRay> rays;
    // Where the rays of every pixel that is marched begin, and where the last ones end.
    std::vector<std::size_t> begins;
    std::optional<FieldMarcher> field;
    std::vector<MarchResult> results;
    std::vector<MarchRecord> records;
    std::vector<std::optional<Surfaces::Hit>> hits;
    // The camera's rays that met objects, and which of the pattern they are.
    std::vector<std::pair<Ray, std::size_t>> seen;
    PixelSum sum;
    DeepPixel deep;
    std::vector<DeepSample> samples;
    std::vector<PixelPoint> points;
  };

  /// Keeps references to all of them.
  Picture(const BakedLight& lit, const RenderScene& scene, const RenderOptions& options, const Film& film);

  /// Pixels of a row that are best marched at a time.
  int pixelsTogether() const;
  /// Marches the rays of `count` pixels of a row.
  void march(int x, int y, int count, Scratch& scratch) const;
  /// Sums up the rays of one of them into scratch.sum and, for deep pictures, scratch.samples; returns the
  /// samples taken.
  std::uint64_t gather(int index, Scratch& scratch) const;

  /// What the centres of the pixels meet, row by row, into scratch.points.
  void points(const PixelBox& box, Scratch& scratch) const;

 private:
  static constexpr DepthBounds::Range kAnywhere{0, std::numeric_limits<float>::infinity()};

  static MarchScene withoutLight(MarchScene scene);
  void preparePoints(const Film& film, const Camera* nextCamera);
  bool centreRay(int x, int y, Ray& world, MarchRay& out, std::optional<Surfaces::Hit>& hit) const;
  Ray worldRay(int x, int y, const SubSample& sub) const;
  bool meet(const Ray& world, double cosine, bool isInside, MarchRay& ray,
            std::optional<Surfaces::Hit>& hit) const;
  Vec3f through(const Vec3d& from, const Vec3d& towards, double distance, const Vec3f& shadow) const;
  Vec3f lightOn(const Surfaces::Hit& hit, const Vec3d& place, std::size_t sample) const;
  float addSurface(const Surfaces::Hit& hit, const MarchRay& ray, const MarchResult& result, const Ray& world,
                   std::size_t sample, PixelSum& out, Vec3f& colour) const;
  void marchAll(const MarchScene& scene, std::size_t count, bool isRecorded, Scratch& scratch) const;
  void addRays(int x, int y, Scratch& scratch) const;
  bool enter(const Ray& ray, const DepthBounds::Range& reach, MarchRay& out) const;
  bool prepare(const Ray& ray, const DepthBounds::Range& reach, const SubSample& sub, double shift,
               MarchRay& out) const;
  bool prepareBlurred(int x, int y, const SubSample& sub, double shift, MarchRay& out) const;

  const BakedLight& lit_;
  const Camera& camera_;
  Shutter shutter_;
  // Null where the volume stands still.
  const RigidMotion* motion_;
  bool blurred_;
  std::vector<SubSample> pattern_;
  // From the density's lattice to the world.
  LatticeMap fromLattice_;
  // None for rays that are spread over a lens or over time.
  std::optional<DepthBounds> bounds_;
  MarchScene scene_;
  ViewLight viewLight_;
  // Null where the density is a grid.
  const FieldDensity* field_ = nullptr;
  const VectorField* fieldColour_ = nullptr;
  const FieldGlow* fieldGlow_ = nullptr;
  FieldSteps fieldSteps_;
  bool isDeep_ = false;
  const Holdout* holdout_ = nullptr;
  const Surfaces* surfaces_ = nullptr;
  MarchScene shadowScene_;
  DeepPixel::Gains gains_;

  // For the centres of pixels: the density alone, seen in the middle of the shutter.
  MarchScene pointScene_;
  std::optional<Camera> middle_;
  std::optional<DensityNormals> normals_;
  std::optional<PixelMotion> pixelMotion_;
};

}  // namespace nephele::detail
