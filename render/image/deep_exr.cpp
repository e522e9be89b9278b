// Deep OpenEXR files, made of scan lines.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepImageStateAttribute.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/detail/exr_check.h"
#include "nephele/render/image/detail/exr_header.h"
#include "nephele/render/image/detail/exr_stream.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/image_file.h"

namespace nephele {

void writeDeepExr(const std::string& path, const DeepImage& image, const ImageCamera& camera,
                  const std::map<std::string, std::string>& metadata) {
  OutputFile output(path);
  writeDeepExr(output, image, camera, metadata);
  output.commit();
}

void writeDeepExr(const OutputFile& output, const DeepImage& image, const ImageCamera& camera,
                  const std::map<std::string, std::string>& metadata) {
  image.check();
  const Imath::Box2i window = detail::dataWindow(image.width, image.height, image.display);
  // In deep files `version` is a number of OpenEXR's own.
  std::map<std::string, std::string> attributes = metadata;
  if (auto node = attributes.extract("version")) {
    node.key() = "softwareVersion";
    attributes.insert(std::move(node));
  }
  Imf::Header header = namingFile(output.path(), [&] {
    return detail::exrHeader(image.width, image.height, image.display, camera, attributes);
  });
  header.setType(Imf::DEEPSCANLINE);
  header.compression() = Imf::ZIPS_COMPRESSION;
  Imf::addDeepImageState(header, Imf::DIS_TIDY);
  for (const char* name : {"Z", "ZBack"}) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
  for (const char* name : {"A", "R", "G", "B"}) header.channels().insert(name, Imf::Channel(Imf::HALF));

  detail::writeWhole(output, [&](Imf::OStream& stream) {
    Imf::DeepScanLineOutputFile file(stream, header);
    const auto width = std::size_t(image.width);
    std::vector<unsigned> counts(width);
    std::vector<const char*> pointers[6];
    for (auto& list : pointers) list.resize(width);
    std::vector<half> halves;
    for (int y = 0; y != image.height; ++y) {
      const std::vector<DeepSample>* row = &image.at(0, y);
      std::size_t total = 0;
      for (std::size_t x = 0; x != width; ++x) {
        counts[x] = unsigned(row[x].size());
        total += row[x].size();
      }
      halves.clear();
      halves.reserve(4 * total);
      for (std::size_t x = 0; x != width; ++x) {
        pointers[0][x] = reinterpret_cast<const char*>(row[x].empty() ? nullptr : &row[x][0].z);
        pointers[1][x] = reinterpret_cast<const char*>(row[x].empty() ? nullptr : &row[x][0].zBack);
        for (std::size_t c = 0; c != 4; ++c)
          pointers[2 + c][x] =
              reinterpret_cast<const char*>(row[x].empty() ? nullptr : halves.data() + halves.size() + c);
        for (const DeepSample& s : row[x])
          for (const float value : {s.alpha, s.colour.x, s.colour.y, s.colour.z}) halves.emplace_back(value);
      }
      Imf::DeepFrameBuffer frame;
      // Slices are addressed by the row number; every row is row y of a buffer that starts y rows before.
      frame.insertSampleCountSlice(
          Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()) - window.min.x * sizeof(unsigned),
                     sizeof(unsigned), 0));
      const char* names[] = {"Z", "ZBack", "A", "R", "G", "B"};
      for (std::size_t c = 0; c != 6; ++c)
        frame.insert(names[c],
                     Imf::DeepSlice(c < 2 ? Imf::FLOAT : Imf::HALF,
                                    reinterpret_cast<char*>(pointers[c].data() - window.min.x), sizeof(char*),
                                    0, c < 2 ? sizeof(DeepSample) : 4 * sizeof(half)));
      file.setFrameBuffer(frame);
      file.writePixels(1);
    }
  });
}

void writeExrPair(const ExrPair& paths, const Image& flat, const DeepImage& deep, const ImageCamera& camera,
                  const std::map<std::string, std::string>& metadata) {
  if (MemoryFile::find(paths.flat)) {
    writeDeepExr(paths.deep, deep, camera, metadata);
    return writeExr(paths.flat, flat, camera, metadata);
  }
  OutputFile flatFile(paths.flat), deepFile(paths.deep);
  writeDeepExr(deepFile, deep, camera, metadata);
  writeExr(flatFile, flat, camera, metadata);
  commitTogether(std::array{&deepFile, &flatFile});
}

