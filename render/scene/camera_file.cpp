// Camera files: .chan and JSON.
//
// The order ZXY of .chan files is the default of Nuke's Camera and Axis nodes; Houdini and Blender write
// other orders unless told to. The JSON reader counts lines as the parser asks for characters, so that every
// message can say where, though the library keeps no places.
#include "nephele/render/scene/camera_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostBytes = std::size_t(64) << 20;
constexpr double kPiHere = 3.14159265358979323846;

[[noreturn]] void fail(const std::string& name, int line, const std::string& message) {
  throw Error(line > 0 ? fmt::format("{}:{}: {}", name, line, message) : name + ": " + message);
}

// Makes the motion; what it refuses is at the line of the frame that its message names.
CameraMotion motionOf(std::vector<CameraKey> keys, const std::vector<int>& lines, bool smooth,
                      const std::string& name) {
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (!(keys[i].frame > keys[i - 1].frame))
      fail(name, lines[i],
           fmt::format("frame {:g} comes after frame {:g}, but frames must increase", keys[i].frame,
                       keys[i - 1].frame));
  std::map<std::string, int> lineOf;
  for (std::size_t i = 0; i != keys.size(); ++i) lineOf[fmt::format("frame {:g}", keys[i].frame)] = lines[i];
  try {
    return CameraMotion(std::move(keys), smooth);
  } catch (const Error& error) {
    const std::string message = error.what();
    const auto line = lineOf.find(message.substr(0, message.find(':')));
    fail(name, line == lineOf.end() ? 0 : line->second, message);
  }
}

// Characters of a text that count the lines they come from.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, int* line) : at_(at), line_(line) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    if (*at_ == '\n') ++*line_;
    ++at_;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  int* line_;
};

// One frame of a JSON file, or the object around them: fields by name, with messages that say where.
class Fields {
 public:
  Fields(const Json& object, const std::map<std::string, int>& lines, int line, const std::string& file)
      : object_(object), lines_(lines), line_(line), file_(file) {}

  [[noreturn]] void refuse(const std::string& field, const std::string& message) const {
    const auto line = lines_.find(field);
    fail(file_, line == lines_.end() ? line_ : line->second, message);
  }
  bool has(const char* field) const { return object_.contains(field); }

  std::optional<double> number(const char* field) const {
    if (!has(field)) return std::nullopt;
    const Json& value = object_[field];
    if (!value.is_number()) refuse(field, fmt::format("{} must be a number, not {}", field, shown(value)));
    return value.get<double>();
  }

  std::optional<Vec3d> vector(const char* field) const {
    if (!has(field)) return std::nullopt;
    const Json& value = object_[field];
    bool fits = value.is_array() && value.size() == 3;
    for (std::size_t i = 0; fits && i != 3; ++i) fits = value[i].is_number();
    if (!fits) refuse(field, fmt::format("{} must be three numbers [x, y, z], not {}", field, shown(value)));
    return Vec3d{value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
  }

  std::string text(const char* field, const std::string& standard) const {
    if (!has(field)) return standard;
    const Json& value = object_[field];
    if (!value.is_string()) refuse(field, fmt::format("{} must be a text, not {}", field, shown(value)));
    return value.get<std::string>();
  }

  void allowOnly(std::initializer_list<const char*> names) const {
    for (const auto& [field, value] : object_.items()) {
      if (std::find(names.begin(), names.end(), field) != names.end()) continue;
      std::string list;
      for (const char* name : names) list += (list.empty() ? "" : ", ") + std::string(name);
      refuse(field, fmt::format("'{}' is not known; there are {}", printable(field, 60), list));
    }
  }

  static std::string shown(const Json& value) {
    const std::string text = value.dump();
    return text.size() > 60 ? text.substr(0, 57) + "..." : text;
  }

 private:
  const Json& object_;
  const std::map<std::string, int>& lines_;
  int line_;
  const std::string& file_;
};

CameraKey keyOf(const Fields& fields, const RotationOrder& order, std::optional<double> filmWidth) {
  fields.allowOnly({"frame", "position", "rotation", "look_at", "up", "fov", "vertical_fov", "focal_length",
                    "orthographic_width", "f_stop", "lens_radius", "focus_distance"});
  CameraKey key;
  const auto frame = fields.number("frame");
  if (!frame) fields.refuse("", "'frame' is missing");
  key.frame = *frame;
  const auto position = fields.vector("position");
  if (!position) fields.refuse("", fmt::format("frame {:g}: 'position' is missing", key.frame));
  key.position = *position;
  if (fields.has("rotation") == fields.has("look_at"))
    fields.refuse("look_at", fmt::format("frame {:g}: needs either 'rotation' or 'look_at'", key.frame));
  if (const auto degrees = fields.vector("rotation")) key.rotation = Rotation::euler(*degrees, order);
  key.target = fields.vector("look_at");
  if (fields.has("up") && !key.target)
    fields.refuse("up", fmt::format("frame {:g}: 'up' goes with 'look_at', not with 'rotation'", key.frame));
  key.up = fields.vector("up").value_or(Vec3d{0, 1, 0});
  key.fovDegrees = fields.number("fov");
  key.verticalFovDegrees = fields.number("vertical_fov");
  if (fields.has("fov") + fields.has("vertical_fov") + fields.has("focal_length") > 1)
    fields.refuse("fov",
                  fmt::format("frame {:g}: give one of 'fov', 'vertical_fov' and 'focal_length'", key.frame));
  if (const auto focal = fields.number("focal_length")) {
    if (!(*focal > 0))
      fields.refuse("focal_length",
                    fmt::format("frame {:g}: focal_length must be above 0, got {:g}", key.frame, *focal));
    key.fovDegrees = fovDegreesOf(*focal, filmWidth.value_or(CameraKey::kFilmWidth));
    key.hasFocalLength = true;
  }
  key.filmWidth = filmWidth;
  key.orthographicWidth = fields.number("orthographic_width");
  key.fStop = fields.number("f_stop");
  key.lensRadius = fields.number("lens_radius");
  if (key.fStop && key.lensRadius)
    fields.refuse("lens_radius",
                  fmt::format("frame {:g}: give 'f_stop' or 'lens_radius', not both", key.frame));
  key.focusDistance = fields.number("focus_distance");
  return key;
}

}  // namespace

