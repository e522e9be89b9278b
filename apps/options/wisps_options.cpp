#include "apps/options/wisps_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/cloud/attribute_field.h"
#include "nephele/levelset/cloud/cloud.h"
#include "nephele/levelset/io/point_io.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::apps {
namespace {

/// The longest side over a voxel of the grid that says what is inside a mesh.
constexpr double kInsideResolution = 96;
/// Radius of a dot where none is given, voxels.
constexpr float kDotVoxels = 1.5f;

Box boxOf(const Mesh& points) {
  Box box;
  for (const Vec3d& p : points.positions) box = box.including(Vec3f(p));
  return box;
}

std::vector<WispGuide> inShape(WispsArguments::Shape shape, float size, const GuideOptions& options) {
  Vec3f radii{size / 2, size / 2, size / 2};
  if (shape == WispsArguments::Shape::disc) radii.y *= 0.15f;
  if (shape == WispsArguments::Shape::streak) radii.y *= 0.1f, radii.z *= 0.1f;
  return guidesInside(ellipsoid({0, 0, 0}, radii), {-radii, radii}, options);
}

/// Points where `guides` are, with what the vertices of `mesh` say at the nearest place of its surface.
Mesh pointsAt(const std::vector<WispGuide>& guides, const Mesh& mesh, const Run& run) {
  Mesh points;
  std::vector<float> x, y, z;
  for (const WispGuide& guide : guides) {
    points.positions.emplace_back(guide.position);
    x.push_back(guide.position.x), y.push_back(guide.position.y), z.push_back(guide.position.z);
  }
  for (const MeshAttribute& attribute : mesh.attributes)
    if (attribute.domain == MeshAttribute::Domain::vertex)
      points.attributes.push_back({attribute.name, MeshAttribute::Domain::vertex, attribute.width,
                                   std::vector<float>(guides.size() * std::size_t(attribute.width))});
  std::vector<float> values(guides.size());
  for (const std::string& name : attributeNames(mesh)) {
    attributeField(mesh, name, {}, run).eval({x, y, z}, values);
    const AttributePart part = *attributePart(points, name);
    MeshAttribute& target = points.attributes[part.attribute];
    for (std::size_t i = 0; i < values.size(); ++i)
      target.values[i * std::size_t(target.width) + std::size_t(part.component)] = values[i];
  }
  return points;
}

std::vector<WispGuide> inMesh(const std::string& path, const Mesh& mesh, const GuideOptions& options,
                              Run& run) {
  const RepairedMesh repaired = namingFile(path, [&] { return repairMesh(mesh, {}, run); });
  for (const std::string& repair : repaired.repairs) run.note(path + ": " + repair);
  const Box box = boundingBox(repaired.mesh);
  const double voxel = double(box.longestSide()) / kInsideResolution;
  const MeshDistanceOptions band{.voxelSize = voxel, .exteriorBand = 3 * voxel, .interiorBand = 3 * voxel};
  const ScalarField level = namingFile(path, [&] { return meshDistance(repaired.mesh, band, run); });
  return guidesOnVertices(pointsAt(guidesInside(level, box, options), repaired.mesh, run), options);
}

/// Places of dots are floats, which far from the origin lie further apart than voxels.
void requireResolved(const Box& box, double voxelSize, const std::string& input) {
  constexpr double kMostOfAVoxel = 0.125;
  double farthest = 0;
  for (int c = 0; c < 3; ++c)
    farthest = std::max({farthest, std::abs(double(box.min[c])), std::abs(double(box.max[c]))});
  const double error = farthest * double(std::numeric_limits<float>::epsilon()) / 2 / voxelSize;
  if (error <= kMostOfAVoxel) return;
  const std::string fault = fmt::format(
      "wisps reach as far as {:.6g} from the origin, with voxels of {:.6g}: single precision would move "
      "dots by up to {:.2g} of their size",
      farthest, voxelSize, error);
  if (input.empty()) throw CLI::ValidationError("--voxel-size", fault);
  throw Error(input + ": " + fault + "; move the points nearer to the origin, or use larger voxels");
}

}  // namespace

