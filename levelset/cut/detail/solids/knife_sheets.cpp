// Knives as surfaces.
//
// A rough blade is a height field over a lattice of its plane: noise is read at the lattice's points, which
// lie on the plane, and raises them. Its sides are raised by half the kerf times the secant of the
// slope, so that what goes has the width of the kerf across the blade: K / |grad K| = +- kerf / 2. A solid's
// sides move its vertices so that the faces around each come to lie at half the kerf, in the sense of least
// squares. Where that folds them over, as in creases and of small triangles, they are surfaces of the
// solid's distance instead, from samples.
#include "nephele/levelset/cut/detail/solids/knife_sheets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "nephele/levelset/cut/detail/solids/cut_source.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/winding_number.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

/// Heights at the points of a lattice over a plane.
class HeightField {
 public:
  HeightField(const RoughBlade& blade, const Vec3d& low, const Vec3d& high, const std::string& name) {
    const Vec3d normal(blade.plane.normal);
    const double size = length(normal);
    require(isFinite(blade.plane.point) && isFinite(normal) && size > 0,
            fmt::format("cut: {} must have a finite point and a normal that is not 0", name));
    require(std::isfinite(blade.spacing) && blade.spacing >= 0,
            fmt::format("cut: {}: spacing must be >= 0, got {}", name, blade.spacing));
    origin_ = Vec3d(blade.plane.point);
    normal_ = normal / size;
    frame_ = PlaneFrame::of(normal_);
    const ScalarField field = roughKnife(blade.plane, blade.roughness).field;

    const double diagonal = length(high - low);
    spacing_ = double(blade.spacing);
    if (spacing_ == 0) spacing_ = roughSpacing(blade.roughness, diagonal);
    double lowU = INFINITY, highU = -INFINITY, lowV = INFINITY, highV = -INFINITY;
    for (int k = 0; k < 8; ++k) {
      const Vec3d corner{k & 1 ? low.x : high.x, k & 2 ? low.y : high.y, k & 4 ? low.z : high.z};
      const double u = dot(corner - origin_, frame_.u) / spacing_,
                   v = dot(corner - origin_, frame_.v) / spacing_;
      lowU = std::min(lowU, u);
      highU = std::max(highU, u);
      lowV = std::min(lowV, v);
      highV = std::max(highV, v);
    }
    constexpr double kMost = 5e7;
    require(
        (highU - lowU + 4) * (highV - lowV + 4) < kMost && std::abs(lowU) < 1e9 && std::abs(lowV) < 1e9,
        fmt::format("cut: {}: a spacing of {} is too fine for a solid of size {}", name, spacing_, diagonal));
    firstU_ = std::int64_t(std::floor(lowU)) - 1;
    firstV_ = std::int64_t(std::floor(lowV)) - 1;
    countU_ = std::size_t(std::int64_t(std::ceil(highU)) + 2 - firstU_);
    countV_ = std::size_t(std::int64_t(std::ceil(highV)) + 2 - firstV_);
    heights_.resize(countU_ * countV_);
    if (blade.roughness.amplitude == 0) return;
    parallelFor(countV_, 8, [&](std::size_t begin, std::size_t end) {
      std::array<std::vector<float>, 3> lanes;
      for (auto& lane : lanes) lane.resize(countU_);
      std::vector<float> values(countU_);
      for (std::size_t j = begin; j < end; ++j) {
        for (std::size_t i = 0; i < countU_; ++i) {
          const Vec3d p = point(i, j, 0);
          for (int axis = 0; axis < 3; ++axis) lanes[std::size_t(axis)][i] = float(p[axis]);
        }
        field.eval({lanes[0], lanes[1], lanes[2]}, values);
        for (std::size_t i = 0; i < countU_; ++i) heights_[j * countU_ + i] = -double(values[i]);
      }
    });
  }

  const PlaneFrame& frame() const { return frame_; }
  std::size_t countU() const { return countU_; }
  std::size_t countV() const { return countV_; }
  Vec3d point(std::size_t i, std::size_t j, double height) const {
    return origin_ + frame_.u * (double(firstU_ + std::int64_t(i)) * spacing_) +
           frame_.v * (double(firstV_ + std::int64_t(j)) * spacing_) + normal_ * height;
  }
  double height(std::size_t i, std::size_t j) const { return heights_[j * countU_ + i]; }

