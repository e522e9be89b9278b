#include "apps/look/exports.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "apps/detail/typed_line.h"
#include "nephele/levelset/io/output_file.h"

namespace nephele::apps {
namespace {

std::string quotedText(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

void addTable(std::string& text, const std::string& name, const nlohmann::json& settings) {
  if (settings.empty()) return;
  text += (text.empty() ? "[" : "\n[") + name + "]\n";
  for (const auto& [key, value] : settings.items()) {
    text += key + " = ";
    if (value.is_boolean()) {
      text += value.get<bool>() ? "true" : "false";
    } else if (value.is_array()) {
      text += "[";
      for (std::size_t i = 0; i < value.size(); ++i)
        text += (i ? ", " : "") + quotedText(value[i].get<std::string>());
      text += "]";
    } else {
      text += quotedText(value.get<std::string>());
    }
    text += '\n';
  }
}

std::filesystem::path folderOfLooks() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  require((config && *config) || (home && *home), "looks are saved in the home folder, and $HOME is not set");
  return std::filesystem::path(config && *config ? config : std::string(home) + "/.config") / "nephele" /
         "looks";
}

/// The same text, as long, with blanks for comments.
std::string withoutComments(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') {
      for (++i; i < text.size() && text[i] != '"' && text[i] != '\n'; ++i)
        if (text[i] == '\\') ++i;
      continue;
    }
    const std::string_view rest = std::string_view(text).substr(i);
    if (!rest.starts_with("//") && !rest.starts_with("/*")) continue;
    const std::size_t found = rest.starts_with("//") ? rest.find('\n') : rest.find("*/", 2);
    const std::size_t end = found == rest.npos ? text.size() : i + found + (rest.starts_with("//") ? 0 : 2);
    for (; i < end; ++i)
      if (text[i] != '\n') text[i] = ' ';
    --i;
  }
  return text;
}

}  // namespace

std::vector<std::string> LookExports::volumeLine(const std::string& output) const {
  const std::string verb = what == LookShow::What::wisps ? "wisps" : "cloud";
  std::vector<std::string> line{verb};
  const LookSettings own = verb == "cloud" ? subject.cloudSettings(settings) : settings[verb];
  if (!subject.path.empty()) line.push_back(subject.path);
  line.push_back("-o");
  line.push_back(output);
  for (std::string& argument : argumentsOf(own)) line.push_back(std::move(argument));
  return line;
}

std::vector<std::string> LookExports::shapesLine() const {
  const std::string verb = LookShow::verb(what);
  std::vector<std::string> line{verb};
  if (what == LookShow::What::transfer)
    line.insert(line.end(), {"--from", subject.reference, "--to", subject.path});
  else
    line.push_back(subject.path);
  nlohmann::json own = settings[verb];
  // What only a picture has to do with.
  for (const char* name : {"checker", "preview-paint"}) own.erase(name);
  for (std::string& argument : argumentsOf(own)) line.push_back(std::move(argument));
  return line;
}

std::vector<std::string> LookExports::previewLine(const std::string& preview) const {
  std::vector<std::string> line{"--preview", preview, fmt::format("--size={}x{}", width, height)};
  const nlohmann::json &own = settings[LookShow::verb(what)], &render = settings["render"];
  for (const char* name : {"checker", "preview-paint"})
    if (own.contains(name)) line.push_back(fmt::format("--{}={}", name, own[name].get<std::string>()));
  if (render.contains("view")) line.push_back("--view=" + render["view"].get<std::string>());
  return line;
}

std::vector<std::string> LookExports::pictureLine(const std::string& verb, const std::string& volume) const {
  std::vector<std::string> line{verb, subject.hasCloud() ? volume : subject.path};
  for (std::string& argument : argumentsOf(settings["render"])) line.push_back(std::move(argument));
  for (const auto& [name, value] : settings["parameters"].items()) {
    line.push_back("--set");
    line.push_back(name + "=" + (value.is_string() ? value.get<std::string>() : value.dump()));
  }
  line.push_back(fmt::format("--size={}x{}", width, height));
  return line;
}

std::vector<std::string> LookExports::typed() const {
  std::vector<std::string> lines;
  if (what == LookShow::What::pieces || what == LookShow::What::transfer) {
    std::vector<std::string> line = shapesLine();
    line.insert(line.end(), {"-o", what == LookShow::What::pieces ? "pieces" : "object_uv.obj"});
    for (std::string& argument : previewLine(LookShow::word(what) + ".png"))
      line.push_back(std::move(argument));
    return {"nephele " + typedLine(line)};
  }
  if (subject.hasCloud()) lines.push_back("nephele " + typedLine(volumeLine("cloud.vdb")));
  std::vector<std::string> picture = pictureLine("render", "cloud.vdb");
  picture.insert(picture.end(), {"-o", "cloud.exr", "--preview", "cloud.png"});
  lines.push_back("nephele " + typedLine(picture));
  return lines;
}