std::vector<WispGuide> WispsArguments::readGuides(Run& run) const {
  GuideOptions options = guides;
  options.count = std::size_t(guideCount);
  options.seed = std::uint32_t(seed);
  options.sizeVariation = float(sizeVariation);
  options.standard.density = float(density);
  if (input.empty()) {
    run.begin("scatter");
    options.standard.size = float(size.worldUnits(shapeSize));
    return inShape(shape, float(shapeSize), options);
  }
  run.begin("read");
  const Mesh mesh = readPoints(input);
  const On where = on.value_or(mesh.faceCount() == 0 ? On::vertices : On::surface);
  if (where == On::vertices)
    refuseGiven({guidesOption}, "is for guides that are scattered, not one on each point");
  require(where == On::vertices || mesh.faceCount() > 0,
          input + ": has no faces to scatter guides on; --on vertices puts one on each of its points");
  const double side = run.longestSide(boxOf(mesh));
  options.standard.size = float(size.worldUnits(side));
  require(std::isfinite(side), input + ": its points lie further apart than numbers of 32 bits can hold");
  // A single point has no extent that a share could be taken of.
  require(options.standard.size > 0 || bringsGuideSizes(mesh),
          input + ": its points lie in one place; give --wisp-size in world units");
  run.begin("scatter");
  return namingFile(input, [&] {
    if (where == On::vertices) return guidesOnVertices(mesh, options);
    return where == On::surface ? guidesOnSurface(mesh, options) : inMesh(input, mesh, options, run);
  });
}

WispVolumeOptions WispsArguments::resolved(const std::vector<WispGuide>& made, const Run& run) const {
  WispVolumeOptions result;
  WispOptions& w = result.wisps;
  w = {.dots = std::uint32_t(dots),
       .correlation = float(correlation),
       .walkLength = std::uint32_t(walkLength),
       .amplitude = float(amplitude),
       .radial = {octaves, float(frequency), float(lacunarity), float(roughness)},
       .thickness = float(thickness),
       .clump = float(clump),
       .displacement = float(displacement),
       .vector = {displacementOctaves, float(displacementFrequency), float(lacunarity),
                  float(displacementRoughness)},
       .seed = std::uint32_t(seed)};
  const double side = run.longestSide(wispBox(made, w));
  namingFile(input, [&] {
    require(std::isfinite(side), "wisps: they reach further than numbers of 32 bits can hold");
  });
  if (!(side > 0) && (voxelSize.value == 0 || voxelSize.relative))
    throw CLI::ValidationError("--voxel-size", "all dots lie in one place; give a length in world units");
  DotVolumeOptions& d = result.dots;
  d.voxelSize = float(voxelSize.value > 0 ? voxelSize.worldUnits(side) : side / resolution);
  // An input is named by itself.
  if (input.empty() && !(d.voxelSize >= DotVolume::kLeastVoxel && d.voxelSize <= DotVolume::kLargestVoxel))
    throw CLI::ValidationError("--voxel-size",
                               fmt::format("voxels of {:g} are not from {:g} to {:g}", d.voxelSize,
                                           DotVolume::kLeastVoxel, DotVolume::kLargestVoxel));
  requireResolved(wispBox(made, w), d.voxelSize, input);
  // A smear is soft as it is, and large dots make it dear.
  const bool smears = shutterOpen != 0 || shutterClose != 0;
  d.radius = dotRadiusOption->count() > 0 ? float(dotRadius.worldUnits(side))
             : smears                     ? 0.0f
                                          : kDotVoxels * d.voxelSize;
  if (d.radius > DotVolume::kLargestRadius * d.voxelSize)
    throw CLI::ValidationError("--dot-radius",
                               fmt::format("{:g} is more than {:g} voxels of {:g}; use larger "
                                           "voxels or smaller dots",
                                           d.radius, DotVolume::kLargestRadius, d.voxelSize));
  d.shutterOpen = shutterOpen;
  d.shutterClose = shutterClose;
  d.withColor = std::any_of(made.begin(), made.end(), [](const WispGuide& g) {
    return g.color != Vec3f{1, 1, 1};
  });
  const bool moves = velocity || std::any_of(made.begin(), made.end(),
                                             [](const WispGuide& g) { return g.velocity != Vec3f{}; });
  if (smears && !moves)
    throw CLI::ValidationError("--shutter", "nothing moves; give --velocity, or points with vx, vy, vz");
  if (velocity) {
    VelocityArguments v = *velocity;
    v.grid = velocityGrid;
    result.velocity = v.field(side, double(run.frame().value_or(0)), seed);
  }
  return result;
}