  /// Raised by `distance`, as measured across the slopes.
  void raise(double distance) {
    const std::vector<double> flat = heights_;
    const auto at = [&](std::size_t i, std::size_t j) { return flat[j * countU_ + i]; };
    std::vector<double> secants(heights_.size()), faces(heights_.size());
    for (std::size_t j = 0; j + 1 < countV_; ++j)
      for (std::size_t i = 0; i + 1 < countU_; ++i)
        for (const bool isLower : {true, false}) {
          const double du = isLower ? at(i + 1, j) - at(i, j) : at(i + 1, j + 1) - at(i, j + 1);
          const double dv = isLower ? at(i + 1, j + 1) - at(i + 1, j) : at(i, j + 1) - at(i, j);
          const double secant = std::sqrt(1 + (du * du + dv * dv) / (spacing_ * spacing_));
          for (const std::size_t k : {j * countU_ + i, (j + 1) * countU_ + i + 1,
                                      isLower ? j * countU_ + i + 1 : (j + 1) * countU_ + i}) {
            secants[k] += secant;
            faces[k] += 1;
          }
        }
    for (std::size_t k = 0; k < heights_.size(); ++k) heights_[k] += distance * secants[k] / faces[k];
  }

  /// How far a point is above, along the normal.
  double above(const Vec3d& p) const {
    const double u = dot(p - origin_, frame_.u) / spacing_ - double(firstU_),
                 v = dot(p - origin_, frame_.v) / spacing_ - double(firstV_);
    const auto i = std::size_t(std::clamp(u, 0.0, double(countU_) - 2)),
               j = std::size_t(std::clamp(v, 0.0, double(countV_) - 2));
    const double x = u - double(i), y = v - double(j);
    const double z00 = height(i, j), z11 = height(i + 1, j + 1);
    const double z = x >= y ? z00 + x * (height(i + 1, j) - z00) + y * (z11 - height(i + 1, j))
                            : z00 + y * (height(i, j + 1) - z00) + x * (z11 - height(i, j + 1));
    return dot(p - origin_, normal_) - z;
  }

 private:
  Vec3d origin_, normal_;
  PlaneFrame frame_;
  double spacing_ = 0.0;
  std::int64_t firstU_ = 0, firstV_ = 0;
  std::size_t countU_ = 0, countV_ = 0;
  std::vector<double> heights_;
};

/// What is to be cut, to ask what is near or inside.
struct Probe {
  explicit Probe(const CutSource& source)
      : solid(source),
        tree(source.positions(), source.triangles(), 0, std::uint32_t(source.triangles().size())) {}

  const CutSource& solid;
  TriangleTree tree;
};

/// Blocks of a lattice, by rows: those that are in the solid or near it. Blocks away from its surface that
/// touch each other are on one side of it.
class NearBlocks {
 public:
  static constexpr std::size_t kSize = 8;

  NearBlocks(const HeightField& field, const Probe& probe)
      : countU_((field.countU() - 2) / kSize + 1), countV_((field.countV() - 2) / kSize + 1) {
    constexpr char kUnknown = 2;
    isNear_.assign(countU_ * countV_, kUnknown);
    parallelFor(isNear_.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const std::size_t i0 = b % countU_ * kSize, j0 = b / countU_ * kSize;
        Vec3d low = field.point(i0, j0, field.height(i0, j0)), high = low;
        for (std::size_t j = j0; j <= std::min(j0 + kSize, field.countV() - 1); ++j)
          for (std::size_t i = i0; i <= std::min(i0 + kSize, field.countU() - 1); ++i) {
            const Vec3d p = field.point(i, j, field.height(i, j));
            low = min(low, p);
            high = max(high, p);
          }
        if (probe.tree.meetsBox(low, high)) isNear_[b] = 1;
      }
    });
    std::vector<std::size_t> open;
    for (std::size_t start = 0; start < isNear_.size(); ++start) {
      if (isNear_[start] != kUnknown) continue;
      const std::size_t i = start % countU_ * kSize, j = start / countU_ * kSize;
      const Vec3d p = field.point(i, j, field.height(i, j));
      const bool isInside = windingNumber(probe.solid.positions(), probe.solid.triangles(), p) > 0.5;
      isNear_[start] = isInside;
      open.push_back(start);
      while (!open.empty()) {
        const std::size_t b = open.back(), u = b % countU_, v = b / countU_;
        open.pop_back();
        const auto visit = [&](std::size_t other) {
          if (isNear_[other] != kUnknown) return;
          isNear_[other] = isInside;
          open.push_back(other);
        };
        if (u > 0) visit(b - 1);
        if (u + 1 < countU_) visit(b + 1);
        if (v > 0) visit(b - countU_);
        if (v + 1 < countV_) visit(b + countU_);
      }
    }
  }

  /// Of the block that holds a cell.
  bool contains(std::size_t i, std::size_t j) const { return isNear_[j / kSize * countU_ + i / kSize] != 0; }

 private:
  std::size_t countU_, countV_;
  std::vector<char> isNear_;
};

