#include "nephele/render/light/scattered_source.h"

namespace nephele {

ScatteredSource ScatteredSource::of(const LightVolume& sun, const Vec3f& towards) {
  ScatteredSource source;
  source.irradiance = [](const Vec3f&) { return 1.0f; };
  source.setColumns(sun);
  source.towards = towards;
  return source;
}

void ScatteredSource::setColumns(const LightVolume& sun) {
  columns = [&sun](std::span<const Vec3f> world, std::span<float> found) {
    sun.columnDensities(world, found);
  };
  leastColumn = [&sun](std::span<const Vec3f> world) { return sun.leastColumnDensity(world); };
}

ScatteredSource ScatteredSource::evenSky() {
  ScatteredSource source;
  source.sky = [](const std::vector<Vec3f>& ways) { return std::vector<float>(ways.size(), 1.0f); };
  return source;
}

}  // namespace nephele
