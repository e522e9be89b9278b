#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/render/light/light_volume.h"
#include "nephele/render/light/phase_expansion.h"
#include "nephele/render/light/projected_light_volume.h"
#include "nephele/render/light/scattered_light.h"
#include "nephele/render/scene/environment.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/scene/surfaces.h"
#include "nephele/render/volume/lattice_map.h"
#include "nephele/render/volume/march_scene.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::detail {

/// The sky's part of a light, which another one of the same volume and medium takes where its sky is equal.
struct SkyPart {
  Vec3f radiance;
  std::optional<Environment> map;
  int parts, colours;
  std::vector<std::shared_ptr<const ScatteredLight>> scattered;
};

/// A volume, its medium and the light in it, tied together for the kernels: all that does not depend on the
/// camera.
struct BakedLight {
  /// `before`: what is left of the light before, or null; let go once it is known that the sky is another
  /// one, before memory is taken for that. Keeps a reference to `volume`.
  BakedLight(const RenderVolume& volume, const Medium& itsMedium, const Lights& itsLights,
             const Octaves& itsOctaves, std::shared_ptr<const SkyPart>* before, const Progress& progress,
             const Surfaces* surfaces);
  BakedLight(const BakedLight&) = delete;
  BakedLight& operator=(const BakedLight&) = delete;

  SkyPart skyPart() const;

  const RenderVolume* source;
  Medium medium;
  Lights lights;
  Octaves octaves;
  float voxelSize;
  LatticeMap toDensity;
  std::vector<LatticeMap> toSun;
  std::optional<LatticeMap> toScattered;
  std::vector<LightVolume> suns;
  /// The suns of `lights`, then those of its map; what is left of that.
  std::vector<DistantLight> distant;
  std::optional<Environment> sky;
  std::vector<LatticeMap> toLocal;
  std::vector<ProjectedLightVolume> locals;
  std::vector<float> phaseTable;
  /// Of every result, suns, locals and sky: what multiplies it, and its place in Lights::names.
  std::vector<Vec3f> gains;
  /// Of every part of the sky.
  std::vector<Vec3f> skyGains;
  std::vector<std::size_t> layers;
  /// Of every colour of every light in turn, the suns first and the sky last, null where there is none; and
  /// of what glows. Shared by colours that are alike. ViewLight makes scene.scattered of them.
  std::vector<std::shared_ptr<const ScatteredLight>> scattered, glow;
  std::vector<Vec3d> directions;
  ForwardLight forward;
  MarchScene scene;
  Box bounds;
  /// Of the medium, times the mean colour of the volume.
  Vec3f meanAlbedo;

 private:
  // Of the phase function.
  std::vector<float> moments_{1.0f};
  ScatteredLight::Options solver_;
  // Whether the columns of a distant light are those of the volume's density alone.
  std::vector<bool> isOfVolume_;

  float columnPerDepth(const Vec3f& shadow) const;
  float darkColumn(const Vec3f& shadow) const;
  template <class Light, class Columns>
  void shadowDeeply(const RenderVolume& volume, const Light& light, Columns& columns,
                    const Progress& progress) const;
  void takeLights();
  void addLocal(const LocalLight& light, const ProjectedLightVolume& shadows);
  bool readsCodes() const;
  void code();
  void setColours(const RenderVolume& volume, float most);
  void scatter(std::shared_ptr<const SkyPart>* before, const Progress& progress);
  // What is solved for: light of one colour `from` somewhere.
  struct Solve {
    int colour;
    float albedo;
    ScatteredSource from;
    std::shared_ptr<const ScatteredLight> light{};
  };
  void solve(std::vector<Solve>& solves, const Progress& progress) const;
  ScatteredSource sourceOf(std::size_t light, int colour) const;
  std::vector<ScatteredSource> partsOfSky();
  ScatteredSource sourceOfGlow(int colour) const;
  int colourLike(int colour, const Vec3f& shadow) const;
};

}  // namespace nephele::detail