std::string LookExports::recipe() const {
  std::string text;
  if (subject.hasCloud()) {
    addTable(text, "cloud", subject.cloudSettings(settings));
    for (const char* verb : {"wisps", "cut", "transfer"}) addTable(text, verb, settings[verb]);
  }
  auto render = settings["render"];
  for (const auto& [name, value] : settings["parameters"].items())
    render["set"].push_back(name + "=" + (value.is_string() ? value.get<std::string>() : value.dump()));
  addTable(text, "render", render);
  return text;
}

std::string LookExports::script() const {
  std::ifstream file(subject.path, std::ios::binary);
  require(file.good(), subject.path + ": cannot be read");
  std::ostringstream whole;
  whole << file.rdbuf();
  std::string text = whole.str();
  for (const auto& [name, value] : settings["parameters"].items()) {
    std::string set = value.is_string() ? value.get<std::string>() : value.dump();
    // param TYPE NAME = VALUE, up to the range, the text or the end of the statement.
    const std::regex declared("(\\bparam\\s+([A-Za-z]+(?:\\s*\\[\\s*\\])?)\\s+" + name +
                              "\\s*=\\s*)((?:\"[^\"]*\"|\\([^;]*?\\)|[^;\"]*?))(\\s*(?:\\bin\\b|;|\"))");
    const std::string code = withoutComments(text);
    std::smatch found;
    if (!std::regex_search(code, found, declared)) continue;
    if (found[2] == "string" && !set.starts_with('"')) set = quotedText(set);
    text.replace(std::size_t(found.position(3)), std::size_t(found.length(3)), set);
  }
  return text;
}

nlohmann::json savedLooks(const LookSubject& subject) {
  auto looks = nlohmann::json::array();
  std::error_code error;
  std::vector<std::filesystem::path> paths;
  try {
    for (const auto& entry : std::filesystem::directory_iterator(folderOfLooks(), error))
      if (entry.path().extension() == ".json") paths.push_back(entry.path());
  } catch (const Error&) {
    return looks;
  }
  std::ranges::sort(paths);
  for (const auto& path : paths) try {
      std::ifstream file(path);
      LookSettings settings = checkedSettings(nlohmann::json::parse(file));
      // What belongs to another shape.
      for (const char* name : {"species", "shape-seed", "shape-size"})
        if (!subject.path.empty()) settings["cloud"].erase(name);
      for (const char* name : {"combine", "blend", "repair", "subdivide"})
        if (subject.path.empty()) settings["cloud"].erase(name);
      looks.push_back({{"name", path.stem().string()}, {"settings", std::move(settings)}});
    } catch (const std::exception&) {
      // Somebody else's file.
    }
  return looks;
}

void saveLook(const std::string& name, const LookSettings& settings) {
  static const std::regex plain("[A-Za-z0-9][A-Za-z0-9 _-]{0,63}");
  if (!std::regex_match(name, plain))
    throw LookFault(
        "", "the name of a look: letters, digits, spaces, - and _, at most 64, and a letter or digit first");
  const std::filesystem::path folder = folderOfLooks();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  require(!error, folder.string() + ": cannot be made: " + error.message());
  OutputFile output((folder / (name + ".json")).string());
  OutputStream stream(output);
  stream.write(settings.dump(2) + "\n");
  stream.close();
  output.commit();
}

std::string plainFileName(const std::string& name, const std::vector<std::string>& extensions) {
  const bool isPlain = !name.empty() && name.size() <= 200 && name.front() != '.' && name.front() != '-' &&
                       name.find_first_of("/\\\n\r\t") == std::string::npos &&
                       name.find('\0') == std::string::npos;
  const bool fits = std::ranges::any_of(extensions, [&](const std::string& extension) {
    return name.ends_with(extension) && name.size() > extension.size();
  });
  if (!isPlain || !fits)
    throw LookFault(
        "", fmt::format("file: got '{}', allowed: a name without folders{}{}", name,
                        extensions.front().empty() ? "" : " that ends with ", fmt::join(extensions, " or ")));
  return name;
}

}  // namespace nephele::apps
