// The repair ladder: from any triangle soup to a closed, outward-oriented mesh, with as little change as
// possible.
//
// 1. Merge equal positions. Closed and outward already: done.
// 2. Drop degenerate and duplicate faces; merge boundary vertices within 1e-6 of the longest side if that
// closes
//    something; give neighbouring faces one orientation.
// 3. Split what is not manifold and fill the holes.
// 4. Turn parts outward; inward parts inside others are cavities and stay.
// 5. Where holes are left, or closing a part took about as much new surface as the part had (a panel, not a
// solid):
//    alpha wrapping of everything, or, if that is most of the mesh, an error, because an open sheet has no
//    inside.
// A mesh whose volume is that of a sheet thinner than about 1e-6 of its longest side is refused: no grid can
// hold it.
#include "nephele/levelset/mesh/mesh_repair.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "nephele/levelset/mesh/detail/mesh_holes.h"
#include "nephele/levelset/mesh/detail/mesh_parts.h"
#include "nephele/levelset/mesh/detail/mesh_wrap.h"
#include "nephele/levelset/mesh/detail/vertex_attributes.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

constexpr double kNearlyEqual = 1e-6;    // share of the longest side
constexpr double kThinnest = 1e-5;       // mean thickness, share of the longest side
constexpr double kSmallest = 1e-9;       // volume, share of the cube over the longest side
constexpr double kMostNewSurface = 0.9;  // filled area / area of a part
constexpr double kMostOfAShell = 1.5;    // mean thickness / twice the offset of the wrap

