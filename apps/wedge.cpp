#include "apps/wedge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <string_view>

#include "apps/options/config_file.h"
#include "apps/options/options.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/nearest_name.h"
#include "nephele/render/image/frame_range.h"

namespace nephele::apps {
namespace {

constexpr const char* kWedgeForm =
    "OPTION=VALUES, as in seed=1-12, billow=0,0.5,1,2 or sun=90,38;120,10 (several options: once more)";
constexpr std::string_view kNever[]{"frames",        "only",        "shard",   "skip-existing",  "wedge",
                                    "contact-sheet", "stats",       "quiet",   "verbose",        "progress",
                                    "overwrite",     "config",      "threads", "display-server", "help",
                                    "help-all",      "memory-limit"};

void refuseCount(double count) {
  if (count <= double(Wedge::kMost)) return;
  throw CLI::ValidationError(
      "--wedge", fmt::format("{:g} calls are more than {}; give fewer values", count, Wedge::kMost));
}

/// The numbers of "FIRST-LAST" or "FIRST-LASTxSTEP"; nothing where `text` is anything else.
std::optional<std::vector<std::string>> rangeOf(const std::string& text) {
  // The first sign may be that of a number.
  const std::size_t dash = text.find('-', 1);
  if (dash == std::string::npos) return std::nullopt;
  const std::size_t times = std::min(text.find('x', dash), text.size());
  const auto first = parseNumber(std::string_view(text).substr(0, dash)),
             last = parseNumber(std::string_view(text).substr(dash + 1, times - dash - 1)),
             step = times == text.size() ? 1.0 : parseNumber(std::string_view(text).substr(times + 1));
  if (!first || !last || !step) return std::nullopt;
  if (!(*step > 0) || *last < *first) refuseValue("--wedge", text, "a range that grows, FIRST-LASTxSTEP");
  // So that the last of 0-1x0.1 is one of them.
  const double count = std::floor((*last - *first) / *step + 1e-6) + 1;
  refuseCount(count);
  std::vector<std::string> values;
  for (int i = 0; i < int(count); ++i) values.push_back(fmt::format("{:.10g}", *first + i * *step));
  return values;
}

std::vector<std::string> valuesOf(const std::string& text) {
  const char separator = text.find(';') != std::string::npos ? ';' : ',';
  std::vector<std::string> values;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    const std::string part = text.substr(at, end - at);
    at = end + 1;
    if (part.empty()) refuseValue("--wedge", text, kWedgeForm);
    if (parseNumber(part)) {
      values.push_back(part);
      continue;
    }
    const auto range = rangeOf(part);
    if (range)
      values.insert(values.end(), range->begin(), range->end());
    else
      values.push_back(part);
  }
  for (std::size_t i = 0; i != values.size(); ++i)
    if (std::find(values.begin(), values.begin() + std::ptrdiff_t(i), values[i]) !=
        values.begin() + std::ptrdiff_t(i))
      refuseValue("--wedge", text, fmt::format("values that differ; {} is there twice", values[i]));
  return values;
}

/// What may stand in the name of a file everywhere.
std::string inFileName(const std::string& text) {
  std::string name;
  for (const char c : text)
    name += std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '-' || c == '+' ? c : '_';
  while (name.ends_with('_')) name.pop_back();
  return name;
}

bool isOption(const std::string& argument, const CLI::App& app, bool (*fits)(const CLI::Option&)) {
  const bool isName = argument.starts_with("--") || (argument.size() == 2 && argument[0] == '-');
  const CLI::Option* option = isName ? app.get_option_no_throw(argument) : nullptr;
  return option && fits(*option);
}

}  // namespace

std::optional<Wedge> Wedge::taken(std::vector<std::string>& arguments, const CLI::App& app) {
  std::vector<std::string> wedges, others;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--wedge" && i + 1 < arguments.size())
      wedges.push_back(arguments[++i]);
    else if (arguments[i].starts_with("--wedge="))
      wedges.push_back(arguments[i].substr(8));
    else
      others.push_back(arguments[i]);
  }
  if (wedges.empty()) return std::nullopt;
  if (wedges.size() > 2)
    throw CLI::ValidationError("--wedge", "two options make a table; give no more of them");
  Wedge wedge;
  double count = 1;
  for (const std::string& text : wedges) {
    const std::size_t equals = text.find('=');
    Axis axis{text.substr(0, equals), {}, false};
    if (equals == std::string::npos || equals == 0) refuseValue("--wedge", text, kWedgeForm);
    const CLI::Option* option = app.get_option_no_throw("--" + axis.option);
    if (!option || isOutput(*option) || std::ranges::count(kNever, axis.option) > 0) {
      std::vector<std::string> names;
      for (const CLI::Option* one : app.get_options())
        for (const std::string& name : one->get_lnames()) names.push_back(name);
      const std::string meant = option ? "" : nearestName(axis.option, names);
      throw CLI::ValidationError(
          "--wedge", fmt::format("'{}' is not an option that a wedge can vary{}", axis.option,
                                 meant.empty() ? "" : fmt::format("; did you mean '{}'?", meant)));
    }
    for (const std::string& other : others)
      if (other == "--" + axis.option || other.starts_with("--" + axis.option + "="))
        throw CLI::ValidationError("--wedge", fmt::format("--{} is given by itself, too", axis.option));
    axis.values = valuesOf(text.substr(equals + 1));
    axis.isFlag = option->get_items_expected_max() == 0;
    for (const std::string& value : axis.values)
      if (axis.isFlag && value != "true" && value != "false")
        refuseValue("--wedge", text, fmt::format("{}=true,false, since it is a flag", axis.option));
    count *= double(axis.values.size());
    refuseCount(count);
    wedge.axes_.push_back(std::move(axis));
  }
  if (wedge.axes_.size() == 2 && wedge.axes_[0].option == wedge.axes_[1].option)
    throw CLI::ValidationError("--wedge", fmt::format("'{}' is there twice", wedge.axes_[0].option));
  arguments = std::move(others);
  return wedge;
}

