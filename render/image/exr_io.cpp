// OpenEXR files.
#include "nephele/render/image/exr_io.h"

#include <Imath/ImathMatrix.h>
#include <OpenEXR/ImfBoxAttribute.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/render/image/detail/exr_check.h"
#include "nephele/render/image/detail/exr_header.h"
#include "nephele/render/image/detail/exr_stream.h"
#include "nephele/render/image/image_file.h"

namespace nephele {

namespace {

Imath::M44f matrix(const Mat44& m) {
  Imath::M44f result;
  for (int row = 0; row != 4; ++row)
    for (int column = 0; column != 4; ++column) result[row][column] = m[std::size_t(row * 4 + column)];
  return result;
}

Mat44 numbers(const Imath::M44f& m) {
  Mat44 result;
  for (int i = 0; i != 16; ++i) result[std::size_t(i)] = m[i / 4][i % 4];
  return result;
}

half toHalf(float value) {
  constexpr float most = 65504.0f;
  return half(std::isnan(value) ? 0.0f : std::clamp(value, -most, most));
}

std::string windowText(const Imath::Box2i& box) {
  return fmt::format("{} x {} at {},{}", (long long)(box.max.x) - box.min.x + 1,
                     (long long)(box.max.y) - box.min.y + 1, box.min.x, box.min.y);
}

// A value for a person, or "" for kinds that have no short one.
std::string attributeText(const Imf::Attribute& attribute) {
  if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute)) return text->value();
  if (const auto* number = dynamic_cast<const Imf::FloatAttribute*>(&attribute))
    return fmt::format("{:g}", number->value());
  if (const auto* whole = dynamic_cast<const Imf::IntAttribute*>(&attribute))
    return std::to_string(whole->value());
  if (const auto* box = dynamic_cast<const Imf::Box2iAttribute*>(&attribute)) return windowText(box->value());
  if (const auto* colour = dynamic_cast<const Imf::ChromaticitiesAttribute*>(&attribute)) {
    const Imf::Chromaticities& c = colour->value();
    return fmt::format("red {:g},{:g} green {:g},{:g} blue {:g},{:g} white {:g},{:g}", c.red.x, c.red.y,
                       c.green.x, c.green.y, c.blue.x, c.blue.y, c.white.x, c.white.y);
  }
  if (const auto* m = dynamic_cast<const Imf::M44fAttribute*>(&attribute)) {
    std::string text;
    for (int i = 0; i != 16; ++i)
      text += fmt::format("{}{:g}", i == 0 ? "" : i % 4 == 0 ? "; " : " ", m->value()[i / 4][i % 4]);
    return text;
  }
  return {};
}

const char* typeName(Imf::PixelType type) {
  return type == Imf::HALF ? "half" : type == Imf::FLOAT ? "float" : "uint32";
}

}  // namespace

detail::ImageHeader detail::imageHeader(const std::string& path, const Imf::Header& header) {
  ImageHeader result;
  result.format = "OpenEXR";
  const Imath::Box2i& window = header.dataWindow();
  const long long width = (long long)(window.max.x) - window.min.x + 1,
                  height = (long long)(window.max.y) - window.min.y + 1;
  long long channels = 0;
  for (auto i = header.channels().begin(); i != header.channels().end(); ++i, ++channels) {
    require(i.channel().xSampling == 1 && i.channel().ySampling == 1,
            fmt::format("{}: channel {} is subsampled, which is not read", path, i.name()));
    if (channels < 4096) result.channels.push_back({i.name(), typeName(i.channel().type)});
  }
  requireSize(path, width, height, channels);
  result.width = int(width);
  result.height = int(height);
  const Imath::Box2i& screen = header.displayWindow();
  result.display = {window.min.x - screen.min.x, window.min.y - screen.min.y, screen.max.x - screen.min.x + 1,
                    screen.max.y - screen.min.y + 1};
  static constexpr const char* kCompressions[] = {"none",  "rle", "zips", "zip",  "piz",
                                                  "pxr24", "b44", "b44a", "dwaa", "dwab"};
  const auto compression = std::size_t(header.compression());
  result.attributes.emplace_back(
      "compression", compression < std::size(kCompressions) ? kCompressions[compression] : "unknown");
  for (auto i = header.begin(); i != header.end(); ++i)
    if (const std::string text = attributeText(i.attribute()); !text.empty())
      result.attributes.emplace_back(i.name(), text);
  return result;
}

Imath::Box2i detail::dataWindow(int width, int height, const std::optional<Image::Display>& display) {
  const Image::Display d = display.value_or(Image::Display{0, 0, width, height});
  return Imath::Box2i({d.x, d.y}, {d.x + width - 1, d.y + height - 1});
}

Imf::Header detail::exrHeader(int width, int height, const std::optional<Image::Display>& display,
                              const ImageCamera& camera, const std::map<std::string, std::string>& metadata) {
  const Image::Display d = display.value_or(Image::Display{0, 0, width, height});
  Imf::Header header(Imath::Box2i({0, 0}, {d.width - 1, d.height - 1}), dataWindow(width, height, display));
  header.compression() = Imf::ZIP_COMPRESSION;
  header.screenWindowWidth() = camera.screenWidth;
  Imf::addChromaticities(header, Imf::Chromaticities());
  Imf::addWorldToCamera(header, matrix(camera.worldToCamera));
  Imf::addWorldToNDC(header, matrix(camera.worldToNdc));
  for (const auto& [name, value] : metadata) {
    try {
      header.insert(name, Imf::StringAttribute(value));
    } catch (const std::exception&) {
      throw Error(fmt::format("'{}' cannot be the name of metadata", printable(name, 60)));
    }
  }
  return header;
}

