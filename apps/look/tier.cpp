#include "apps/look/tier.h"

#include <algorithm>
#include <chrono>

#include "nephele/levelset/cloud/wisp_volume.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {
namespace {

constexpr const char* kSamples = ";samples";

/// A density as the march reads it: its samples may have been given back.
ScalarField codedField(const RenderVolume& volume) {
  const BrickGrid& grid = volume.density();
  const CodedBricks codes = volume.coded();
  const Affine toIndex = grid.worldToIndex();
  const Vec3i first = grid.firstBrick() * BrickGrid::kBrick, count = grid.brickCount();
  return functionField([=](const Vec3f& world) {
    const Vec3f at = toIndex(world) - Vec3f(first);
    const Vec3i cell{int(std::floor(at.x)), int(std::floor(at.y)), int(std::floor(at.z))};
    for (int axis = 0; axis != 3; ++axis)
      if (cell[axis] < 0 || cell[axis] >= BrickGrid::kBrick * count[axis]) return 0.0f;
    const Vec3i brick = cell / BrickGrid::kBrick, node = cell - brick * BrickGrid::kBrick;
    const auto place = std::size_t((brick.z * count.y + brick.y) * count.x + brick.x);
    float sum = 0;
    for (int corner = 0; corner != 8; ++corner) {
      const Vec3i step{corner & 1, corner >> 1 & 1, corner >> 2};
      float share = 1;
      for (int axis = 0; axis != 3; ++axis) {
        const float along = at[axis] - float(cell[axis]);
        share *= step[axis] ? along : 1 - along;
      }
      sum += share * codes.at(place, node + step);
    }
    return sum;
  });
}

/// The same density on voxels that make a quick picture of it.
RenderVolume coarser(const RenderVolume& volume, Run& run) {
  const BrickGrid& grid = volume.density();
  const float longest = volume.worldBounds().longestSide();
  const float voxel = std::max(grid.voxelSize(), longest / LookPlan::kCoarseVoxels);
  // Ranges of what it holds are as they were.
  const ScalarField density = withRangesOf(grid, codedField(volume));
  run.begin("coarse density");
  return RenderVolume(bakeGrid(max(density, 0.0f),
                               {.voxelSize = voxel, .box = volume.worldBounds(), .background = 0.0f}, run));
}

RenderVolume wispsOf(const LookPlan& plan, LookPlan::Tier tier, Run& run) {
  const WispsArguments wisps = plan.wispsOf(tier);
  const std::vector<WispGuide> guides = wisps.readGuides(run);
  const WispVolumeOptions options = wisps.resolved(guides, run);
  run.requireMemory(
      estimatedWispBytes(guides, options),
      "use larger voxels (a lower --resolution or a larger --voxel-size), or fewer or smaller wisps");
  run.begin("bake");
  const DotVolume dots = namingFile(wisps.input, [&] { return bakeWisps(guides, options, run); });
  return volumeOf([&](const BrickSink& made) { return toBricks(dots.densityGrid(), Beside::varying, made); },
                  plan.picture.volumes, {plan.picture.shutter, false, plan.scene.objects.any()}, run);
}

/// Without layers that coarse voxels cannot show, and that take the most time.
CloudOptions optionsOf(const CloudArguments& cloud, LookPlan::Tier tier, FieldSources& sources,
                       const Run& run) {
  CloudOptions options = cloud.resolved(sources, run);
  if (tier == LookPlan::Tier::fine) return options;
  options.layers.resize(layersThatShow(options.layers, options.voxelSize));
  return options;
}

}  // namespace

PictureStages::Keys LookTier::keysOf(const LookPlan& plan) const {
  PictureStages::Keys keys = plan.keys(tier_);
  const auto reach = reaches_.find(keys.shape + keys.levels + keys.volume);
  if (reach != reaches_.end()) keys.levels += reach->second;
  if (plan.subject.kind == LookSubject::Kind::script && keys.volume == voxelsKey_)
    keys.volume += fmt::format("voxels={:g}", voxels_);
  if (keys.volume + kSamples == samplesKey_) keys.volume = samplesKey_;
  return keys;
}

std::string LookTier::surfaceKey(const LookPlan& plan) const {
  const PictureStages::Keys keys = plan.keys(tier_);
  return keys.shape + (plan.what == LookShow::What::checker ? "checker" : keys.levels + keys.volume);
}

bool LookTier::isReady(const LookPlan& plan) const {
  return LookShow{plan.what}.isVolume() ? stages_.isLit(keysOf(plan)) : surface_.isAt(surfaceKey(plan));
}

