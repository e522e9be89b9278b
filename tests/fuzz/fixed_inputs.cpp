// libFuzzer's own changes depend on what it has seen before, and on where things lie in memory.
#include "tests/fuzz/fixed_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele::fuzz {
namespace {

namespace fs = std::filesystem;
using Data = std::vector<std::uint8_t>;

/// How much longer than its seed an input may become.
constexpr std::size_t kRoom = 4096;

std::vector<Data> filesOf(const std::string& folder) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<Data> files;
  for (const fs::path& path : paths) {
    std::ifstream file(path, std::ios::binary);
    files.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  require(!files.empty(), folder + ": no files to change");
  return files;
}

/// Changes bytes in one of several ways.
class Changes {
 public:
  Changes(std::uint64_t stream, const Data& other) : random_(stream), other_(other) {}

  /// Below `end`, as the standard's distributions are not the same everywhere.
  std::size_t below(std::size_t end) { return end == 0 ? 0 : std::size_t(random_() % end); }

  std::size_t operator()(Bytes bytes, std::size_t size) {
    Data data(bytes.begin(), bytes.begin() + std::ptrdiff_t(size));
    for (std::size_t left = std::size_t(1) << below(4); left > 0; --left) change(data);
    data.resize(std::min(data.size(), bytes.size()));
    std::copy(data.begin(), data.end(), bytes.begin());
    return data.size();
  }

 private:
  struct Range {
    std::size_t begin, end;
  };

  /// Short ones mostly.
  Range anyRange(const Data& data) {
    const std::size_t begin = below(data.size());
    return {begin, begin + below(std::min(data.size() - begin, std::size_t(1) << below(13)) + 1)};
  }

  void change(Data& data) {
    if (data.empty()) data.push_back(0);
    const auto at = [&](std::size_t place) { return data.begin() + std::ptrdiff_t(place); };
    switch (below(9)) {
      case 0:
        data[below(data.size())] ^= std::uint8_t(1 << below(8));
        break;
      case 1:
        changeNumber(data);
        break;
      case 2:
        changeDigits(data);
        break;
      case 3: {
        const Range range = anyRange(data);
        data.erase(at(range.begin), at(range.end));
        break;
      }
      case 4: {
        const Range range = anyRange(data);
        const Data copy(at(range.begin), at(range.end));
        data.insert(at(below(data.size() + 1)), copy.begin(), copy.end());
        break;
      }
      case 5: {
        const Range from = anyRange(data);
        const Data copy(at(from.begin), at(from.end));
        std::copy(copy.begin(), copy.end(), at(below(data.size() - copy.size() + 1)));
        break;
      }
      case 6: {
        const Range range = anyRange(data);
        for (std::size_t i = range.begin; i < range.end; ++i) data[i] = std::uint8_t(random_());
        break;
      }
      case 7:
        data.resize(below(data.size()));
        data.insert(data.end(), other_.begin() + std::ptrdiff_t(below(other_.size())), other_.end());
        break;
      default:
        data.resize(below(data.size()));
    }
  }

  /// A number in bytes becomes one at an end of its range, or a neighbour, in the order of either machine.
  void changeNumber(Data& data) {
    const std::size_t bytes = std::size_t(1) << below(4);
    if (data.size() < bytes) return;
    const std::size_t place = below(data.size() - bytes + 1);
    std::uint64_t number = 0;
    const bool bigEndian = below(2) == 0;
    const auto byte = [&](std::size_t i) -> std::uint8_t& {
      return data[place + (bigEndian ? bytes - 1 - i : i)];
    };
    for (std::size_t i = 0; i < bytes; ++i) number |= std::uint64_t(byte(i)) << (8 * i);
    const std::uint64_t power = std::uint64_t(1) << below(8 * bytes);
    const std::uint64_t numbers[] = {0,
                                     ~std::uint64_t(0),
                                     number + 1,
                                     number - 1,
                                     ~number,
                                     number + power,
                                     number - power,
                                     power,
                                     power - 1,
                                     data.size(),
                                     std::bit_cast<std::uint32_t>(1e-20f),
                                     std::bit_cast<std::uint32_t>(1e20f),
                                     0x7f800000,
                                     0x7fc00000,
                                     std::bit_cast<std::uint64_t>(1e300),
                                     0x7ff0000000000000};
    number = numbers[below(std::size(numbers))];
    for (std::size_t i = 0; i < bytes; ++i) byte(i) = std::uint8_t(number >> (8 * i));
  }

  /// A number in letters becomes another.
  void changeDigits(Data& data) {
    constexpr std::string_view kNumbers[] = {
        "",     "0",    "-1",    "1e-320", "1e39",       "-1e300",     "1e999",      "nan",
        "-inf", "0.5x", "1e-20", "65536",  "2147483647", "2147483648", "4294967295", "18446744073709551616"};
    const auto isDigit = [&](std::size_t place) { return data[place] >= '0' && data[place] <= '9'; };
    std::size_t begin = below(data.size());
    while (begin < data.size() && !isDigit(begin)) ++begin;
    std::size_t end = begin;
    while (end < data.size() && (isDigit(end) || data[end] == '.')) ++end;
    const std::string_view number = kNumbers[below(std::size(kNumbers))];
    data.erase(data.begin() + std::ptrdiff_t(begin), data.begin() + std::ptrdiff_t(end));
    data.insert(data.begin() + std::ptrdiff_t(begin), number.begin(), number.end());
  }

  std::mt19937_64 random_;
  const Data& other_;
};

}  // namespace

void writeFixedInputs(const Format& format, const std::string& seeds, const std::string& inputs, int count) {
  const std::vector<Data> files = filesOf(seeds);
  fs::create_directories(inputs);
  for (int i = 0; i < count; ++i) {
    Changes changes(std::uint64_t(i), files[std::size_t(i) * 7 % files.size()]);
    Data data = files[std::size_t(i) % files.size()];
    std::size_t size = data.size();
    data.resize(size + kRoom);
    const ByteChange change = [&](Bytes bytes, std::size_t used) { return changes(bytes, used); };
    if (format.mutator && i % 4 != 0)
      size = format.mutator(data, size, unsigned(changes.below(1 << 16)), change);
    else
      size = changes(data, size);
    data.resize(size);
    std::ofstream(fmt::format("{}/{:05}", inputs, i), std::ios::binary)
        .write(reinterpret_cast<const char*>(data.data()), std::streamsize(data.size()));
  }
}

}  // namespace nephele::fuzz
