// What lights may be.
#include "nephele/render/scene/lights.h"

#include <fmt/format.h>

#include <set>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

namespace {

// Beyond these, squares and sums of floats overflow or lose their digits.
constexpr float kBrightest = 1e12f;
constexpr float kFarthest = 1e9f;

void checkColour(const std::string& what, const Vec3f& colour, float most) {
  for (int c = 0; c != 3; ++c)
    require(colour[c] >= 0 && colour[c] <= most,
            fmt::format("{}: expected three numbers within [0, {:g}], got {}", what, most, colour[c]));
}

void checkDirection(const std::string& what, const Vec3f& direction) {
  require(isFinite(direction) && length(direction) > 0 && length(direction) <= kFarthest,
          fmt::format("{}: expected a direction that is not zero and at most {:g} long, got {}, {}, {}", what,
                      kFarthest, direction.x, direction.y, direction.z));
}

void checkCone(const std::string& what, const LocalLight::Cone& cone) {
  checkDirection(what, cone.direction);
  require(cone.angleDegrees > 0 && cone.angleDegrees <= 90,
          fmt::format("{}: expected a cone of more than 0 and at most 90 degrees from its axis, got {}", what,
                      cone.angleDegrees));
  require(cone.penumbraDegrees >= 0 && cone.penumbraDegrees <= cone.angleDegrees,
          fmt::format("{}: expected a penumbra from 0 to the cone's {} degrees, got {}", what,
                      cone.angleDegrees, cone.penumbraDegrees));
}

}  // namespace

std::vector<std::string> Lights::names() const {
  std::vector<std::string> result;
  for (const DistantLight& sun : suns) result.push_back(sun.name);
  for (const LocalLight& light : locals) result.push_back(light.name);
  result.emplace_back("sky");
  return result;
}

void Lights::check() const {
  for (int c = 0; c != 3; ++c)
    require(sky[c] >= 0 && sky[c] <= kBrightest,
            fmt::format("sky: expected three numbers within [0, {:g}], got {}", kBrightest, sky[c]));
  require(suns.size() <= kMost, fmt::format("sun: at most {} are possible, got {}", kMost, suns.size()));
  require(locals.size() <= kMost,
          fmt::format("point and spot: at most {} are possible, got {}", kMost, locals.size()));
  for (const DistantLight& sun : suns) {
    checkDirection(sun.name, sun.direction);
    checkColour(sun.name, sun.irradiance, kBrightest);
    checkColour(sun.name + ": shadow multiplier", sun.shadow, 100);
  }
  for (const LocalLight& light : locals) {
    require(isFinite(light.position) && length(light.position) <= kFarthest,
            fmt::format("{}: expected a position at most {:g} from the origin, got {}, {}, {}", light.name,
                        kFarthest, light.position.x, light.position.y, light.position.z));
    checkColour(light.name, light.intensity, kBrightest);
    checkColour(light.name + ": shadow multiplier", light.shadow, 100);
    require(light.decayStart >= 0 && light.decayStart <= kFarthest,
            fmt::format("{}: expected a decay that starts at a distance within [0, {:g}], got {}", light.name,
                        kFarthest, light.decayStart));
    if (light.cone) checkCone(light.name, *light.cone);
  }
  require(shadowDetail == 1 || shadowDetail == 2 || shadowDetail == 4,
          fmt::format("shadow detail: expected 1, 2 or 4 nodes per voxel, got {}", shadowDetail));
  std::set<std::string> seen;
  for (const std::string& name : names()) {
    require(!name.empty() && name.find_first_of(". ,=") == std::string::npos,
            fmt::format("light: expected a name without blanks, dots, commas and =, got '{}'",
                        printable(name, 60)));
    require(name.size() <= kLongestName, fmt::format("light: expected a name of at most {} bytes, got '{}'",
                                                     kLongestName, printable(name, 60)));
    require(name != "air" && name != "objects",
            fmt::format("light: the name '{}' is that of a layer of its own; choose another", name));
    require(seen.insert(name).second, fmt::format("light: the name '{}' is taken twice", name));
  }
}

}  // namespace nephele
