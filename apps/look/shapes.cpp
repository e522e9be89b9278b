#include "apps/look/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "apps/file_hashes.h"
#include "apps/options/mesh_options.h"
#include "nephele/levelset/warp/mesh_warp.h"
#include "nephele/levelset/warp/transfer_attributes.h"

namespace nephele::apps {
namespace {

/// Settings as a key, but for some, and the files that they name.
std::string keyWithout(const nlohmann::json& settings, const std::set<std::string>& others) {
  return keyOf(settings, [&](const std::string& name) { return !others.contains(name); });
}

bool hasUv(const Mesh& mesh) {
  return std::ranges::any_of(mesh.attributes, [](const MeshAttribute& a) { return a.name == "uv"; });
}

/// From this side, where the settings say nothing of it.
void standAt(PictureOptions& options, const Vec3f& view) {
  if (!options.viewGiven && !options.position && options.file.empty()) options.CameraOptions::view = view;
}

/// Degrees from the front towards +x of a camera that is on its way to two shapes side by side, each one unit
/// long.
float azimuthOf(const PictureOptions& options, const Run& run) {
  const Box box{{-1.2f, 0, -0.6f}, {1.2f, 1, 0.6f}};
  Extent extent{box, double(box.longestSide())};
  for (const Vec3f& corner : {box.min, box.max}) extent.outline.push_back(corner);
  PictureOptions placed = options;
  static_cast<CameraOptions&>(placed) = options.placed(extent, run);
  const Vec3d ahead = placed.camera().forward();
  return float(std::atan2(-ahead.x, -ahead.z) * 180 / std::numbers::pi);
}

}  // namespace

LookPicture LookShapes::picture(const LookPlan& plan, const LookFrame& frame, Run& run) {
  return plan.what == LookShow::What::pieces ? piecesPicture(plan, frame, run)
                                             : transferPicture(plan, frame, run);
}

LookPicture LookShapes::piecesPicture(const LookPlan& plan, const LookFrame& frame, Run& run) {
  const CutArguments& cut = plan.cut;
  const nlohmann::json& settings = plan.settings["cut"];
  const bool isOfLevelSets = cut.geometry == CutArguments::Geometry::levelset && cut.hasKnives();
  const std::set<std::string> ofParts{"geometry", "repair"}, ofLevelSets{"resolution", "voxel-size"};
  const std::string partsKey =
      plan.subject.stamp() + (isOfLevelSets ? ";levels;" : ";") +
      keyOf(settings, [&](const std::string& name) {
        return ofParts.contains(name) || (isOfLevelSets && ofLevelSets.contains(name));
      });
  std::string piecesKey = partsKey + keyWithout(settings, {"explode"}) + fileStamp(cut.points);
  for (const std::string& file : cut.knifeFiles) piecesKey += fileStamp(file) + ";";
  const double explode = cut.explode.value_or(cut.picture.explode);
  const auto shown = surfaces_.at(piecesKey + fmt::format("explode={}", explode), [&] {
    const auto& pieces = pieces_.at(piecesKey, [&] {
      const auto& parts = parts_.at(partsKey, [&] {
        std::vector<CutPart> read = cut.readParts(run);
        if (isOfLevelSets) addLevelSets(read, knivesOf(cut, read, run).voxelSize, run);
        return std::make_shared<const std::vector<CutPart>>(std::move(read));
      });
      run.begin("cut");
      // A model without knives is one piece.
      return std::make_shared<const Pieces>(cut.hasKnives() ? cut.cut(*parts, knivesOf(cut, *parts, run), run)
                                                            : cutIntoMeshes(*parts, {}, {}, run));
    });
    if (pieces->pieces.empty()) throw LookFault("cut", "no piece is left: all are smaller than --min-volume");
    run.begin("pieces");
    return std::make_shared<const LookSurfaces>(piecesObjects(*pieces, explode), run);
  });
  PictureOptions options = optionsOfSurfaces(plan, frame);
  standAt(options, {cut.picture.azimuthDegrees, cut.picture.elevationDegrees, 0});
  return pictureOf(*shown, options, frame, pace_, run);
}

std::shared_ptr<const LookShapes::Carried> LookShapes::carried(const LookPlan& plan, bool isQuick,
                                                               std::string& key, Run& run) {
  const TransferArguments& transfer = plan.transfer;
  key = fileStamp(transfer.from) + ";" + plan.subject.stamp() + ";" +
        keyWithout(plan.settings["transfer"], {"texture", "texture-encoding", "checker", "preview-paint"});
  // What is there already needs no quicker one.
  isQuick = isQuick && !carried_.isAt(key);
  const auto make = [&] {
    run.begin("read");
    auto result = std::make_shared<Carried>();
    result->reference = readShape(transfer.from, run);
    result->object = subdividedAsAsked(readShape(transfer.to, run), transfer.subdivide, run);
    MeshWarpOptions options = transfer.warp;
    if (isQuick) options.quality = WarpQuality::fast;
    const MeshWarp warp = transfer.warped(result->reference, result->object, options, run);
    namingFile(fmt::format("{} to {}", transfer.from, transfer.to), [&] {
      run.begin("measure");
      result->quality = transferQuality(result->reference, result->object, warp.images, run);
      if (hasUv(result->reference))
        result->object =
            transferAttributes(result->reference, result->object, warp.images, {{std::string("uv")}}, run);
    });
    return result;
  };
  Stage<Carried>& stage = isQuick ? quick_ : carried_;
  if (isQuick) key += "quick";
  return stage.at(key, make);
}

LookPicture LookShapes::transferPicture(const LookPlan& plan, const LookFrame& frame, Run& run) {
  const TransferArguments& transfer = plan.transfer;
  const bool isQuick = frame.samples == 1 && transfer.warp.method == WarpMethod::nacelle &&
                       transfer.warp.quality != WarpQuality::fast;
  std::string key;
  const auto made = carried(plan, isQuick, key, run);
  if (!transfer.paintsDistortion && !hasUv(made->reference))
    throw LookFault("transfer", transfer.from +
                                    ": has no texture coordinates; --preview-paint distortion shows how well "
                                    "the shapes fit");
  std::string textureKey;
  std::shared_ptr<const Image> texture;
  if (!transfer.texture.empty() && !transfer.paintsDistortion) {
    textureKey = fileStamp(transfer.texture) + keyOf(plan.settings["transfer"], [](const std::string& name) {
                   return name.starts_with("texture");
                 });
    texture = texture_.at(textureKey, [&] {
      return std::make_shared<const Image>(
          readLinearImage(transfer.texture, transfer.textureEncoding, run.memoryLimitBytes));
    });
  }
  TransferPictureOptions row = transfer.picture;
  PictureOptions options = optionsOfSurfaces(plan, frame);
  standAt(options, {row.azimuthDegrees, row.elevationDegrees, 0});
  row.azimuthDegrees = azimuthOf(options, run);
  key +=
      textureKey + fmt::format(";{};{};{:.3f}", transfer.paintsDistortion, row.checkers, row.azimuthDegrees);
  const auto shown = surfaces_.at(key, [&] {
    run.begin("shapes");
    return std::make_shared<const LookSurfaces>(
        transfer.paintsDistortion ? distortionObjects(made->reference, made->object, made->quality, row)
                                  : transferObjects(made->reference, made->object, texture, nullptr, row),
        run);
  });
  return pictureOf(*shown, options, frame, pace_, run);
}

}  // namespace nephele::apps
