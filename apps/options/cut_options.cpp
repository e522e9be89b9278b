#include "apps/options/cut_options.h"

#include "apps/options/cut_quantities.h"
#include "apps/options/expression_names.h"

namespace nephele::apps {
namespace {

void addPicture(CLI::App& app, CutArguments& a) {
  auto* preview =
      addOutput(app, "--preview", a.preview, {".png"},
                "Picture of the pieces, moved apart, each in a colour of its own; may be the only output.");
  addPreviewFrame(app, preview, a.picture.width, a.picture.height, a.picture.azimuthDegrees,
                  a.picture.elevationDegrees);
}

}  // namespace

void addCutOptions(CLI::App& app, CutArguments& a) {
  app.add_option("input", a.input, "Mesh or level set (.vdb) to cut, or a folder of pieces to cut again.")
      ->required()
      ->type_name("FILE");
  auto* folder =
      markOutput(app.add_option("-o,--output", a.folder, "Folder for the pieces."), OutputTrial::verb)
          ->type_name("FOLDER");

  addPlanes(app, a.planes);
  auto* random =
      addCount(app, "--random-planes", a.randomPlanes, 1, 1000000, "Cut by this many random planes.")
          ->default_str("");
  app.add_flag("--through-center", a.throughCentre, "Random planes all pass through the middle of the box.")
      ->needs(random);
  auto* roughness =
      addLength(app, "--roughness", a.roughness,
                "Roughen all planes and walls of cells, as fracture does: root mean square height.");
  addFrequency(app, "--roughness-frequency", a.roughnessFrequency,
               "Hills of the largest size: cycles per world unit, or per longest side (5x).")
      ->needs(roughness);
  addCount(app, "--roughness-octaves", a.octaves, 1, 12,
           "Sizes of hills: each half as large and half as high as the one before.")
      ->needs(roughness);
  addInputs(app, "--knife", a.knifeFiles,
            "Cut by the surface of a closed mesh or a level set (.vdb), or where =EXPRESSION of P is 0; may "
            "be given again.")
      ->each([](const std::string& text) {
        if (text.starts_with('='))
          checkedExpression("--knife", text.substr(1), {felt::Kind::scalarField}, namesOfPlace(0, 0));
      });
  auto* voronoi = addCount(app, "--voronoi", a.cellCount, 1, 1000000,
                           "Cut into the Voronoi cells of this many points, scattered inside.")
                      ->default_str("");
  app.add_option("--points", a.points, "Cut into the Voronoi cells of these points (.ply, .obj, .txt, .csv).")
      ->type_name("FILE")
      ->excludes(voronoi);
  addLength(app, "--kerf", a.kerf, "Width of the cuts: half of it goes from either side.");
  addCount(app, "--seed", a.seed, 0, 1 << 30, "Another seed is another set of planes, hills and points.");

  using Geometry = CutArguments::Geometry;
  addChoice<Geometry>(app, "--geometry", a.geometry,
                      {{"exact", Geometry::exact}, {"levelset", Geometry::levelset}},
                      "Cut the mesh itself, or its level set, which bevels rims by less than a voxel.");
  auto* resolution = addCount(app, "--resolution", a.resolution, 8, 1000000,
                              "Voxels along the longest side, where level sets are made.")
                         ->default_str("256, or those of a level set");
  a.resolutionOption = resolution;
  addLength(app, "--voxel-size", a.voxelSize, "Edge of a voxel, instead of --resolution.", Sign::positive)
      ->excludes(resolution);
  addVolume(app, a.minVolume);
  addRepair(app, a.repair.mode);

  using Format = PieceFilesOptions::Format;
  addChoice<Format>(app, "--format", a.format, {{"obj", Format::obj}, {"ply", Format::ply}},
                    "Of the pieces' meshes; PLY has no groups.");
  app.add_flag("--vdb", a.levelSets, "Also write pieces.vdb, a level set of each piece.")->needs(folder);
  addOptional(
      app, "--explode", a.explode, 0, 1000,
      "Also write exploded.obj: pieces moved apart, by this share of their distance from the middle.");
  addPicture(app, a);
  requireOneOutput(app, {"--output", "--preview"});
}

}  // namespace nephele::apps
