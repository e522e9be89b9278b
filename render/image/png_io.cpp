// PNG files, through libpng.
#include "nephele/render/image/png_io.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string_view>

#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/render/image/image_file.h"

namespace nephele {

namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

// libpng reports errors through a callback that must not return; it is C++ all the way up here, so it throws.
[[noreturn]] void fail(png_structp, png_const_charp message) {
  throw Error(fmt::format("is damaged: {}", message));
}
[[noreturn]] void failToWrite(png_structp, png_const_charp message) {
  throw Error(message);
}
void writeBytes(png_structp png, png_bytep bytes, std::size_t count) {
  static_cast<OutputStream*>(png_get_io_ptr(png))->write({reinterpret_cast<const char*>(bytes), count});
}
void flushBytes(png_structp) {}
void ignore(png_structp, png_const_charp) {}

// What libpng holds of a file.
struct Handle {
  explicit Handle(png_structp made) : png(made), info(png_create_info_struct(made)) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  png_structp png;
  png_infop info;
};

/// Chunks are as long as they say, which libpng believes before it reads them. Up to the pixels: those come
/// row by row.
void requireWholeHeader(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = std::int64_t(file.tellg());
  for (std::int64_t at = 8; at + 8 <= size;) {
    std::array<unsigned char, 8> head{};
    file.seekg(at);
    file.read(reinterpret_cast<char*>(head.data()), head.size());
    const std::int64_t length = std::int64_t(head[0]) << 24 | head[1] << 16 | head[2] << 8 | head[3];
    require(file.good() && length <= size - at - 12, "is damaged: a chunk is longer than the file");
    if (std::string_view(reinterpret_cast<char*>(head.data()) + 4, 4) == "IDAT") return;
    at += length + 12;
  }
}

// What the file says of its numbers, the most exact first; sRGB where it says nothing.
std::array<TransferCurve, 3> curvesOf(png_structp png, png_infop info) {
  std::array<TransferCurve, 3> curves;
  png_charp name = nullptr;
  png_bytep profile = nullptr;
  png_uint_32 size = 0;
  int compression = 0, intent = 0;
  double gamma = 0;
  if (png_get_iCCP(png, info, &name, &compression, &profile, &size))
    if (const auto described = TransferCurve::ofProfile({profile, size})) return *described;
  curves.fill(TransferCurve::srgb());
  if (!png_get_sRGB(png, info, &intent) && png_get_gAMA(png, info, &gamma) && gamma > 0)
    curves.fill(TransferCurve::power(float(1 / gamma)));
  return curves;
}

/// The chunk that holds `text` as it is: plain ones are in Latin-1, which agrees with UTF-8 for ASCII alone.
int textKind(std::string_view text) {
  const bool isAscii = std::all_of(text.begin(), text.end(), [](char c) { return (c & 0x80) == 0; });
  return !isAscii && isUtf8(text) ? PNG_ITXT_COMPRESSION_NONE : PNG_TEXT_COMPRESSION_NONE;
}

/// A text of a file in UTF-8. Plain ones are Latin-1, but many programs write UTF-8 there.
std::string utf8Of(const png_text& text) {
  const std::string value = text.text ? text.text : "";
  if (text.compression >= PNG_ITXT_COMPRESSION_NONE || isUtf8(value)) return value;
  std::string result;
  for (const char c : value) {
    const auto code = static_cast<unsigned char>(c);
    if (code >= 0x80) result += static_cast<char>(0xc0 | code >> 6);
    result += static_cast<char>(code < 0x80 ? code : 0x80 | (code & 0x3f));
  }
  return result;
}

struct Writer : Handle {
  Writer() : Handle(png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, failToWrite, ignore)) {}
  ~Writer() { png_destroy_write_struct(&png, &info); }
};

struct Reader : Handle {
  Reader() : Handle(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, ignore)) {}
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
};

}  // namespace

