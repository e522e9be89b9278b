#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "nephele/levelset/cut/cut.h"
#include "tests/support/mesh_attributes.h"
#include "tests/support/mesh_topology.h"

namespace nephele::test {

inline double volumeSum(const Pieces& cut) {
  double sum = cut.sliverVolume;
  for (const Piece& piece : cut.pieces) sum += piece.mass.volume;
  return sum;
}

inline double faceArea(const Mesh& mesh, std::size_t f) {
  const auto v = mesh.face(f);
  const Vec3d &a = mesh.positions[v[0]], &b = mesh.positions[v[1]], &c = mesh.positions[v[2]];
  return length(cross(b - a, c - a)) / 2;
}

/// First face of the group `inside`; the number of faces if there is none.
inline std::size_t firstInside(const Mesh& mesh) {
  return !mesh.groups.empty() && mesh.groups.back().name == "inside" ? mesh.groups.back().firstFace
                                                                     : mesh.faceCount();
}

inline double insideArea(const Mesh& mesh) {
  double area = 0;
  for (std::size_t f = firstInside(mesh); f < mesh.faceCount(); ++f) area += faceArea(mesh, f);
  return area;
}

/// Closed manifold pieces facing outwards, of the volume of the source together, whose inner faces each lie
/// on one of another piece, point by point.
inline void expectSound(const Mesh& source, const Pieces& cut) {
  double inside = 0, contact = 0;
  for (const Piece& piece : cut.pieces) {
    EXPECT_TRUE(topologyOf(piece.mesh).isClosedManifold()) << topologyOf(piece.mesh);
    EXPECT_GT(piece.mass.volume, 0);
    EXPECT_NEAR(signedVolume(piece.mesh), piece.mass.volume, 1e-9 * signedVolume(source));
    inside += insideArea(piece.mesh);
    for (const PieceContact& neighbour : piece.neighbours) contact += neighbour.area;
  }
  // The bar of an exact cut; rounding alone is some 1e-14.
  EXPECT_NEAR(volumeSum(cut) / signedVolume(source), 1, 1e-8);
  if (cut.slivers == 0) {
    EXPECT_NEAR(contact, inside, 1e-9 * (1 + inside));
  }
}

/// The largest difference between texture coordinates of outer faces, at random points of every `stride`-th
/// of them, and those of the source there. `checked` counts the points.
inline double worstTexture(const Mesh& source, const Pieces& cut, std::size_t stride, std::size_t& checked) {
  const MeshAttribute& sourceUv = attributeOf(source, "uv");
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.05, 0.9);
  checked = 0;
  double worst = 0;
  for (const Piece& piece : cut.pieces) {
    const MeshAttribute& uv = attributeOf(piece.mesh, "uv");
    for (std::size_t f = random() % stride; f < firstInside(piece.mesh); f += stride) {
      double w[3] = {unit(random), unit(random), unit(random)};
      const double sum = w[0] + w[1] + w[2];
      Vec3d p{};
      double u[2] = {0, 0};
      for (std::size_t k = 0; k < 3; ++k) {
        w[k] /= sum;
        p += piece.mesh.positions[piece.mesh.face(f)[k]] * w[k];
        for (std::size_t i = 0; i < 2; ++i) u[i] += w[k] * double(uv.values[2 * (3 * f + k) + i]);
      }
      // Of all triangles of the source that hold the point, the one that agrees best.
      double best = 1;
      for (std::size_t t = 0; t < source.faceCount(); ++t) {
        const auto v = source.face(t);
        const Vec3d &a = source.positions[v[0]], &b = source.positions[v[1]], &c = source.positions[v[2]];
        if (std::abs(p.x - a.x) > 0.2 || std::abs(p.y - a.y) > 0.2 || std::abs(p.z - a.z) > 0.2) continue;
        const Vec3d n = cross(b - a, c - a);
        const double area = dot(n, n);
        if (std::abs(dot(n, p - a)) > 1e-9 * std::sqrt(area)) continue;
        const double wb = dot(n, cross(p - a, c - a)) / area, wc = dot(n, cross(b - a, p - a)) / area;
        if (wb < -1e-7 || wc < -1e-7 || wb + wc > 1 + 1e-7) continue;
        double error = 0;
        for (std::size_t i = 0; i < 2; ++i) {
          const auto at = [&](std::size_t k) { return double(sourceUv.values[2 * (3 * t + k) + i]); };
          error = std::max(error, std::abs((1 - wb - wc) * at(0) + wb * at(1) + wc * at(2) - u[i]));
        }
        best = std::min(best, error);
      }
      worst = std::max(worst, best);
      ++checked;
    }
  }
  return worst;
}

}  // namespace nephele::test