std::size_t Wedge::size() const {
  std::size_t count = 1;
  for (const Axis& axis : axes_) count *= axis.values.size();
  return count;
}

void Wedge::requireFew(std::size_t frames) const {
  if (size() * frames > kMost)
    throw CLI::ValidationError(
        "--wedge",
        fmt::format("{} frames of {} values are {} calls, more than {}; give fewer values or frames", frames,
                    size(), size() * frames, kMost));
}

std::optional<int> Wedge::columns() const {
  return axes_.size() == 2 ? std::optional(int(axes_[1].values.size())) : std::nullopt;
}

const std::string& Wedge::valueOf(std::size_t axis, std::size_t index) const {
  const std::size_t columns = axes_.back().values.size();
  return axes_[axis].values[axis + 1 == axes_.size() ? index % columns : index / columns];
}

std::map<std::string, std::string> Wedge::values(std::size_t index) const {
  std::map<std::string, std::string> result;
  for (std::size_t axis = 0; axis != axes_.size(); ++axis) result[axes_[axis].option] = valueOf(axis, index);
  return result;
}

std::vector<std::string> Wedge::arguments(std::size_t index) const {
  std::vector<std::string> result;
  for (std::size_t axis = 0; axis != axes_.size(); ++axis) {
    const std::string& value = valueOf(axis, index);
    const bool isOn = axes_[axis].isFlag && value == "true";
    result.push_back("--" + axes_[axis].option + (isOn ? "" : "=" + value));
  }
  return result;
}

std::string Wedge::label(std::size_t index) const {
  std::string text;
  for (std::size_t axis = 0; axis != axes_.size(); ++axis)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", axes_[axis].option, valueOf(axis, index));
  return text;
}

std::string Wedge::fileName(const std::string& path, std::size_t index, bool isSequence) const {
  if (isStream(path)) return path;
  const int places = FramePattern::places(path);
  if (places > 1) refuseValue("--wedge", path, "outputs with one place for a number, as in NAME.####.EXT");
  const bool hasPlace = places == 1;
  if (hasPlace && !isSequence) return FramePattern::parse(path).path(int(index) + 1);
  std::string values;
  for (std::size_t axis = 0; axis != axes_.size(); ++axis) {
    const std::string own = inFileName(valueOf(axis, index));
    std::string name = own;
    // Values that differ only in other signs.
    for (const std::string& other : axes_[axis].values)
      if (&other == &valueOf(axis, index))
        break;
      else if (inFileName(other) == own)
        name += "_";
    values += fmt::format("{}{}_{}", values.empty() ? "" : ".", axes_[axis].option, name);
  }
  if (hasPlace) return FramePattern::parse(path).withWords(values);
  std::filesystem::path file(path);
  if (!file.has_filename()) file = file.parent_path();
  return (file.parent_path() / (file.stem().string() + "." + values + file.extension().string())).string();
}

std::vector<std::string> Wedge::named(std::vector<std::string> arguments, std::size_t index,
                                      const CLI::App& app) const {
  for (const Axis& axis : axes_)
    if (axis.isFlag) std::erase(arguments, "--" + axis.option + "=false");
  const bool isSequence = givenTo("--frames", arguments).has_value();
  const auto own = [&](const std::string& path) { return fileName(path, index, isSequence); };
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    std::string& argument = arguments[i];
    const std::size_t equals = argument.find('=');
    if (argument.starts_with("-o") && argument.size() > 2)
      argument = "-o" + own(argument.substr(2));
    else if (equals != std::string::npos && isOption(argument.substr(0, equals), app, isOutputOfCall))
      argument = argument.substr(0, equals + 1) + own(argument.substr(equals + 1));
    else if (isOption(argument, app, isOutputOfCall) && i + 1 < arguments.size()) {
      arguments[i + 1] = own(arguments[i + 1]);
      ++i;
    }
  }
  return arguments;
}

}  // namespace nephele::apps