std::string counted(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

/// Beyond them cubes of lengths leave the range of float, in which boxes and fields are held.
constexpr double kSmallestSide = 1e-9, kLargestSide = 1e12;

std::string joined(const std::vector<std::string>& list) {
  std::string text;
  for (const std::string& entry : list) text += (text.empty() ? "" : "; ") + entry;
  return text;
}

bool isThin(const MeshDiagnosis& d) {
  const double side = static_cast<double>(d.box.longestSide());
  return 2 * std::abs(d.volume) < kThinnest * d.area * side ||
         std::abs(d.volume) < kSmallest * side * side * side;
}

class Ladder {
 public:
  Ladder(const Mesh& mesh, const MeshRepairOptions& options, const Progress& progress)
      : source_(mesh), options_(options), progress_(progress) {}

  RepairedMesh run() {
    result_.before = diagnose(source_);
    progress_.check();
    require(result_.before.faces > 0, "mesh repair: the mesh has no faces");
    const double side = double(result_.before.box.longestSide());
    require(side > 0, "mesh repair: the mesh is a single point");
    const bool isTooLarge = !std::isfinite(result_.before.area) || !(side <= kLargestSide);
    if (isTooLarge || side < kSmallestSide)
      throw Error(fmt::format(
          "mesh repair: the mesh is too {}: its longest side is {:.3g}, allowed: from {:g} to {:g}",
          isTooLarge ? "large" : "small", side, kSmallestSide, kLargestSide));
    result_.mesh = result_.before.mergedVertices > 0 ? detail::withMergedPositions(source_) : source_;
    // Before polygons become fans: two that coincide may be cut along different diagonals.
    if (options_.mode == MeshRepairOptions::Mode::automatic && result_.before.duplicateFaces > 0)
      dropDuplicates();
    Mesh polygons;
    if (options_.keepPolygons && !result_.mesh.isTriangles()) polygons = result_.mesh;
    result_.mesh = triangulated(result_.mesh);
    switch (options_.mode) {
      case MeshRepairOptions::Mode::off:
        requireGood();
        break;
      case MeshRepairOptions::Mode::wrap:
        wrap("as asked");
        break;
      case MeshRepairOptions::Mode::automatic:
        repair();
        break;
    }
    result_.after = result_.repairs.empty() && result_.before.mergedVertices == 0 && source_.isTriangles()
                        ? result_.before
                        : diagnose(result_.mesh);
    if (result_.after.closed() && isThin(result_.after)) failThin(result_.after);
    require(result_.after.closed() && result_.after.volume > 0,
            fmt::format("mesh repair: the mesh could not be closed{}; repair mode 'wrap' makes a closed "
                        "surface around it",
                        result_.after.problems().empty()
                            ? ", or holds nothing"
                            : fmt::format(" ({})", joined(result_.after.problems()))));
    if (result_.repairs.empty() && polygons.faceCount() > 0) result_.mesh = std::move(polygons);
    return std::move(result_);
  }

 private:
  [[noreturn]] static void failThin(const MeshDiagnosis& d) {
    throw Error(
        fmt::format("mesh repair: the mesh is flat: it encloses {:.3g} cubic units within an area of {:.3g}, "
                    "too thin for any grid; "
                    "repair mode 'wrap' makes a shell around it",
                    d.volume, d.area));
  }

  void requireGood() {
    const MeshDiagnosis& d = result_.before;
    require(d.closed(),
            fmt::format("mesh repair: the mesh is not closed: {}; repair mode 'auto' may repair it",
                        joined(d.problems())));
    require(!d.inward(),
            "mesh repair: the mesh is closed but oriented inwards; repair mode 'auto' would turn it");
  }

  void report(std::string what) { result_.repairs.push_back(std::move(what)); }

  void repair() {
    const MeshDiagnosis& before = result_.before;
    if (before.closed()) {
      // Volumes of parts of which one is inside out cancel each other.
      if (before.components == 1 && isThin(before)) failThin(before);
      if (before.degenerateFaces > 0) dropDegenerates();
      const bool onePart = before.components == 1 && before.manifold();
      if (onePart && result_.repairs.empty() && !before.inward()) return;
      turnParts(result_.mesh, detail::findClosedParts(result_.mesh));
      return;
    }

    if (before.mergedVertices > 0)
      report(fmt::format("merged {}", counted(before.mergedVertices, "equal vertex", "equal vertices")));
    dropDegenerates();
    dropDuplicates();
    mergeNearBoundary();
    orient();
    progress_.check();
    if (diagnose(result_.mesh).closed()) {
      turnParts(result_.mesh, detail::findClosedParts(result_.mesh));
    } else {
      fillHoles();
    }
  }

  void requireFaces() const {
    require(
        result_.mesh.faceCount() > 0,
        "mesh repair: nothing is left without degenerate and coincident faces; repair mode 'wrap' makes a "
        "shell around "
        "what was there");
  }

  void dropDegenerates() {
    Mesh clean = detail::withoutDegenerates(result_.mesh);
    const std::size_t dropped = result_.mesh.faceCount() - clean.faceCount();
    if (dropped == 0) return;
    report(fmt::format("dropped {}", counted(dropped, "degenerate triangle", "degenerate triangles")));
    result_.mesh = std::move(clean);
    requireFaces();
  }

  void dropDuplicates() {
    Mesh clean = detail::withoutDuplicates(result_.mesh);
    const std::size_t dropped = result_.mesh.faceCount() - clean.faceCount();
    if (dropped == 0) return;
    report(fmt::format("dropped {}", counted(dropped, "coincident face", "coincident faces")));
    result_.mesh = std::move(clean);
    requireFaces();
  }

  void mergeNearBoundary() {
    const MeshDiagnosis d = diagnose(result_.mesh);
    if (d.boundaryEdges == 0) return;
    const double tolerance = kNearlyEqual * static_cast<double>(d.box.longestSide());
    Mesh merged = detail::withoutDegenerates(detail::withNearBoundaryMerged(result_.mesh, tolerance));
    const MeshDiagnosis m = diagnose(merged);
    if (m.boundaryEdges >= d.boundaryEdges || m.nonManifoldEdges > d.nonManifoldEdges) return;
    report(fmt::format("merged {} closer than {:.3g}",
                       counted(d.vertices - m.vertices, "boundary vertex", "boundary vertices"), tolerance));
    result_.mesh = std::move(merged);
  }

  // Neighbours agree afterwards, except across edges with more than two faces and on one-sided parts.
  void orient() {
    const detail::MeshParts parts = detail::findParts(result_.mesh);
    oneSided_ = parts.oneSided;
    const auto turned = static_cast<std::size_t>(std::count(parts.turned.begin(), parts.turned.end(), true));
    if (turned == 0) return;
    report(fmt::format("turned {} to agree with the rest", counted(turned, "triangle", "triangles")));
    result_.mesh =
        detail::selectFaces(result_.mesh, std::vector<bool>(result_.mesh.faceCount(), true), parts.turned);
  }

  void turnParts(Mesh& mesh, const detail::MeshParts& parts) {
    const std::vector<bool> turn = detail::partsToTurn(mesh, parts);
    const auto count = static_cast<std::size_t>(std::count(turn.begin(), turn.end(), true));
    if (count == 0) return;
    if (parts.count == 1)
      report("turned the mesh outward");
    else
      report(fmt::format("turned {} of {} parts outward", count, parts.count));
    std::vector<bool> turned(mesh.faceCount());
    for (std::size_t f = 0; f < turned.size(); ++f) turned[f] = turn[parts.partOf[f]];
    mesh = detail::selectFaces(mesh, std::vector<bool>(turned.size(), true), turned);
  }

  void fillHoles() {
    detail::FilledMesh filled = detail::withHolesFilled(result_.mesh, progress_);
    progress_.check();
    const detail::MeshParts parts = detail::findParts(filled.mesh);
    const SheetShare sheets = sheetShare(filled, parts);
    if (sheets.area > 0.5 * sheets.total) {
      throw Error(fmt::format(
          "mesh repair: the mesh is {}, not a solid ({}), so it has no inside; repair mode 'wrap' makes a "
          "shell "
          "around it",
          oneSided_ > 0 ? "a one-sided sheet" : "an open sheet", joined(result_.before.problems())));
    }
    if (sheets.count > 0) {
      wrap(fmt::format("{} could not be closed", counted(sheets.count, "part", "parts")));
      return;
    }
    if (filled.holes > 0)
      report(fmt::format("filled {} ({})", counted(filled.holes, "hole", "holes"),
                         counted(filled.edges, "boundary edge", "boundary edges")));
    else
      report("split the surface where it touches itself");
    turnParts(filled.mesh, parts);
    result_.mesh = detail::withVertexAttributesOf(result_.mesh, detail::withMergedPositions(filled.mesh));
    if (diagnose(result_.mesh).duplicateFaces > 0) result_.mesh = detail::withoutDuplicates(result_.mesh);
    requireFaces();
  }

  // Parts that are sheets rather than solids: still open, or closed only by about as much new surface as they
  // had.
  struct SheetShare {
    std::size_t count = 0;
    double area = 0, total = 0;
  };
  static SheetShare sheetShare(const detail::FilledMesh& filled, const detail::MeshParts& parts) {
    std::vector<double> old(parts.count), added(parts.count);
    for (std::size_t f = 0; f < filled.mesh.faceCount(); ++f) {
      const auto face = filled.mesh.face(f);
      const Vec3d& a = filled.mesh.positions[face[0]];
      const double area =
          0.5 * length(cross(filled.mesh.positions[face[1]] - a, filled.mesh.positions[face[2]] - a));
      (f < filled.firstNewFace ? old : added)[parts.partOf[f]] += area;
    }
    std::vector<bool> open(parts.count, false);
    for (const std::uint32_t f : filled.openFaces) open[parts.partOf[f]] = true;
    SheetShare share;
    for (std::size_t p = 0; p < parts.count; ++p) {
      share.total += old[p];
      if (!open[p] && added[p] <= kMostNewSurface * old[p]) continue;
      share.area += old[p];
      ++share.count;
    }
    return share;
  }

  /// Wrapping constructs points that are so far apart, and goes wrong without a word where they are not.
  void requireDigits(double distance) const {
    constexpr double kLeast = 1e-11;
    const Box& box = result_.before.box;
    double farthest = 0;
    for (int axis = 0; axis < 3; ++axis)
      farthest = std::max({farthest, std::abs(double(box.min[axis])), std::abs(double(box.max[axis]))});
    require(distance >= kLeast * farthest,
            fmt::format(
                "mesh repair: the mesh is too far from the origin to be wrapped: its longest side is {:.3g}, "
                "its coordinates are up to {:.3g}",
                box.longestSide(), farthest));
  }

  void wrap(const std::string& why) {
    for (const double share : {options_.wrapAlpha, options_.wrapOffset})
      require(share > 0 && share <= 1,
              fmt::format(
                  "mesh repair: alpha and offset of the wrap must be in (0, 1] of the longest side, got {}",
                  share));
    progress_.begin("wrap");
    const double side = static_cast<double>(result_.before.box.longestSide());
    double coarser = 1;
    if (options_.voxelSize) {
      const double voxel = *options_.voxelSize / side;
      coarser = std::clamp(voxel / options_.wrapAlpha, 1.0, 1 / options_.wrapAlpha);
    }
    const double fineAlpha = options_.wrapAlpha * coarser * side,
                 fineOffset = options_.wrapOffset * coarser * side;
    requireDigits(std::min(fineAlpha, fineOffset));
    const Wrap wrap = chosenWrap(fineAlpha, fineOffset);
    const double alpha = wrap.factor * fineAlpha, offset = wrap.factor * fineOffset;
    const bool isSheet = isShell(wrap, fineOffset);
    if (isSheet) requireHeld(offset, wrap.thickness);
    result_.mesh = detail::withVertexAttributesOf(result_.mesh, wrap.mesh);
    // What was done before does not show in the wrap.
    result_.repairs.clear();
    report(fmt::format(
        "wrapped with alpha {:.3g} ({:.2g} % of the longest side), offset {:.3g} ({:.2g} %): {}{}", alpha,
        100 * alpha / side, offset, 100 * offset / side, why,
        wrap.factor > 1 ? "; a finer wrap would enter what is open, and be a shell too thin for "
                          "the voxels"
                        : ""));
    progress_.check();
    if (isSheet)
      report(
          fmt::format("the surface is open, so that the wrap is a shell about {:.3g} thick around it, not a "
                      "solid; close what is open for a solid",
                      2 * offset));
  }

  // A shell on both sides of a sheet holds half of its own area times its thickness; a solid far more.
  static double meanThickness(const Mesh& closed) { return 2 * signedVolume(closed) / surfaceArea(closed); }

  struct Wrap {
    Mesh mesh;
    double thickness;
    /// Coarser than asked for.
    double factor;
  };

  // Whether a wrap is a shell around an open surface.
  bool isShell(const Wrap& wrap, double fineOffset) const {
    return !result_.before.closed() && wrap.thickness < kMostOfAShell * 2 * wrap.factor * fineOffset;
  }

  // Whether the coarser wrap holds more than a shell of its own thickness where `shell` is one.
  static bool isFuller(const Wrap& coarser, const Wrap& shell) {
    constexpr double kFar = 2;
    return signedVolume(coarser.mesh) > kFar * coarser.factor / shell.factor * signedVolume(shell.mesh);
  }

  // The finest wrap that is no shell too thin for the voxels. Coarse ones take a small share of the time, and
  // close what finer ones enter: a coarse one that is a shell tells of a shell ahead, and one that is a solid
  // is what is left where a finer one is a shell.
  Wrap chosenWrap(double alpha, double offset) const {
    const double side = static_cast<double>(result_.before.box.longestSide());
    const bool mayBeThin = !result_.before.closed() && options_.voxelSize && 2 * offset < *options_.voxelSize;
    std::optional<Wrap> solid;
    bool isHeld = !mayBeThin;
    for (const double factor : {4.0, 2.0, 1.0}) {
      if (factor > 1 && (isHeld || factor * alpha > side)) continue;
      // Their areas, and so their times, go with the square.
      const double begin = mayBeThin && factor < 4 ? (factor == 2 ? 0.05 : 0.24) : 0;
      const SubProgress part(progress_, begin, factor == 4 ? 0.05 : factor == 2 ? 0.24 : 1);
      Wrap wrap{detail::wrapped(result_.mesh, factor * alpha, factor * offset, part), 0, factor};
      wrap.thickness = meanThickness(wrap.mesh);
      if (factor == 1 && isHeld) return wrap;
      if (isShell(wrap, offset)) {
        if (solid && isFuller(*solid, wrap)) return *std::move(solid);
        requireHeld(offset, wrap.thickness - 2 * (factor - 1) * offset);
        isHeld = true;
        solid.reset();
        if (factor == 1) return wrap;
      } else {
        solid = std::move(wrap);
      }
    }
    return *std::move(solid);
  }

  void requireHeld(double offset, double thickness) const {
    if (!options_.voxelSize || thickness >= *options_.voxelSize) return;
    // Marching cubes keep walls of two voxels.
    constexpr double kKept = 2.2;
    const double side = static_cast<double>(result_.before.box.longestSide());
    const double better = 2 * options_.wrapOffset * side / kKept;
    throw Error(fmt::format(
        "mesh repair: the surface is open ({}), so that its wrap is a shell about {:.3g} thick, not a solid, "
        "too thin for a voxel size of {:.4g}; close what is open for a solid, or try resolution {:.0f} "
        "(voxel size {:.4g}) for the shell",
        joined(result_.before.problems()), 2 * offset, *options_.voxelSize, std::ceil(side / better),
        better));
  }

  const Mesh& source_;
  const MeshRepairOptions& options_;
  const Progress& progress_;
  RepairedMesh result_;
  std::size_t oneSided_ = 0;
};

}  // namespace

RepairedMesh repairMesh(const Mesh& mesh, const MeshRepairOptions& options, const Progress& progress) {
  return Ladder(requireValid(mesh), options, progress).run();
}

}  // namespace nephele
