// Source: "OpenEXR File Layout" and "Multi-View and Deep Data" of the OpenEXR documentation.
#include "nephele/render/image/detail/exr_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <string_view>

#include "nephele/levelset/io/file_bytes.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele::detail {
namespace {

constexpr std::uint32_t kTiled = 0x200, kLongNames = 0x400, kDeep = 0x800, kMultiPart = 0x1000;

struct Compression {
  int lines;
  /// No more bytes come out for each that goes in: 1032 is what deflate reaches, and wavelets and cosines
  /// of constants leave one number of 64.
  std::int64_t ratio;
};
constexpr std::array kCompressions{
    Compression{1, 1},          Compression{1, 128},        Compression{1, 1032}, Compression{16, 1032},
    Compression{32, 64 * 1032}, Compression{16, 1032},      Compression{32, 64},  Compression{32, 64},
    Compression{32, 64 * 1032}, Compression{256, 64 * 1032}};

struct Window {
  std::int64_t minX = 0, minY = 0, maxX = -1, maxY = -1;

  std::int64_t width() const { return maxX - minX + 1; }
  std::int64_t height() const { return maxY - minY + 1; }
};

struct Tiles {
  std::int64_t width, height;
  int levels;
  bool roundsUp;
};

struct Part {
  Window data, display;
  std::int64_t bytesPerPixel = 0;
  std::size_t compression = 0;
  std::optional<Tiles> tiles;
  std::string type;
  std::int64_t chunks = 0;
  std::vector<std::uint64_t> offsets;

  bool isDeep() const { return type.starts_with("deep"); }
  bool isTiled() const { return tiles && type != "scanlineimage" && type != "deepscanline"; }
};

std::int64_t dividedUp(std::int64_t a, std::int64_t b) {
  return (a + b - 1) / b;
}

class Follower {
 public:
  explicit Follower(const std::string& path) : bytes_(path), file_(path, std::ios::binary) {}

  ExrCheck follow() {
    require(bytes_.left() >= 8 && bytes_.take<std::uint32_t>() == 20000630u, "is not a whole OpenEXR file");
    const auto version = bytes_.take<std::uint32_t>();
    require((version & 0xff) == 2,
            fmt::format("is OpenEXR of version {}, which is not read", version & 0xff));
    require((version & ~(0xffu | kTiled | kLongNames | kDeep | kMultiPart)) == 0,
            "is of a kind of OpenEXR that is not known");
    std::vector<Part> parts;
    const bool isMultiPart = (version & kMultiPart) != 0;
    do {
      parts.push_back(header());
      Part& part = parts.back();
      if (part.type.empty())
        part.type = (version & kDeep) != 0    ? "deepscanline"
                    : (version & kTiled) != 0 ? "tiledimage"
                                              : "scanlineimage";
    } while (isMultiPart && !endsHere());
    for (Part& part : parts) {
      require(part.chunks <= bytes_.left() / 8, damaged("its table of chunks is longer than the file"));
      part.offsets.resize(std::size_t(part.chunks));
      for (std::uint64_t& offset : part.offsets) offset = bytes_.take<std::uint64_t>();
    }
    ExrCheck result{parts.front().isDeep(), 0};
    for (const Part& part : parts) {
      const std::int64_t sampleBytes = checkChunks(part, isMultiPart);
      if (&part == &parts.front()) result.sampleBytes = sampleBytes;
    }
    return result;
  }

 private:
  static std::string damaged(std::string_view what) { return fmt::format("is damaged: {}", what); }

  bool endsHere() {
    if (bytes_.sgetc() != 0) return false;
    bytes_.skip(1);
    return true;
  }

  std::string name() {
    std::string result;
    while (const char c = bytes_.take<char>()) {
      result += c;
      require(result.size() < 256, damaged("a name in its header has no end"));
    }
    return result;
  }