CameraMotion parseChan(const std::string& text, const std::string& name, const RotationOrder& order) {
  std::vector<CameraKey> keys;
  std::vector<int> lines;
  std::size_t columns = 0;
  std::istringstream stream(text);
  std::string row;
  for (int line = 1; std::getline(stream, row); ++line) {
    std::vector<double> numbers;
    std::istringstream words(row);
    for (std::string word; words >> word && word[0] != '#';) {
      const char* begin = word.data() + (word[0] == '+' ? 1 : 0);
      const char* end = word.data() + word.size();
      double number = 0;
      const auto [stop, error] = std::from_chars(begin, end, number);
      if (error != std::errc() || stop != end || !std::isfinite(number))
        fail(name, line, fmt::format("'{}' is not a number", printable(word, 60)));
      numbers.push_back(number);
      if (numbers.size() > 8) break;
    }
    if (numbers.empty()) continue;
    if (numbers.size() < 7 || numbers.size() > 8)
      fail(name, line,
           fmt::format("expected 7 or 8 numbers (frame tx ty tz rx ry rz [vertical fov]), found {}",
                       numbers.size() > 8 ? "more" : std::to_string(numbers.size())));
    if (columns != 0 && columns != numbers.size())
      fail(name, line, fmt::format("has {} numbers, the lines before have {}", numbers.size(), columns));
    columns = numbers.size();
    CameraKey key;
    key.frame = numbers[0];
    key.position = {numbers[1], numbers[2], numbers[3]};
    key.rotation = Rotation::euler({numbers[4], numbers[5], numbers[6]}, order);
    if (columns == 8) key.verticalFovDegrees = numbers[7];
    keys.push_back(key);
    lines.push_back(line);
  }
  return motionOf(std::move(keys), lines, true, name);
}

