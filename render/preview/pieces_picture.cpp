// A picture of pieces: colours that tell them apart, and meshes whose vertices are parted where surfaces turn
// sharply, so that cuts look flat and rims sharp.
#include "nephele/render/preview/pieces_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "nephele/levelset/cut/piece_files.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele {
namespace {

constexpr float kCreaseCosine = 0.82f;  // 35 degrees

/// OKLCH, by B. Ottosson, to linear Rec.709, clamped.
Vec3f fromLch(double lightness, double chroma, double hue) {
  const double a = chroma * std::cos(hue), b = chroma * std::sin(hue);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3),
               m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3),
               s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  const auto part = [](double v) { return float(std::clamp(v, 0.01, 0.95)); };
  return {part(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          part(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          part(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

struct Paint {
  double lightness, chroma, hueDegrees;
};

// Twelve that differ in hue and lightness, the ones that differ most first.
constexpr std::array<Paint, 12> kPaints{{{0.66, 0.17, 33},
                                         {0.62, 0.12, 235},
                                         {0.80, 0.14, 83},
                                         {0.60, 0.11, 165},
                                         {0.56, 0.15, 300},
                                         {0.74, 0.13, 125},
                                         {0.72, 0.12, 5},
                                         {0.72, 0.09, 205},
                                         {0.50, 0.13, 265},
                                         {0.72, 0.15, 58},
                                         {0.62, 0.16, 340},
                                         {0.53, 0.10, 50}}};

Vec3f paint(std::size_t number) {
  const Paint& base = kPaints[number % kPaints.size()];
  const auto round = double(number / kPaints.size());
  // Later rounds turn the hue by a part of the circle that never repeats, and vary the lightness.
  const double turned = std::fmod(round * 0.381966 * 30, 30.0) - (round > 0 ? 15 : 0);
  const double lighter = 0.055 * std::sin(round * 2.4);
  return fromLch(base.lightness + lighter, base.chroma, (base.hueDegrees + turned) * M_PI / 180);
}

/// Some faces of a mesh, moved, with vertices parted at creases.
Mesh facesOf(const Mesh& mesh, const std::vector<std::uint32_t>& faces, const Vec3d& offset) {
  struct Corner {
    std::uint32_t vertex, place;
    Vec3f normal;
  };
  std::vector<Corner> corners;
  for (std::uint32_t i = 0; i < faces.size(); ++i) {
    const auto v = mesh.face(faces[i]);
    const Vec3d& a = mesh.positions[v[0]];
    const Vec3f normal(normalize(cross(mesh.positions[v[1]] - a, mesh.positions[v[2]] - a)));
    for (std::uint32_t k = 0; k < 3; ++k) corners.push_back({v[k], 3 * i + k, normal});
  }
  std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return a.vertex != b.vertex ? a.vertex < b.vertex : a.place < b.place;
  });
  Mesh result;
  result.corners.resize(3 * faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) result.faceStart.push_back(3 * (f + 1));
  struct Fan {
    Vec3f sum;
    std::uint32_t position;
  };
  std::vector<Fan> fans;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i == 0 || corners[i].vertex != corners[i - 1].vertex) fans.clear();
    const auto fan = std::find_if(fans.begin(), fans.end(), [&](const Fan& f) {
      return dot(normalize(f.sum), corners[i].normal) > kCreaseCosine;
    });
    if (fan != fans.end()) {
      fan->sum += corners[i].normal;
      result.corners[corners[i].place] = fan->position;
      continue;
    }
    fans.push_back({corners[i].normal, std::uint32_t(result.positions.size())});
    result.corners[corners[i].place] = fans.back().position;
    result.positions.push_back(mesh.positions[corners[i].vertex] + offset);
  }
  return result;
}

/// Outer and inner faces of a piece as objects.
void addObjects(const Piece& piece, const Vec3d& offset, const Vec3f& colour,
                std::vector<SurfaceObject>& objects) {
  const Mesh mesh = triangulated(piece.mesh);
  std::vector<std::uint32_t> faces[2];
  std::size_t group = 0;
  for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
    while (group < mesh.groups.size() && f >= mesh.groups[group].firstFace + mesh.groups[group].faceCount)
      ++group;
    const bool isInner = group < mesh.groups.size() && f >= mesh.groups[group].firstFace &&
                         mesh.groups[group].name == "inside";
    faces[isInner ? 1 : 0].push_back(f);
  }
  const Vec3f pale = colour * 0.45f + Vec3f{0.48f, 0.46f, 0.43f};
  for (const int side : {0, 1})
    if (!faces[side].empty())
      objects.push_back({.mesh = facesOf(mesh, faces[side], offset), .colour = side == 0 ? colour : pale});
}

}  // namespace

std::vector<Vec3f> pieceColours(std::span<const std::vector<PieceContact>> neighbours,
                                std::span<const double> sizes) {
  require(neighbours.size() == sizes.size(), "colours of pieces: neighbours and sizes differ in number");
  std::vector<std::uint32_t> order(sizes.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return sizes[a] > sizes[b]; });
  std::vector<Vec3f> colours(sizes.size());
  std::vector<bool> isSet(sizes.size());
  // Each round of paints is used up before the next begins; within it, what is farthest from the neighbours'.
  std::vector<std::size_t> left;
  std::size_t made = 0;
  for (const std::uint32_t piece : order) {
    if (left.empty())
      for (std::size_t k = 0; k < kPaints.size(); ++k) left.push_back(made++);
    std::size_t best = 0;
    float farthest = -1;
    for (std::size_t k = 0; k < left.size(); ++k) {
      const Vec3f colour = paint(left[k]);
      float nearest = 10;
      for (const PieceContact& other : neighbours[piece])
        if (isSet[other.piece]) {
          const Vec3f &a = colour, &b = colours[other.piece];
          nearest =
              std::min(nearest, length(Vec3f{std::cbrt(a.x) - std::cbrt(b.x), std::cbrt(a.y) - std::cbrt(b.y),
                                             std::cbrt(a.z) - std::cbrt(b.z)}));
        }
      if (nearest > farthest) {
        farthest = nearest;
        best = k;
      }
    }
    colours[piece] = paint(left[best]);
    isSet[piece] = true;
    left.erase(left.begin() + std::ptrdiff_t(best));
  }
  return colours;
}

std::vector<SurfaceObject> piecesObjects(const Pieces& pieces, double explode) {
  require(!pieces.pieces.empty(), "picture of pieces: there are none");
  std::vector<std::vector<PieceContact>> neighbours;
  std::vector<double> sizes;
  for (const Piece& piece : pieces.pieces) {
    neighbours.push_back(piece.neighbours);
    sizes.push_back(piece.mass.volume);
  }
  const std::vector<Vec3f> colours = pieceColours(neighbours, sizes);
  const std::vector<Vec3d> offsets = explodedOffsets(pieces, explode);
  std::vector<SurfaceObject> objects;
  for (std::size_t i = 0; i < pieces.pieces.size(); ++i)
    addObjects(pieces.pieces[i], offsets[i], colours[i], objects);
  return objects;
}

Image picturePieces(const Pieces& pieces, const PiecesPictureOptions& options, const Progress& progress) {
  return pictureSurfaces(piecesObjects(pieces, options.explode),
                         {.width = options.width,
                          .height = options.height,
                          .azimuthDegrees = options.azimuthDegrees,
                          .elevationDegrees = options.elevationDegrees,
                          .samples = options.samples},
                         progress);
}

}  // namespace nephele
