#include "apps/options/picture/object_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/options/picture/colour_options.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {
namespace {

Mesh readObject(const std::string& path, const std::string& name) {
  if (!isVolumeFile(path)) return readMesh(path);
  const VdbGrid grid = readScalarGrid(path, name);
  if (const VdbGridInfo info = describe(grid); info.gridClass != VdbGridInfo::Class::levelSet)
    throw Error(fmt::format("{}: grid '{}' is not a level set, which objects are", path, info.name));
  return namingFile(path, [&] { return marchingCubes(*toBricks(grid)); });
}

bool hasCoordinates(const Mesh& mesh) {
  return std::ranges::any_of(mesh.attributes, [](const MeshAttribute& a) {
    return a.name == "uv" && a.domain == MeshAttribute::Domain::corner && a.width == 2;
  });
}

std::vector<SurfaceObject> painted(const ObjectOptions& options, const std::vector<std::string>& paths,
                                   const std::vector<std::string>& grids, const Vec3f& colour,
                                   double mostBytes) {
  std::vector<SurfaceObject> result;
  const auto image = options.texture.empty() ? nullptr
                                             : std::make_shared<const Image>(readLinearImage(
                                                   options.texture, options.textureEncoding, mostBytes));
  for (std::size_t i = 0; i != paths.size(); ++i) {
    const std::string& path = paths[i];
    SurfaceObject object{readObject(path, i < grids.size() ? grids[i] : ""), options.colour.value_or(colour),
                         options.checkers, image};
    if (object.mesh.faceCount() == 0) throw Error(path + ": has no surface");
    if ((options.checkers > 0 || image) && !hasCoordinates(object.mesh))
      throw Error(fmt::format("{}: has no texture coordinates, which --{} needs", path,
                              image ? "texture" : "checker"));
    result.push_back(std::move(object));
  }
  return result;
}

}  // namespace

void addObjectOptions(CLI::App& app, ObjectOptions& options) {
  addInputs(app, "--object", options.objects,
            "Opaque object beside the volume: a mesh, or a level set (.vdb); may be given again.");
  addInputs(app, "--holdout-object", options.holdouts,
            "The same as a holdout: hides what is behind it, and is not seen itself.");
  addNumbers(
      app, "--object-color", "R,G,B", 3, 0, 1, [&options](const Vec3d& v) { options.colour = Vec3f(v); },
      "Share of the light that objects scatter.")
      ->default_str("0.5,0.5,0.5");
  addCount(app, "--checker", options.checkers, 0, 10000,
           "Fields of a chess board across the texture coordinates of objects; 0: none.");
  app.add_option("--texture", options.texture,
                 "Picture (.png, .exr) on the texture coordinates of objects; times their colour.")
      ->type_name("FILE");
  addColourEncoding(app, "--texture-encoding", options.textureEncoding,
                    "How its numbers stand for light; auto: as the file says.");
  app.add_flag_function(
         "--backdrop,!--no-backdrop", [&options](std::int64_t count) { options.backdrop = count > 0; },
         "The sky behind previews, as the layer backdrop: that of --sky clear or of a map, or a gradient; or "
         "none.")
      ->default_str("with --sky clear, unless there is a --background");
  CLI::Option* ground = app.add_flag("--ground", options.ground,
                                     "A plane below the volume, in its shadow, as wide as can be seen.");
  addLength(
      app, "--ground-height", options.groundHeight,
      "Of the plane: y in world units, or above the volume's lowest point in percent of its longest side; "
      "default: the bottom of the volume.",
      Sign::any)
      ->needs(ground);
  addNumbers(
      app, "--ground-color", "R,G,B", 3, 0, 1,
      [&options](const Vec3d& v) { options.groundColour = Vec3f(v); },
      "Share of the light that the plane scatters.")
      ->needs(ground)
      ->default_str("0.3,0.3,0.3");
}

std::shared_ptr<const Surfaces> ObjectOptions::surfaces(const RenderVolume& volume, const Extent& seen,
                                                        double mostBytes) const {
  if (any()) require(!volume.isEmpty(), "objects and the ground stand in a volume that is not empty");
  std::vector<SurfaceObject> all = painted(*this, objects, {}, {0.5f, 0.5f, 0.5f}, mostBytes);
  for (const std::string& path : holdouts) all.push_back({.mesh = readObject(path, ""), .isHoldout = true});
  if (ground) {
    const Box& box = seen.box;
    const Length height = groundHeight.value_or(Length{0, true});
    const double y = height.worldUnits(seen.longestSide) + (height.relative ? double(box.min.y) : 0.0);
    // Seen from up to 50 sides of the volume above it, its edge is less than a pixel below the horizon.
    constexpr float kGroundSides = 2e5f;
    all.push_back({.mesh = groundPlane(box.center(), float(y), kGroundSides * box.longestSide()),
                   .colour = groundColour,
                   .castsShadows = false});
  }
  return all.empty() ? nullptr : std::make_shared<const Surfaces>(std::move(all));
}

std::vector<SurfaceObject> ObjectOptions::shapes(const std::vector<std::string>& paths,
                                                 const std::vector<std::string>& grids,
                                                 double mostBytes) const {
  return painted(*this, paths, grids, kShapeColour, mostBytes);
}

void ObjectOptions::lift(CameraOptions& camera) const {
  constexpr float kElevation = 5;
  if (ground && !camera.viewGiven) camera.view.y = kElevation;
}

void ObjectOptions::addTo(PictureOptions& picture, const RenderVolume& volume, bool isShown,
                          double mostBytes) const {
  const std::pair<const char*, bool> ofObjects[] = {
      {"--object-color", colour.has_value()}, {"--checker", checkers > 0}, {"--texture", !texture.empty()}};
  for (const auto& [option, isGiven] : ofObjects)
    if (isGiven && objects.empty())
      throw CLI::ValidationError(option, "needs objects; give --object, or a mesh as the input");
  if (!picture.render.surfaces) picture.render.surfaces = surfaces(volume, picture.seen, mostBytes);
  picture.backdrop = showsBackdrop(picture, isShown);
}

bool ObjectOptions::showsBackdrop(const PictureOptions& picture, bool isShown) const {
  return backdrop.value_or(isShown && picture.lights.clear && !picture.background);
}

}  // namespace nephele::apps
