#include "apps/options/field_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/options/expression_names.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/nearest_name.h"

namespace nephele::apps {
namespace {

constexpr double kFarthestPlace = 1e6;
constexpr int kOctaves = 3, kMostOctaves = 8;
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

/// As Felt has it, so that it is read as the same number.
std::string literal(double value) {
  const std::string text = fmt::format("{}", std::abs(value));
  return value < 0 ? "-" + text : text;
}

std::string literal(const Amount& amount, Quantity::Unit unit) {
  const char* mark = !amount.isRelative ? "" : unit == Quantity::Unit::length ? "%" : "x";
  return literal(amount.value) + mark;
}

std::string literal(const std::string& text) {
  return felt::literalText(text, {felt::Kind::text});
}

std::string vectorLiteral(const Vec3f& v) {
  return fmt::format("({}, {}, {})", literal(double(v.x)), literal(double(v.y)), literal(double(v.z)));
}

/// Reads the short forms and says what they are in Felt.
class Parser {
 public:
  Parser(const std::string& option, const std::string& text, const Quantity& quantity) {
    value_.option = option;
    value_.text = text;
    value_.quantity = quantity;
  }

  FieldValue parsed() {
    const auto [text, factors] = splitFirst(value_.text, '*');
    value_.expression = one(text);
    if (value_.text.find('*') != std::string::npos) {
      const FieldValue others = parseFieldValue(value_.option, factors, kFactor);
      if (value_.constant && others.constant)
        value_.constant->value *= others.constant->value;
      else
        value_.constant.reset();
      value_.expression += " * " + others.expression;
      value_.files.insert(value_.files.end(), others.files.begin(), others.files.end());
    }
    return value_;
  }

 private:
  struct Stop {
    double at;
    Amount amount;
  };
  using Stops = std::vector<Stop>;

  std::string one(const std::string& text) {
    if (text.find(':') == std::string::npos) {
      value_.constant = amount(text);
      return literal(*value_.constant, value_.quantity.unit);
    }
    const auto [word, rest] = splitFirst(text, ':');
    if (word == "height")
      return ramp("along((0.0, 1.0, 0.0), false)", rises(rest, -kFarthestPlace, kFarthestPlace));
    if (word == "along" || word == "facing") {
      const auto [direction, stops] = splitFirst(rest, ':');
      const std::string vector = vectorLiteral(directionOf(word, direction));
      if (word == "facing") return ramp("facing(" + vector + ")", rises(stops, -1, 1));
      return ramp("along(" + vector + ", false)", rises(stops, -kFarthestPlace, kFarthestPlace));
    }
    if (word == "mask") return mask(rest);
    if (word == "attribute") return attribute(rest);
    if (word == "noise") return noise(rest);
    const std::string meant = nearestName(word, {"height", "along", "facing", "mask", "attribute", "noise"});
    refuse(value_.quantity.allowed() +
           ", height:, along:, facing:, mask:, attribute: or noise:, or an expression after =" +
           (meant.empty() ? "" : "; did you mean " + meant + ":?"));
  }

  [[noreturn]] void refuse(const std::string& allowed) const {
    throw CLI::ValidationError(value_.option, fmt::format("got '{}', allowed: {}", value_.text, allowed));
  }

  [[noreturn]] void refusePart(const std::string& part, const std::string& allowed) const {
    refuse(part == value_.text ? allowed : fmt::format("in place of '{}' {}", part, allowed));
  }

