#include "tests/fuzz/json_changes.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

namespace nephele::fuzz {
namespace {

using nlohmann::json;

class JsonChanges {
 public:
  JsonChanges(json& whole, unsigned seed, const ByteChange& change)
      : whole_(whole), random_(seed), change_(change) {}

  void operator()() {
    json& value = any();
    switch (below(8)) {
      case 0:
        value = otherValue();
        break;
      case 1:
        // By way of a copy, as one may be within the other.
        value = json(any());
        break;
      case 2:
        remove(value);
        break;
      case 3:
        if (value.is_array() && !value.empty()) value.push_back(json(value[below(value.size())]));
        break;
      default:
        changeWithin(value);
    }
  }

 private:
  std::size_t below(std::size_t end) { return random_() % end; }

  static void collect(json& value, std::vector<json*>& all) {
    all.push_back(&value);
    if (value.is_structured())
      for (json& part : value) collect(part, all);
  }
  json& any() {
    std::vector<json*> all;
    collect(whole_, all);
    return *all[below(all.size())];
  }

  json otherValue() {
    const json values[] = {nullptr, true, "", "x", json::array(), json::object(), {0, 1, 2}, otherNumber()};
    return values[below(std::size(values))];
  }
  json otherNumber() {
    const json numbers[] = {0,           1,           -1,        2,         3,          255,  65535,
                            65536,       2147483647,  5120,      5121,      5123,       5125, 5126,
                            -2147483648, 4294967295u, 1e39,      -1e308,    1e-39,      0.5,  1e20,
                            1e300,       4294967296,  INT64_MIN, INT64_MAX, UINT64_MAX, 4.0};
    return numbers[below(std::size(numbers))];
  }

  void remove(json& value) {
    if (value.is_array() && !value.empty()) value.erase(below(value.size()));
    if (value.is_object() && !value.empty()) value.erase(std::next(value.begin(), long(below(value.size()))));
  }

  void changeWithin(json& value) {
    if (value.is_number_integer() && below(2) == 0)
      value = value.get<std::int64_t>() / 2 + std::int64_t(below(5)) - 2;
    else if (value.is_number())
      value = otherNumber();
    else if (value.is_string())
      value = changedText(value.get<std::string>());
    else if (value.is_boolean())
      value = !value.get<bool>();
  }

  std::string changedText(std::string text) {
    // Of data within the file the letters of base64 change.
    constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    if (const std::size_t comma = text.find(','); text.starts_with("data:") && comma + 1 < text.size()) {
      for (std::size_t left = 1 + below(8); left > 0; --left)
        text[comma + 1 + below(text.size() - comma - 1)] = kLetters[below(kLetters.size())];
      return text;
    }
    std::vector<std::uint8_t> bytes(text.begin(), text.end());
    bytes.resize(text.size() + 16);
    bytes.resize(change_(bytes, text.size()));
    return {bytes.begin(), bytes.end()};
  }

  json& whole_;
  std::mt19937 random_;
  const ByteChange& change_;
};

}  // namespace

std::string changedJson(const std::string& text, unsigned seed, const ByteChange& change) {
  json whole = json::parse(text, nullptr, false);
  if (whole.is_discarded()) return text;
  JsonChanges changes(whole, seed, change);
  for (unsigned left = 1u << (seed % 3); left > 0; --left) changes();
  return whole.dump(-1, ' ', false, json::error_handler_t::ignore);
}

std::size_t mutateJson(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change) {
  const std::string before(bytes.begin(), bytes.begin() + std::ptrdiff_t(size));
  const std::string after = changedJson(before, seed / 4, change);
  if (after == before || after.size() > bytes.size()) return change(bytes, size);
  std::copy(after.begin(), after.end(), bytes.begin());
  return after.size();
}

}  // namespace nephele::fuzz
