// NanoVDB files as OpenVDB grids.
//
// NanoVDB trusts its files: sizes are allocated and offsets followed as they stand. So the segment headers
// are compared with the length of the file before anything is read, and every offset to a node with the
// length of its grid before it is followed.
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include <fmt/format.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/NanoToOpenVDB.h>

#include <fstream>

#include "nephele/levelset/io/detail/openvdb_grid.h"

namespace nephele::detail {

namespace {

/// Grids expand by less than this when they are decompressed; a larger claim is damage.
constexpr std::uint64_t kLargestExpansion = 4096;

/// Reads all headers and checks that what they announce can be in the file.
void checkSegments(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(0, std::ios::end);
  const auto fileSize = std::uint64_t(file.tellg());
  file.seekg(0);
  while (std::uint64_t(file.tellg()) < fileSize) {
    nanovdb::io::Header header;
    file.read(reinterpret_cast<char*>(&header), sizeof(header));
    if (!file) throw Error("the file is cut short");
    if (header.magic != NANOVDB_MAGIC_NUMBER) throw Error("not a NanoVDB file");
    if (header.version.getMajor() != NANOVDB_MAJOR_VERSION_NUMBER)
      throw Error(
          fmt::format("NanoVDB file of version {}.{}.{}, but {}.x is needed; convert it again from its .vdb",
                      header.version.getMajor(), header.version.getMinor(), header.version.getPatch(),
                      NANOVDB_MAJOR_VERSION_NUMBER));
    if (header.codec >= nanovdb::io::Codec::END) throw Error("damaged: unknown compression");
    std::uint64_t dataBytes = 0;
    for (int i = 0; i < header.gridCount; ++i) {
      nanovdb::io::MetaData data;
      file.read(reinterpret_cast<char*>(&data), sizeof(data));
      if (!file || data.nameSize == 0 || data.nameSize > fileSize || data.fileSize > fileSize ||
          data.gridSize / kLargestExpansion > fileSize || data.gridSize < sizeof(nanovdb::GridData))
        throw Error("the file is cut short or damaged: its grid header does not fit");
      std::string name(data.nameSize, '\0');
      file.read(name.data(), std::streamsize(name.size()));
      if (!file || name.back() != '\0') throw Error("damaged: a grid's name does not end");
      dataBytes += data.fileSize;
    }
    const auto position = std::uint64_t(file.tellg());
    if (dataBytes > fileSize - position)
      throw Error(fmt::format("the file is cut short: its grids end at byte {}, the file at byte {}",
                              position + dataBytes, fileSize));
    file.seekg(std::streamoff(dataBytes), std::ios::cur);
  }
}

/// Throws unless `bytes` bytes from `node` lie within the grid.
class Extent {
 public:
  Extent(const void* begin, std::uint64_t size)
      : begin_(reinterpret_cast<std::uintptr_t>(begin)), size_(size) {}

  void require(const void* node, std::uint64_t bytes) const {
    const std::uintptr_t offset = reinterpret_cast<std::uintptr_t>(node) - begin_;
    if (offset > size_ || bytes > size_ - offset || offset % alignof(std::uint64_t) != 0)
      throw Error("damaged: an offset leads out of its grid");
  }

 private:
  std::uintptr_t begin_;
  std::uint64_t size_;
};

template <class Node>
void checkNode(const Node& node, const Extent& extent) {
  if constexpr (Node::LEVEL > 0) {
    using Child = typename Node::ChildNodeType;
    extent.require(&node, sizeof(Node));
    const auto* data = node.data();
    for (std::uint32_t n = 0; n < (1u << (3 * Node::LOG2DIM)); ++n)
      if (data->mChildMask.isOn(n)) {
        const Child* child = data->getChild(n);
        extent.require(child, 64);
        checkNode(*child, extent);
      }
  } else {
    if constexpr (std::is_same_v<typename Node::BuildType, nanovdb::FpN>)
      extent.require(&node, node.data()->memUsage());
    else
      extent.require(&node, sizeof(Node));
  }
}

template <class Build>
openvdb::GridBase::Ptr convert(const nanovdb::GridHandle<>& handle) {
  const auto* grid = reinterpret_cast<const nanovdb::NanoGrid<Build>*>(handle.data());
  const Extent extent(handle.data(), handle.size());
  extent.require(grid, sizeof(*grid));
  const auto& tree = grid->tree();
  extent.require(&tree, sizeof(tree));
  const auto& root = tree.root();
  extent.require(&root, sizeof(*root.data()));
  const auto* data = root.data();
  using Root = std::decay_t<decltype(root)>;
  extent.require(data + 1, std::uint64_t(data->mTableSize) * sizeof(typename Root::DataType::Tile));
  for (std::uint32_t i = 0; i < data->mTableSize; ++i)
    if (const auto* tile = data->tile(i); tile->isChild()) checkNode(*data->getChild(tile), extent);
  return nanovdb::nanoToOpenVDB(*grid);
}

openvdb::GridBase::Ptr convertAny(const nanovdb::GridHandle<>& handle) {
  const auto* grid = reinterpret_cast<const nanovdb::GridData*>(handle.data());
  if (handle.size() < sizeof(nanovdb::GridData) || grid->mMagic != NANOVDB_MAGIC_NUMBER)
    throw Error("damaged: a grid does not start with NanoVDB's mark");
  switch (grid->mGridType) {
    case nanovdb::GridType::Float:
      return convert<float>(handle);
    case nanovdb::GridType::Double:
      return convert<double>(handle);
    case nanovdb::GridType::Fp4:
      return convert<nanovdb::Fp4>(handle);
    case nanovdb::GridType::Fp8:
      return convert<nanovdb::Fp8>(handle);
    case nanovdb::GridType::Fp16:
      return convert<nanovdb::Fp16>(handle);
    case nanovdb::GridType::FpN:
      return convert<nanovdb::FpN>(handle);
    case nanovdb::GridType::Vec3f:
      return convert<nanovdb::Vec3f>(handle);
    case nanovdb::GridType::Int32:
      return convert<std::int32_t>(handle);
    default:
      return nullptr;
  }
}

}  // namespace

std::vector<openvdb::GridBase::Ptr> readNanoVdb(const std::string& path) {
  checkSegments(path);
  std::vector<openvdb::GridBase::Ptr> result;
  std::string unsupported;
  for (const auto& handle : nanovdb::io::readGrids(path)) {
    if (auto grid = convertAny(handle))
      result.push_back(grid);
    else
      unsupported = nanovdb::toStr(reinterpret_cast<const nanovdb::GridData*>(handle.data())->mGridType);
  }
  if (result.empty() && !unsupported.empty())
    throw Error(fmt::format("no grid of a type that can be read; it holds {} values", unsupported));
  return result;
}

}  // namespace nephele::detail
