// `nephele_fuzz_seeds FOLDER` writes small files of every format into FOLDER/NAME-OF-THE-FORMAT, to begin
// from: by the library and, where a format can do more than the library writes, by the libraries that it
// reads with.
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <fmt/format.h>
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/openvdb_bridge.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/shape/shapes.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"

namespace nephele::fuzz {
namespace {

namespace fs = std::filesystem;

class Folder {
 public:
  Folder(const std::string& parent, const std::string& name) : path_(fs::path(parent) / name) {
    fs::create_directories(path_);
  }
  std::string file(const std::string& name) const { return (path_ / name).string(); }
  void write(const std::string& name, std::string_view text) const {
    std::ofstream(file(name), std::ios::binary) << text;
  }

 private:
  fs::path path_;
};

Mesh meshOf(float voxelSize) {
  Mesh mesh = marchingCubes(
      *bakeGrid(sphere({0, 0, 0}, 0.5f), {.voxelSize = voxelSize, .box = {{-1, -1, -1}, {1, 1, 1}}}));
  MeshAttribute uv{"uv", MeshAttribute::Domain::corner, 2, {}},
      color{"color", MeshAttribute::Domain::vertex, 3, {}};
  for (const std::uint32_t corner : mesh.corners)
    uv.values.insert(uv.values.end(), {float(mesh.positions[corner].x), float(mesh.positions[corner].y)});
  for (const Vec3d& p : mesh.positions)
    color.values.insert(color.values.end(), {float(p.x * p.x), float(p.y * p.y), 0.5f});
  mesh.attributes = {uv, color};
  mesh.groups = {{"lower", 0, 4, "stone"}, {"upper", 4, std::uint32_t(mesh.faceCount()) - 4, ""}};
  return mesh;
}

constexpr char kCubeObj[] =
    "mtllib a.mtl\no cube\nv 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nvt "
    "0 0\nvt 1 0\n"
    "vt 1 1\nvn 0 0 1\ng sides\nusemtl stone\nf 1/1/1 4/2/1 3/3/1 2/1/1\nf 5//1 6//1 7//1 8//1\nf -8 -7 -3 "
    "-4\n"
    "f 2 3 7 6\nf 3 4 8 7 # last\nf 4 1 5 8\nl 1 2\np 1\n";
constexpr char kTetrahedronOff[] =
    "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3 255 0 0\n3 2 0 3\n";
constexpr char kTetrahedronPly[] =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\nproperty double "
    "y\nproperty double z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 4\nproperty list uchar int "
    "vertex_indices\n"
    "property list uchar float texcoord\nend_header\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1 9 9 "
    "9\n"
    "3 0 2 1 6 0 0 1 0 1 1\n3 0 1 3 6 0 0 1 0 1 1\n3 1 2 3 0\n3 2 0 3 0\n";
constexpr char kTriangleStl[] =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
    "0\nendloop\nendfacet\nendsolid a\n";

void appendNumber(std::string& bytes, auto value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

std::string base64(std::string_view bytes) {
  constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? std::uint8_t(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kLetters[group >> (18 - 6 * k) & 63];
  }
  return text;
}

/// A tetrahedron: its JSON, with the buffer as text or, for GLB, in the next chunk.
std::string gltf(std::string_view uri, std::size_t bytes) {
  return fmt::format(
      R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],)"
      R"("nodes":[{{"mesh":0,"translation":[1,0,0],"scale":[1,2,1],"children":[1]}},{{"rotation":[0,0,0,1],"mesh":0}}],)"
      R"("meshes":[{{"name":"a","primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":2}},"indices":1,"material":0}}]}}],)"
      R"("materials":[{{"name":"stone"}}],)"
      R"("accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},)"
      R"({{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}},)"
      R"({{"bufferView":0,"byteOffset":0,"componentType":5126,"count":4,"type":"VEC2","sparse":{{"count":1,)"
      R"("indices":{{"bufferView":1,"componentType":5123}},"values":{{"bufferView":0}}}}}}],)"
      R"("bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],)"
      R"("buffers":[{{{}"byteLength":{}}}]}})",
      uri, bytes);
}

std::string tetrahedronBuffer() {
  std::string bytes;
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f}) appendNumber(bytes, x);
  for (const std::uint16_t i : {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}) appendNumber(bytes, i);
  return bytes;
}

