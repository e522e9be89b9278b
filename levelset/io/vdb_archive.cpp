// Reading .vdb files with every byte accounted for.
//
// OpenVDB trusts its files. One that was cut short reads as zeros where the cut falls into raw data, and a
// damaged length makes it write past its buffers: a block that was stored uncompressed is read with the
// length that stands before it in the file, whatever the size of the place it goes to. So OpenVDB parses here
// from a stream of our own over the bytes of the file, which throws where a read leaves the file, and where
// such a raw block is longer than any node. The table of contents is compared with the length of the file
// first. Damage that keeps to plausible lengths is not seen.
#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <istream>
#include <streambuf>
#include <string_view>
#include <vector>

#include "nephele/levelset/io/detail/openvdb_grid.h"

namespace nephele::detail {

namespace {

/// The largest node, 32^3 vectors of three doubles, and some.
constexpr std::int64_t kLargestRawBlock = std::int64_t(1) << 20;

/// The bytes of a file as a stream that throws rather than end. Only a window of the file is in memory.
class FileBytes final : public std::streambuf {
 public:
  explicit FileBytes(const std::string& path)
      : file_(path, std::ios::binary | std::ios::ate), window_(std::size_t(kWindow)) {
    size_ = file_ ? std::int64_t(file_.tellg()) : -1;
    if (size_ < 0) throw Error("cannot be read");
    moveTo(0);
  }

  std::int64_t size() const { return size_; }
  /// What is left in the window, to be asked at the beginning of the file.
  bool startsWith(std::string_view text) {
    if (gptr() == egptr() && size_ > 0) fill();
    return std::string_view(gptr(), std::size_t(egptr() - gptr())).starts_with(text);
  }

 protected:
  int_type underflow() override {
    if (position() >= size_) failShort();
    fill();
    return traits_type::to_int_type(*gptr());
  }

  std::streamsize xsgetn(char* target, std::streamsize count) override {
    if (count < 0 || count > size_ - position()) failShort();
    // Blocks that could not be compressed stand after minus their length.
    if (lastNumber_ < -kLargestRawBlock && count == -lastNumber_)
      throw Error("damaged: a block of values is longer than any node");
    const std::streamsize there = std::min<std::streamsize>(count, egptr() - gptr());
    std::memcpy(target, gptr(), std::size_t(there));
    setg(eback(), gptr() + there, egptr());
    if (const std::streamsize rest = count - there; rest >= kWindow) {
      readAt(position(), target + there, rest);
      moveTo(position() + rest);
    } else if (rest > 0) {
      fill();
      std::memcpy(target + there, gptr(), std::size_t(rest));
      setg(eback(), gptr() + rest, egptr());
    }
    lastNumber_ = 0;
    if (count == sizeof(lastNumber_)) std::memcpy(&lastNumber_, target, sizeof(lastNumber_));
    return count;
  }

  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type base = from == std::ios::beg   ? 0
                          : from == std::ios::cur ? off_type(position())
                                                  : off_type(size_);
    if (offset > off_type(size_) - base || offset < -base) failShort();
    const std::int64_t target = base + offset;
    if (target >= start_ && target <= start_ + (egptr() - eback()))
      setg(eback(), eback() + (target - start_), egptr());
    else
      moveTo(target);
    return target;
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode mode) override {
    return seekoff(off_type(position), std::ios::beg, mode);
  }

 private:
  static constexpr std::int64_t kWindow = std::int64_t(1) << 20;

  std::int64_t position() const { return start_ + (gptr() - eback()); }

  [[noreturn]] void failShort() const {
    throw Error(fmt::format("the file is cut short: it ends after {} bytes", size_));
  }

