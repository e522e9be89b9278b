#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "apps/manual/option_table.h"
#include "tests/fuzz/harness.h"
#include "tests/fuzz/verb_calls.h"

namespace nephele::fuzz {
namespace {

/// The options of a verb.
const std::vector<apps::OptionRow>& optionsOf(const VerbCall& call) {
  static const auto all = [] {
    std::map<std::string_view, std::vector<apps::OptionRow>> made;
    for (const apps::Verb& verb : apps::allVerbs())
      if (const VerbCall* each = callOf(verb.name)) {
        made[each->verb] = apps::optionTable(verb);
        std::erase_if(made[each->verb], &apps::OptionRow::isInput);
      }
    return made;
  }();
  return all.at(call.verb);
}

/// Choices that follow from a seed.
class Choices {
 public:
  explicit Choices(unsigned seed) : random_(seed) {}

  std::size_t below(std::size_t end) { return random_() % end; }
  template <class List>
  const auto& any(const List& list) {
    return list[below(std::size(list))];
  }

 private:
  std::mt19937 random_;
};

class ArgumentChanges : Choices {
 public:
  ArgumentChanges(std::vector<std::string>& lines, unsigned seed, const ByteChange& change)
      : Choices(seed), lines_(lines), change_(change) {}

  void operator()() {
    const VerbCall* call = lines_.empty() ? nullptr : callOf(lines_.front());
    if (!call || below(24) == 0) {
      call = &verbCalls()[below(verbCalls().size())];
      lines_ = {std::string(call->verb)};
    }
    for (std::size_t left = 1 + below(3); left > 0; --left) {
      const apps::OptionRow& option = any(optionsOf(*call));
      const auto present = std::ranges::find(lines_, "--" + option.name);
      if (present != lines_.end() && below(3) != 0) {
        const auto value = present + 1;
        const bool isAlone = option.isFlag || value == lines_.end();
        if (isAlone || below(3) == 0)
          lines_.erase(present, isAlone ? value : value + 1);
        else
          *value = below(2) == 0 ? valueFor(option) : changed(*value);
      } else if (lines_.size() > 1 && below(5) == 0) {
        std::string& line = lines_[1 + below(lines_.size() - 1)];
        if (!line.starts_with("--")) line = changed(line);
      } else {
        lines_.push_back("--" + option.name);
        if (!option.isFlag) lines_.push_back(valueFor(option));
      }
    }
  }

 private:
  std::string changed(const std::string& text) {
    std::vector<std::uint8_t> bytes(text.begin(), text.end());
    bytes.resize(text.size() + 32);
    bytes.resize(change_(bytes, text.size()));
    return {bytes.begin(), bytes.end()};
  }

  /// Ordinary ones mostly, as a value out of its range hides those of all other options.
  std::string number() {
    static constexpr const char* kNumbers[] = {
        "0",           "1",          "-1",         "0.5",
        "2",           "nan",        "inf",        "-inf",
        "1e-30",       "1e30",       "-1e30",      "1e308",
        "1e400",       "1e-320",     "-0",         "1e-10",
        "1e10",        "65536",      "",           "2147483647",
        "-2147483649", "4294967296", "16777217",   "x",
        "1e6",         "-5%",        "100%",       "1e9%",
        "1e5x",        "0.0001x",    "16777216.5", "9223372036854775808"};
    switch (below(6)) {
      case 0:
        return any(kNumbers);
      case 1:
        return std::to_string(below(20));
      case 2:
        return fmt::format("{:.3g}{}", between(-3, 3), below(2) == 0 ? "%" : "x");
      default:
        return fmt::format("{}{:.4g}", below(5) == 0 ? "-" : "", between(-4, 4));
    }
  }
  /// Ten to the power of a number from `low` to `high`.
  double between(double low, double high) {
    return std::pow(10.0, low + (high - low) * double(below(1000)) / 999);
  }
  std::string count() {
    static constexpr const char* kCounts[] = {
        "0",          "1",     "2",      "3",       "5",
        "8",          "17",    "64",     "100",     "1000",
        "65535",      "65536", "100000", "-1",      "1.5",
        "1e6",        "1-3",   "2-1",    "1000000", "4294967295",
        "2147483648", "16",    "1x2",    "1-9x2",   "999999999999999999999"};
    return below(2) == 0 ? std::to_string(below(9)) : any(kCounts);
  }
  std::string fileName() {
    static constexpr const char* kOthers[] = {"new.vdb", "new.obj", "new.exr", "new.png", "new.json",
                                              "new.ply", ".",       "none",    "",        "new deep.exr"};
    return below(3) == 0 ? std::string(any(kOthers)) : std::string(any(verbFiles()));
  }
  std::string field() {
    static constexpr const char* kForms[] = {"height:N=N,N=N",
                                             "along:N,N,N:N=N,N=N",
                                             "facing:N,N,N:N=N,N=N",
                                             "mask:fog.vdb:N,N",
                                             "noise:N:N,N",
                                             "noise:N,C:N,N",
                                             "attribute:uv:N,N",
                                             "attribute:uv:spheres:N,N",
                                             "=N * P.x",
                                             "=P.x / N",
                                             "=length(P) - N",
                                             "=noise(P * N)",
                                             "=sqrt(P.y - N)",
                                             "=log(P.y * N)",
                                             "=exp(P.y * N)",
                                             "=pow(P.y, N)",
                                             "=clamp(height, N, N)",
                                             "=normal.y * height",
                                             "=facing((0, N, N))",
                                             "height:N=N,N=N*noise:N:N,N",
                                             "noise:kind=perlin,amplitude=N,frequency=N",
                                             "curl:amplitude=N,frequency=N,octaves=C,seed=C",
                                             "seed=C-C",
                                             "resolution=C,C",
                                             "density=N;N",
                                             "N",
                                             "amplitude=N,frequency=N,time=N,roughness=N,lacunarity=N"};
    return filled(any(kForms));
  }
  std::string filled(std::string_view form) {
    std::string text;
    for (const char c : form) text += c == 'N' ? number() : c == 'C' ? count() : std::string(1, c);
    return text;
  }

