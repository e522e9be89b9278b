// The layout is that of files since OpenVDB 1.0 (file version 222): openvdb/tree/RootNode.h, InternalNode.h,
// LeafNode.h, LeafNodeBool.h, LeafNodeMask.h and openvdb/io/Compression.h of OpenVDB 10.
#include "nephele/levelset/io/detail/vdb_check.h"

#include <fmt/format.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <istream>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "nephele/levelset/grid/openvdb_bridge.h"
#include "nephele/levelset/io/detail/blosc_header.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele::detail {

namespace {

using openvdb::Coord;

/// The grid's metadata for delayed loading: its contents are lengths and compressed blocks.
constexpr std::string_view kDelayedLoad = "__delayedload";

enum class Leaf { values, bits, mask };

/// How the values of a type lie in a file.
struct ValueLayout {
  std::string_view type;
  std::int64_t bytes;
  /// Where the grid is stored in half floats; 0 for types that never are.
  std::int64_t halfBytes;
  Leaf leaf;
};

constexpr std::array<ValueLayout, 9> kLayouts = {{
    {"float", 4, 2, Leaf::values},
    {"double", 8, 2, Leaf::values},
    {"int32", 4, 0, Leaf::values},
    {"int64", 8, 0, Leaf::values},
    {"vec3s", 12, 6, Leaf::values},
    {"vec3d", 24, 6, Leaf::values},
    {"vec3i", 12, 0, Leaf::values},
    {"bool", 1, 0, Leaf::bits},
    {"mask", 1, 0, Leaf::mask},
}};

const ValueLayout* layoutOf(const openvdb::GridBase& grid) {
  if (!grid.type().ends_with("_5_4_3")) return nullptr;
  for (const ValueLayout& layout : kLayouts)
    if (layout.type == grid.valueType()) return &layout;
  return nullptr;
}

void requireTextSize(std::int64_t size) {
  if (size > kLongestText)
    throw Error(fmt::format("a text of {} bytes, where {} are the most", size, kLongestText));
}

std::string takeText(FileBytes& bytes) {
  const std::int64_t size = bytes.take<std::uint32_t>();
  if (size > bytes.left())
    throw Error(fmt::format("damaged: a text of {} bytes, where {} are left", size, bytes.left()));
  requireTextSize(size);
  std::string text(std::size_t(size), '\0');
  bytes.sgetn(text.data(), size);
  return text;
}

/// Returns to where it began.
class Return {
 public:
  explicit Return(FileBytes& bytes) : bytes_(bytes), position_(bytes.position()) {}
  ~Return() { bytes_.moveTo(position_); }
  Return(const Return&) = delete;
  Return& operator=(const Return&) = delete;

 private:
  FileBytes& bytes_;
  std::int64_t position_;
};

void followMetadata(FileBytes& bytes) {
  const auto count = bytes.take<std::uint32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string name = takeText(bytes);
    const std::int64_t typePosition = bytes.position() + std::int64_t(sizeof(std::uint32_t));
    const std::string type = takeText(bytes);
    const std::int64_t size = bytes.take<std::uint32_t>();
    if (type == kDelayedLoad) {
      bytes.replace(typePosition, '-');
    } else if (type != openvdb::StringMetadata::staticTypeName() &&
               openvdb::Metadata::isRegisteredType(type)) {
      const std::int64_t expected = openvdb::Metadata::createMetadata(type)->size();
      if (size != expected)
        throw Error(fmt::format("damaged: metadata '{}' of type {} has {} bytes, not {}", name, type, size,
                                expected));
    }
    // What is longer than the file is found where it ends.
    if (size <= bytes.left()) requireTextSize(size);
    bytes.skip(size);
  }
}

class TreeCheck {
 public:
  TreeCheck(FileBytes& bytes, const ValueLayout& layout, bool asHalf, std::uint32_t compression)
      : bytes_(bytes), layout_(layout), half_(asHalf && layout.halfBytes > 0), compression_(compression) {}

  /// Returns where the leaves begin.
  std::vector<std::int64_t> check() {
    if (const auto buffers = bytes_.take<std::int32_t>(); buffers != 1)
      throw Error(fmt::format("damaged: a tree of {} buffers", buffers));
    bytes_.skip(layout_.bytes);
    const std::int64_t tiles = bytes_.take<std::uint32_t>();
    const std::int64_t children = bytes_.take<std::uint32_t>();
    for (std::int64_t i = 0; i < tiles; ++i) {
      takeRootOrigin();
      bytes_.skip(layout_.bytes + 1);
    }
    for (std::int64_t i = 0; i < children; ++i) followNode<kUpper>(takeRootOrigin());
    std::vector<std::int64_t> begins;
    begins.reserve(leaves_.size());
    for (const Coord& leaf : leaves_) {
      begins.push_back(bytes_.position());
      followLeaf(leaf);
    }
    return begins;
  }