  /// The polyline through the stops.
  std::string ramp(const std::string& place, const Stops& stops) const {
    std::string places, values;
    for (const Stop& stop : stops) {
      places += (places.empty() ? "" : ", ") + literal(stop.at);
      values += (values.empty() ? "" : ", ") + literal(stop.amount, value_.quantity.unit);
    }
    return fmt::format("ramp({}, [{}], [{}])", place, places, values);
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

  Vec3f directionOf(const std::string& word, const std::string& part) const {
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
    return {float(d[0] / length), float(d[1] / length), float(d[2] / length)};
  }

  Stops rises(const std::string& text, double lowest, double highest) const {
    Stops stops;
    for (const std::string& part : listed(text)) {
      const auto [at, stop] = splitFirst(part, '=');
      if (part.find('=') == std::string::npos)
        refusePart(part, fmt::format("a stop AT={}", value_.quantity.word()));
      const auto place = parseNumber(at);
      if (!place || *place < lowest || *place > highest)
        refusePart(part, fmt::format("a stop at a place from {:g} to {:g}", lowest, highest));
      if (!stops.empty() && *place < stops.back().at)
        refusePart(part, fmt::format("places that rise: {:g} comes after {:g}", *place, stops.back().at));
      stops.push_back({*place, amount(stop)});
    }
    if (stops.size() < 2) refusePart(text, "two stops or more");
    return stops;
  }

  Stops two(const std::string& part) const {
    const std::vector<std::string> parts = listed(part);
    if (parts.size() != 2)
      refusePart(part,
                 fmt::format("two values {0},{0}: where it is 0, and where it is 1", value_.quantity.word()));
    return {{0, amount(parts[0])}, {1, amount(parts[1])}};
  }

  std::string mask(const std::string& rest) {
    const auto [where, values] = splitLast(rest, ':');
    std::string path = where, grid;
    // The path itself may hold colons.
    if (!isVolumeFile(where)) std::tie(path, grid) = splitLast(where, ':');
    if (!isVolumeFile(path) || rest.find(':') == std::string::npos)
      refuse(fmt::format("mask:FILE.vdb:{0},{0} or mask:FILE.vdb:GRID:{0},{0}", value_.quantity.word()));
    value_.files.push_back(path);
    return ramp(fmt::format("mask({}, {})", literal(path), literal(grid)), two(values));
  }

  std::string attribute(const std::string& rest) const {
    const auto [typed, values] = splitLast(rest, ':');
    std::string name = typed;
    const auto [before, last] = splitLast(name, ':');
    const bool hasSpheres = last == "spheres";
    if (hasSpheres) name = before;
    if (name.empty() || rest.find(':') == std::string::npos)
      refuse(fmt::format("attribute:NAME:{0},{0} or attribute:NAME:spheres:{0},{0}", value_.quantity.word()));
    return ramp(fmt::format("attribute({}{})", literal(name), hasSpheres ? ", \"spheres\"" : ""),
                two(values));
  }

  std::string noise(const std::string& rest) const {
    const auto [noise, values] = splitFirst(rest, ':');
    const std::vector<std::string> parts = listed(noise);
    const std::string frequency = parts.front();
    const bool isRelative = frequency.ends_with('x');
    const auto number = parseNumber(frequency.substr(0, frequency.size() - (isRelative ? 1 : 0)));
    const auto octaves = parts.size() > 1 ? parseNumber(parts[1]) : std::optional<double>(kOctaves);
    if (parts.size() > 2 || !number || !(*number > 0 && *number <= 1e6) || !octaves ||
        !(*octaves >= 1 && *octaves <= kMostOctaves) || *octaves != std::floor(*octaves))
      refusePart(noise, fmt::format("a frequency above 0 (2.5 or 6x), and octaves from 1 to {}, as in "
                                    "noise:3x,2:0.5,1",
                                    kMostOctaves));
    const std::string place =
        fmt::format("smoothstep(-1.5, 1.5, fractalsum({}, {}, seed = seed))", int(*octaves),
                    literal({*number, isRelative}, Quantity::Unit::frequency));
    return ramp(place, two(values));
  }

  FieldValue value_;
};

/// Expressions as typed; their faults are told by the language.
FieldValue parsedExpression(const std::string& option, const std::string& text, const Quantity& quantity) {
  FieldValue value{.quantity = quantity, .option = option, .text = text};
  value.expression = text.substr(1);
  value.isTypedAsExpression = true;
  static const ExpressionNames names = namesOfShape();
  for (const std::string& string :
       checkedExpression(option, value.expression, {felt::Kind::scalarField}, names))
    if (isVolumeFile(string)) value.files.push_back(string);
  return value;
}

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

FieldValue parseFieldValue(const std::string& option, const std::string& text, const Quantity& quantity) {
  if (text.starts_with('=')) return parsedExpression(option, text, quantity);
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
         "  FIELD*FIELD[*...]                     their product; all but the first are numbers\n"
         "  =EXPRESSION                           anything else, of P, height, normal, facing(DIRECTION), "
         "mask(\"FILE\"), attribute(\"NAME\"), time, seed; see docs/felt.md\n";
}

}  // namespace nephele::apps