LookTier::Growing::Growing(const CloudArguments& itsArguments, std::shared_ptr<const Mesh> itsMesh,
                           LookPlan::Tier tier, const Run& run)
    : arguments(itsArguments),
      mesh(std::move(itsMesh)),
      sources(arguments.sources(*mesh, run)),
      options(optionsOf(arguments, tier, sources, run)) {}

RenderVolume LookTier::Growing::volume(const LookPlan& plan, bool isCoded, Run& run) {
  const CloudAdvectionArguments& advection = arguments.advection;
  const auto bricks = [&](const BrickSink& made) -> std::shared_ptr<const BrickGrid> {
    VoxelGrid<float> density = makeCloud(*levels, options, run).density;
    if (!advection.isAny(sources)) return toBricks(density, Beside::varying, made);
    const VdbGridLabel label{"density", VdbGridInfo::Class::fogVolume, false};
    return toBricks(advection.carried(toVdb(std::move(density), label), sources, arguments.seed, run), made);
  };
  return volumeOf(bricks, plan.picture.volumes, {plan.picture.shutter, isCoded, plan.scene.objects.any()},
                  run);
}

std::unique_ptr<LookTier::Growing> LookTier::grown(const LookPlan& plan, Run& run) {
  const CloudArguments cloud = plan.cloudOf(tier_);
  const PictureStages::Keys keys = plan.keys(tier_);
  const auto mesh = stages_.shape(keys.shape, [&] { return cloud.shapeOf(cloud.shape, run); });
  auto growing = std::make_unique<Growing>(cloud, mesh, tier_, run);
  const CloudOptions& options = growing->options;
  run.requireMemory(estimatedCloudBytes(*mesh, options),
                    "use larger voxels (a lower --resolution or a larger --voxel-size)");
  constexpr std::size_t kMostReaches = 256;
  if (reaches_.size() > kMostReaches) reaches_.clear();
  const float edge = options.edgeThickness.range(Box::everywhere()).max;
  reaches_[keys.shape + keys.levels + keys.volume] =
      fmt::format("reach={:g}", cloudEdgeReach(edge, options.voxelSize));
  growing->levels = stages_.levels(keysOf(plan).levels, options, plan.layerKeys(), run);
  return growing;
}

ScriptVolume& LookTier::script(const LookPlan& plan, Run& run) {
  const std::string key = plan.keys(tier_).volume;
  if (!script_ || scriptKey_ != key) {
    script_.reset();
    PictureOptions picture = plan.picture;
    script_ = std::make_unique<ScriptVolume>(plan.subject.path, plan.scene.script, picture, run);
    scriptKey_ = key;
  }
  return *script_;
}

void LookTier::chooseVoxels(const LookPlan& plan, const PictureOptions& picture, bool isFinal,
                            LookTier* finer, Run& run) {
  const std::string key = plan.keys(tier_).volume;
  ScriptVolume& ran = (finer ? finer : this)->script(plan, run);
  if (key == voxelsKey_ && (finer || !isFinal)) return;
  const float coarse = ran.box().longestSide() / LookPlan::kCoarseVoxels;
  voxels_ = finer ? coarse : ran.voxelSizeFor(picture, run).value_or(coarse);
  voxelsKey_ = key;
}

std::shared_ptr<const RenderVolume> LookTier::volume(const LookPlan& plan, LookTier* finer, Run& run) {
  const std::string key = keysOf(plan).volume;
  if (plan.subject.kind == LookSubject::Kind::script) {
    const ScriptVolume& ran = (finer ? finer : this)->script(plan, run);
    return stages_.volume(key, [&] { return ran.withVoxels(voxels_, run); });
  }
  if (plan.growsCloud()) {
    if (auto kept = stages_.volumeAt(keysOf(plan))) return kept;
    const std::unique_ptr<Growing> growing = grown(plan, run);
    const bool isCoded = tier_ == LookPlan::Tier::fine && key != samplesKey_;
    return stages_.volume(key, [&] {
      RenderVolume made = growing->volume(plan, isCoded, run);
      if (isCoded) made.giveUpSamples();
      return made;
    });
  }
  return stages_.volume(key, [&] {
    if (plan.what == LookShow::What::wisps) return wispsOf(plan, tier_, run);
    if (finer) return coarser(*finer->volume(plan, nullptr, run), run);
    PictureOptions picture = plan.picture;
    // What needs the samples of a file beside its codes.
    if (key == samplesKey_) picture.render.aovs = {"normal"};
    return plan.scene.volume(picture, run);
  });
}