void writeMeshSeeds(const std::string& parent) {
  const Mesh coarse = meshOf(0.5f), finer = meshOf(0.3f);
  const Folder obj(parent, "obj"), ply(parent, "ply"), stl(parent, "stl"), off(parent, "off"),
      gltfs(parent, "gltf"), glb(parent, "glb");
  writeMesh(obj.file("ball.obj"), coarse);
  obj.write("cube.obj", kCubeObj);
  writeMesh(ply.file("ball.ply"), coarse);
  writeMesh(ply.file("finer.ply"), finer);
  ply.write("ascii.ply", kTetrahedronPly);
  writeMesh(stl.file("ball.stl"), coarse);
  stl.write("ascii.stl", kTriangleStl);
  off.write("tetrahedron.off", kTetrahedronOff);
  off.write("coff.off", "COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n3 0 1 2\n");
  const std::string buffer = tetrahedronBuffer();
  gltfs.write(
      "tetrahedron.gltf",
      gltf(R"("uri":"data:application/octet-stream;base64,)" + base64(buffer) + "\",", buffer.size()));
  std::string json = gltf("", buffer.size());
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  appendNumber(bytes, 2u);
  appendNumber(bytes, std::uint32_t(12 + 8 + json.size() + 8 + buffer.size()));
  appendNumber(bytes, std::uint32_t(json.size()));
  bytes += "JSON" + json;
  appendNumber(bytes, std::uint32_t(buffer.size()));
  bytes += std::string("BIN\0", 4) + buffer;
  glb.write("tetrahedron.glb", bytes);
}

template <class Grid>
typename Grid::Ptr gridOf(const std::string& name, typename Grid::ValueType outside,
                          typename Grid::ValueType inside) {
  const auto grid = Grid::create(outside);
  grid->setName(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  auto values = grid->getAccessor();
  for (int i = 0; i < 5; ++i)
    for (int k = 0; k < 6; ++k) values.setValue({i, k, (i * k) % 4 - 2}, inside);
  grid->tree().addTile(1, {8, 8, 8}, inside, true);
  return grid;
}

openvdb::FloatGrid::Ptr ballGrid() {
  const float h = 0.25f;
  const VdbGrid grid =
      toVdb(*bakeGrid(sphere({0, 0, 0}, 0.5f),
                      {.voxelSize = h, .box = {{-1, -1, -1}, {1, 1, 1}}, .band = {-3 * h, 3 * h}}),
            {"surface", VdbGridInfo::Class::levelSet});
  const std::string path =
      (fs::temp_directory_path() / fmt::format("nephele-seed-{}.vdb", ::getpid())).string();
  writeVdbFile(path, {grid}, {});
  openvdb::io::File file(path);
  file.open(false);
  auto read = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("surface"));
  file.close();
  fs::remove(path);
  return read;
}

