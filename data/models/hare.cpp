#include <cmath>

#include "data/models/animals.h"
#include "data/models/implicit_mesh.h"
#include "data/models/shapes.h"
#include "nephele/levelset/mesh/decimation.h"

namespace nephele {
namespace {

double hareBody(const Vec3d& p) {
  const Vec3d q{p.x, p.y, std::abs(p.z)};
  double body = ellipsoid(frameAt({-0.38, 0.47, 0}, {-0.25, 1, 0}, {1, 0, 0})(p), {0.46, 0.47, 0.36});
  body = blended(body, limb(p, {-0.30, 0.66, 0}, 0.35, {0.16, 0.86, 0}, 0.25), 0.20);
  body = blended(body, ellipsoid(p - Vec3d{0.22, 0.74, 0}, {0.22, 0.34, 0.22}), 0.12);
  body = blended(body, limb(p, {0.18, 0.95, 0}, 0.20, {0.36, 1.22, 0}, 0.15), 0.15);
  const double thigh =
      ellipsoid(frameAt({-0.24, 0.37, 0.29}, {-0.35, 1, -0.12}, {1, 0, 0})(q), {0.31, 0.36, 0.16});
  body = blended(body, thigh, 0.04);
  const double foot = limb(q, {-0.30, 0.095, 0.34}, 0.095, {0.17, 0.075, 0.36}, 0.08);
  body = blended(body, foot, 0.05);
  const double shoulder =
      ellipsoid(frameAt({0.21, 0.68, 0.15}, {0.15, 1, 0}, {1, 0, 0})(q), {0.15, 0.24, 0.11});
  body = blended(body, shoulder, 0.05);
  const double foreleg = limb(q, {0.27, 0.54, 0.16}, 0.10, {0.40, 0.10, 0.125}, 0.07);
  body = blended(body, foreleg, 0.08);
  body = blended(body, ellipsoid(q - Vec3d{0.455, 0.065, 0.13}, {0.13, 0.065, 0.08}), 0.04);
  return blended(body, ball(p, {-0.86, 0.36, 0}, 0.16), 0.04);
}

double hareHead(const Vec3d& p) {
  const Vec3d q{p.x, p.y, std::abs(p.z)};
  const Frame skull = frameAt({0.44, 1.28, 0}, {0.30, 1, 0}, {1, -0.3, 0});
  double head = ellipsoid(skull(p), {0.26, 0.215, 0.185});
  head = blended(
      head, ellipsoid(frameAt({0.63, 1.195, 0}, {0.30, 1, 0}, {1, -0.30, 0})(p), {0.17, 0.125, 0.115}), 0.10);
  head = blended(head, ball(q, {0.50, 1.19, 0.105}, 0.11), 0.08);
  // Lips on either side of a cleft, and the nose above it.
  head = blended(head, ball(q, {0.735, 1.135, 0.05}, 0.062), 0.025);
  head = blended(head, ellipsoid(p - Vec3d{0.775, 1.20, 0}, {0.032, 0.03, 0.045}), 0.025);
  const Vec3d eye{0.55, 1.325, 0.122};
  head = -blended(-head, ball(q, eye + Vec3d{0.01, 0.005, 0.06}, 0.075), 0.04);
  return blended(head, ball(q, eye, 0.06), 0.012);
}

// A spoon, its hollow towards `open`.
double hareEar(const Vec3d& p, const Vec3d& root, const Vec3d& along, const Vec3d& open) {
  const Frame ear = frameAt(root + normalize(along) * 0.36, along, open);
  const Vec3d local = ear(p);
  // Wider in the upper half, and bent backwards towards the tip.
  const double bend = local.x + 0.22 * (local.y + 0.3) * (local.y + 0.3);
  const double width = 0.118 + 0.03 * local.y;
  const double blade =
      ellipsoid({bend, local.y, local.z * 0.118 / std::max(width, 0.05)}, {0.065, 0.42, 0.118});
  const double hollow = ellipsoid({bend - 0.075, local.y - 0.02, local.z}, {0.07, 0.34, 0.075});
  return -blended(-blade, hollow, 0.03);
}

double hare(const Vec3d& p) {
  double all = blended(hareBody(p), hareHead(p), 0.10);
  all = blended(all, hareEar(p, {0.33, 1.40, 0.085}, {-0.66, 1, 0.20}, {0.5, 0, 1}), 0.05);
  all = blended(all, hareEar(p, {0.33, 1.40, -0.085}, {0.02, 1, -0.24}, {0.75, 0, -1}), 0.05);
  // Flat where it sits.
  return -blended(-all, -p.y, 0.03);
}

}  // namespace

Mesh hareMesh() {
  const Mesh fine = meshOf(hare, {-1.1, -0.1, -0.6}, {0.95, 2.3, 0.6}, 0.018, 4);
  return decimate(fine, {.faces = 20000}).mesh;
}

}  // namespace nephele
