#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/app.h"
#include "nephele/levelset/warp/mesh_warp.h"
#include "nephele/levelset/warp/transfer_attributes.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/preview/texture_bake.h"
#include "nephele/render/preview/transfer_picture.h"

namespace nephele::apps {

/// What is to be carried from where to where.
struct TransferArguments {
  std::string from, to, output;
  TransferOptions transfer;
  MeshWarpOptions warp;
  int resolution = 256;
  /// Of the object.
  int subdivide = 0;
  std::string warpFile, warpedMesh;
  std::string texture, bakedTexture, preview;
  ColourEncoding textureEncoding = ColourEncoding::automatic;
  TextureBakeOptions bake;
  /// That of the reference's picture, unless given.
  bool bakeSizeGiven = false;
  TransferPictureOptions picture;
  /// What the preview shows: the attributes, or how well the map keeps shapes.
  bool paintsDistortion = false;
  const CLI::Option *align = nullptr, *quality = nullptr;
  /// What --method nacelle has alone, beside these.
  std::vector<const CLI::Option*> ofNacelle;

  /// What messages call the result: the first of its files.
  const std::string& name() const;
  /// Refuses options that the method does not have. @throws CLI::ValidationError naming them.
  void requireMethod() const;
  /// The attributes to carry: those asked for, or all that the output can hold. Says what is left out.
  /// @throws Error naming a file that lacks what is asked for or cannot hold it.
  TransferOptions chosen(const Mesh& reference, const Mesh& object, const Run& run) const;
  /// `bake` with its size filled in.
  TextureBakeOptions bakeOptions(const Image& image) const;
  /// Writes the baked texture, and says what the file cannot hold of it.
  void writeBaked(const Image& image, const Run& run) const;
  /// `object` mapped to `reference`, with `options` at the resolution asked for.
  /// @throws Error naming both files, or the option to change where it needs too much memory; Cancelled.
  MeshWarp warped(const Mesh& reference, const Mesh& object, MeshWarpOptions options, const Run& run) const;
  /// Refuses pictures that need too much memory. @throws Error naming the option to change.
  void requirePictureMemory(const TextureBakeOptions& baked, const Run& run) const;
};

/// One of the two meshes; says what is wrong with it. @throws Error naming the file.
Mesh readShape(const std::string& path, const Run& run);

/// Declares the options on `app`.
void addTransferOptions(CLI::App& app, TransferArguments& arguments);

}  // namespace nephele::apps