void writeVolumeSeeds(const std::string& parent) {
  detail::initializeOpenVdb();
  const Folder vdb(parent, "vdb"), nvdb(parent, "nvdb");
  const auto fog = gridOf<openvdb::FloatGrid>("density", 0.f, 1.f);
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  const auto ball = ballGrid();
  const auto velocity = gridOf<openvdb::Vec3SGrid>("v", openvdb::Vec3s(0), openvdb::Vec3s(1, 2, 3));
  velocity->setGridClass(openvdb::GRID_STAGGERED);
  const auto half = gridOf<openvdb::FloatGrid>("half", 0.f, 0.3f);
  half->setSaveFloatAsHalf(true);
  half->insertMeta("note", openvdb::StringMetadata("text"));
  const auto twin = openvdb::gridPtrCast<openvdb::FloatGrid>(fog->copyGrid());
  twin->setName("copy");
  const auto mapped = gridOf<openvdb::FloatGrid>("turned", 0.f, 1.f);
  mapped->setTransform(openvdb::math::Transform::createLinearTransform(
      openvdb::Mat4R(0.1, 0.02, 0.0, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 1.0, 2.0, 3.0, 1.0)));
  const auto frustum = gridOf<openvdb::FloatGrid>("frustum", 0.f, 1.f);
  frustum->setTransform(
      openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd({0, 0, 0}, {8, 8, 8}), 0.5, 1.0, 0.1));
  const auto points =
      openvdb::points::createPointDataGrid<openvdb::points::NullCodec, openvdb::points::PointDataGrid>(
          std::vector<openvdb::Vec3R>{{0, 0, 0}, {0.1, 0.2, 0.3}},
          *openvdb::math::Transform::createLinearTransform(0.1));
  points->setName("points");
  const auto write = [&](const std::string& name, const openvdb::GridCPtrVec& grids,
                         std::uint32_t compression) {
    openvdb::io::File file(vdb.file(name));
    file.setCompression(compression);
    file.write(grids);
    // Files are numbered at random, and seeds are to be the same every time.
    constexpr int kNumberPlace = 21;
    constexpr std::string_view kNumber = "00000000-0000-0000-0000-000000000000";
    std::fstream(vdb.file(name), std::ios::binary | std::ios::in | std::ios::out)
        .seekp(kNumberPlace)
        .write(kNumber.data(), kNumber.size());
  };
  using namespace openvdb::io;
  write("fog_none.vdb", {fog}, COMPRESS_NONE);
  write("fog_mask.vdb", {fog}, COMPRESS_ACTIVE_MASK);
  write("fog_zip.vdb", {fog}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);
  write("fog_blosc.vdb", {fog}, COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK);
  write("ball_zip.vdb", {ball}, COMPRESS_ZIP);
  write("ball_blosc.vdb", {ball}, COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK);
  write("velocity.vdb", {velocity}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);
  write("half.vdb", {half}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);
  write("shared_tree.vdb", {fog, twin}, COMPRESS_ACTIVE_MASK);
  write("turned.vdb", {mapped}, COMPRESS_ACTIVE_MASK);
  write("frustum.vdb", {frustum}, COMPRESS_ACTIVE_MASK);
  write("points.vdb", {points}, COMPRESS_BLOSC);
  write("others.vdb",
        {gridOf<openvdb::DoubleGrid>("double", 0., 1.), gridOf<openvdb::BoolGrid>("bool", false, true),
         gridOf<openvdb::Int32Grid>("int", 0, 7),
         gridOf<openvdb::Vec3DGrid>("vec3d", openvdb::Vec3d(0), openvdb::Vec3d(1))},
        COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);

  using nanovdb::io::Codec;
  for (const auto& [codec, name] :
       {std::pair{Codec::NONE, "none"}, {Codec::ZIP, "zip"}, {Codec::BLOSC, "blosc"}}) {
    nanovdb::io::writeGrid(nvdb.file(fmt::format("fog_{}.nvdb", name)), nanovdb::openToNanoVDB(*fog), codec);
    nanovdb::io::writeGrid(nvdb.file(fmt::format("velocity_{}.nvdb", name)),
                           nanovdb::openToNanoVDB(*velocity), codec);
  }
  nanovdb::io::writeGrid(nvdb.file("ball_zip.nvdb"), nanovdb::openToNanoVDB(*ball), Codec::ZIP);
  nanovdb::OpenToNanoVDB<float, nanovdb::FpN> quantized;
  nanovdb::io::writeGrid(nvdb.file("quantized_zip.nvdb"), quantized(*ball), Codec::ZIP);
}

Image smallPicture(int width, int height) {
  Image image{.width = width, .height = height};
  for (const char* name : {"R", "G", "B", "A"})
    for (std::size_t i = 0; float& value : image.add(name, name[0] != 'A').values)
      value = float(i++ % 17) / 16;
  return image;
}

void writeExrSeed(const std::string& path, Imf::Compression compression, bool tiled) {
  constexpr int kWidth = 12, kHeight = 6;
  Imf::Header header(kWidth, kHeight);
  header.compression() = compression;
  std::vector<float> values(kWidth * kHeight);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = float(i % 13) / 12;
  Imf::FrameBuffer pixels;
  for (const char* name : {"R", "G", "B"}) {
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    pixels.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), sizeof(float),
                                   sizeof(float) * kWidth));
  }
  if (!tiled) {
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(pixels);
    return file.writePixels(kHeight);
  }
  header.setTileDescription(Imf::TileDescription(8, 4, Imf::MIPMAP_LEVELS));
  Imf::TiledOutputFile file(path.c_str(), header);
  file.setFrameBuffer(pixels);
  for (int level = 0; level < file.numLevels(); ++level)
    file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
}