  Part header() {
    Part part;
    bool hasChannels = false, hasData = false, hasDisplay = false, hasCompression = false;
    for (std::string attribute = name(); !attribute.empty(); attribute = name()) {
      const std::string type = name();
      const std::int64_t size = bytes_.take<std::int32_t>();
      require(size >= 0 && size <= bytes_.left(),
              damaged(fmt::format("an attribute is said to be of {} bytes", size)));
      const std::int64_t end = bytes_.position() + size;
      const auto is = [&](std::string_view wantedName, std::string_view wantedType, std::int64_t wantedSize) {
        if (attribute != wantedName) return false;
        require(type == wantedType && (wantedSize == 0 || size == wantedSize),
                damaged(fmt::format("attribute {} is no {}", wantedName, wantedType)));
        return true;
      };
      if (is("channels", "chlist", 0)) {
        part.bytesPerPixel = channels(end);
        hasChannels = true;
      } else if (is("dataWindow", "box2i", 16)) {
        part.data = window();
        hasData = true;
      } else if (is("displayWindow", "box2i", 16)) {
        part.display = window();
        hasDisplay = true;
      } else if (is("compression", "compression", 1)) {
        part.compression = bytes_.take<std::uint8_t>();
        require(part.compression < kCompressions.size(), "is compressed in a way that is not known");
        hasCompression = true;
      } else if (is("tiles", "tiledesc", 9)) {
        part.tiles = tiles();
      } else if (is("type", "string", 0)) {
        require(size < 256, damaged("attribute type is too long"));
        part.type.resize(std::size_t(size));
        bytes_.sgetn(part.type.data(), size);
      } else if (type == "preview") {
        require(size >= 8, damaged("a preview is too short"));
        const std::int64_t across = bytes_.take<std::uint32_t>(), down = bytes_.take<std::uint32_t>();
        require(across < (1 << 20) && down < (1 << 20) && size == 8 + 4 * across * down,
                damaged("a preview is not of its size"));
      } else if (type == "stringvector") {
        while (bytes_.position() < end) {
          const std::int64_t length = end - bytes_.position() >= 4 ? bytes_.take<std::int32_t>() : -1;
          require(length >= 0 && length <= end - bytes_.position(), damaged("a list of texts is cut short"));
          bytes_.skip(length);
        }
      }
      bytes_.moveTo(end);
    }
    require(hasChannels && hasData && hasDisplay && hasCompression,
            damaged("its header lacks channels, windows or compression"));
    part.chunks = chunkCount(part);
    return part;
  }

  std::int64_t channels(std::int64_t end) {
    constexpr std::array<std::int64_t, 3> kSizes{4, 2, 4};
    std::int64_t sum = 0;
    for (std::string channel = name(); !channel.empty(); channel = name()) {
      const auto type = bytes_.take<std::int32_t>();
      bytes_.skip(4);
      const auto xSampling = bytes_.take<std::int32_t>(), ySampling = bytes_.take<std::int32_t>();
      require(type >= 0 && type < 3 && xSampling > 0 && ySampling > 0,
              damaged("a channel is of no known type"));
      sum += kSizes[std::size_t(type)];
    }
    require(bytes_.position() == end, damaged("its list of channels is not of its length"));
    return sum;
  }

  Window window() {
    // OpenEXR computes with sums of these in 32 bits.
    constexpr std::int64_t kFar = 1 << 29, kMost = 1 << 20;
    Window w;
    for (std::int64_t* side : {&w.minX, &w.minY, &w.maxX, &w.maxY}) {
      *side = bytes_.take<std::int32_t>();
      require(std::abs(*side) < kFar, damaged("a window lies too far away"));
    }
    require(w.width() > 0 && w.height() > 0, "holds no pixels");
    require(w.width() <= kMost && w.height() <= kMost,
            damaged(fmt::format("a window of {} x {} pixels", w.width(), w.height())));
    return w;
  }

  Tiles tiles() {
    const std::int64_t width = bytes_.take<std::uint32_t>(), height = bytes_.take<std::uint32_t>();
    const auto mode = bytes_.take<std::uint8_t>();
    require(
        width > 0 && height > 0 && width <= 65536 && height <= 65536 && (mode & 15) < 3 && (mode >> 4) < 2,
        damaged("its tiles are of an impossible size or kind"));
    return {width, height, mode & 15, (mode >> 4) == 1};
  }