KnifeSheet sheetOf(HeightField field, const Probe& probe, const std::string& name, std::uint32_t knife) {
  KnifeSheet sheet;
  sheet.name = name;
  sheet.knife = knife;
  sheet.frames = {field.frame()};
  const NearBlocks near(field, probe);
  constexpr std::uint32_t kNone = ~0u;
  const std::size_t nu = field.countU(), nv = field.countV();
  std::vector<std::uint32_t> numbers(nu * nv, kNone);
  const auto number = [&](std::size_t i, std::size_t j) {
    std::uint32_t& n = numbers[j * nu + i];
    if (n == kNone) {
      n = std::uint32_t(sheet.positions.size());
      sheet.positions.push_back(field.point(i, j, field.height(i, j)));
    }
    return n;
  };
  for (std::size_t j = 0; j + 1 < nv; ++j)
    for (std::size_t i = 0; i + 1 < nu; ++i) {
      if (!near.contains(i, j)) continue;
      const std::uint32_t a = number(i, j), b = number(i + 1, j), c = number(i + 1, j + 1),
                          d = number(i, j + 1);
      sheet.triangles.push_back({a, c, b});
      sheet.triangles.push_back({a, d, c});
    }
  const auto shared = std::make_shared<HeightField>(std::move(field));
  sheet.side = [shared](const Vec3d& p) { return shared->above(p); };
  return sheet;
}

/// The vector d with n . d as near to 1 as can be for all normals, and no longer than it must.
Vec3d jointNormal(std::span<const std::pair<Vec3d, double>> normals) {
  // Steepest ascent in the space of the normals: conjugate gradients for the normal equations, which give the
  // shortest solution from zero on. Three steps are exact; a flat fan needs one.
  Vec3d d{}, r{};
  double weights = 0;
  for (const auto& [n, w] : normals) {
    r += n * w;
    weights += w;
  }
  Vec3d p = r;
  double rr = dot(r, r);
  for (int step = 0; step < 3 && rr > 1e-4 * weights * weights; ++step) {
    Vec3d q{};
    for (const auto& [n, w] : normals) q += n * (w * dot(n, p));
    const double a = rr / dot(p, q);
    d += p * a;
    r = r - q * a;
    const double next = dot(r, r);
    p = r + p * (next / rr);
    rr = next;
  }
  return d;
}

/// A closed mesh with its vertices moved so that its faces come to lie `distance` further out.
Mesh movedOut(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles, double distance) {
  std::vector<std::vector<std::pair<Vec3d, double>>> fans(positions.size());
  for (const TriangleIndices& t : triangles) {
    const Vec3d n = normalize(cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d a = positions[t[(k + 1) % 3]] - positions[t[k]],
                  b = positions[t[(k + 2) % 3]] - positions[t[k]];
      const double angle = std::atan2(length(cross(a, b)), dot(a, b));
      if (angle > 0) fans[t[k]].emplace_back(n, angle);
    }
  }
  Mesh moved;
  moved.positions.assign(positions.begin(), positions.end());
  for (std::size_t v = 0; v < fans.size(); ++v)
    if (!fans[v].empty()) moved.positions[v] += jointNormal(fans[v]) * distance;
  for (const TriangleIndices& t : triangles) moved.addFace(t);
  return moved;
}

/// True if the triangles of `moved` turned over on their way from `positions`, or cross each other.
bool isFolded(const Mesh& moved, std::span<const Vec3d> positions) {
  const auto normalOf = [&](std::span<const std::uint32_t> face, std::span<const Vec3d> at) {
    return cross(at[face[1]] - at[face[0]], at[face[2]] - at[face[0]]);
  };
  for (std::size_t f = 0; f < moved.faceCount(); ++f)
    if (dot(normalOf(moved.face(f), positions), normalOf(moved.face(f), moved.positions)) < 0) return true;
  return signedVolume(moved) <= 0 || countSelfIntersections(moved).value_or(0) != 0;
}