void addWispsOptions(CLI::App& app, WispsArguments& a) {
  constexpr double any = 1e9;
  auto* input = app.add_option("input", a.input,
                               "Guides: points (.ply), or a mesh to scatter them on; default: in --shape.")
                    ->type_name("FILE");
  addOutput(app, "-o,--output", a.output, {".vdb"},
            "Volume to write: 'density', and 'Cd' where guides have colours.")
      ->required();
  addOutput(app, "--points", a.points, {".ply"}, "Also write the dots as points.");
  using On = WispsArguments::On;
  addChoice<std::optional<On>>(
      app, "--on", a.on, {{"vertices", On::vertices}, {"surface", On::surface}, {"volume", On::volume}},
      "Where in the input guides are; default: surface, or vertices where there are no faces.")
      ->needs(input);
  using Shape = WispsArguments::Shape;
  addChoice<Shape>(app, "--shape", a.shape,
                   {{"ball", Shape::ball}, {"disc", Shape::disc}, {"streak", Shape::streak}},
                   "Where guides are without an input.")
      ->excludes(input);
  addNumber(app, "--shape-size", a.shapeSize, 1e-6, any, "Longest side of the shape, world units.")
      ->excludes(input);

  a.guidesOption = addCount(app, "--guides", a.guideCount, 1, 100000000, "Guides to scatter.");
  addLength(app, "--wisp-size", a.size, "Radius of a wisp, where points bring none; percent: of the input.",
            Sign::positive);
  addNumber(app, "--wisp-size-variation", a.sizeVariation, 0, 0.99,
            "--wisp-size varies by this share, up and down.");
  addNumber(app, "--density", a.density, 0, any, "Mean density of a wisp, where points bring none.");
  app.add_option_function<std::string>(
         "--color",
         [&a](const std::string& text) {
           const std::string form = "R,G,B, each 0 to 1";
           const std::vector<double> c = parseNumbers("--color", text, form);
           if (c.size() != 3 || *std::min_element(c.begin(), c.end()) < 0 ||
               *std::max_element(c.begin(), c.end()) > 1)
             refuseValue("--color", text, form);
           a.guides.standard.color = {float(c[0]), float(c[1]), float(c[2])};
         },
         "Colour of wisps, where points bring none.")
      ->type_name("R,G,B")
      ->default_str("1,1,1");

  addCount(app, "--dots", a.dots, 1, 100000000, "Dots of a wisp: more are smoother, not denser.");
  addNumber(app, "--correlation", a.correlation, 0, 1,
            "How near a dot's random place stays to the last one's: towards 1, dots crowd along walks.");
  addCount(app, "--walk-length", a.walkLength, 1, 100000000, "Dots after which a new walk starts.");
  addNumber(app, "--thickness", a.thickness, 0, 1, "0: dots lie on a crumpled sheet; 1: they fill the wisp.");
  addNumber(app, "--clump", a.clump, 0, 10, "0: dots on a sphere; small: near it; large: about its centre.");
  addNumber(app, "--amplitude", a.amplitude, 0, 1000, "Strength of the noise that moves dots radially.");
  addNumber(app, "--frequency", a.frequency, 1e-6, 1e6, "Its cycles along the radius of a wisp.");
  addCount(app, "--octaves", a.octaves, 1, 16, "Noises added up, each finer and weaker.");
  addNumber(app, "--roughness", a.roughness, 0, 10, "Strength of an octave in that of the one before.");
  addNumber(app, "--lacunarity", a.lacunarity, 0.1, 100, "Frequency of an octave in that of the one before.");
  addNumber(app, "--displacement", a.displacement, 0, 1000,
            "How far dots are then moved by a vector of noises, in radii of the wisp.");
  addNumber(app, "--displacement-frequency", a.displacementFrequency, 1e-6, 1e6, "Its cycles, likewise.");
  addCount(app, "--displacement-octaves", a.displacementOctaves, 1, 16, "Its octaves.");
  addNumber(app, "--displacement-roughness", a.displacementRoughness, 0, 10, "Its roughness.");

  auto* resolution =
      addCount(app, "--resolution", a.resolution, 1, 1000000, "Voxels along the longest side of the wisps.");
  addLength(app, "--voxel-size", a.voxelSize, "Edge of a voxel, instead of --resolution.", Sign::positive)
      ->excludes(resolution);
  a.dotRadiusOption =
      addLength(app, "--dot-radius", a.dotRadius,
                "Radius of a dot; percent: of the wisps; default: 1.5 voxels, 0 with --shutter.");
  auto* velocity =
      app.add_option_function<std::string>(
             "--velocity",
             [&a](const std::string& text) { parseVelocity("--velocity", text, a.velocity.emplace()); },
             "Motion of dots, added to that of the points: a vector, in world units or percent of the "
             "longest "
             "side of "
             "the wisps per unit of time, noise, curl noise, or a grid of vectors.")
          ->type_name("X,Y,Z|noise:KEYS|curl:KEYS|FILE");
  app.add_option("--velocity-grid", a.velocityGrid,
                 "Grid of the velocity file; default: v, vel, velocity, or the only one of vectors.")
      ->type_name("NAME")
      ->needs(velocity);
  addShutter(
      app, "units of time",
      [&a](double open, double close) { a.shutterOpen = float(open), a.shutterClose = float(close); },
      "Smear dots along their velocity, from when the shutter opens to when it closes.");
  addCount(app, "--seed", a.seed, 0, 1 << 30, "Another seed is another set of guides and wisps.");
  app.add_flag("--half", a.halfFloat, "Write half floats.");
}

}  // namespace nephele::apps
