#include "apps/options/transfer_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/options/mesh_options.h"
#include "apps/options/picture/colour_options.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {
namespace {

void addPictures(CLI::App& app, TransferArguments& a) {
  CLI::Option* texture =
      app.add_option("--texture", a.texture, "Picture (.png, .exr) on the reference's texture coordinates.")
          ->type_name("FILE");
  addColourEncoding(app, "--texture-encoding", a.textureEncoding,
                    "How its numbers stand for light; auto: as the file says.");
  CLI::Option* bake = addOutput(app, "--bake-texture", a.bakedTexture, {".png"},
                                "Write this picture laid out for the object's own texture coordinates.")
                          ->needs(texture);
  addSize(app, "--bake-size", a.bake.width, a.bake.height, "Texels of the baked texture.")
      ->each([&a](const std::string&) { a.bakeSizeGiven = true; })
      ->default_str("as the texture")
      ->needs(bake);
  addCount(app, "--bake-samples", a.bake.samples, 1, 16, "Samples per texel, along either side.")
      ->needs(bake);
  addCount(app, "--gutter", a.bake.gutter, 0, 1024, "Texels that continue the charts of the baked texture.")
      ->needs(bake);
  CLI::Option* preview = addOutput(
      app, "--preview", a.preview, {".png"},
      "Picture of the reference and the object beside it, with the texture or a checker; may be the "
      "only output.");
  addPreviewFrame(app, preview, a.picture.width, a.picture.height, a.picture.azimuthDegrees,
                  a.picture.elevationDegrees);
  addCount(app, "--checker", a.picture.checkers, 1, 10000,
           "Fields of the chess board across the texture coordinates, where there is no texture.")
      ->needs(preview);
  addChoice(
      app, "--preview-paint", a.paintsDistortion, {{"texture", false}, {"distortion", true}},
      "What the preview shows: the texture, or where it is stretched (yellow, red from 4 times on), turned "
      "over, collapsed or not shown at all (violet).")
      ->needs(preview);
}

/// Whether the format of `path` can hold `attribute`, once it is carried.
bool holds(const std::string& path, const MeshAttribute& attribute) {
  if (path.empty() || CLI::detail::to_lower(path).ends_with(".ply") ||
      (attribute.name == "uv" && attribute.width == 2))
    return true;
  return attribute.domain == MeshAttribute::Domain::vertex && attribute.name == "color" &&
         attribute.width >= 3;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

void TransferArguments::requireMethod() const {
  if (warp.method == WarpMethod::nacelle) return;
  std::vector<const CLI::Option*> others = ofNacelle;
  // `none` and `fast` say what closest points are.
  if (warp.align != Alignment::none) others.push_back(align);
  if (warp.quality != WarpQuality::fast) others.push_back(quality);
  refuseGiven(others, "is for --method nacelle alone");
}

TransferOptions TransferArguments::chosen(const Mesh& reference, const Mesh& object, const Run& run) const {
  const auto hasUv = [](const Mesh& mesh) {
    return std::ranges::any_of(mesh.attributes,
                               [](const MeshAttribute& a) { return a.name == "uv" && a.width == 2; });
  };
  for (const auto& [file, mesh] : {std::pair{&from, &reference}, std::pair{&to, &object}})
    if (!warpedMesh.empty() && !diagnose(*mesh).closed())
      throw Error(*file + ": is not closed, and --warped-mesh needs what is inside");
  const bool showsUv = !preview.empty() && !paintsDistortion;
  for (const auto& [option, isGiven] :
       {std::pair{"--texture", !texture.empty()}, std::pair{"--preview", showsUv}})
    if (isGiven && !hasUv(reference))
      throw Error(fmt::format("{}: has no texture coordinates, which {} needs", from, option));
  if (!bakedTexture.empty() && !hasUv(object))
    throw Error(fmt::format("{}: has no texture coordinates, which --bake-texture needs", to));

  std::vector<std::string> all, fit, other;
  for (const MeshAttribute& a : reference.attributes) {
    all.push_back(a.name);
    // A baked texture is laid out for the object's own.
    if ((a.name == "uv" && !bakedTexture.empty()) || a.name == "nx" || a.name == "ny" || a.name == "nz")
      continue;
    (holds(output, a) ? fit : other).push_back(a.name);
  }
  if (!transfer.names.empty()) {
    for (const std::string& name : transfer.names) {
      const auto found = std::ranges::find(reference.attributes, name, &MeshAttribute::name);
      if (found == reference.attributes.end())
        throw Error(fmt::format("{}: has no attribute '{}'; it has {}", from, name,
                                all.empty() ? "none" : listed(all)));
      if (!holds(output, *found))
        throw Error(
            fmt::format("{}: cannot hold '{}': .obj holds uv and the color of vertices, .ply every attribute",
                        output, name));
      if (name == "uv" && !bakedTexture.empty())
        throw Error(
            fmt::format("{}: '--attributes uv' would replace the texture coordinates that "
                        "--bake-texture is laid out for",
                        to));
    }
    if (showsUv && bakedTexture.empty() && std::ranges::count(transfer.names, "uv") == 0)
      refuseValue("--attributes", listed(transfer.names), "a list with uv, which --preview shows");
    return transfer;
  }
  if (!other.empty()) run.note(fmt::format("{} cannot hold {}, left out; a .ply can", output, listed(other)));
  // Without the object all that is to be seen is how its coordinates lie.
  const bool showsOwn = showsUv && bakedTexture.empty();
  if (output.empty()) return {showsOwn ? std::vector<std::string>{"uv"} : std::vector<std::string>{}};
  if (fit.empty() && bakedTexture.empty())
    throw Error(fmt::format("{}: has no attributes that {} can hold{}", from, output,
                            all.empty() ? "" : "; it has " + listed(all)));
  return {fit};
}

const std::string& TransferArguments::name() const {
  for (const std::string* file : {&output, &preview, &bakedTexture, &warpFile})
    if (!file->empty()) return *file;
  return warpedMesh;
}

TextureBakeOptions TransferArguments::bakeOptions(const Image& image) const {
  TextureBakeOptions options = bake;
  if (!bakeSizeGiven) {
    options.width = image.width;
    options.height = image.height;
  }
  return options;
}

void TransferArguments::writeBaked(const Image& image, const Run& run) const {
  // More than rounding makes of white.
  constexpr float kWhite = 1.001f;
  std::size_t bright = 0;
  const std::size_t count = image.channels[0].values.size();
  for (std::size_t i = 0; i < count; ++i)
    bright += std::ranges::any_of(image.channels, [&](const auto& c) { return c.values[i] > kWhite; });
  if (bright > 0)
    run.note(fmt::format("{}: {} of {} texels are brighter than 1, the most that a .png holds", bakedTexture,
                         bright, count));
  writePng(bakedTexture, image, {.shoulder = 0.99999f}, run.metadata());
}

Mesh readShape(const std::string& path, const Run& run) {
  Mesh mesh = readMesh(path);
  const MeshDiagnosis is = diagnose(mesh);
  if (!is.closed()) run.note(path + ": is not closed: only its surface and its outside are mapped");
  if (is.inward()) run.note(path + ": is inside out, taken the right way round");
  return mesh;
}

MeshWarp TransferArguments::warped(const Mesh& reference, const Mesh& object, MeshWarpOptions options,
                                   const Run& run) const {
  options.voxelSize = double(boundingBox(reference).longestSide()) / resolution;
  const bool isRelaxed = options.method == WarpMethod::nacelle && options.quality != WarpQuality::fast;
  run.requireMemory(estimateWarpBytes(object, options),
                    isRelaxed ? "use --quality fast, take an object of fewer triangles"
                              : "take an object of fewer triangles");
  return namingFile(fmt::format("{} to {}", from, to),
                    [&] { return warpMesh(triangulated(reference), triangulated(object), options, run); });
}

void TransferArguments::requirePictureMemory(const TextureBakeOptions& baked, const Run& run) const {
  if (!bakedTexture.empty())
    run.requireMemory(estimateBakeBytes(baked.width, baked.height),
                      "make the baked texture smaller (--bake-size)");
  if (!preview.empty())
    run.requireMemory(estimateSurfacePictureBytes(picture.width, picture.height),
                      "make the preview smaller (--size)");
}

void addTransferOptions(CLI::App& app, TransferArguments& a) {
  app.add_option("--from", a.from, "Reference: the mesh that has the attributes.")
      ->required()
      ->type_name("FILE");
  app.add_option("--to", a.to, "Object: the mesh that gets them.")->required()->type_name("FILE");
  addOutput(app, "-o,--output", a.output, {".obj", ".ply"}, "The object with the attributes.");
  addSubdivide(app, a.subdivide)
      ->description("Split every triangle of the object in four this often and round it (Loop) first.");
  app.add_option_function<std::string>(
         "--attributes",
         [&a](const std::string& text) {
           a.transfer.names.clear();
           for (std::size_t begin = 0; begin <= text.size();) {
             const std::size_t end = std::min(text.find(',', begin), text.size());
             if (end == begin) refuseValue("--attributes", text, "names, separated by commas");
             a.transfer.names.push_back(text.substr(begin, end - begin));
             begin = end + 1;
           }
         },
         "What to carry: uv, color, names of other attributes.")
      ->type_name("NAME,...")
      ->default_str("all but normals");

  addChoice(app, "--method", a.warp.method,
            {{"nacelle", WarpMethod::nacelle}, {"closest", WarpMethod::closest}},
            "A warp field between level sets, or closest points.");
  a.align = addChoice(
      app, "--align", a.warp.align,
      {{"none", Alignment::none}, {"similarity", Alignment::similarity}, {"lattice", Alignment::lattice}},
      "Turn, scale and shift the object onto the reference first; lattice: and bend it.");
  a.quality = addChoice(
      app, "--quality", a.warp.quality,
      {{"fast", WarpQuality::fast}, {"balanced", WarpQuality::balanced}, {"best", WarpQuality::best}},
      "fast: the warp field as it is; else relaxed where it folds over, for longer with best.");
  CLI::Option* iterations =
      addCount(app, "--iterations", a.warp.steps, 1, 20, "Steps of the warp field at most.");
  CLI::Option* order =
      addCount(app, "--order", a.warp.order, 1, 2, "Of a step: 1 along gradients, 2 with second derivatives.")
          ->default_str("1");
  addCount(
      app, "--resolution", a.resolution, 8, 100000,
      "Voxels along the longest side: of the reference, the unit of residuals; of the object, for --warp "
      "and --warped-mesh.");
  addOutput(app, "--warp", a.warpFile, {".vdb"},
            "Write the map as a vector grid 'rest', in bricks about the object.");
  CLI::Option* warpedMesh = addOutput(app, "--warped-mesh", a.warpedMesh, {".obj", ".ply", ".stl"},
                                      "Write the reference's level set, warped, as a mesh.");
  a.ofNacelle = {iterations, order, warpedMesh};
  addPictures(app, a);
  requireOneOutput(app, {"--output", "--preview", "--bake-texture", "--warp", "--warped-mesh"});
}

}  // namespace nephele::apps
