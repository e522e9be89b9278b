// NanoVDB files as OpenVDB grids.
//
// NanoVDB trusts its files: sizes are allocated and offsets followed as they stand, and a block that cannot
// be decompressed goes unnoticed. So files are read here, and NanoVDB gets grids whose every offset has been
// followed.
#include <blosc.h>
#include <fmt/format.h>
#include <nanovdb/util/GridChecksum.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/NanoToOpenVDB.h>
#include <zlib.h>

#include <array>

#include "nephele/levelset/io/detail/blosc_header.h"
#include "nephele/levelset/io/detail/nano_nodes.h"
#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/levelset/io/file_bytes.h"

namespace nephele::detail {

namespace {

using Buffer = nanovdb::HostBuffer;

/// What zlib makes of a byte at most.
constexpr std::uint64_t kLargestExpansion = 1032;
/// NanoVDB compresses with Blosc in pieces of this size.
constexpr std::uint64_t kBloscPiece = std::uint64_t(1) << 30;

template <class Build>
using OpenGrid = typename decltype(nanovdb::nanoToOpenVDB(std::declval<const nanovdb::NanoGrid<Build>&>(),
                                                          0))::element_type;

template <class Build>
openvdb::GridBase::Ptr emptyGrid() {
  return OpenGrid<Build>::create();
}

template <class Build>
openvdb::GridBase::Ptr convert(Buffer& buffer) {
  NanoNodes<Build>(buffer.data(), buffer.size()).check();
  auto* grid = reinterpret_cast<nanovdb::NanoGrid<Build>*>(buffer.data());
  if (grid->checksum() != nanovdb::GridChecksum::EMPTY &&
      !nanovdb::validateChecksum(*grid, nanovdb::ChecksumMode::Full))
    throw Error("damaged: its checksum is wrong");
  // Its name comes from the file's table of contents; here it may lie anywhere.
  auto* data = reinterpret_cast<nanovdb::GridData*>(buffer.data());
  data->setLongGridNameOn(false);
  data->mGridName[0] = '\0';
  try {
    return nanovdb::nanoToOpenVDB(*grid);
  } catch (const openvdb::Exception&) {
    throw Error("its transform has no inverse, or its voxels are too small");
  }
}

struct ValueType {
  nanovdb::GridType type;
  openvdb::GridBase::Ptr (*empty)();
  openvdb::GridBase::Ptr (*convert)(Buffer& buffer);
};

template <class Build>
constexpr ValueType valueType(nanovdb::GridType type) {
  return {type, emptyGrid<Build>, convert<Build>};
}

constexpr std::array<ValueType, 8> kValueTypes = {{
    valueType<float>(nanovdb::GridType::Float),
    valueType<double>(nanovdb::GridType::Double),
    valueType<nanovdb::Fp4>(nanovdb::GridType::Fp4),
    valueType<nanovdb::Fp8>(nanovdb::GridType::Fp8),
    valueType<nanovdb::Fp16>(nanovdb::GridType::Fp16),
    valueType<nanovdb::FpN>(nanovdb::GridType::FpN),
    valueType<nanovdb::Vec3f>(nanovdb::GridType::Vec3f),
    valueType<std::int32_t>(nanovdb::GridType::Int32),
}};

std::string nameOf(nanovdb::GridType type) {
  return type < nanovdb::GridType::End ? nanovdb::toStr(type) : fmt::format("type {}", std::uint32_t(type));
}

void unzip(FileBytes& bytes, std::uint64_t compressed, Buffer& target) {
  std::vector<char> block(compressed);
  bytes.sgetn(block.data(), std::streamsize(block.size()));
  uLongf size = target.size();
  const int status =
      uncompress(target.data(), &size, reinterpret_cast<const Bytef*>(block.data()), compressed);
  if (status != Z_OK || size != target.size()) throw Error("damaged: it cannot be decompressed");
}

void unblosc(const std::vector<char>& block, char* target, std::uint64_t size) {
  checkBloscHeader(block.data(), std::int64_t(block.size()), std::int64_t(size));
  if (blosc_decompress_ctx(block.data(), target, size, 1) != std::int64_t(size))
    throw Error("damaged: it cannot be decompressed");
}

/// The grid that stands in the next `stored` bytes.
Buffer readGrid(FileBytes& bytes, std::uint64_t stored, std::uint64_t size, nanovdb::io::Codec codec) {
  const auto take = [&](std::uint64_t room) {
    const auto length = room < sizeof(std::uint64_t) ? room : bytes.take<std::uint64_t>();
    if (room < sizeof(length) || length > room - sizeof(length))
      throw Error("damaged: a compressed block is longer than its grid");
    return length;
  };
  const std::uint64_t expansion = codec == nanovdb::io::Codec::NONE ? 1 : kLargestExpansion;
  if (size / expansion > stored || size < sizeof(nanovdb::GridData))
    throw Error(fmt::format("damaged: {} bytes stand for {}", stored, size));
  Buffer buffer = Buffer::create(size);
  switch (codec) {
    case nanovdb::io::Codec::NONE:
      bytes.sgetn(reinterpret_cast<char*>(buffer.data()), std::streamsize(size));
      break;
    case nanovdb::io::Codec::ZIP:
      unzip(bytes, take(stored), buffer);
      break;
    case nanovdb::io::Codec::BLOSC:
      for (std::uint64_t done = 0; done < size; done += kBloscPiece) {
        std::vector<char> block(take(stored));
        stored -= sizeof(std::uint64_t) + block.size();
        bytes.sgetn(block.data(), std::streamsize(block.size()));
        unblosc(block, reinterpret_cast<char*>(buffer.data()) + done, std::min(kBloscPiece, size - done));
      }
      break;
    default:
      throw Error(fmt::format("damaged: unknown compression {}", int(codec)));
  }
  return buffer;
}

class NanoArchive {
 public:
  explicit NanoArchive(const std::string& path) : bytes_(path) {}

