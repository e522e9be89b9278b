#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/render/march/detail/path_random.h"
#include "nephele/render/march/detail/path_volume.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/scene/environment.h"
#include "nephele/render/scene/surfaces.h"

namespace nephele::detail {

/// What the paths of one pixel add up to.
struct PathSums {
  /// Opacity that is seen, per colour, and the same times the albedo of what is met.
  Vec3d opacity{}, albedo{};
  Vec3d emission{};
  /// As RenderScene::lightNames.
  std::vector<Vec3d> light;
  /// For deep pictures; no event means nothing is met.
  std::vector<DeepPixel::Event> events;
};

/// Follows the paths of a picture. What it is made from must outlive it.
class PathTracer {
 public:
  PathTracer(const RenderScene& scene, const PathOptions& options, bool isDeep, const Progress& progress);

  /// One path on its way.
  struct Path {
    PathRandom random;
    /// From where it is. In the world, or, once the volume has scattered it, in the space of the volume.
    Ray ray;
    bool isInWorld = true;
    /// When, in frames after the one of the picture.
    double frames = 0.0;
    Vec3f weight{1, 1, 1};
    int scatterings = 0, reflections = 0;
    /// Per steradian, how likely it was to go where it goes.
    float chance = 0.0f;
    bool isFromSurface = false;
    std::uint32_t pixel = 0;
    /// Of what it met first: what holdouts leave of it, and how much light glows in front of that and behind.
    Foreground foreground{};
    DeepPixel::Event event{};
    float held = 1.0f;
    bool isOfObject = false;
    Vec3d emission{}, laterEmission{};
  };

  /// Working memory of a thread.
  class Wave {
   public:
    std::uint64_t scatterings = 0;

   private:
    friend class PathTracer;

    struct Look {
      std::uint32_t path;
      std::size_t light;
      Vec3f radiance;
    };
    PathVolume::Scratch volume;
    std::vector<Path> paths;
    std::vector<std::uint32_t> live;
    std::vector<std::optional<Surfaces::Hit>> hits;
    std::vector<Flight> flights;
    std::vector<ShadowWay> ways;
    // What each of the ways is for.
    std::vector<Look> looks;
    // Of every path in turn, as PathSums::light.
    std::vector<Vec3d> light;
  };

  /// Traces the paths of the pixels of a tile, row by row, into as many `sums`.
  void trace(const PixelBox& tile, Wave& wave, std::vector<PathSums>& sums) const;

 private:
  struct Sun {
    Vec3d towards;
    Vec3f irradiance, shadow;
    std::shared_ptr<const DeepShadowMap> map;
  };
  // Where a path meets anything, and how it scatters there.
  struct Meeting {
    Vec3d place;
    Vec3f incoming;
    // Of a surface; the second one that of the face itself.
    Vec3f normal, faceNormal;
    bool isSurface;
  };

  void start(int x, int y, std::uint64_t number, Path& path) const;
  void follow(Wave& wave) const;
  Ray inVolume(const Path& path, const Ray& ray) const;
  void prepareFlight(Path& path, std::optional<Surfaces::Hit>& hit, Flight& flight) const;
  bool arrive(std::uint32_t index, Flight& flight, const std::optional<Surfaces::Hit>& hit, Wave& wave) const;
  static bool meetFirst(Path& path, const Vec3f& weight, double distance, const Vec3f& albedo,
                        bool isOfObject);
  bool survives(Path& path) const;
  bool scatter(std::uint32_t index, const Meeting& meeting, Wave& wave) const;
  float shareOf(const Meeting& meeting, const Vec3f& towards) const;
  void lookAtLights(std::uint32_t index, const Meeting& meeting, Wave& wave) const;
  void leave(std::uint32_t index, Wave& wave) const;
  void add(std::uint32_t index, std::size_t light, const Vec3f& radiance, Wave& wave) const;
  void finish(Wave& wave, std::vector<PathSums>& sums) const;

  const RenderScene& scene_;
  const PathOptions& options_;
  const Progress& progress_;
  const Surfaces* surfaces_;
  bool isDeep_;
  PathVolume volume_;
  std::vector<Sun> suns_;
  std::vector<std::shared_ptr<const DeepShadowMap>> localMaps_;
  const Environment* skyMap_;
  std::size_t layers_, skyLayer_;
};

}  // namespace nephele::detail