 private:
  struct Level {
    int log2;
    /// Of the side of a child, in voxels.
    int childLog2;
  };
  static constexpr Level kLevels[2] = {{4, 3}, {5, 7}};
  static constexpr int kLower = 0;
  static constexpr int kUpper = 1;
  static constexpr std::int64_t kLeafValues = 512;

  Coord takeRootOrigin() {
    const auto xyz = bytes_.take<std::array<std::int32_t, 3>>();
    const Coord origin(xyz.data());
    for (int axis = 0; axis < 3; ++axis)
      if (xyz[std::size_t(axis)] & 4095)
        throw Error(fmt::format("damaged: a node begins at voxel {}, {}, {}", xyz[0], xyz[1], xyz[2]));
    if (!roots_.insert(origin).second)
      throw Error(fmt::format("damaged: two nodes begin at voxel {}, {}, {}", xyz[0], xyz[1], xyz[2]));
    return origin;
  }

  template <int level>
  void followNode(const Coord& origin) {
    constexpr Level kLevel = kLevels[level];
    constexpr int kWords = 1 << (3 * kLevel.log2 - 6);
    const auto children = bytes_.take<std::array<std::uint64_t, kWords>>();
    const auto active = bytes_.take<std::array<std::uint64_t, kWords>>();
    for (int i = 0; i < kWords; ++i)
      if (children[std::size_t(i)] & active[std::size_t(i)])
        throw Error("damaged: a value is where a node is");
    followValues(kWords * 64, countOf(active));
    for (int word = 0; word < kWords; ++word)
      for (std::uint64_t left = children[std::size_t(word)]; left; left &= left - 1) {
        const int index = word * 64 + std::countr_zero(left);
        const int mask = (1 << kLevel.log2) - 1;
        const Coord offset(index >> (2 * kLevel.log2), (index >> kLevel.log2) & mask, index & mask);
        const Coord child = origin + (offset << kLevel.childLog2);
        if constexpr (level == kUpper) {
          followNode<kLower>(child);
        } else {
          bytes_.skip(kLeafValues / 8);
          leaves_.push_back(child);
        }
      }
  }

  void followLeaf(const Coord& origin) {
    const auto active = bytes_.take<std::array<std::uint64_t, kLeafValues / 64>>();
    if (layout_.leaf == Leaf::values) return followValues(kLeafValues, countOf(active));
    const auto stored = bytes_.take<std::array<std::int32_t, 3>>();
    if (Coord(stored.data()) != origin)
      throw Error(fmt::format("damaged: a node at voxel {}, {}, {} claims to be at {}, {}, {}", origin.x(),
                              origin.y(), origin.z(), stored[0], stored[1], stored[2]));
    if (layout_.leaf == Leaf::bits) bytes_.skip(kLeafValues / 8);
  }

  static std::int64_t countOf(std::span<const std::uint64_t> mask) {
    std::int64_t count = 0;
    for (const std::uint64_t word : mask) count += std::popcount(word);
    return count;
  }

  /// The values of a node, of which `active` are on.
  void followValues(std::int64_t count, std::int64_t active) {
    using namespace openvdb::io;
    const int kind = bytes_.take<std::int8_t>();
    if (kind < NO_MASK_OR_INACTIVE_VALS || kind > NO_MASK_AND_ALL_VALS)
      throw Error(fmt::format("damaged: the values of a node are of kind {}", kind));
    const bool two = kind == MASK_AND_TWO_INACTIVE_VALS;
    if (two || kind == NO_MASK_AND_ONE_INACTIVE_VAL || kind == MASK_AND_ONE_INACTIVE_VAL)
      bytes_.skip(layout_.bytes * (two ? 2 : 1));
    if (two || kind == MASK_AND_NO_INACTIVE_VALS || kind == MASK_AND_ONE_INACTIVE_VAL) bytes_.skip(count / 8);
    followBlock((compression_ & COMPRESS_ACTIVE_MASK) && kind != NO_MASK_AND_ALL_VALS ? active : count);
  }