  std::vector<openvdb::GridBase::Ptr> read(const WantedGrid& wanted) {
    while (bytes_.left() > 0) readSegment(wanted);
    if (result_.empty() && !unsupported_.empty())
      throw Error(fmt::format("no grid of a type that can be read; it holds {} values", unsupported_));
    return std::move(result_);
  }

 private:
  struct Entry {
    nanovdb::io::MetaData data;
    std::string name;
  };

  void readSegment(const WantedGrid& wanted) {
    const auto header = bytes_.take<nanovdb::io::Header>();
    if (header.magic != NANOVDB_MAGIC_NUMBER) throw Error("not a NanoVDB file");
    if (header.version.getMajor() != NANOVDB_MAJOR_VERSION_NUMBER)
      throw Error(
          fmt::format("NanoVDB file of version {}.{}.{}, but {}.x is needed; convert it again from its .vdb",
                      header.version.getMajor(), header.version.getMinor(), header.version.getPatch(),
                      NANOVDB_MAJOR_VERSION_NUMBER));
    std::vector<Entry> entries;
    for (int i = 0; i < header.gridCount; ++i) {
      Entry entry;
      entry.data = bytes_.take<nanovdb::io::MetaData>();
      if (entry.data.nameSize == 0 || entry.data.nameSize > bytes_.left())
        throw Error("the file is cut short or damaged: its grid header does not fit");
      entry.name.resize(entry.data.nameSize);
      bytes_.sgetn(entry.name.data(), std::streamsize(entry.name.size()));
      if (entry.name.back() != '\0') throw Error("damaged: a grid's name does not end");
      entry.name.resize(std::strlen(entry.name.c_str()));
      entries.push_back(std::move(entry));
    }
    for (const Entry& entry : entries) {
      if (entry.data.fileSize > std::uint64_t(bytes_.left()))
        throw Error(fmt::format("the file is cut short: its grids end after byte {}, the file at byte {}",
                                std::uint64_t(bytes_.position()) + entry.data.fileSize, bytes_.size()));
      const std::int64_t end = bytes_.position() + std::int64_t(entry.data.fileSize);
      try {
        readEntry(entry, header.codec, wanted);
      } catch (const Error& error) {
        throw Error(fmt::format("grid '{}': {}", entry.name, error.what()));
      }
      bytes_.moveTo(end);
    }
  }

  void readEntry(const Entry& entry, nanovdb::io::Codec codec, const WantedGrid& wanted) {
    const auto* type = std::find_if(kValueTypes.begin(), kValueTypes.end(), [&](const ValueType& known) {
      return known.type == entry.data.gridType;
    });
    if (type == kValueTypes.end()) {
      unsupported_ = nameOf(entry.data.gridType);
      return;
    }
    openvdb::GridBase::Ptr grid = type->empty();
    if (wanted(*grid, entry.name)) {
      Buffer buffer = readGrid(bytes_, entry.data.fileSize, entry.data.gridSize, codec);
      const auto* data = reinterpret_cast<const nanovdb::GridData*>(buffer.data());
      if (data->mMagic != NANOVDB_MAGIC_NUMBER) throw Error("damaged: it does not start with NanoVDB's mark");
      if (data->mGridType != type->type || data->mGridClass >= nanovdb::GridClass::End)
        throw Error(fmt::format("damaged: its values are of {}, not {}", nameOf(data->mGridType),
                                nameOf(type->type)));
      grid = type->convert(buffer);
    }
    grid->setName(entry.name);
    result_.push_back(grid);
  }

  FileBytes bytes_;
  std::vector<openvdb::GridBase::Ptr> result_;
  std::string unsupported_;
};

}  // namespace

std::vector<openvdb::GridBase::Ptr> readNanoVdb(const std::string& path, const WantedGrid& wanted) {
  return NanoArchive(path).read(wanted);
}

}  // namespace nephele::detail