void writePng(const std::string& path, const Image& image, const ViewTransform& view,
              const std::map<std::string, std::string>& metadata) {
  OutputFile output(path);
  OutputStream stream(output);
  try {
    const auto width = std::size_t(image.width);
    const std::vector<std::uint8_t> bytes = screenBytes(image, view);
    const Writer writer;
    png_set_write_fn(writer.png, &stream, writeBytes, flushBytes);
    png_set_IHDR(writer.png, writer.info, png_uint_32(image.width), png_uint_32(image.height), 8,
                 PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    // Pictures of clouds become as small as by libpng's defaults, in half the time.
    png_set_filter(writer.png, PNG_FILTER_TYPE_DEFAULT, PNG_FILTER_SUB);
    png_set_compression_level(writer.png, 4);
    if (!view.configView && view.curve == ViewCurve::raw)
      png_set_gAMA(writer.png, writer.info, 1.0);
    else if (!view.configView)
      png_set_sRGB(writer.png, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
    auto texts = metadata;
    texts["view_transform"] = view.name();
    for (const auto& [name, value] : texts) {
      // libpng takes its texts by pointers that are not const, and copies them.
      png_text text{};
      text.compression = textKind(value);
      text.key = const_cast<char*>(name.c_str());
      text.text = const_cast<char*>(value.c_str());
      png_set_text(writer.png, writer.info, &text, 1);
    }
    png_write_info(writer.png, writer.info);
    for (std::size_t y = 0; y != std::size_t(image.height); ++y)
      png_write_row(writer.png, bytes.data() + y * width * 3);
    png_write_end(writer.png, nullptr);
  } catch (const Error& error) {
    stream.requireWritten();
    throw Error(fmt::format("{}: cannot be written: {}", path, error.what()));
  }
  stream.close();
  output.commit();
}

void detail::readPngFile(const std::string& path, const ImageReader& reader) {
  try {
    const File file(std::fopen(path.c_str(), "rb"));
    require(file != nullptr, "cannot be opened");
    requireWholeHeader(path);
    const auto fileSize = double(std::filesystem::file_size(path));
    const Reader png;
    // Texts and profiles may be packed a thousandfold.
    png_set_chunk_malloc_max(png.png, 1 << 22);
    png_set_chunk_cache_max(png.png, 256);
    png_init_io(png.png, file.get());
    png_read_info(png.png, png.info);
    const int depth = png_get_bit_depth(png.png, png.info);
    ImageHeader header;
    header.format = "PNG";
    header.width = int(png_get_image_width(png.png, png.info));
    header.height = int(png_get_image_height(png.png, png.info));
    png_set_expand(png.png);
    const bool interlaced = png_set_interlace_handling(png.png) > 1;
    png_read_update_info(png.png, png.info);
    const std::size_t count = png_get_channels(png.png, png.info);
    requireSize(path, header.width, header.height, (long long)(count));
    // Of what is packed, a byte makes no more than 1032: the limit of deflate.
    const double packed = double(png_get_rowbytes(png.png, png.info)) * header.height /
                          (depth < 8 ? 8.0 / depth : 1.0) / double(count);
    require(packed <= 1032 * fileSize, fmt::format("is damaged: {} bytes cannot hold {} x {} pixels",
                                                   fileSize, header.width, header.height));
    const char* names[4][4] = {{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
    for (std::size_t c = 0; c != count; ++c)
      header.channels.push_back({names[count - 1][c], depth == 16 ? "uint16" : "uint8"});
    png_textp texts = nullptr;
    const int textCount = png_get_text(png.png, png.info, &texts, nullptr);
    for (int i = 0; i < textCount; ++i) header.attributes.emplace_back(texts[i].key, utf8Of(texts[i]));
    header.curves = curvesOf(png.png, png.info);
    header.isPremultiplied = false;
    reader.begin(header);

    const std::size_t rowBytes = png_get_rowbytes(png.png, png.info);
    // An interlaced file is whole only after its last pass.
    const double held = double(rowBytes) * header.height;
    require(!interlaced || held <= reader.mostBytes,
            fmt::format("is interlaced: its pixels need {:.0f} MB of memory, and {:.0f} MB is the limit",
                        held / 1e6, reader.mostBytes / 1e6));
    std::vector<std::uint8_t> bytes(rowBytes * (interlaced ? std::size_t(header.height) : 1));
    if (interlaced) {
      std::vector<png_bytep> rows;
      for (int y = 0; y != header.height; ++y) rows.push_back(bytes.data() + std::size_t(y) * rowBytes);
      png_read_image(png.png, rows.data());
    }
    std::vector<float> values(std::size_t(header.width) * count);
    for (int y = 0; y != header.height; ++y) {
      if (!interlaced) png_read_row(png.png, bytes.data(), nullptr);
      const std::uint8_t* from = bytes.data() + (interlaced ? std::size_t(y) * rowBytes : 0);
      for (std::size_t i = 0; i != values.size(); ++i)
        values[i] =
            depth == 16 ? float(from[2 * i] * 256 + from[2 * i + 1]) / 65535.0f : float(from[i]) / 255.0f;
      reader.row(y, values.data());
    }
    png_read_end(png.png, nullptr);
  } catch (const std::bad_alloc&) {
    throw Error(path + ": its pixels need more memory than there is");
  } catch (const Error& error) {
    const std::string what = error.what();
    throw Error(what.starts_with(path) ? what : fmt::format("{}: {}", path, what));
  }
}

}  // namespace nephele
