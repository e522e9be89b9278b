#include <algorithm>
#include <cmath>

#include "data/models/animals.h"
#include "data/models/box_charts.h"
#include "data/models/implicit_mesh.h"
#include "data/models/shapes.h"
#include "nephele/levelset/mesh/decimation.h"

namespace nephele {
namespace {

// An ellipse in x and y, thickened: `radius` at the root (y < 0), and less towards the tip.
double blade(const Vec3d& p, double width, double length, double radius) {
  const double outside = std::max(-ellipsoid({p.x, p.y, 0}, {width, length, 1}), 0.0);
  return radius * (1 - 0.3 * p.y / length) - std::hypot(outside, p.z);
}

double whale(const Vec3d& p) {
  const Vec3d q{p.x, p.y, std::abs(p.z)};
  double body = ellipsoid(frameAt({0.38, 0.02, 0}, {0.04, 1, 0}, {1, 0, 0})(p), {0.86, 0.52, 0.54});
  body = blended(body, limb(p, {-0.05, 0, 0}, 0.42, {-0.75, 0.06, 0}, 0.22), 0.25);
  body = blended(body, limb(p, {-0.72, 0.05, 0}, 0.23, {-1.12, 0.38, 0}, 0.115), 0.25);
  body = blended(body, limb(p, {-1.10, 0.36, 0}, 0.12, {-1.22, 0.66, 0}, 0.07), 0.15);

  // Pleats from the chin to the navel.
  const double throat = std::clamp((-0.10 - p.y) / 0.12, 0.0, 1.0) * std::clamp((p.x + 0.1) / 0.3, 0.0, 1.0);
  body += 0.012 * throat * std::cos(34 * std::atan2(p.z, 0.35 - p.y));
  // The mouth, which rises to a smile below the eye.
  const double lips = p.y + 0.10 - 0.55 * std::pow(std::max(0.95 - p.x, 0.0), 2.2);
  const double opened = std::clamp((p.x - 0.42) / 0.08, 0.0, 1.0);
  body -= 0.035 * opened * std::exp(-lips * lips / (0.026 * 0.026));
  body = blended(body, ball(q, {0.55, 0.165, 0.462}, 0.072), 0.012);

  const Frame breast = frameAt({0.20, -0.42, 0.66}, {-0.45, -0.42, 1}, {1, 0, 0});
  body = blended(body, blade(breast(q), 0.13, 0.40, 0.05), 0.08);
  body = blended(body, blade(frameAt({-0.52, 0.36, 0}, {-0.5, 1, 0}, {1, 0, 0})(p), 0.08, 0.16, 0.05), 0.08);
  const Vec3d f = frameAt({-1.26, 0.80, 0.24}, {-0.10, 0.42, 1}, {-0.3, 1, 0})(q);
  return blended(body, blade({f.x - 0.4 * f.y * f.y, f.y, f.z}, 0.13, 0.40, 0.05), 0.08);
}

}  // namespace

Mesh whaleMesh() {
  const Mesh fine = meshOf(whale, {-2.0, -1.0, -1.3}, {1.4, 1.1, 1.3}, 0.024, 4);
  Mesh mesh = decimate(fine, {.faces = 20000}).mesh;
  addBoxCharts(mesh);
  return mesh;
}

}  // namespace nephele
