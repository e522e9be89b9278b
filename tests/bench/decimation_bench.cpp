// Decimation beside OpenMesh's own decimater (quadrics, no turned normals) on the same mesh; items are the
// triangles that go. The counter `distance` is the Hausdorff distance from the mesh before, in voxels.
#include <benchmark/benchmark.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <cstdlib>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/decimation.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "tests/support/surface_distance.h"

namespace {

using namespace nephele;

constexpr std::size_t kFaces = 20000;

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using HalfEdges = OpenMesh::TriMesh_ArrayKernelT<Traits>;

struct Source {
  Mesh mesh;
  double voxel = 0;
};

// The mesh in NEPHELE_DECIMATION_MESH, a level set (.vdb).
const Source& source() {
  static const Source made = [] {
    const char* path = std::getenv("NEPHELE_DECIMATION_MESH");
    if (!path) std::abort();
    const VdbGrid grid = readScalarGrid(path, "");
    return Source{marchingCubes(*toBricks(grid)), describe(grid).voxelSize.x};
  }();
  return made;
}

Mesh byOpenMesh(const Mesh& mesh) {
  HalfEdges half;
  for (const Vec3d& p : mesh.positions) half.add_vertex({p.x, p.y, p.z});
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    half.add_face(half.vertex_handle(face[0]), half.vertex_handle(face[1]), half.vertex_handle(face[2]));
  }
  half.request_face_normals();
  half.update_face_normals();
  {
    OpenMesh::Decimater::DecimaterT<HalfEdges> decimater(half);
    OpenMesh::Decimater::ModQuadricT<HalfEdges>::Handle quadric;
    OpenMesh::Decimater::ModNormalFlippingT<HalfEdges>::Handle flipping;
    decimater.add(quadric);
    decimater.add(flipping);
    decimater.module(quadric).unset_max_err();
    decimater.initialize();
    decimater.decimate_to_faces(0, kFaces);
    half.garbage_collection();
  }
  Mesh result;
  for (const auto v : half.vertices()) {
    const auto& p = half.point(v);
    result.positions.emplace_back(p[0], p[1], p[2]);
  }
  for (const auto f : half.faces()) {
    std::vector<std::uint32_t> face;
    for (const auto v : half.fv_range(f)) face.push_back(std::uint32_t(v.idx()));
    result.addFace(face);
  }
  return result;
}

void report(benchmark::State& state, const Mesh& result) {
  const Source& from = source();
  state.SetItemsProcessed(state.iterations() * std::int64_t(from.mesh.faceCount() - kFaces));
  state.counters["faces"] = double(result.faceCount());
  state.counters["manifold"] = diagnose(result).manifold();
  state.counters["distance"] = test::surfaceDistance(result, from.mesh, 0.3 * from.voxel) / from.voxel;
}

void decimateByOpenMesh(benchmark::State& state) {
  source();
  Mesh result;
  for (auto _ : state) result = byOpenMesh(source().mesh);
  report(state, result);
}

void decimateByUs(benchmark::State& state) {
  source();
  Mesh result;
  for (auto _ : state) result = decimate(source().mesh, {.faces = kFaces}).mesh;
  report(state, result);
}

BENCHMARK(decimateByOpenMesh)->Unit(benchmark::kSecond)->Iterations(1);
BENCHMARK(decimateByUs)->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace

BENCHMARK_MAIN();