CameraMotion parseCameraJson(const std::string& text, const std::string& name) {
  int line = 1;
  std::map<std::string, int> lines;
  std::vector<std::map<std::string, int>> frameLines;
  std::vector<int> frameStarts;
  // Depth 0 is the file's object, 1 its fields, 2 a frame, 3 the fields of a frame.
  const auto note = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::key && depth == 1) lines[parsed.get<std::string>()] = line;
    if (event == Json::parse_event_t::object_start && depth == 2) {
      frameStarts.push_back(line);
      frameLines.emplace_back();
    }
    if (event == Json::parse_event_t::key && depth == 3 && !frameLines.empty())
      frameLines.back()[parsed.get<std::string>()] = line;
    if (depth > 16) fail(name, line, "is nested too deeply for a camera");
    return true;
  };
  Json json;
  try {
    json = Json::parse(CountingIterator(text.data(), &line),
                       CountingIterator(text.data() + text.size(), &line), note);
  } catch (const Json::exception& error) {
    fail(name, line, "is not JSON: " + jsonFault(error.what()));
  }
  if (!json.is_object()) fail(name, 1, "must be an object with 'frames'");
  const Fields top(json, lines, 1, name);
  top.allowOnly({"frames", "rotation_order", "interpolation", "film_width"});
  RotationOrder order;
  try {
    order = RotationOrder::parse(top.text("rotation_order", "ZXY"));
  } catch (const Error& error) {
    top.refuse("rotation_order", error.what());
  }
  const std::string interpolation = top.text("interpolation", "smooth");
  if (interpolation != "smooth" && interpolation != "linear")
    top.refuse("interpolation",
               "interpolation must be smooth or linear, not " + printable(interpolation, 60));
  const std::optional<double> filmWidth = top.number("film_width");
  if (filmWidth && !(*filmWidth > 0))
    top.refuse("film_width", fmt::format("film_width must be above 0, got {:g}", *filmWidth));
  if (!top.has("frames") || !json["frames"].is_array())
    top.refuse("frames", "must have 'frames', a list of objects");
  const Json& frames = json["frames"];
  if (frames.empty()) top.refuse("frames", "holds no frames");
  std::vector<CameraKey> keys;
  for (std::size_t i = 0; i != frames.size(); ++i) {
    if (!frames[i].is_object() || i >= frameStarts.size())
      top.refuse("frames", fmt::format("frames[{}] must be an object, not {}", i, Fields::shown(frames[i])));
    keys.push_back(keyOf(Fields(frames[i], frameLines[i], frameStarts[i], name), order, filmWidth));
  }
  return motionOf(std::move(keys), frameStarts, interpolation == "smooth", name);
}

CameraMotion readCameraFile(const std::string& path, const RotationOrder& order) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  require(extension == ".chan" || extension == ".json",
          path + ": is not a camera file of a kind that is known (.chan, .json)");
  const std::string text = readTextFile(path, kMostBytes);
  return extension == ".chan" ? parseChan(text, path, order) : parseCameraJson(text, path);
}

std::string chanText(const CameraMotion& motion, double aspect, const RotationOrder& order) {
  std::string text;
  for (const CameraKey& given : motion.keys()) {
    // A key without an angle has that of the curve through those that have one.
    const CameraKey key = motion.at(given.frame);
    const Vec3d degrees = key.rotation.eulerDegrees(order);
    text += fmt::format("{} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g}", key.frame, key.position.x,
                        key.position.y, key.position.z, degrees.x, degrees.y, degrees.z);
    if (key.verticalFovDegrees) text += fmt::format(" {:.12g}", *key.verticalFovDegrees);
    if (key.fovDegrees)
      text += fmt::format(" {:.12g}",
                          std::atan(std::tan(*key.fovDegrees * kPiHere / 360) / aspect) * 360 / kPiHere);
    text += '\n';
  }
  return text;
}

std::string cameraJsonText(const CameraMotion& motion) {
  const auto triple = [](const Vec3d& v) {
    return fmt::format("[{:.12g}, {:.12g}, {:.12g}]", v.x, v.y, v.z);
  };
  std::string frames;
  for (const CameraKey& key : motion.keys()) {
    frames += frames.empty() ? "\n" : ",\n";
    frames += fmt::format("    {{\"frame\": {}, \"position\": {}", key.frame, triple(key.position));
    if (key.target)
      frames += fmt::format(", \"look_at\": {}, \"up\": {}", triple(*key.target), triple(key.up));
    else
      frames += fmt::format(", \"rotation\": {}", triple(key.rotation.eulerDegrees({})));
    const std::pair<const char*, std::optional<double>> numbers[] = {
        {"fov", key.fovDegrees},
        {"vertical_fov", key.verticalFovDegrees},
        {"orthographic_width", key.orthographicWidth},
        {"f_stop", key.fStop},
        {"lens_radius", key.lensRadius},
        {"focus_distance", key.focusDistance}};
    for (const auto& [name, value] : numbers)
      if (value) frames += fmt::format(", \"{}\": {:.12g}", name, *value);
    frames += "}";
  }
  const std::optional<double> filmWidth = motion.keys().front().filmWidth;
  return fmt::format(
      "{{\n  \"rotation_order\": \"ZXY\",\n  \"interpolation\": \"{}\",\n{}  \"frames\": [{}\n  ]\n}}\n",
      motion.isSmooth() ? "smooth" : "linear",
      filmWidth ? fmt::format("  \"film_width\": {:.12g},\n", *filmWidth) : "", frames);
}

}  // namespace nephele