/// The sides of a solid as surfaces of its distance, in and around what is cut.
std::array<Mesh, 2> sampledSides(const Mesh& blade, float kerf, const CutSource& solid,
                                 const Progress& progress) {
  // Of a blade that is far larger than what is cut no more is sampled than memory holds.
  constexpr double kVoxels = 256, kMostOfBlade = 2048;
  const Box box{Vec3f(solid.low()), Vec3f(solid.high())};
  const double voxel =
      std::max(double(box.longestSide()) / kVoxels, double(boundingBox(blade).longestSide()) / kMostOfBlade);
  const auto grid =
      sampledBlade(solidKnife(triangulated(blade), voxel, kerf, progress).field, box, voxel, kerf, progress);
  return {marchingCubes(*grid, -0.5f * kerf, progress), marchingCubes(*grid, 0.5f * kerf, progress)};
}

KnifeSheet sheetOf(std::vector<Vec3d> positions, std::vector<TriangleIndices> triangles,
                   const std::string& name, std::uint32_t knife) {
  KnifeSheet sheet;
  sheet.name = name;
  sheet.knife = knife;
  for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
    sheet.frames.push_back(PlaneFrame::of(axis));
  for (const TriangleIndices& t : triangles) {
    const Vec3d n = cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]);
    const double x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
    sheet.frameOf.push_back(x >= y && x >= z ? 0 : y >= z ? 1 : 2);
  }
  struct Surface {
    std::vector<Vec3d> positions;
    std::vector<TriangleIndices> triangles;
  };
  const auto surface = std::make_shared<Surface>(Surface{positions, triangles});
  sheet.side = [surface](const Vec3d& p) {
    return windingNumber(surface->positions, surface->triangles, p) - 0.5;
  };
  sheet.positions = std::move(positions);
  sheet.triangles = std::move(triangles);
  return sheet;
}

}  // namespace

PlaneFrame PlaneFrame::of(const Vec3d& normal) {
  const Vec3d u =
      normalize(std::abs(normal.y) < 0.9 ? cross(Vec3d{0, 1, 0}, normal) : cross(Vec3d{0, 0, 1}, normal));
  return {u, cross(normal, u)};
}

double roughSpacing(const RoughnessOptions& roughness, double size) {
  constexpr double kPointsPerWave = 8, kFinest = 400;
  const double shortest =
      1 / (double(roughness.noise.frequency) * std::pow(double(roughness.lacunarity), roughness.octaves - 1));
  return std::clamp(shortest / kPointsPerWave, size / kFinest, size / 8);
}

std::vector<KnifeSheet> knifeSheets(const Knives& knives, float kerf, const CutSource& solid,
                                    const Progress& progress) {
  const double half = double(kerf) / 2;
  const std::size_t perKnife = half == 0 ? 1 : 2;
  std::vector<KnifeSheet> sheets(perKnife * knives.rough.size());
  if (!knives.rough.empty()) {
    const Probe probe(solid);
    parallelFor(knives.rough.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const std::string name = fmt::format("rough blade {}", k);
        const HeightField field(knives.rough[k], solid.low(), solid.high(), name);
        for (std::size_t s = 0; s < perKnife; ++s) {
          HeightField side = field;
          if (half != 0) side.raise(s == 0 ? -half : half);
          sheets[perKnife * k + s] = sheetOf(std::move(side), probe, name, std::uint32_t(k));
        }
      }
    });
  }
  auto knife = std::uint32_t(knives.rough.size());
  for (std::size_t k = 0; k < knives.solids.size(); ++k, ++knife) {
    const std::string name = fmt::format("solid {}", k);
    const CutSource blade(knives.solids[k], name);
    const auto& positions = blade.positions();
    const auto& triangles = blade.triangles();
    if (half == 0) {
      sheets.push_back(sheetOf(positions, triangles, name, knife));
      continue;
    }
    // The positive side is inside, so what is further out comes first.
    std::array<Mesh, 2> sides{movedOut(positions, triangles, half), movedOut(positions, triangles, -half)};
    if (isFolded(sides[0], positions) || isFolded(sides[1], positions))
      sides = sampledSides(knives.solids[k], kerf, solid, progress);
    for (Mesh& side : sides) {
      std::vector<TriangleIndices> faces;
      for (std::size_t f = 0; f < side.faceCount(); ++f) {
        const auto corners = side.face(f);
        faces.push_back({corners[0], corners[1], corners[2]});
      }
      sheets.push_back(sheetOf(std::move(side.positions), std::move(faces), name, knife));
    }
  }
  return sheets;
}

}  // namespace nephele::detail
