// Calls that write files, in any order and with any contents.
#include <fmt/format.h>
#include <fuzzer/FuzzedDataProvider.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "tests/fuzz/formats.h"
#include "tests/fuzz/harness.h"

namespace nephele::fuzz {
namespace {

using Calls = FuzzedDataProvider;

float anyFloat(Calls& calls) {
  return calls.ConsumeBool() ? calls.ConsumeFloatingPointInRange(-2.0f, 2.0f)
                             : calls.ConsumeFloatingPoint<float>();
}

std::string anyName(Calls& calls) {
  return calls.ConsumeRandomLengthString(12);
}

Mesh anyMesh(Calls& calls) {
  Mesh mesh;
  const auto vertices = calls.ConsumeIntegralInRange<std::uint32_t>(0, 12);
  for (std::uint32_t i = 0; i < vertices; ++i)
    mesh.positions.push_back({anyFloat(calls), anyFloat(calls), calls.ConsumeFloatingPoint<double>()});
  // Valid ones mostly, as what is not goes no further.
  const auto seldom = [&] { return calls.ConsumeIntegral<std::uint8_t>() == 1; };
  for (int faces = calls.ConsumeIntegralInRange(0, 12); faces > 0 && vertices > 0; --faces) {
    const bool isThin = seldom();
    std::vector<std::uint32_t> face(
        calls.ConsumeIntegralInRange<std::size_t>(isThin ? 0 : 3, isThin ? 2 : 6));
    for (std::uint32_t& corner : face)
      corner = calls.ConsumeIntegralInRange<std::uint32_t>(0, vertices - 1) + (seldom() ? vertices : 0);
    mesh.addFace(face);
  }
  for (int count = calls.ConsumeIntegralInRange(0, 3); count > 0; --count) {
    MeshAttribute attribute{
        anyName(calls),
        calls.ConsumeBool() ? MeshAttribute::Domain::vertex : MeshAttribute::Domain::corner,
        calls.ConsumeIntegralInRange(1, 5),
        {}};
    if (calls.ConsumeBool()) attribute.name = calls.PickValueInArray({"uv", "color", "normal"});
    const std::size_t elements =
        attribute.domain == MeshAttribute::Domain::vertex ? mesh.positions.size() : mesh.corners.size();
    attribute.values.resize(elements * std::size_t(attribute.width));
    for (float& value : attribute.values) value = anyFloat(calls);
    mesh.attributes.push_back(std::move(attribute));
  }
  if (calls.ConsumeBool())
    mesh.groups.push_back({anyName(calls), calls.ConsumeIntegralInRange<std::uint32_t>(0, 3),
                           calls.ConsumeIntegralInRange<std::uint32_t>(0, 12), anyName(calls)});
  if (calls.ConsumeBool()) mesh.materialFiles.push_back(anyName(calls));
  return mesh;
}

bool writeMeshes(Calls& calls) {
  const Mesh mesh = anyMesh(calls);
  const std::string path = scratchPath(calls.PickValueInArray({"a.obj", "a.ply", "a.stl"}));
  std::filesystem::remove(path);
  if (!succeeds("", [&] { requireValid(mesh); })) {
    expect(!succeeds("", [&] { writeMesh(path, mesh); }), "a mesh that is not valid was written");
    return false;
  }
  if (!succeeds(path, [&] { writeMesh(path, mesh); })) {
    expect(!std::filesystem::exists(path), "a mesh that could not be written left a file");
    return false;
  }
  Mesh back;
  const bool isRead = succeeds(path, [&] { back = readMesh(path); });
  if (path.ends_with(".stl")) return isRead;
  expect(isRead || mesh.faceCount() == 0, "a mesh that was written cannot be read: " + lastError());
  if (isRead)
    expect(back.corners == mesh.corners && back.faceStart == mesh.faceStart, "other faces are read");
  return isRead;
}

VoxelGrid<float> anyVoxels(Calls& calls) {
  VoxelGrid<float> voxels("fuzz", calls.PickValueInArray({1.0, 0.1, 1e-6, 1e6}), anyFloat(calls));
  for (int bricks = calls.ConsumeIntegralInRange(0, 6); bricks > 0; --bricks) {
    const auto along = [&] {
      return calls.ConsumeIntegral<std::uint8_t>() == 0 ? calls.ConsumeIntegralInRange(-200000000, 200000000)
                                                        : calls.ConsumeIntegralInRange(-3, 3);
    };
    const Vec3i brick{along(), along(), along()};
    if (voxels.entryAt(brick) >= 0) continue;
    if (calls.ConsumeBool()) {
      voxels.setConstant(brick, anyFloat(calls));
      continue;
    }
    float* samples = voxels.add(brick);
    const float first = anyFloat(calls), step = anyFloat(calls);
    for (int i = 0; i < kBrickSamples; ++i) samples[i] = first + step * float(i);
  }
  return voxels;
}

bool writeVolumes(Calls& calls) {
  const std::string path = scratchPath("a.vdb");
  std::filesystem::remove(path);
  std::vector<VdbGrid> grids;
  succeeds("", [&] {
    for (int count = calls.ConsumeIntegralInRange(0, 3); count > 0; --count) {
      VdbGridLabel label{anyName(calls),
                         calls.PickValueInArray({VdbGridInfo::Class::levelSet, VdbGridInfo::Class::fogVolume,
                                                 VdbGridInfo::Class::unknown}),
                         calls.ConsumeBool(),
                         {{anyName(calls), anyName(calls)}}};
      grids.push_back(toVdb(anyVoxels(calls), label));
      if (grids.size() > 1 && calls.ConsumeBool()) copyMetadata(grids[0], grids.back());
    }
  });
  if (grids.empty()) return false;
  if (!succeeds(path, [&] { writeVdbFile(path, grids, {{anyName(calls), anyName(calls)}}); })) {
    expect(!std::filesystem::exists(path), "a volume that could not be written left a file");
    return false;
  }
  std::vector<VdbGrid> back;
  expect(succeeds(path, [&] { back = readVdbFile(path); }),
         "a volume that was written cannot be read: " + lastError());
  expect(back.size() == grids.size(), "a volume has another number of grids");
  for (std::size_t i = 0; i < grids.size(); ++i) {
    expect(describe(back[i]).activeVoxels == describe(grids[i]).activeVoxels, "other voxels are active");
    succeeds("", [&] { toBricks(back[i]); });
  }
  return true;
}

bool writePictures(Calls& calls) {
  Image image{.width = calls.ConsumeIntegralInRange(0, 9), .height = calls.ConsumeIntegralInRange(0, 9)};
  if (calls.ConsumeBool())
    image.display =
        Image::Display{calls.ConsumeIntegralInRange(-3, 3), calls.ConsumeIntegralInRange(-3, 3),
                       calls.ConsumeIntegralInRange(-1, 99), calls.ConsumeIntegralInRange(-1, 99)};
  for (int channels = calls.ConsumeIntegralInRange(0, 5); channels > 0; --channels) {
    image.channels.push_back(
        {calls.ConsumeBool() ? anyName(calls) : calls.PickValueInArray({"R", "G", "B", "A"}),
         calls.ConsumeBool(),
         {}});
    image.channels.back().values.resize(std::size_t(image.width) * std::size_t(image.height) +
                                        (calls.ConsumeIntegral<std::uint8_t>() == 0));
    for (float& value : image.channels.back().values) value = anyFloat(calls);
  }
  const std::map<std::string, std::string> metadata = {{anyName(calls), anyName(calls)}};
  const std::string path = scratchPath(calls.PickValueInArray({"a.exr", "a.png"}));
  std::filesystem::remove(path);
  const bool isValid = succeeds("", [&] { image.check(); });
  const bool isWritten = succeeds(isValid ? path : "", [&] {
    if (path.ends_with(".png"))
      writePng(path, image, {}, metadata);
    else
      writeExr(path, image, ImageCamera{}, metadata);
  });
  expect(isWritten == std::filesystem::exists(path), "a picture that could not be written left a file");
  if (!isWritten) return false;
  Image back;
  expect(succeeds(path, [&] { back = readImage(path); }),
         "a picture that was written cannot be read: " + lastError());
  expect(back.width == image.width && back.height == image.height, "a picture has another size");
  return true;
}

bool writeDeepPictures(Calls& calls) {
  DeepImage image{.width = calls.ConsumeIntegralInRange(0, 5),
                  .height = calls.ConsumeIntegralInRange(0, 5),
                  .pixels = {}};
  image.pixels.resize(std::size_t(image.width) * std::size_t(image.height));
  for (auto& samples : image.pixels)
    for (int count = calls.ConsumeIntegralInRange(0, 3); count > 0; --count)
      samples.push_back(
          {anyFloat(calls), anyFloat(calls), anyFloat(calls), {anyFloat(calls), anyFloat(calls), 0}});
  const std::string path = scratchPath("deep.exr");
  std::filesystem::remove(path);
  const bool isValid = succeeds("", [&] { image.check(); });
  const bool isWritten = succeeds(isValid ? path : "", [&] { writeDeepExr(path, image, ImageCamera{}); });
  expect(isWritten == std::filesystem::exists(path), "a deep picture that could not be written left a file");
  if (!isWritten) return false;
  DeepImage back;
  expect(succeeds(path, [&] { back = readDeepExr(path); }),
         "a deep picture that was written cannot be read: " + lastError());
  expect(back.sampleCount() == image.sampleCount(), "a deep picture has other samples");
  return true;
}

/// Files that are begun, committed, withdrawn and given up in any order are there whole or not at all.
bool writeOutputs(Calls& calls) {
  constexpr int kTargets = 2;
  std::vector<std::unique_ptr<OutputFile>> open(4);
  const auto target = [&] {
    return scratchPath(fmt::format("output_{}", calls.ConsumeIntegralInRange(0, kTargets - 1)));
  };
  while (calls.remaining_bytes() > 0) {
    auto& output = open[calls.ConsumeIntegralInRange<std::size_t>(0, open.size() - 1)];
    switch (calls.ConsumeIntegralInRange(0, 5)) {
      case 0:
        output.reset();
        break;
      case 1:
        succeeds("", [&] { output = std::make_unique<OutputFile>(target()); });
        break;
      case 2:
        if (output) std::ofstream(output->temporaryPath()) << "whole";
        break;
      case 3:
        if (output) succeeds(output->path(), [&] { output->commit(); });
        break;
      case 4:
        if (output) output->withdraw();
        break;
      default:
        discardAllOutputs();
    }
  }
  open.clear();
  for (int i = 0; i < kTargets; ++i) {
    const std::string path = scratchPath(fmt::format("output_{}", i));
    std::ifstream file(path);
    std::string text;
    if (file >> text) expect(text == "whole", "a part of an output was left");
    std::filesystem::remove(path);
  }
  return true;
}

}  // namespace

bool useCalls(const Input& input) {
  Calls calls(reinterpret_cast<const std::uint8_t*>(input.bytes.data()), input.bytes.size());
  constexpr bool (*kKinds[])(Calls&) = {writeMeshes, writeVolumes, writePictures, writeDeepPictures,
                                        writeOutputs};
  return calls.PickValueInArray(kKinds)(calls);
}

}  // namespace nephele::fuzz