void writePictureSeeds(const std::string& parent) {
  const Folder exr(parent, "exr"), deep(parent, "deep"), png(parent, "png"), hdr(parent, "hdr");
  const Image image = smallPicture(12, 6);
  writeExr(exr.file("picture.exr"), image, ImageCamera{}, {{"note", "text"}});
  constexpr std::pair<Imf::Compression, const char*> kCompressions[] = {
      {Imf::NO_COMPRESSION, "none"},   {Imf::RLE_COMPRESSION, "rle"},     {Imf::ZIPS_COMPRESSION, "zips"},
      {Imf::PIZ_COMPRESSION, "piz"},   {Imf::PXR24_COMPRESSION, "pxr24"}, {Imf::B44_COMPRESSION, "b44"},
      {Imf::B44A_COMPRESSION, "b44a"}, {Imf::DWAA_COMPRESSION, "dwaa"},   {Imf::DWAB_COMPRESSION, "dwab"}};
  for (const auto& [compression, name] : kCompressions) {
    writeExrSeed(exr.file(fmt::format("{}.exr", name)), compression, false);
    writeExrSeed(exr.file(fmt::format("tiled_{}.exr", name)), compression, true);
  }
  DeepImage samples{.width = 4, .height = 3, .pixels = std::vector<std::vector<DeepSample>>(12)};
  for (std::size_t i = 0; i < samples.pixels.size(); ++i)
    for (std::size_t k = 0; k < i % 4; ++k)
      samples.pixels[i].push_back({float(k), float(k) + 0.5f, 0.25f, {0.1f, 0.2f, 0.1f * float(i)}});
  writeDeepExr(deep.file("deep.exr"), samples, ImageCamera{});
  writePng(png.file("picture.png"), image, {}, {{"note", "text"}});
  std::string flat = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 2 +X 4\n";
  for (int i = 0; i < 8; ++i) flat += {char(i * 30), char(200 - i), 9, char(128 + i % 3)};
  hdr.write("flat.hdr", flat);
  std::string runs = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 2 +X 8\n";
  for (int row = 0; row < 2; ++row) {
    runs += std::string("\2\2\0\10", 4);
    for (int channel = 0; channel < 4; ++channel) runs += std::string("\204\200\4\1\2\3\4", 7);
  }
  hdr.write("runs.hdr", runs);
}

void writeScriptSeeds(const std::string& parent) {
  const Folder felt(parent, "felt");
  felt.write("values.felt",
             "int[] a; for (int i = 0; i < 5; i++) { a[i] = i % 3; if (a[i] == 2) continue; }\n"
             "vector v = (1, 2.5, -3e-1); matrix m = ((1,0,0), (0,1,0), (0,0,1));\n"
             "print(a, v * v, m * v, v.x ^ 2, size(a) > 2 && !false ? \"yes\" : \"no\", 2.5%, 6x);\n");
  felt.write(
      "functions.felt",
      "param float gain = 1.5 in [0, 4] \"how much\"; /* a comment */\n"
      "func scalarfield[] layers(scalarfield noise, int count, float rough = 0.5) {\n"
      "  scalarfield[] all = []; scalarfield scale = scalarfield(1.0);\n"
      "  while (size(all) < count) { all[size(all)] = compose(noise, P * 2) * scale; scale *= rough; }\n"
      "  return all;\n}\n"
      "scalarfield[] some = layers(noise(\"simplex\", seed = 3), 3); // and more\n"
      "vectorfield map = advect(identity(), curlnoise(frequency = 2), gain);\n");
  felt.write("fields.felt",
             "scalarfield l = union(sphere((0,0,0), 1), box((1,0,0), (1,1,1))) + 0.1 * abs(perlin(4));\n"
             "vectorfield n = -grad(l) / sqrt(grad(l) * grad(l)); matrixfield h = grad(grad(l));\n"
             "domain d((-1,-1,-1), (2,2,2), (0,0,0), 0.5, 0.5, 0.5); scalarcache c(d);\n"
             "scalarfield f = (mask(l) * n.x - n[1]) ^ 0.5 + n * h * n; bool b = 1.0 / 3 < 7 / 2;\n");
}

void writeViewConfigSeeds(const std::string& parent) {
  const Folder ocio(parent, "ocio");
  const std::string head = R"(ocio_profile_version: 2
environment: {A: table}
search_path: ""
strictparsing: true
roles: {default: lin_rec709, scene_linear: lin_rec709}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
)";
  const std::string plain = head + R"(displays:
  screen:
    - !<View> {name: Half, colorspace: half}
    - !<View> {name: Film, colorspace: film, looks: "+warm"}
    - !<View> {name: Log, colorspace: log}
active_displays: [screen]
active_views: []
looks:
  - !<Look>
    name: warm
    process_space: log
    transform: !<CDLTransform> {slope: [1.1, 1, 0.9], offset: [0, 0.01, 0], power: [1, 1.1, 1], sat: 0.9}