  std::string word(std::string_view name) {
    for (const std::string_view counted : {"COUNT", "FRAME", "I", "WxH", "W", "H"})
      if (name == counted) return count();
    for (const std::string_view file : {"FILE", "FOLDER"})
      if (name == file) return fileName();
    for (const std::string_view text : {"FIELD", "EXPRESSION", "KEYS", "VALUES", "OPTION"})
      if (name == text) return field();
    if (name == "FRAMES") return count() + "-" + count();
    static constexpr const char* kNames[] = {"density", "surface", "uv",      "a",
                                             "Cd",      "none",    "humilis", "storm"};
    if (name == "NAME" || name == "GRID" || name == "VIEW") return any(kNames);
    return number();
  }

  /// Often near what it is left alone, as other values are mostly refused.
  std::string valueFor(const apps::OptionRow& option) {
    const char* const begin = option.standard.c_str();
    char* end = nullptr;
    const double number = std::strtod(begin, &end);
    if (end == begin || below(2) == 0) return valueOf(option.type);
    if (number == std::floor(number) && *end == '\0')
      return std::to_string(long(number) + long(below(7)) - 3);
    return fmt::format("{:.3g}{}", number * between(-1, 1), end);
  }

  /// A value of a form as help shows it: one of its alternatives, with what stands in brackets or without,
  /// and with numbers, files and names for its words in capitals.
  std::string valueOf(std::string form) {
    if (below(12) == 0) return below(2) == 0 ? field() : number();
    std::string text, name;
    std::vector<std::string> alternatives{""};
    int depth = 0;
    for (const char c : form) {
      depth += c == '[' ? 1 : c == ']' ? -1 : 0;
      if (depth == 0 && c == '|')
        alternatives.emplace_back();
      else
        alternatives.back() += c;
    }
    const std::string chosen = any(alternatives);
    bool isLeftOut = false;
    const auto flush = [&] {
      if (!name.empty() && !isLeftOut) text += std::isupper(std::uint8_t(name[0])) ? word(name) : name;
      name.clear();
    };
    for (const char c : chosen) {
      if (std::isalnum(std::uint8_t(c)) || c == '-' || c == '_') {
        name += c;
        continue;
      }
      flush();
      if (c == '[')
        isLeftOut = below(2) == 0;
      else if (c == ']')
        isLeftOut = false;
      else if (c == ' ')
        break;
      else if (!isLeftOut && c != '.')
        text += c;
    }
    flush();
    return text;
  }

  std::vector<std::string>& lines_;
  const ByteChange& change_;
};

}  // namespace

std::size_t mutateArguments(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change) {
  std::vector<std::string> lines = linesOf({reinterpret_cast<const char*>(bytes.data()), size});
  ArgumentChanges(lines, seed, change)();
  const std::string text = fmt::format("{}\n", fmt::join(lines, "\n"));
  if (text.size() > bytes.size()) return size;
  std::copy(text.begin(), text.end(), bytes.begin());
  return text.size();
}

}  // namespace nephele::fuzz
