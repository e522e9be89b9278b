// What compare_data_transfer.py needs of the library: meshes as plain numbers, and the measures of a map.
//
//   measure_transfer dump MESH OUT.bin            counts, positions, corners of triangles
//   measure_transfer turn MESH DEGREES SCALE OUT  a copy turned about (1, 2, 0.5), scaled and shifted
//   measure_transfer split MESH OUT               every triangle split in 16 at the middles of its sides
//   measure_transfer measure REFERENCE OBJECT IMAGES.bin   of images of the object's corners, as JSON
//   measure_transfer time REFERENCE OBJECT        closest points, attributes, a grid of the map, in seconds
#include <chrono>
#include <cstdio>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/warp/mesh_warp.h"
#include "nephele/levelset/warp/transfer_attributes.h"
#include "nephele/levelset/warp/transfer_quality.h"
#include "nephele/levelset/warp/warp_grid.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "tests/support/uv_layout.h"

namespace {

using namespace nephele;

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void dump(const Mesh& mesh, const std::string& path) {
  std::ofstream out(path, std::ios::binary);
  const std::uint64_t counts[] = {mesh.positions.size(), mesh.faceCount()};
  out.write(reinterpret_cast<const char*>(counts), sizeof counts);
  out.write(reinterpret_cast<const char*>(mesh.positions.data()),
            std::streamsize(mesh.positions.size() * sizeof(Vec3d)));
  out.write(reinterpret_cast<const char*>(mesh.corners.data()),
            std::streamsize(mesh.corners.size() * sizeof(std::uint32_t)));
}

void measure(const Mesh& reference, const Mesh& object, const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<Vec3d> images(object.corners.size());
  in.read(reinterpret_cast<char*>(images.data()), std::streamsize(images.size() * sizeof(Vec3d)));
  require(bool(in), path + ": too short");
  const TransferQuality q = transferQuality(reference, object, images);
  std::puts(nlohmann::json({{"flipped_fraction", q.flippedFraction},
                            {"degenerate_fraction", q.degenerateFraction},
                            {"stretch_median", q.stretchMedian},
                            {"stretch_p95", q.stretchP95},
                            {"coverage", q.coverage}})
                .dump()
                .c_str());
}

/// Closest points of every corner with what they carry, as one would with Embree alone.
double closestCorners(const Mesh& reference, const Mesh& object) {
  const double start = seconds();
  const NearestOnMesh tree(reference);
  const std::vector<float>& uv = test::attributeOf(reference, "uv").values;
  std::vector<float> values(2 * object.corners.size());
  parallelFor(object.corners.size(), 768, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const Vec3d& p = object.positions[object.corners[c]];
      const auto hit = tree.nearest(Vec3f(p), std::numeric_limits<float>::infinity());
      const auto face = reference.face(hit->triangle);
      const Vec3d& a = reference.positions[face[0]];
      const Vec3d e = reference.positions[face[1]] - a, f = reference.positions[face[2]] - a,
                  d = Vec3d(hit->point) - a, n = cross(e, f);
      const double area = std::max(dot(n, n), 1e-300);
      const double v = dot(cross(d, f), n) / area, w = dot(cross(e, d), n) / area;
      for (std::size_t k = 0; k < 2; ++k) {
        const float* at = uv.data() + 6 * std::size_t(hit->triangle) + k;
        values[2 * c + k] = float((1 - v - w) * double(at[0]) + v * double(at[2]) + w * double(at[4]));
      }
    }
  });
  return seconds() - start;
}

void time(const Mesh& reference, const Mesh& object) {
  nlohmann::json result;
  const auto median = [](const auto& run) {
    std::vector<double> all;
    for (int i = 0; i < 5; ++i) all.push_back(run());
    std::sort(all.begin(), all.end());
    return all[2];
  };
  result["embree_corners"] = median([&] { return closestCorners(reference, object); });
  std::vector<Vec3d> images;
  for (const auto& [name, align] :
       {std::pair{"none", Alignment::none}, std::pair{"similarity", Alignment::similarity}})
    result[std::string("fast_warp_") + name] = median([&, a = align] {
      const double start = seconds();
      images = warpMesh(reference, object, {.align = a, .quality = WarpQuality::fast}).images;
      return seconds() - start;
    });
  result["attributes"] = median([&] {
    const double start = seconds();
    transferAttributes(reference, object, images, {.names = {"uv"}});
    return seconds() - start;
  });
  result["quality"] = median([&] {
    const double start = seconds();
    transferQuality(reference, object, images);
    return seconds() - start;
  });
  const MeshWarp gridded = warpMesh(reference, object, {.quality = WarpQuality::fast, .gridded = true});
  const Box box = boundingBox(object);
  const WarpBricks bricks(float(1 / gridded.alignment.scale) * gridded.object, box,
                          {.voxelSize = double(box.longestSide()) / 256});
  const double start = seconds();
  bricks.sample(gridded.map);
  result["warp_grid"] = seconds() - start;
  result["warp_grid_voxels"] = bricks.voxelCount();
  std::puts(result.dump().c_str());
}

Mesh turned(Mesh mesh, double degrees, double scale) {
  const Mat3f turn = Mat3f::rotation({1, 2, 0.5f}, radians(float(degrees)));
  for (Vec3d& p : mesh.positions) {
    const Vec3d q = p;
    for (int i = 0; i < 3; ++i)
      p[i] = scale * (double(turn(i, 0)) * q.x + double(turn(i, 1)) * q.y + double(turn(i, 2)) * q.z);
    p += Vec3d{0.7, -0.4, 1.1};
  }
  return mesh;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::vector<std::string> a(argv + 1, argv + argc);
  const auto mesh = [&](std::size_t i) { return triangulated(readMesh(a.at(i))); };
  if (a.size() == 3 && a[0] == "dump")
    dump(mesh(1), a[2]);
  else if (a.size() == 5 && a[0] == "turn")
    writeMesh(a[4], turned(readMesh(a[1]), std::stod(a[2]), std::stod(a[3])));
  else if (a.size() == 3 && a[0] == "split")
    writeMesh(a[2], test::midpointSplit(test::midpointSplit(mesh(1))));
  else if (a.size() == 4 && a[0] == "measure")
    measure(mesh(1), mesh(2), a[3]);
  else if (a.size() == 3 && a[0] == "time")
    time(mesh(1), mesh(2));
  else
    throw Error("usage: measure_transfer dump|turn|split|measure|time ...");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "measure_transfer: %s\n", error.what());
  return 1;
}