  static std::int64_t chunkCount(const Part& part) {
    const std::int64_t width = part.data.width(), height = part.data.height();
    if (!part.isTiled()) return dividedUp(height, kCompressions[part.compression].lines);
    const Tiles& tiles = *part.tiles;
    const auto sizes = [&](std::int64_t size, bool until) {
      std::vector<std::int64_t> result{size};
      while (tiles.levels > 0 && until && result.back() > 1)
        result.push_back(std::max<std::int64_t>(1, (result.back() + (tiles.roundsUp ? 1 : 0)) / 2));
      return result;
    };
    std::vector<std::int64_t> across = sizes(width, true), down = sizes(height, true);
    const auto tilesOf = [&](std::int64_t w, std::int64_t h) {
      return dividedUp(w, tiles.width) * dividedUp(h, tiles.height);
    };
    std::int64_t count = 0;
    if (tiles.levels == 2) {
      for (const std::int64_t h : down)
        for (const std::int64_t w : across) count += tilesOf(w, h);
      return count;
    }
    const std::size_t levels = std::max(across.size(), down.size());
    across.resize(levels, 1);
    down.resize(levels, 1);
    for (std::size_t level = 0; level != levels; ++level) count += tilesOf(across[level], down[level]);
    return count;
  }

  template <class T>
  T at(std::int64_t& position) {
    T value{};
    file_.seekg(position);
    file_.read(reinterpret_cast<char*>(&value), sizeof(value));
    require(file_.good(), damaged("a chunk of pixels is cut short"));
    position += sizeof(value);
    return value;
  }

  /// Returns what the samples of a deep part take.
  std::int64_t checkChunks(const Part& part, bool isMultiPart) {
    const Compression& compression = kCompressions[part.compression];
    const std::int64_t pixels =
        part.isTiled() ? part.tiles->width * part.tiles->height
                       : part.data.width() * std::min<std::int64_t>(compression.lines, part.data.height());
    const std::int64_t bytes = pixels * (part.isDeep() ? 4 : part.bytesPerPixel);
    // Chunks at the edges hold fewer pixels, the last one perhaps one line, and levels a single one.
    const std::int64_t least = part.isTiled() ? 0 : bytes / compression.lines / compression.ratio;
    require(bytes <= compression.ratio * bytes_.size(),
            damaged(fmt::format("chunks of {} bytes cannot be in a file of {}", bytes, bytes_.size())));
    std::int64_t sampleBytes = 0;
    const std::int64_t first = bytes_.position();
    for (const std::uint64_t offset : part.offsets) {
      require(offset >= std::uint64_t(first) && offset < std::uint64_t(bytes_.size()),
              damaged("a chunk of pixels is missing"));
      auto position = std::int64_t(offset) + (isMultiPart ? 4 : 0) + (part.isTiled() ? 16 : 4);
      std::array<std::int64_t, 2> sizes{};
      if (part.isDeep()) {
        sizes = {at<std::int64_t>(position), at<std::int64_t>(position)};
        const auto unpacked = at<std::int64_t>(position);
        require(sizes[1] >= 0 && sizes[1] <= bytes_.size() && unpacked >= 0 &&
                    unpacked <= compression.ratio * sizes[1],
                damaged("the samples of a chunk are more than it can hold"));
        sampleBytes += unpacked;
      } else {
        sizes[0] = at<std::int32_t>(position);
      }
      for (const std::int64_t size : sizes)
        require(size >= 0 && size <= bytes_.size() - position, damaged("a chunk of pixels is cut short"));
      require(sizes[0] >= least, damaged("a chunk of pixels is shorter than its pixels can be"));
    }
    return sampleBytes;
  }

  FileBytes bytes_;
  std::ifstream file_;
};

}  // namespace

ExrCheck checkExr(const std::string& path) {
  requireWholeName(path);
  return namingFile(path, [&] { return Follower(path).follow(); });
}

}  // namespace nephele::detail
