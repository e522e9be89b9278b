#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/app.h"
#include "nephele/render/scene/clear_sky.h"
#include "nephele/render/scene/environment.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::apps {

/// The lights as the command line gives them.
struct LightOptions {
  /// What is said of one light, or of all where the name is empty.
  template <class T>
  using Said = std::vector<std::pair<std::string, T>>;
  struct DecayFrom {
    Decay decay = Decay::quadratic;
    Length start;
  };

  Lights lights;
  bool noSun = false;
  Said<DecayFrom> decays;
  Said<Vec3f> shadows;
  bool deepShadows = false;
  float deepTolerance = 2e-3f;
  /// Files to take a light's shadow from, and to write it to.
  Said<std::string> readShadows, writtenShadows;
  /// A sky from a file, or a clear one of some haze over some ground; else lights.sky.
  std::string skyFile;
  std::optional<float> turbidity = ClearSky::Options{}.turbidity;
  Vec3f groundAlbedo{0.2f, 0.2f, 0.2f};
  /// Numbers of suns whose irradiance is that of the clear sky, if there is one.
  std::vector<std::size_t> sunsOfTheSky;
  Environment::Options sky;
  /// --sky was said.
  bool skyGiven = false;

  /// What a script asks for where the command line does not: a sky of one radiance, and one sun (degrees; no
  /// sun if its irradiance is 0).
  void suggestSky(const Vec3f& radiance);
  void suggestSun(double azimuth, double elevation, double irradiance);
  /// The lights of the picture; one sun where no light is given but a sky without a map. Reads the sky's map.
  /// Percentages are of `longestSide`. @throws Error if a name is unknown or taken twice, or a file cannot be
  /// read.
  Lights resolved(double longestSide, double mostBytes) const;
  /// Whether a density that is coded is enough for them all.
  bool readsCodes() const;
  /// Writes the deep shadow maps that are asked for. @throws Error naming the light or the file.
  void writeShadows(const RenderVolume& volume, const Lights& resolved, const Medium& medium,
                    const Run& run) const;

 private:
  void setClearSky(const std::vector<std::size_t>& ofTheSky, Lights& result) const;
};

/// Declares the options of lights on `app`.
void addLightOptions(CLI::App& app, LightOptions& options);
/// Declares the option for LightOptions::writeShadows.
void addShadowOutput(CLI::App& app, LightOptions& options);

}  // namespace nephele::apps
