// Reading .vdb files with every byte accounted for.
//
// OpenVDB trusts its files. One that was cut short reads as zeros where the cut falls into raw data, and a
// damaged length makes it write past its buffers. So OpenVDB parses here from a stream of our own over the
// bytes of the file, which throws where a read leaves the file, and only what vdb_check.h has followed
// before.
#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>

#include <algorithm>
#include <istream>
#include <vector>

#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/levelset/io/detail/vdb_check.h"
#include "nephele/levelset/io/file_bytes.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

/// Files of OpenVDB 1.0 and later.
constexpr std::uint32_t kOldestVersion = openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;

class VdbArchive : public openvdb::io::Archive {
 public:
  explicit VdbArchive(const std::string& path) : path_(path), bytes_(path), stream_(&bytes_) {
    stream_.exceptions(std::ios::badbit | std::ios::failbit);
    checkStart();
    // Holds what readers of values need to know of the file.
    metadata_ = std::make_shared<openvdb::io::StreamMetadata>(stream_);
    openvdb::io::setStreamMetadataPtr(stream_, metadata_, /*transfer=*/false);
    readHeader(stream_);
    setFormatVersion(stream_);
    setLibraryVersion(stream_);
    setDataCompression(stream_);
    openvdb::MetaMap fileMetadata;
    checkMetadata(bytes_);
    fileMetadata.readMeta(stream_);
    gridCount_ = readGridCount(stream_);
    if (gridCount_ < 0) throw Error(fmt::format("damaged: it claims to hold {} grids", gridCount_));
  }

  /// Every grid; those that `wanted` leaves out by type and name come without values.
  std::vector<openvdb::GridBase::Ptr> read(const WantedGrid& wanted) {
    std::vector<Entry> entries;
    for (std::int32_t i = 0; i < gridCount_; ++i) {
      Entry entry;
      checkDescriptor(bytes_);
      entry.grid = entry.descriptor.read(stream_);
      entry.wanted = wanted(*entry.grid, entry.descriptor.gridName());
      // Without offsets the way to the next grid leads through this one.
      if (inputHasGridOffsets()) {
        checkOffsets(entry.descriptor);
        entry.descriptor.seekToEnd(stream_);
      } else {
        readValues(entry);
      }
      entries.push_back(entry);
    }
    if (inputHasGridOffsets()) {
      wantParents(entries);
      // Where no values are asked for, what else is said of the grids is.
      const bool onlyLabels = std::ranges::none_of(entries, &Entry::wanted);
      for (Entry& entry : entries)
        if (entry.wanted || onlyLabels) {
          entry.descriptor.seekToGrid(stream_);
          readValues(entry);
        }
    }
    NamedGridMap byName;
    for (const Entry& entry : entries) byName[entry.descriptor.uniqueName()] = entry.grid;
    std::vector<openvdb::GridBase::Ptr> result;
    for (const Entry& entry : entries) {
      connectInstance(entry.descriptor, byName);
      entry.grid->setName(entry.descriptor.gridName());
      result.push_back(entry.grid);
    }
    return result;
  }

 private:
  struct Entry {
    openvdb::io::GridDescriptor descriptor;
    openvdb::GridBase::Ptr grid;
    bool wanted = false;
  };

  /// A grid that shares the tree of another needs that one's values.
  static void wantParents(std::vector<Entry>& entries) {
    for (const Entry& entry : entries)
      if (entry.wanted && entry.descriptor.isInstance())
        for (Entry& parent : entries)
          parent.wanted |= parent.descriptor.uniqueName() == entry.descriptor.instanceParentName();
  }