colorspaces:
  - !<ColorSpace>
    name: lin_rec709
  - !<ColorSpace>
    name: half
    from_scene_reference: !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1]}
  - !<ColorSpace>
    name: log
    from_scene_reference: !<LogAffineTransform> {base: 10, log_side_slope: 0.2, log_side_offset: 0.6, lin_side_offset: 0.01}
  - !<ColorSpace>
    name: film
    from_scene_reference: !<GroupTransform>
      children:
        - !<ColorSpaceTransform> {src: lin_rec709, dst: log}
        - !<FileTransform> {src: $A, interpolation: linear}
        - !<RangeTransform> {min_in_value: 0, min_out_value: 0, max_in_value: 1, max_out_value: 1}
        - !<ExponentTransform> {value: [0.5, 0.5, 0.5, 1]}
)";
  const std::string displays = head + R"(shared_views:
  - !<View> {name: Half, view_transform: tone, display_colorspace: <USE_DISPLAY_NAME>}
displays:
  screen:
    - !<Views> [Half]
    - !<View> {name: Film, view_transform: tone, display_colorspace: screen, rule: any}
    - !<View> {name: Log, colorspace: acescct}
viewing_rules:
  - !<Rule> {name: any, colorspaces: lin_rec709}
default_view_transform: tone
view_transforms:
  - !<ViewTransform>
    name: tone
    from_scene_reference: !<GroupTransform>
      children:
        - !<GradingPrimaryTransform> {style: log, contrast: {rgb: [1, 1, 1], master: 1.2}}
        - !<ColorSpaceTransform> {src: lin_rec709, dst: named}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}
named_transforms:
  - !<NamedTransform>
    name: named
    transform: !<ExposureContrastTransform> {style: linear, exposure: 0.5, contrast: 1.1, gamma: 1, pivot: 0.18}
display_colorspaces:
  - !<ColorSpace>
    name: screen
    from_display_reference: !<GroupTransform>
      children:
        - !<FileTransform> {src: table}
        - !<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055, direction: inverse}
colorspaces:
  - !<ColorSpace>
    name: lin_rec709
    aliases: [linear]
  - !<ColorSpace>
    name: acescct
    to_scene_reference: !<BuiltinTransform> {style: ACEScct_to_ACES2065-1}
)";
  const std::pair<const char*, const char*> tables[] = {
      {"cube", "LUT_3D_SIZE 2\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n"},
      {"curve", "LUT_1D_SIZE 3\n0 0 0\n0.6 0.5 0.4\n1 1 1\n"},
      {"spi1d", "Version 1\nFrom 0.0 1.0\nLength 3\nComponents 1\n{\n0\n0.7\n1\n}\n"},
      {"spimtx", "0.9 0.1 0 0\n0 1 0 0\n0 0.1 0.9 0\n"},
      {"clf",
       "<?xml version=\"1.0\"?>\n<ProcessList compCLFversion=\"3\" id=\"a\">\n<LUT1D inBitDepth=\"32f\" "
       "outBitDepth=\"32f\"><Array dim=\"3 1\">0 0.6 1</Array></LUT1D>\n</ProcessList>\n"},
      {"csp", "CSPLUTV100\n1D\n\n2\n0 1\n0 1\n2\n0 1\n0 1\n2\n0 1\n0 1\n\n2\n0 0 0\n1 1 1\n"}};
  for (const auto& [name, table] : tables) {
    ocio.write(fmt::format("plain_{}.ocio", name), plain + "...\n" + table);
    ocio.write(fmt::format("displays_{}.ocio", name), displays + "...\n" + table);
  }
}

