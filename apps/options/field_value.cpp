#include "apps/options/field_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/io/vdb_io.h"

namespace nephele::apps {
namespace {

constexpr double kFarthestPlace = 1e6;
constexpr int kMostOctaves = 8;
// What fields may be multiplied by.
constexpr Quantity kFactor{Quantity::Unit::number, 0, 1e6};

/// The text before and after the first or last `separator`; the second is empty where there is none.
std::pair<std::string, std::string> splitFirst(const std::string& text, char separator) {
  const std::size_t at = text.find(separator);
  if (at == std::string::npos) return {text, {}};
  return {text.substr(0, at), text.substr(at + 1)};
}
std::pair<std::string, std::string> splitLast(const std::string& text, char separator) {
  const std::size_t at = text.rfind(separator);
  if (at == std::string::npos) return {text, {}};
  return {text.substr(0, at), text.substr(at + 1)};
}

std::vector<std::string> listed(const std::string& text) {
  std::vector<std::string> parts{{}};
  for (const char c : text) {
    if (c == ',')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

class Parser {
 public:
  Parser(const std::string& option, const std::string& text, const Quantity& quantity) {
    value_.option = option;
    value_.text = text;
    value_.quantity = quantity;
  }

  FieldValue parsed() {
    const auto [text, factors] = splitFirst(value_.text, '*');
    readOne(text);
    if (value_.text.find('*') != std::string::npos)
      value_.factors.push_back(parseFieldValue(value_.option, factors, kFactor));
    return value_;
  }

 private:
  void readOne(const std::string& text) {
    using Source = FieldValue::Source;
    if (text.find(':') == std::string::npos) {
      value_.stops = {{0, amount(text)}};
      return;
    }
    const auto [word, rest] = splitFirst(text, ':');
    if (word == "height") {
      value_.source = Source::along;
      readRamp(rest, -kFarthestPlace, kFarthestPlace);
    } else if (word == "along" || word == "facing") {
      value_.source = word == "along" ? Source::along : Source::facing;
      const auto [direction, stops] = splitFirst(rest, ':');
      readDirection(word, direction);
      const double farthest = word == "along" ? kFarthestPlace : 1;
      readRamp(stops, -farthest, farthest);
    } else if (word == "mask") {
      value_.source = Source::mask;
      readMask(rest);
    } else if (word == "attribute") {
      value_.source = Source::attribute;
      readAttribute(rest);
    } else if (word == "noise") {
      value_.source = Source::noise;
      readNoise(rest);
    } else {
      const std::string meant =
          closestWord(word, {"height", "along", "facing", "mask", "attribute", "noise"});
      refuse(value_.quantity.allowed() + ", or height:, along:, facing:, mask:, attribute: or noise:" +
             (meant.empty() ? "" : "; did you mean " + meant + ":?"));
    }
  }

  [[noreturn]] void refuse(const std::string& allowed) const {
    throw CLI::ValidationError(value_.option, fmt::format("got '{}', allowed: {}", value_.text, allowed));
  }

  [[noreturn]] void refusePart(const std::string& part, const std::string& allowed) const {
    refuse(part == value_.text ? allowed : fmt::format("in place of '{}' {}", part, allowed));
  }

  Amount amount(const std::string& part) const {
    using Unit = Quantity::Unit;
    const Quantity& quantity = value_.quantity;
    Amount amount;
    amount.isRelative = (quantity.unit == Unit::length && part.ends_with('%')) ||
                        (quantity.unit == Unit::frequency && part.ends_with('x'));
    const auto number = parseNumber(part.substr(0, part.size() - (amount.isRelative ? 1 : 0)));
    if (!number || *number < quantity.low || *number > quantity.high ||
        (!quantity.lowIsAllowed && *number == quantity.low))
      refusePart(part, quantity.allowed());
    amount.value = *number;
    return amount;
  }

  void readDirection(const std::string& word, const std::string& part) {
    const std::vector<std::string> parts = listed(part);
    const std::string form = "a direction X,Y,Z that is not 0, as in " + word + ":0,1,0:...";
    if (parts.size() != 3) refusePart(part, form);
    double d[3];
    for (int i = 0; i < 3; ++i) {
      const auto number = parseNumber(parts[std::size_t(i)]);
      if (!number) refusePart(part, form);
      d[i] = *number;
    }
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (!(length > 1e-30 && length < 1e30)) refusePart(part, form);
    value_.direction = {float(d[0] / length), float(d[1] / length), float(d[2] / length)};
  }

  void readRamp(const std::string& text, double lowest, double highest) {
    for (const std::string& part : listed(text)) {
      const auto [at, stop] = splitFirst(part, '=');
      if (part.find('=') == std::string::npos)
        refusePart(part, fmt::format("a stop AT={}", value_.quantity.word()));
      const auto place = parseNumber(at);
      if (!place || *place < lowest || *place > highest)
        refusePart(part, fmt::format("a stop at a place from {:g} to {:g}", lowest, highest));
      if (!value_.stops.empty() && *place < value_.stops.back().at)
        refusePart(part,
                   fmt::format("places that rise: {:g} comes after {:g}", *place, value_.stops.back().at));
      value_.stops.push_back({*place, amount(stop)});
    }
    if (value_.stops.size() < 2) refusePart(text, "two stops or more");
  }

  void readTwo(const std::string& part) {
    const std::vector<std::string> parts = listed(part);
    if (parts.size() != 2)
      refusePart(part,
                 fmt::format("two values {0},{0}: where it is 0, and where it is 1", value_.quantity.word()));
    value_.stops = {{0, amount(parts[0])}, {1, amount(parts[1])}};
  }

  void readMask(const std::string& rest) {
    const auto [where, values] = splitLast(rest, ':');
    value_.path = where;
    // The path itself may hold colons.
    if (!isVolumeFile(where)) std::tie(value_.path, value_.grid) = splitLast(where, ':');
    if (!isVolumeFile(value_.path) || rest.find(':') == std::string::npos)
      refuse(fmt::format("mask:FILE.vdb:{0},{0} or mask:FILE.vdb:GRID:{0},{0}", value_.quantity.word()));
    readTwo(values);
  }

  void readAttribute(const std::string& rest) {
    const auto [name, values] = splitLast(rest, ':');
    value_.attribute = name;
    const auto [before, last] = splitLast(name, ':');
    if (last == "spheres") {
      value_.attribute = before;
      value_.hasSpheres = true;
    }
    if (value_.attribute.empty() || rest.find(':') == std::string::npos)
      refuse(fmt::format("attribute:NAME:{0},{0} or attribute:NAME:spheres:{0},{0}", value_.quantity.word()));
    readTwo(values);
  }

  void readNoise(const std::string& rest) {
    const auto [noise, values] = splitFirst(rest, ':');
    const std::vector<std::string> parts = listed(noise);
    const std::string frequency = parts.front();
    value_.frequency.isRelative = frequency.ends_with('x');
    const auto number =
        parseNumber(frequency.substr(0, frequency.size() - (value_.frequency.isRelative ? 1 : 0)));
    const auto octaves = parts.size() > 1 ? parseNumber(parts[1]) : std::optional<double>(value_.octaves);
    if (parts.size() > 2 || !number || !(*number > 0 && *number <= 1e6) || !octaves ||
        !(*octaves >= 1 && *octaves <= kMostOctaves) || *octaves != std::floor(*octaves))
      refusePart(noise, fmt::format("a frequency above 0 (2.5 or 6x), and octaves from 1 to {}, as in "
                                    "noise:3x,2:0.5,1",
                                    kMostOctaves));
    value_.frequency.value = *number;
    value_.octaves = int(*octaves);
    readTwo(values);
  }

  FieldValue value_;
};

}  // namespace

std::string Quantity::allowed() const {
  const char* sign = lowIsAllowed ? ">=" : ">";
  switch (unit) {
    case Unit::length:
      return fmt::format("a length {} {:g} in world units (0.3) or percent of the longest side (5%)", sign,
                         low);
    case Unit::frequency:
      return fmt::format("cycles {} {:g} per world unit (2.5) or per longest side (6x)", sign, low);
    case Unit::number:
      break;
  }
  return fmt::format("a number from {:g} to {:g}", low, high);
}

std::string Quantity::word() const {
  return unit == Unit::length ? "LENGTH" : unit == Unit::frequency ? "FREQUENCY" : "NUMBER";
}

double Amount::inWorldUnits(Quantity::Unit unit, double longestSide) const {
  if (!isRelative) return value;
  return unit == Quantity::Unit::length ? value * 0.01 * longestSide : value / longestSide;
}

Amount FieldValue::largest(double longestSide) const {
  Amount result = std::max_element(stops.begin(), stops.end(), [&](const Stop& a, const Stop& b) {
                    return a.amount.inWorldUnits(quantity.unit, longestSide) <
                           b.amount.inWorldUnits(quantity.unit, longestSide);
                  })->amount;
  for (const FieldValue& factor : factors) result.value *= factor.largest(longestSide).value;
  return result;
}

FieldValue parseFieldValue(const std::string& option, const std::string& text, const Quantity& quantity) {
  return Parser(option, text, quantity).parsed();
}

CLI::Option* addFieldValue(CLI::App& app, const std::string& name, FieldValue& target,
                           const std::string& description) {
  return app
      .add_option_function<std::string>(
          name,
          [&target, name](const std::string& text) { target = parseFieldValue(name, text, target.quantity); },
          description)
      ->type_name(target.quantity.word() + "|FIELD")
      ->default_str(target.text);
}

std::string fieldValueHelp() {
  return "FIELD: a value that varies in space, in place of one for everywhere:\n"
         "  height:AT=VALUE,AT=VALUE[,...]        by height, from 0 (lowest point of the shape) to 1\n"
         "  along:X,Y,Z:AT=VALUE,AT=VALUE[,...]   the same along another direction\n"
         "  facing:X,Y,Z:AT=VALUE,AT=VALUE[,...]  by where the shape's surface faces: -1 away, 1 towards "
         "X,Y,Z\n"
         "  mask:FILE.vdb[:GRID]:VALUE,VALUE      where a grid is 0, and where it is 1\n"
         "  attribute:NAME[:spheres]:VALUE,VALUE  where a vertex attribute of the mesh is 0, and where it is "
         "1\n"
         "  noise:FREQUENCY[,OCTAVES]:VALUE,VALUE where smooth noise is low, and where it is high\n"
         "  FIELD*FIELD[*...]                     their product; all but the first are numbers\n";
}

}  // namespace nephele::apps