  void readValues(Entry& entry) {
    const std::string name = entry.descriptor.gridName();
    try {
      const bool checkable = isCheckable(*entry.grid),
                 hasValues = checkable && (entry.wanted || !inputHasGridOffsets());
      const bool hasTree = hasValues && !entry.descriptor.isInstance();
      const std::vector<std::int64_t> leaves = checkGrid(bytes_, *entry.grid, hasTree);
      if (hasTree) {
        // OpenVDB reads all but the tree of what has none of its own.
        openvdb::io::GridDescriptor treeless = entry.descriptor;
        treeless.setInstanceParentName("none");
        readGrid(entry.grid, treeless, stream_);
        entry.grid->readTopology(stream_);
        const auto readAll = [&](auto& grid) { readLeaves(grid, leaves); };
        if (!entry.grid
                 ->apply<openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Vec3SGrid>>(
                     readAll))
          entry.grid->readBuffers(stream_);
      } else if (hasValues) {
        readGrid(entry.grid, entry.descriptor, stream_);
      } else if (inputHasGridOffsets()) {
        // Nothing here computes with points, either: what their metadata tells of them suffices.
        readGridCompression(stream_);
        entry.grid->readMeta(stream_);
        entry.grid->readTransform(stream_);
      } else {
        throw Error(fmt::format("its values of type {} cannot be read", entry.grid->valueType()));
      }
    } catch (const Error& error) {
      throw Error(fmt::format("grid '{}': {}", name, error.what()));
    }
  }

  /// The values of the leaves of a grid whose tree is there, on all cores; `begins` says where they lie.
  template <class Grid>
  void readLeaves(Grid& grid, const std::vector<std::int64_t>& begins) {
    // So many that opening the file once more does not count.
    constexpr std::size_t kTogether = 2048;
    std::vector<typename Grid::TreeType::LeafNodeType*> leaves;
    grid.tree().getNodes(leaves);
    require(leaves.size() == begins.size(), "damaged: it has another number of leaves than its nodes say");
    parallelFor((leaves.size() + kTogether - 1) / kTogether, 1, [&](std::size_t first, std::size_t last) {
      FileBytes bytes(path_);
      std::istream stream(&bytes);
      stream.exceptions(std::ios::badbit | std::ios::failbit);
      auto metadata = std::make_shared<openvdb::io::StreamMetadata>(*metadata_);
      openvdb::io::setStreamMetadataPtr(stream, metadata, /*transfer=*/false);
      setFormatVersion(stream);
      setLibraryVersion(stream);
      openvdb::io::setDataCompression(stream, openvdb::io::getDataCompression(stream_));
      openvdb::io::setGridClass(stream, grid.getGridClass());
      openvdb::io::setGridBackgroundValuePtr(stream, &grid.background());
      bytes.moveTo(begins[first * kTogether]);
      for (std::size_t i = first * kTogether; i < std::min(last * kTogether, leaves.size()); ++i)
        leaves[i]->readBuffers(stream, grid.saveFloatAsHalf());
    });
  }

  void checkStart() {
    if (bytes_.startsWith("version https://git-lfs"))
      throw Error("not a VDB file but a Git LFS pointer; fetch the real file with 'git lfs pull'");
    std::int32_t magic = 0;
    if (bytes_.size() >= std::int64_t(sizeof(magic))) {
      stream_.read(reinterpret_cast<char*>(&magic), sizeof(magic));
      stream_.seekg(0);
    }
    if (magic != openvdb::OPENVDB_MAGIC) throw Error("not a VDB file");
    bytes_.moveTo(sizeof(std::int64_t));
    const auto version = bytes_.take<std::uint32_t>();
    bytes_.moveTo(0);
    if (version < kOldestVersion || version > openvdb::OPENVDB_FILE_VERSION)
      throw Error(fmt::format("VDB file of version {}; versions {} to {} can be read", version,
                              kOldestVersion, std::uint32_t(openvdb::OPENVDB_FILE_VERSION)));
  }

  void checkOffsets(const openvdb::io::GridDescriptor& descriptor) const {
    if (descriptor.getGridPos() <= 0 || descriptor.getGridPos() > descriptor.getEndPos())
      throw Error(fmt::format("damaged: grid '{}' has impossible offsets", descriptor.gridName()));
    if (descriptor.getEndPos() > bytes_.size())
      throw Error(fmt::format("the file is cut short: grid '{}' ends at byte {}, the file at byte {}",
                              descriptor.gridName(), descriptor.getEndPos(), bytes_.size()));
  }

  std::string path_;
  FileBytes bytes_;
  openvdb::io::StreamMetadata::Ptr metadata_;
  std::istream stream_;
  std::int32_t gridCount_ = 0;
};

}  // namespace

std::vector<openvdb::GridBase::Ptr> readOpenVdb(const std::string& path, const WantedGrid& wanted) {
  return VdbArchive(path).read(wanted);
}

}  // namespace nephele::detail