void detail::refuseExr(const std::string& path, const std::exception& error) {
  if (dynamic_cast<const Error*>(&error)) throw;
  if (dynamic_cast<const std::bad_alloc*>(&error))
    throw Error(path + ": its pixels need more memory than there is");
  throw Error(path + ": is damaged: its pixels cannot be decoded");
}

std::optional<ImageCamera> readImageCamera(const std::string& path) {
  try {
    detail::checkExr(path);
    const Imf::MultiPartInputFile file(path.c_str());
    const Imf::Header& header = file.header(0);
    if (!Imf::hasWorldToCamera(header) || !Imf::hasWorldToNDC(header)) return std::nullopt;
    return ImageCamera{numbers(Imf::worldToCamera(header)), numbers(Imf::worldToNDC(header)),
                       header.screenWindowWidth()};
  } catch (const std::exception& error) {
    detail::refuseExr(path, error);
  }
}

void writeExr(const std::string& path, const Image& image, const ImageCamera& camera,
              const std::map<std::string, std::string>& metadata) {
  if (MemoryFile::put(path, [&] { return ExrContent{image, camera, metadata}; })) return;
  OutputFile output(path);
  writeExr(output, image, camera, metadata);
  output.commit();
}

void writeExr(const OutputFile& output, const Image& image, const ImageCamera& camera,
              const std::map<std::string, std::string>& metadata) {
  image.check();
  require(!image.channels.empty(), output.path() + ": the image has no channels");
  const Imath::Box2i window = detail::dataWindow(image.width, image.height, image.display);
  Imf::Header header = namingFile(output.path(), [&] {
    return detail::exrHeader(image.width, image.height, image.display, camera, metadata);
  });

  Imf::FrameBuffer frame;
  std::vector<detail::UnsetVector<half>> halves(image.channels.size());
  parallelFor(halves.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c != end; ++c) {
      const Image::Channel& channel = image.channels[c];
      if (!channel.half) continue;
      halves[c].resize(channel.values.size());
      std::transform(channel.values.begin(), channel.values.end(), halves[c].begin(), toHalf);
    }
  });
  const auto pitch = std::size_t(image.width);
  for (std::size_t c = 0; c != halves.size(); ++c) {
    const Image::Channel& channel = image.channels[c];
    header.channels().insert(channel.name, Imf::Channel(channel.half ? Imf::HALF : Imf::FLOAT));
    if (channel.half) {
      frame.insert(channel.name,
                   Imf::Slice::Make(Imf::HALF, halves[c].data(), window, sizeof(half), pitch * sizeof(half)));
    } else {
      frame.insert(channel.name, Imf::Slice::Make(Imf::FLOAT, channel.values.data(), window, sizeof(float),
                                                  pitch * sizeof(float)));
    }
  }
  detail::writeWhole(output, [&](Imf::OStream& stream) {
    // Parts of large pictures are compressed on all cores. OpenEXR has no threads until it is told, and
    // starting them takes as long as compressing two million samples.
    constexpr std::size_t kSamplesWorthThreads = 2'000'000;
    const std::size_t samples = image.channels.size() * pitch * std::size_t(image.height);
    const int cores = int(threadCount());
    if (samples >= kSamplesWorthThreads && cores > 1 && Imf::globalThreadCount() < cores)
      Imf::setGlobalThreadCount(cores);
    Imf::OutputFile file(stream, header, Imf::globalThreadCount());
    file.setFrameBuffer(frame);
    file.writePixels(image.height);
  });
}

void detail::readExrFile(const std::string& path, const ImageReader& reader) {
  try {
    const bool isDeep = checkExr(path).isDeep;
    if (isDeep && reader.deepRow) return readDeepRows(path, reader);
    require(!isDeep, path + ": is a deep image, where a flat one is needed");
    Imf::InputFile file(path.c_str());
    const ImageHeader header = imageHeader(path, file.header());
    reader.begin(header);

    // In bands: the size in a damaged header is not to be believed before its pixels arrive.
    const std::size_t count = header.channels.size(), rowSize = std::size_t(header.width) * count;
    const int band = int(std::clamp<std::size_t>((std::size_t(1) << 22) / rowSize, 1, 256));
    const Imath::Box2i window = file.header().dataWindow();
    std::vector<float> values(rowSize * std::size_t(std::min(band, header.height)));
    for (int y = 0; y < header.height; y += band) {
      const int end = std::min(y + band, header.height);
      Imf::FrameBuffer frame;
      for (std::size_t c = 0; c != count; ++c)
        frame.insert(header.channels[c].name,
                     Imf::Slice::Make(Imf::FLOAT, values.data() + c,
                                      Imath::Box2i({window.min.x, window.min.y + y},
                                                   {window.max.x, window.min.y + end - 1}),
                                      count * sizeof(float), rowSize * sizeof(float)));
      file.setFrameBuffer(frame);
      file.readPixels(window.min.y + y, window.min.y + end - 1);
      for (int row = y; row != end; ++row) reader.row(row, values.data() + std::size_t(row - y) * rowSize);
    }
  } catch (const std::exception& error) {
    refuseExr(path, error);
  }
}

}  // namespace nephele
