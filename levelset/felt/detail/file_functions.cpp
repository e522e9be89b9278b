#include <fmt/format.h>

#include <filesystem>

#include "nephele/levelset/cloud/cloud.h"
#include "nephele/levelset/felt/detail/functions.h"
#include "nephele/levelset/felt/domain_samples.h"
#include "nephele/levelset/felt/written_file.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/field/space.h"

namespace nephele::felt {

namespace {

namespace fs = std::filesystem;
using S = ScalarField;
using V = VectorField;
using ShapePtr = std::shared_ptr<const Shape>;

ShapePtr readShapeFile(Context& context, const std::string& path) {
  context.filesRead.push_back(path);
  Mesh mesh = isVolumeFile(path) ? readShape(path, {}, *context.progress).mesh : readMesh(path);
  if (!context.longestSide) context.longestSide = double(boundingBox(mesh).longestSide());
  return std::make_shared<const Shape>(Shape{std::move(mesh), fs::path(path).stem().string()});
}

S readField(Context& context, const std::string& path, const std::string& grid) {
  context.filesRead.push_back(path);
  const VdbGrid read = readScalarGrid(path, grid);
  return namingFile(path, [&] { return gridField(std::shared_ptr<const BrickGrid>(toBricks(read))); });
}

V readVectorField(Context& context, const std::string& path, const std::string& grid) {
  context.filesRead.push_back(path);
  const std::array<VdbGrid, 3> read = readVectorGrid(path, grid);
  return namingFile(path, [&] {
    VectorGrids grids;
    for (int c = 0; c < 3; ++c) grids[c] = toBricks(read[c]);
    return gridField(grids);
  });
}

/// The samples of a domain and nothing else.
BakeOptions bakingOf(const Domain& domain) {
  const auto cells = domain.cells();
  return {.voxelSize = 1,
          .box = {{0.5f, 0.5f, 0.5f}, {float(cells.x) - 0.5f, float(cells.y) - 0.5f, float(cells.z) - 0.5f}}};
}

void writeGrid(const std::string& path, const VdbGrid& grid) {
  writeVdbFile(path, {grid}, {{"creator", "nephele"}});
}

void writeField(const Context& context, const std::string& path, const S& f, const Domain& domain,
                const std::string& name) {
  constexpr float kHalfWidth = 3;
  requireWritable(context, path, {".vdb"});
  requireRoom(domain, 1, context);
  BakeOptions options = bakingOf(domain);
  VdbGridLabel label{name};
  if (name == "surface") {
    if (domain.cell.x != domain.cell.y || domain.cell.x != domain.cell.z)
      throw CallError(Code::outOfRange, "the cells of a level set must be cubes",
                      "give the domain three equal cell sizes, or the grid another name than \"surface\"");
    label.gridClass = VdbGridInfo::Class::levelSet;
    const float band = kHalfWidth * static_cast<float>(domain.cell.x);
    options.band = {-band, band};
  } else if (name == "density") {
    label.gridClass = VdbGridInfo::Class::fogVolume;
  }
  const Affine toWorld = sampleToWorld(domain);
  const auto grid = bakeGrid(transformed(f, inverse(toWorld)), options, *context.progress);
  grid->setLattice(Lattice::of(toWorld));
  writeGrid(path, toVdb(*grid, label));
}

void writeField(const Context& context, const std::string& path, const V& f, const Domain& domain,
                const std::string& name) {
  requireWritable(context, path, {".vdb"});
  requireRoom(domain, 3, context);
  const Affine toWorld = sampleToWorld(domain);
  VectorGrids grids = gridsOf(bake(transformed(f, inverse(toWorld)), bakingOf(domain), *context.progress));
  for (auto& grid : grids) {
    auto placed = std::make_shared<BrickGrid>(*grid);
    placed->setLattice(Lattice::of(toWorld));
    grid = std::move(placed);
  }
  writeGrid(path, toVdb(grids, VdbGridLabel{name}));
}

void addReading(Registry& r) {
  r.add(
      "shape read(string path)",
      "The mesh in an .obj, .ply, .stl, .off, .gltf or .glb file, or the surface of a level set in a .vdb or "
      ".nvdb. The first shape that is read is the main one: shares as 2.5% are of its longest side.",
      "write(\"ball.obj\", ls2shape(sphere((0,0,0), 1), 16));\nshape ball = read(\"ball.obj\");",
      [](Context& context, const std::string& path) { return readShapeFile(context, path); });
  r.add("scalarfield readfield(string path, string grid = \"\")",
        "A grid of numbers in a .vdb or .nvdb file, as a field: the one of that name, or the first there is. "
        "Level sets are positive inside, as all shapes here.",
        "domain d((-1,-1,-1), (2,2,2), 0.1);\nwrite(\"fog.vdb\", mask(sphere((0,0,0), 0.8)), d);\n"
        "scalarfield fog = readfield(\"fog.vdb\");",
        [](Context& context, const std::string& path, const std::string& grid) {
          return readField(context, path, grid);
        });
  r.add("vectorfield readvectorfield(string path, string grid = \"v\")",
        "A grid of vectors in a .vdb or .nvdb file, as a field: a velocity.",
        "domain d((-1,-1,-1), (2,2,2), 0.1);\nwrite(\"wind.vdb\", cross((0,1,0), identity()), d);\n"
        "vectorfield wind = readvectorfield(\"wind.vdb\");",
        [](Context& context, const std::string& path, const std::string& grid) {
          return readVectorField(context, path, grid);
        });
}

void addWriting(Registry& r) {
  r.add("void write(string path, shape s)",
        "Writes a shape as .obj, .ply or .stl. Files appear whole or not at all, and never in place of one "
        "that the script has read.",
        "write(\"ball.ply\", ls2shape(sphere((0,0,0), 1), 16));",
        [](Context& context, const std::string& path, const ShapePtr& s) {
          requireWritable(context, path, {".obj", ".ply", ".stl"});
          writeMesh(path, s->mesh);
        });
  r.add("void write(string path, scalarfield f, domain box, string name = \"density\")",
        "Samples a field on a domain and writes it as .vdb. \"density\" is fog: what is below 0 is 0. "
        "\"surface\" is a level set with a band of three cells, negative inside as other programs expect it.",
        "write(\"ball.vdb\", sphere((0,0,0), 0.8), domain((-1,-1,-1), (2,2,2), 0.1), \"surface\");",
        [](Context& context, const std::string& path, const S& f, const Domain& box,
           const std::string& name) { writeField(context, path, f, box, name); });
  r.add("void write(string path, vectorfield f, domain box, string name = \"v\")",
        "Samples a field of vectors on a domain and writes it as .vdb.",
        "write(\"wind.vdb\", curlnoise(), domain((-1,-1,-1), (2,2,2), 0.1));",
        [](Context& context, const std::string& path, const V& f, const Domain& box,
           const std::string& name) { writeField(context, path, f, box, name); });
  r.add("void write(string path, scalarcache cache, string name = \"density\")",
        "Writes what a cache holds as .vdb.",
        "scalarcache c(domain((-1,-1,-1), (2,2,2), 0.1));\ncachewrite(c, mask(sphere((0,0,0), 0.8)));\n"
        "write(\"fog.vdb\", c);",
        [](Context& context, const std::string& path, const std::shared_ptr<Cache<float>>& cache,
           const std::string& name) { writeField(context, path, samplesOf(*cache), cache->domain, name); });
  r.add("void write(string path, vectorcache cache, string name = \"v\")",
        "Writes what a cache holds as .vdb.",
        "vectorcache c(domain((-1,-1,-1), (2,2,2), 0.1));\ncachewrite(c, curlnoise());\nwrite(\"wind.vdb\", "
        "c);",
        [](Context& context, const std::string& path, const std::shared_ptr<Cache<Vec3f>>& cache,
           const std::string& name) { writeField(context, path, samplesOf(*cache), cache->domain, name); });
}

}  // namespace

void addFileFunctions(Registry& r) {
  r.group("files");
  addReading(r);
  addWriting(r);
}

}  // namespace nephele::felt