  void followBlock(std::int64_t count) {
    using namespace openvdb::io;
    if (half_ && count == 0) return;
    const std::int64_t expected = count * (half_ ? layout_.halfBytes : layout_.bytes);
    if (!(compression_ & (COMPRESS_BLOSC | COMPRESS_ZIP))) return bytes_.skip(expected);
    // What could not be compressed stands after minus its length.
    const auto length = bytes_.take<std::int64_t>();
    if (length <= 0 ? length != -expected : length > expected + kLargestOverhead)
      throw Error(fmt::format("damaged: a block of {} bytes stands for {}", length, expected));
    if (length > 0 && (compression_ & COMPRESS_BLOSC))
      followBlosc(length, expected);
    else
      bytes_.skip(length > 0 ? length : expected);
  }

  void followBlosc(std::int64_t length, std::int64_t expected) {
    if (length < kBloscHeaderBytes) throw Error("damaged: a compressed block is too short");
    const auto header = bytes_.take<std::array<char, kBloscHeaderBytes>>();
    checkBloscHeader(header.data(), length, expected);
    bytes_.skip(length - kBloscHeaderBytes);
  }

  /// Of a compressed block over its contents; one that would be longer is stored as it is.
  static constexpr std::int64_t kLargestOverhead = 64;

  FileBytes& bytes_;
  const ValueLayout& layout_;
  bool half_;
  std::uint32_t compression_;
  std::set<Coord> roots_;
  std::vector<Coord> leaves_;
};

void checkTransform(FileBytes& bytes) {
  const Return back(bytes);
  const std::string type = takeText(bytes);
  if (!openvdb::math::MapRegistry::isRegistered(type))
    throw Error(fmt::format("its transform is of an unknown kind, '{}'", type));
  if (type != openvdb::math::NonlinearFrustumMap::mapType()) return;
  // The box, the taper and the depth, then the name of a second transform.
  bytes.skip(8 * std::int64_t(sizeof(double)));
  takeText(bytes);
}

}  // namespace

void checkMetadata(FileBytes& bytes) {
  const Return back(bytes);
  followMetadata(bytes);
}

void checkDescriptor(FileBytes& bytes) {
  const Return back(bytes);
  for (int i = 0; i < 3; ++i) takeText(bytes);
  bytes.skip(3 * std::int64_t(sizeof(std::int64_t)));
}

namespace {

/// Under the names that OpenVDB sets itself it takes no value of another type.
void checkTypes(const openvdb::MetaMap& metadata) {
  using Grid = openvdb::GridBase;
  const std::pair<const char*, std::string> own[] = {
      {Grid::META_GRID_CLASS, "string"},   {Grid::META_GRID_CREATOR, "string"},
      {Grid::META_GRID_NAME, "string"},    {Grid::META_VECTOR_TYPE, "string"},
      {Grid::META_IS_LOCAL_SPACE, "bool"}, {Grid::META_SAVE_HALF_FLOAT, "bool"}};
  for (const auto& [name, type] : own)
    if (const auto value = metadata[name]; value && value->typeName() != type)
      throw Error(fmt::format("its metadata '{}' is of type '{}' and must be of type {}", name,
                              printable(value->typeName(), 40), type));
}

}  // namespace

bool isCheckable(const openvdb::GridBase& grid) {
  return layoutOf(grid) != nullptr;
}

std::vector<std::int64_t> checkGrid(FileBytes& bytes, const openvdb::GridBase& grid, bool hasTree) {
  const Return back(bytes);
  const auto compression = bytes.take<std::uint32_t>();
  checkMetadata(bytes);
  std::istream stream(&bytes);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  // As all since the oldest version, to what is read here.
  openvdb::io::setCurrentVersion(stream);
  openvdb::MetaMap metadata;
  metadata.readMeta(stream);
  checkTypes(metadata);
  const auto asHalf = metadata[openvdb::GridBase::META_SAVE_HALF_FLOAT];
  checkTransform(bytes);
  try {
    openvdb::math::Transform transform;
    transform.read(stream);
    if (transform.isLinear() && !(std::cbrt(std::abs(matrixOf(transform).det())) >= kLeastEdge))
      throw Error("its transform has no inverse, or its voxels are too small");
  } catch (const openvdb::Exception&) {
    throw Error("its transform has no inverse, or its voxels are too small");
  }
  if (!hasTree) return {};
  const ValueLayout* layout = layoutOf(grid);
  require(layout != nullptr, "values of this type cannot be followed");
  return TreeCheck(bytes, *layout, asHalf && asHalf->asBool(), compression).check();
}

}  // namespace nephele::detail
