#include "tests/fuzz/mutators.h"

#include <blosc.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <vector>

#include "nephele/levelset/io/detail/blosc_header.h"
#include "nephele/modeling/base/error.h"
#include "tests/fuzz/json_changes.h"

namespace nephele::fuzz {
namespace {

using Data = std::vector<std::uint8_t>;

template <class T>
T numberAt(const Data& data, std::size_t place) {
  T value;
  std::memcpy(&value, data.data() + place, sizeof(T));
  return value;
}

template <class T>
void setNumber(Data& data, std::size_t place, T value) {
  std::memcpy(data.data() + place, &value, sizeof(T));
}

std::uint32_t bigEndian(std::uint32_t value) {
  return __builtin_bswap32(value);
}

/// A compressed block within a file.
struct Stream {
  std::size_t begin = 0, size = 0;
  Data contents;
  /// Of Blosc's elements; 0: zlib's.
  std::size_t elementBytes = 0;
};

constexpr std::size_t kLargestContents = 4 << 20;

std::optional<Stream> bloscAt(const Data& data, std::size_t place) {
  if (data[place] != BLOSC_VERSION_FORMAT || data.size() - place <= BLOSC_MIN_HEADER_LENGTH)
    return std::nullopt;
  const auto unpacked = numberAt<std::uint32_t>(data, place + 4),
             packed = numberAt<std::uint32_t>(data, place + 12);
  if (packed <= BLOSC_MIN_HEADER_LENGTH || packed > data.size() - place || unpacked > kLargestContents)
    return std::nullopt;
  const char* block = reinterpret_cast<const char*>(data.data()) + place;
  try {
    detail::checkBloscHeader(block, packed, unpacked);
  } catch (const Error&) {
    return std::nullopt;
  }
  Stream stream{place, packed, Data(unpacked), data[place + 3]};
  if (blosc_decompress_ctx(block, stream.contents.data(), unpacked, 1) != int(unpacked)) return std::nullopt;
  return stream;
}

std::optional<Stream> streamAt(const Data& data, std::size_t place) {
  if (auto blosc = bloscAt(data, place)) return blosc;
  const unsigned head = unsigned(data[place]) << 8 | data[place + 1];
  if ((head & 0x8f00) != 0x0800 || head % 31 != 0) return std::nullopt;
  z_stream z{};
  if (inflateInit(&z) != Z_OK) return std::nullopt;
  static Data room(kLargestContents);
  z.next_in = const_cast<Bytef*>(data.data() + place);
  z.avail_in = uInt(data.size() - place);
  z.next_out = room.data();
  z.avail_out = uInt(room.size());
  const int status = inflate(&z, Z_FINISH);
  inflateEnd(&z);
  if (status != Z_STREAM_END) return std::nullopt;
  return Stream{place, z.total_in, Data(room.begin(), room.begin() + std::ptrdiff_t(z.total_out))};
}

/// One of the file's compressed blocks, found by what zlib says of every place.
std::optional<Stream> anyStream(const Data& data, unsigned seed) {
  std::vector<Stream> found;
  constexpr std::size_t kMostStreams = 64;
  for (std::size_t place = 0; place + 8 < data.size() && found.size() < kMostStreams; ++place)
    if (auto stream = streamAt(data, place)) {
      place += stream->size - 1;
      found.push_back(std::move(*stream));
    }
  if (found.empty()) return std::nullopt;
  return std::move(found[seed % found.size()]);
}

Data changed(Data data, std::size_t most, const ByteChange& change) {
  const std::size_t size = data.size();
  data.resize(std::max({most, size, std::size_t(1)}));
  data.resize(change(data, size));
  return data;
}

/// Changes a few bytes somewhere in `data` and moves none of the others.
Data changedInPlace(Data data, unsigned seed, const ByteChange& change) {
  constexpr std::size_t kMost = 64;
  if (data.empty()) return data;
  const std::size_t begin = std::size_t(seed) * 2654435761u % data.size();
  const std::size_t size = std::min({data.size() - begin, kMost, std::size_t(1) << seed % 7});
  const auto part = data.begin() + std::ptrdiff_t(begin);
  const Data after = changed(Data(part, part + std::ptrdiff_t(size)), size, change);
  std::copy_n(after.begin(), std::min(after.size(), size), part);
  return data;
}

Data packed(const Stream& stream, const Data& data) {
  if (stream.elementBytes > 0) {
    Data result(data.size() + BLOSC_MAX_OVERHEAD);
    const int size = blosc_compress_ctx(5, BLOSC_SHUFFLE, stream.elementBytes, data.size(), data.data(),
                                        result.data(), result.size(), BLOSC_LZ4_COMPNAME, 0, 1);
    result.resize(std::size_t(std::max(size, 0)));
    return result;
  }
  uLongf size = compressBound(data.size());
  Data result(size);
  compress2(result.data(), &size, data.data(), data.size(), 6);
  result.resize(size);
  return result;
}

/// What stands before a block and says how long it is, alone and with that number.
void correctLength(Data& data, const Stream& stream, std::size_t newSize) {
  constexpr std::size_t kNumber = sizeof(std::uint64_t), kFurthest = 32;
  for (std::size_t place = 0; place + kNumber <= stream.begin; ++place)
    if (numberAt<std::uint64_t>(data, place) == stream.size + kNumber)
      setNumber(data, place, std::uint64_t(newSize + kNumber));
  const std::size_t from = stream.begin - std::min(stream.begin, kFurthest);
  for (std::size_t place = stream.begin; place-- > from;) {
    if (place + 8 <= stream.begin && numberAt<std::uint64_t>(data, place) == stream.size)
      return setNumber(data, place, std::uint64_t(newSize));
    if (place + 4 > stream.begin) continue;
    if (numberAt<std::uint32_t>(data, place) == stream.size)
      return setNumber(data, place, std::uint32_t(newSize));
    if (numberAt<std::uint32_t>(data, place) == bigEndian(std::uint32_t(stream.size)))
      return setNumber(data, place, bigEndian(std::uint32_t(newSize)));
  }
}

/// Places in the file that are told in 8 bytes from its start and lie behind `end` move with what they tell.
void correctPlaces(Data& data, std::size_t end, std::ptrdiff_t shift) {
  const std::size_t size = data.size();
  for (std::size_t place = 0; shift != 0 && place + 8 <= end; ++place)
    if (const auto told = numberAt<std::uint64_t>(data, place); told >= end && told <= size) {
      setNumber(data, place, told + std::uint64_t(shift));
      place += 7;
    }
}

void replaceStream(Data& data, const Stream& stream, const Data& packed) {
  const std::size_t end = stream.begin + stream.size;
  correctLength(data, stream, packed.size());
  correctPlaces(data, end, std::ptrdiff_t(packed.size()) - std::ptrdiff_t(stream.size));
  Data result(data.begin(), data.begin() + std::ptrdiff_t(stream.begin));
  result.insert(result.end(), packed.begin(), packed.end());
  result.insert(result.end(), data.begin() + std::ptrdiff_t(end), data.end());
  data = std::move(result);
}

/// Changes the contents of one compressed block; false where there is none.
bool changeStream(Data& data, unsigned seed, const ByteChange& change) {
  const auto stream = anyStream(data, seed);
  if (!stream) return false;
  // As long as before, mostly: blocks hold a known number of values, which stand where they are looked for.
  const Data contents = seed % 8 == 0 ? changed(stream->contents, stream->contents.size() + 64, change)
                                      : changedInPlace(stream->contents, seed / 8, change);
  replaceStream(data, *stream, packed(*stream, contents));
  return true;
}

/// `data` in place of what was there, unless it has become too long.
std::size_t store(Bytes bytes, std::size_t size, const Data& data, const ByteChange& change) {
  if (data.size() > bytes.size()) return change(bytes, size);
  std::copy(data.begin(), data.end(), bytes.begin());
  return data.size();
}

Data first(Bytes bytes, std::size_t size) {
  return {bytes.begin(), bytes.begin() + std::ptrdiff_t(size)};
}

void correctChecksums(Data& png) {
  constexpr std::size_t kSignature = 8, kFrame = 12;
  for (std::size_t place = kSignature; place + kFrame <= png.size();) {
    const std::size_t length = bigEndian(numberAt<std::uint32_t>(png, place));
    if (length > png.size() - place - kFrame) return;
    const uLong checksum = crc32(0, png.data() + place + 4, uInt(length + 4));
    setNumber(png, place + 8 + length, bigEndian(std::uint32_t(checksum)));
    place += kFrame + length;
  }
}

}  // namespace

std::size_t mutateBlocks(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change) {
  Data data = first(bytes, size);
  if (changeStream(data, seed / 4, change)) return store(bytes, size, data, change);
  return change(bytes, size);
}

std::size_t mutateNanoVdb(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change) {
  constexpr char kMagic[] = "NanoVDB0";
  constexpr std::size_t kLength = 8;
  const auto switchOff = [&](Data& data) {
    // The file begins with the same words as its grids, but has no checksum.
    for (std::size_t place = 1; place + 2 * kLength <= data.size(); ++place)
      if (std::memcmp(data.data() + place, kMagic, kLength) == 0)
        setNumber(data, place + kLength, ~std::uint64_t(0));
  };
  Data data = first(bytes, size);
  if (auto stream = anyStream(data, seed / 4)) {
    switchOff(stream->contents);
    replaceStream(data, *stream, packed(*stream, changedInPlace(stream->contents, seed / 4, change)));
  } else {
    data = seed / 4 % 8 == 0 ? changed(std::move(data), bytes.size(), change)
                             : changedInPlace(std::move(data), seed / 32, change);
    switchOff(data);
  }
  return store(bytes, size, data, change);
}

std::size_t mutatePng(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change) {
  Data data = first(bytes, size);
  if (seed / 4 % 2 == 0 || !changeStream(data, seed / 8, change))
    data = changed(std::move(data), bytes.size(), change);
  correctChecksums(data);
  return store(bytes, size, data, change);
}

std::size_t mutateGlb(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change) {
  constexpr std::size_t kHeader = 12, kChunk = 8;
  Data data = first(bytes, size);
  if (size < kHeader + kChunk) return change(bytes, size);
  const std::size_t text = kHeader + kChunk;
  const std::size_t length = std::min<std::size_t>(numberAt<std::uint32_t>(data, kHeader), size - text);
  const auto middle = data.begin() + std::ptrdiff_t(text + length);
  Data json(data.begin() + std::ptrdiff_t(text), middle), rest(middle, data.end());
  if (seed / 4 % 4 > 1) {
    const std::string after = changedJson({json.begin(), json.end()}, seed / 16, change);
    json.assign(after.begin(), after.end());
  } else if (seed / 4 % 4 == 1)
    json = changed(std::move(json), json.size() + 64, change);
  else
    rest = changed(std::move(rest), rest.size() + 64, change);
  while (json.size() % 4 != 0) json.push_back(' ');
  data.resize(text);
  setNumber(data, kHeader, std::uint32_t(json.size()));
  data.insert(data.end(), json.begin(), json.end());
  if (rest.size() >= kChunk) setNumber(rest, 0, std::uint32_t(rest.size() - kChunk));
  data.insert(data.end(), rest.begin(), rest.end());
  setNumber(data, 8, std::uint32_t(data.size()));
  return store(bytes, size, data, change);
}

}  // namespace nephele::fuzz