std::shared_ptr<const Mesh> LookTier::surface(const LookPlan& plan, LookTier* finer, Run& run) {
  if (plan.what == LookShow::What::checker)
    return stages_.shape(plan.keys(tier_).shape, [&] { return plan.cloud.shapeOf(plan.cloud.shape, run); });
  if (plan.growsCloud())
    return std::make_shared<const Mesh>(
        marchingCubes(*toBricks(cloudSurface(*grown(plan, run)->levels, run)), 0.0f, run));
  const auto density = volume(plan, finer, run);
  return std::make_shared<const Mesh>(marchingCubes(density->density(), 0.5f * density->maxDensity(), run));
}

LookPicture LookTier::surfacePicture(const LookPlan& plan, const LookFrame& frame, LookTier* finer,
                                     Run& run) {
  const bool isChecker = plan.what == LookShow::What::checker;
  const auto shown = surface_.at(surfaceKey(plan), [&] {
    const std::shared_ptr<const Mesh> mesh = surface(plan, finer, run);
    if (mesh->faceCount() == 0) throw LookFault("", "there is no surface to be seen");
    const bool hasUv =
        std::ranges::any_of(mesh->attributes, [](const MeshAttribute& a) { return a.name == "uv"; });
    if (isChecker && !hasUv) throw LookFault("", "the mesh has no texture coordinates");
    std::vector<SurfaceObject> objects;
    objects.push_back({.mesh = *mesh, .colour = kShapeColour, .checkers = isChecker ? 16 : 0});
    return std::make_shared<const LookSurfaces>(std::move(objects), run);
  });
  return pictureOf(*shown, optionsOfSurfaces(plan, frame), frame, shading_, run);
}

LookPicture LookTier::picture(const LookPlan& plan, const LookFrame& frame, LookTier* finer, Run& run) {
  // Steps of a cloud are no steps to something else.
  if (plan.growsCloud() != isGrown_) stages_.forget();
  isGrown_ = plan.growsCloud();
  PictureOptions picture = plan.pictureOf(tier_);
  picture.frame.width = frame.width;
  picture.frame.height = frame.height;
  if (plan.subject.kind == LookSubject::Kind::script) {
    (finer ? finer : this)->script(plan, run).suggestTo(picture);
    chooseVoxels(plan, picture, frame.samples == 0, finer, run);
  }
  picture.render.aovs = frame.show.layers();
  // The surface of a cloud is that of its levels.
  const bool needsSamples = !picture.readsCodes() || !(frame.show.isVolume() || plan.growsCloud());
  if ((plan.subject.kind == LookSubject::Kind::volume || plan.growsCloud()) && needsSamples && !finer)
    samplesKey_ = plan.keys(tier_).volume + kSamples;
  if (!frame.show.isVolume()) return surfacePicture(plan, frame, finer, run);
  std::shared_ptr<const LitCloud> lit;
  if (isReady(plan)) {
    lit = stages_.lit();
    picture = picture.resolved(*lit->volume, run, &lit->light);
    plan.scene.addTo(picture, *lit->volume, true, run);
  } else {
    const auto density = volume(plan, finer, run);
    picture = picture.resolved(*density, run);
    plan.scene.addTo(picture, *density, true, run);
    lit = picture.lit(stages_, plan.keys(tier_), run);
  }
  if (frame.samples > 0) picture.render.samples = frame.samples;
  const Camera camera = picture.camera();
  // Read again for each: what stands in front may have changed.
  if (!plan.scene.holdout.empty())
    picture.render.holdout = readHoldout(plan.scene.holdout, camera, run.memoryLimitBytes);
  const double rays = double(frame.width) * frame.height * picture.render.samples;
  const auto start = std::chrono::steady_clock::now();
  const std::string key = plan.cameraKey() + fmt::format("{}x{}x{};{}", frame.width, frame.height,
                                                         frame.samples, frame.show.layer);
  const auto result =
      stages_.picture(key, camera, frame.samples > 0 ? picture.render : picture.marched(camera), run);
  march_.learn(rays, secondsSince(start));
  auto image = std::make_shared<Image>(result->image);
  picture.addSky(*image, camera, picture.lights);
  return {image,        camera,
          picture,      lit->volume->worldBounds(),
          result->rays, double(lit->volume->density().voxelSize())};
}

}  // namespace nephele::apps