void writeTextSeeds(const std::string& parent) {
  const Folder chan(parent, "chan"), camera(parent, "camera"), toml(parent, "toml"), field(parent, "field"),
      verbs(parent, "verbs"), calls(parent, "calls");
  chan.write("a.chan", "# frames\n1 0 0 3 0 0 0 35\n2 0.5 0 3 10 -5 0 35\n4 1 0.25 3 20 -5 1 40\n");
  camera.write(
      "a.json",
      R"({"rotation_order":"XYZ","interpolation":"linear","film_width":24,"frames":[)"
      R"({"frame":1,"position":[0,0,3],"rotation":[0,10,0],"focal_length":35,"f_stop":2.8,"focus_distance":3},)"
      R"({"frame":5,"position":[1,0,3],"rotation":[5,20,0],"focal_length":50,"f_stop":4,"focus_distance":2}]})");
  camera.write(
      "b.json",
      R"({"frames":[{"frame":0.5,"position":[2,1,3],"look_at":[0,0,0],"up":[0,1,0],"vertical_fov":30}]})");
  toml.write(
      "layers.toml",
      "[[layer]]\nnoise = \"worley\"\namplitude = \"3%\"\nfrequency = \"4x\"\nbillow = 0.5\n\n[[layer]]\n"
      "amplitude = \"height:0=1%,0.6=3%\"\nmask = \"facing:0,1,0:-1=0,1=1\"\nseed = 7\noctaves = 3\ntime = "
      "0.5\n"
      "direction = [0, 1, 0]\nbias = 0.4\n");
  toml.write("config.toml",
             "[cloud]\nresolution = 64\nlayers = 3\namplitude = \"2%\"\nbillow = "
             "\"=clamp(height, 0, 1)\"\n\n[render]\nsun = [\"30,20\", \"a=10,5\"]\nsize = \"64x48\"\n");
  field.write("ramp.txt", "height:0=1%,0.6=3%");
  field.write("along.txt", "along:1,0.5,0:0=0.1,1=0.9");
  field.write("facing.txt", "facing:0,1,0:-1=0,1=1");
  field.write("product.txt", "height:0=1%,1=2%*noise:6x,3:0.5,1");
  field.write("expression.txt", "=clamp(0.3 * height + facing((0, 1, 0)) * P.x, 0, 1)");
  field.write("constant.txt", "0.5,0,1%");
  field.write("noise.txt", "noise:kind=perlin,amplitude=2%,frequency=6x,octaves=3,seed=1");
  field.write("curl.txt", "curl:amplitude=0.1,frequency=2,lacunarity=2.1,roughness=0.5,time=3");
  field.write(
      "options.txt",
      "cloud\n--resolution\n64\n--amplitude\n2.5%\n--billow\n0.5\n-o\na.vdb\n--sun\n30,20,3\n--size=64x48");
  field.write("cut.txt", "cut\na.obj\n-o\npieces\n--plane\n0,0,0,1,0,0\n--kerf\n1%\n--random-planes\n4");
  for (const auto& [verb, options] : {std::pair{"levelset", "--half-width\n2"},
                                      {"cloud", "--billow\n0.3\n--thin-out\n0.5"},
                                      {"cloud", "--amplitude\nheight:0=1%,1=3%\n--advect\n2%"},
                                      {"advect", "--steps\n2\n--dt\n0.5"},
                                      {"wisps", "--guides\n2\n--clump\n0.5"},
                                      {"mesh", "--adaptivity\n0.1"},
                                      {"cut", "--kerf\n1%\n--explode\n0.2"},
                                      {"transfer", "--method\nclosest"},
                                      {"transform", "--rotate\n0,30,0\n--move\n1,0,0"},
                                      {"render", "--view\n40,20\n--phase\nhg:0.5"},
                                      {"render", "--camera\ncamera.json\n--frame\n1"},
                                      {"turntable", "--step\n5%"},
                                      {"info", "--self-intersections"}})
    verbs.write(fmt::format("{}_{}.txt", verb, std::string_view(options).size()),
                fmt::format("{}\n{}\n", verb, options));
  // By which meshes, volumes, pictures, deep pictures and outputs are written so that they can be read.
  constexpr std::size_t kPatterns[][2] = {{3, 4},  {5, 1}, {3, 0}, {7, 4}, {21, 1},
                                          {32, 3}, {1, 0}, {3, 2}, {1, 1}, {2, 2}};
  for (const auto& [rise, first] : kPatterns) {
    std::string bytes(256, '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = char(i * (2 * rise + 1) + i / 8 * rise + first);
    calls.write(fmt::format("{}_{}.bin", rise, first), bytes);
  }
}

}  // namespace
}  // namespace nephele::fuzz

int main(int argc, char** argv) {
  using namespace nephele::fuzz;
  if (argc != 2) {
    std::fprintf(stderr, "nephele_fuzz_seeds: one folder is needed\n");
    return 2;
  }
  const std::string folder = argv[1];
  writeMeshSeeds(folder);
  writeVolumeSeeds(folder);
  writePictureSeeds(folder);
  writeScriptSeeds(folder);
  writeViewConfigSeeds(folder);
  writeTextSeeds(folder);
}