DeepImage readDeepExr(const std::string& path, double mostBytes) {
  try {
    const detail::ExrCheck check = detail::checkExr(path);
    Imf::MultiPartInputFile file(path.c_str());
    const Imf::Header& header = file.header(0);
    require(header.hasType() && Imf::isDeepData(header.type()),
            path + ": is not a deep image; a deep OpenEXR file with Z and A is needed");
    require(header.type() == Imf::DEEPSCANLINE, path + ": is a tiled deep image; only scan lines are read");
    const Imf::ChannelList& channels = header.channels();
    for (const char* name : {"Z", "A"})
      require(channels.findChannel(name) != nullptr,
              fmt::format("{}: has no channel {}, which deep images need", path, name));
    const Imath::Box2i window = header.dataWindow(), screen = header.displayWindow();
    const long long wide = (long long)(window.max.x) - window.min.x + 1,
                    high = (long long)(window.max.y) - window.min.y + 1;
    detail::requireSize(path, wide, high, 1);
    DeepImage image;
    image.width = int(wide);
    image.height = int(high);
    const Image::Display display{window.min.x - screen.min.x, window.min.y - screen.min.y,
                                 screen.max.x - screen.min.x + 1, screen.max.y - screen.min.y + 1};
    if (display != Image::Display{0, 0, image.width, image.height}) image.display = display;

    Imf::DeepScanLineInputPart part(file, 0);
    const auto width = std::size_t(image.width);
    double bytes = double(width) * image.height * sizeof(std::vector<DeepSample>);
    // Every sample has Z and A.
    constexpr std::int64_t kLeastSample = 4;
    std::int64_t samplesLeft = check.sampleBytes / kLeastSample;
    const char* names[] = {"Z", "ZBack", "A", "R", "G", "B"};
    std::vector<unsigned> counts(width);
    std::vector<char*> pointers[6];
    for (auto& list : pointers) list.resize(width);
    for (int y = window.min.y; y <= window.max.y; ++y) {
      Imf::DeepFrameBuffer frame;
      frame.insertSampleCountSlice(
          Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data() - window.min.x), sizeof(unsigned), 0));
      for (std::size_t c = 0; c != 6; ++c)
        if (channels.findChannel(names[c]))
          frame.insert(names[c],
                       Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers[c].data() - window.min.x),
                                      sizeof(char*), 0, sizeof(DeepSample)));
      part.setFrameBuffer(frame);
      part.readPixelSampleCounts(y, y);
      std::vector<std::vector<DeepSample>> row(width);
      for (std::size_t x = 0; x != width; ++x) {
        bytes += double(counts[x]) * sizeof(DeepSample);
        samplesLeft -= std::int64_t(counts[x]);
        require(samplesLeft >= 0, path + ": is damaged: pixels have more samples than it holds");
      }
      if (bytes > mostBytes)
        throw Error(fmt::format("{}: its samples need more than {:.1f} GB, which is the limit", path,
                                mostBytes / 1e9));
      for (std::size_t x = 0; x != width; ++x) {
        row[x].resize(counts[x]);
        DeepSample* first = row[x].data();
        // What an empty pixel's address is does not matter, but it must not be computed from null.
        static DeepSample none;
        if (!first) first = &none;
        float* parts[] = {&first->z,        &first->zBack,    &first->alpha,
                          &first->colour.x, &first->colour.y, &first->colour.z};
        for (std::size_t c = 0; c != 6; ++c) pointers[c][x] = reinterpret_cast<char*>(parts[c]);
      }
      part.readPixels(y, y);
      const bool hasBack = channels.findChannel("ZBack") != nullptr;
      for (auto& samples : row) {
        for (DeepSample& sample : samples) {
          if (!hasBack) sample.zBack = sample.z;
          require(!std::isnan(sample.z) && !std::isnan(sample.zBack) && !std::isnan(sample.alpha),
                  path + ": holds samples that are not numbers");
        }
        image.pixels.push_back(std::move(samples));
      }
    }
    return image;
  } catch (const std::exception& error) {
    detail::refuseExr(path, error);
  }
}

void detail::readDeepRows(const std::string& path, const ImageReader& reader) {
  const ExrCheck check = checkExr(path);
  Imf::MultiPartInputFile file(path.c_str());
  const Imf::Header& header = file.header(0);
  const ImageHeader image = imageHeader(path, header);
  require(header.hasType() && header.type() == Imf::DEEPSCANLINE,
          path + ": is a tiled deep image; only scan lines are read");
  reader.begin(image);

  std::int64_t bytesPerSample = 0;
  for (auto i = header.channels().begin(); i != header.channels().end(); ++i)
    bytesPerSample += i.channel().type == Imf::HALF ? 2 : 4;
  std::int64_t samplesLeft = check.sampleBytes / bytesPerSample;
  Imf::DeepScanLineInputPart part(file, 0);
  const Imath::Box2i window = header.dataWindow();
  const auto width = std::size_t(image.width);
  std::vector<unsigned> counts(width);
  std::vector<std::vector<float>> values(image.channels.size());
  std::vector<std::vector<char*>> pointers(values.size(), std::vector<char*>(width));
  for (int y = window.min.y; y <= window.max.y; ++y) {
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data() - window.min.x), sizeof(unsigned), 0));
    for (std::size_t c = 0; c != values.size(); ++c)
      frame.insert(image.channels[c].name,
                   Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers[c].data() - window.min.x),
                                  sizeof(char*), 0, sizeof(float)));
    part.setFrameBuffer(frame);
    part.readPixelSampleCounts(y, y);
    std::size_t total = 0;
    for (const unsigned count : counts) {
      total += count;
      samplesLeft -= std::int64_t(count);
      require(samplesLeft >= 0, path + ": is damaged: pixels have more samples than it holds");
    }
    for (std::size_t c = 0; c != values.size(); ++c) {
      // One more, so that pixels without samples have an address too.
      values[c].resize(total + 1);
      float* next = values[c].data();
      for (std::size_t x = 0; x != width; next += counts[x++]) pointers[c][x] = reinterpret_cast<char*>(next);
    }
    part.readPixels(y, y);
    for (std::vector<float>& channel : values) channel.resize(total);
    reader.deepRow(counts, values);
  }
}

}  // namespace nephele