  /// An empty window at `position`.
  void moveTo(std::int64_t position) {
    start_ = position;
    setg(window_.data(), window_.data(), window_.data());
  }
  /// A full window at the present position.
  void fill() {
    moveTo(position());
    const std::int64_t count = std::min(kWindow, size_ - start_);
    readAt(start_, window_.data(), count);
    setg(window_.data(), window_.data(), window_.data() + count);
  }
  void readAt(std::int64_t position, char* target, std::int64_t count) {
    file_.seekg(position);
    file_.read(target, count);
    // It was longer when it was opened.
    if (!file_) throw Error(fmt::format("the file is cut short: it ends before byte {}", position + count));
  }

  std::ifstream file_;
  std::vector<char> window_;
  /// Where in the file the window begins.
  std::int64_t start_ = 0;
  std::int64_t size_ = 0;
  std::int64_t lastNumber_ = 0;
};

class VdbArchive : public openvdb::io::Archive {
 public:
  explicit VdbArchive(const std::string& path) : bytes_(path), stream_(&bytes_) {
    stream_.exceptions(std::ios::badbit | std::ios::failbit);
    checkMagic();
    // Holds what readers of values need to know of the file.
    metadata_ = std::make_shared<openvdb::io::StreamMetadata>(stream_);
    openvdb::io::setStreamMetadataPtr(stream_, metadata_, /*transfer=*/false);
    readHeader(stream_);
    setFormatVersion(stream_);
    setLibraryVersion(stream_);
    setDataCompression(stream_);
    openvdb::MetaMap fileMetadata;
    fileMetadata.readMeta(stream_);
    gridCount_ = readGridCount(stream_);
    if (gridCount_ < 0) throw Error(fmt::format("damaged: it claims to hold {} grids", gridCount_));
  }

  /// Every grid; those that `wanted` leaves out by type and name come without values.
  std::vector<openvdb::GridBase::Ptr> read(const WantedGrid& wanted) {
    std::vector<openvdb::GridBase::Ptr> result;
    NamedGridMap byName;
    std::vector<openvdb::io::GridDescriptor> descriptors;
    for (std::int32_t i = 0; i < gridCount_; ++i) {
      openvdb::io::GridDescriptor descriptor;
      openvdb::GridBase::Ptr grid = descriptor.read(stream_);
      if (inputHasGridOffsets()) checkOffsets(descriptor);
      // Without offsets the way to the next grid leads through this one; others may share the tree of this
      // one.
      if (!inputHasGridOffsets() || wanted(*grid, descriptor.gridName())) {
        if (inputHasGridOffsets()) descriptor.seekToGrid(stream_);
        readGrid(grid, descriptor, stream_);
      }
      if (inputHasGridOffsets()) descriptor.seekToEnd(stream_);
      grid->setName(descriptor.gridName());
      byName[descriptor.uniqueName()] = grid;
      descriptors.push_back(descriptor);
      result.push_back(grid);
    }
    for (const auto& descriptor : descriptors) connectInstance(descriptor, byName);
    return result;
  }

 private:
  void checkMagic() {
    if (bytes_.startsWith("version https://git-lfs"))
      throw Error("not a VDB file but a Git LFS pointer; fetch the real file with 'git lfs pull'");
    std::int32_t magic = 0;
    if (bytes_.size() >= std::int64_t(sizeof(magic))) {
      stream_.read(reinterpret_cast<char*>(&magic), sizeof(magic));
      stream_.seekg(0);
    }
    if (magic != openvdb::OPENVDB_MAGIC) throw Error("not a VDB file");
  }

  void checkOffsets(const openvdb::io::GridDescriptor& descriptor) const {
    if (descriptor.getGridPos() <= 0 || descriptor.getGridPos() > descriptor.getEndPos())
      throw Error(fmt::format("damaged: grid '{}' has impossible offsets", descriptor.gridName()));
    if (descriptor.getEndPos() > bytes_.size())
      throw Error(fmt::format("the file is cut short: grid '{}' ends at byte {}, the file at byte {}",
                              descriptor.gridName(), descriptor.getEndPos(), bytes_.size()));
  }

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
