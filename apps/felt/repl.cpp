#include "apps/felt/repl.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/felt/explain.h"
#include "apps/felt/felt_scripts.h"
#include "apps/felt/field_drawing.h"
#include "apps/felt/function_list.h"
#include "apps/felt/line_reader.h"
#include "apps/options/expression_names.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/render/image/png_io.h"

namespace nephele::apps {
namespace {

using felt::Kind;
using felt::Named;

constexpr const char* kPrompt = "felt> ";
constexpr const char* kMorePrompt = "  ... ";
constexpr int kPicturePixels = 512;

constexpr const char* kHelp =
    "Statements are carried out, expressions are answered; a ; at the end may be left out.\n"
    ":plot FIELD from (x, y, z) to (x, y, z)      the field along a line\n"
    ":slice FIELD [z=0] [FILE.png]                the field on a plane, as text or as a picture\n"
    "   ... from (x, y, z) to (x, y, z)           in this box; else in the first domain or shape\n"
    ":help WORD                                   functions that are called so, or speak of it\n"
    ":names                                       what has been declared\n"
    ":quit";

/// What of a text matters for whether it is whole, and what it is.
struct Outline {
  /// Brackets that have not been closed.
  int open = 0;
  bool isAssignment = false;
  /// The last character that is neither space nor comment.
  char last = ' ';

  explicit Outline(const std::string& text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : '\0';
      if (c == '/' && next == '/') {
        i = std::min(text.find('\n', i), text.size());
        continue;
      }
      if (c == '/' && next == '*') {
        const std::size_t end = text.find("*/", i + 2);
        if (end == std::string::npos) {
          open = 1;
          return;
        }
        i = end + 1;
        continue;
      }
      if (c == '"') {
        for (++i; i < text.size() && text[i] != '"' && text[i] != '\n'; ++i)
          if (text[i] == '\\') ++i;
        last = c;
        continue;
      }
      if (c == '(' || c == '[' || c == '{') ++open;
      if (c == ')' || c == ']' || c == '}') open = std::max(0, open - 1);
      const bool compares = next == '=' || last == '=' || last == '<' || last == '>' || last == '!';
      if (c == '=' && open == 0 && !compares) isAssignment = true;
      if (c != ' ' && c != '\t' && c != '\n' && c != '\r') last = c;
    }
  }
};

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
}

class Repl {
 public:
  Repl(const felt::Limits& limits, Run& run)
      : run_(run),
        context_(feltContext(limits, run)),
        session_(feltFunctions(), context_, namesOfPlace(0, 0).given) {}

  /// Whether there was no fault.
  bool answerAll() {
    LineReader reader([&] { return words(); });
    if (reader.isTerminal()) run_.result("Felt; :help says what there is, :quit ends.");
    bool isGood = true;
    while (!hasQuit_) {
      std::optional<std::string> text = reader.next(kPrompt);
      line_ = ++lines_;
      while (text && !text->starts_with(':') && Outline(*text).open > 0) {
        const std::optional<std::string> more = reader.next(kMorePrompt);
        if (!more) break;
        ++lines_;
        *text += '\n' + *more;
      }
      run_.check();
      if (!text) break;
      isGood = answered(trimmed(*text)) && isGood;
      std::fflush(stdout);
    }
    return isGood || reader.isTerminal();
  }

 private:
  bool answered(const std::string& text) {
    try {
      if (text.starts_with(':'))
        obey(text);
      else if (!text.empty())
        carryOut(text);
      return true;
    } catch (const felt::ScriptError& error) {
      std::fprintf(stderr, "%s\n", error.what());
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      std::fprintf(stderr, "error: %s\n", printable(error.what()).c_str());
    }
    return false;
  }

  Named entered(const std::string& text) { return session_.enter(text, fmt::format("line {}", line_)); }

  void carryOut(const std::string& text) {
    const Outline outline(text);
    const auto firstWord = text.substr(0, text.find_first_of(" ([;"));
    // "float(3)" is a value, "float a" declares.
    const bool declares = felt::kindOf(firstWord) && text.find_first_of("([;") != firstWord.size();
    const bool isWhole = outline.last == ';' || outline.last == '}';
    const Named answer = entered(!isWhole && (outline.isAssignment || declares) ? text + ";" : text);
    for (const std::string& warning : session_.warnings()) std::fprintf(stderr, "%s\n", warning.c_str());
    if (answer.type.kind != Kind::nothing) tell("", answer);
  }

  void tell(const std::string& name, const Named& named) {
    const std::string type = typeName(named.type), value = shown(named.value, named.type);
    const std::string start = name.empty() ? "" : name + " = ";
    run_.result(named.type.isField() || value == "nothing" ? start + value
                                                           : fmt::format("{}{} : {}", start, value, type));
  }

  void obey(const std::string& text) {
    const std::size_t space = std::min(text.find(' '), text.size());
    const std::string command = text.substr(0, space), rest = trimmed(text.substr(space));
    if (command == ":quit" || command == ":q")
      hasQuit_ = true;
    else if (command == ":help" && rest.empty())
      context_.print(kHelp);
    else if (command == ":help")
      listFunctions(rest, run_);
    else if (command == ":names")
      for (const std::string& name : session_.names()) tell(name, valueOf(name));
    else if (command == ":plot")
      plot(rest);
    else if (command == ":slice")
      slice(rest);
    else
      throw Error(fmt::format("there is no command {}; :help says which there are", quoted(command, 40)));
  }

  /// The value of a variable; nothing if it has none.
  Named valueOf(const std::string& name) {
    try {
      return entered(name);
    } catch (const felt::ScriptError&) {
      return {};
    }
  }

  ScalarField fieldOf(const std::string& text) {
    if (text.empty()) throw Error("say which field");
    const Named named = entered(text);
    const felt::Type wanted{Kind::scalarField};
    if (named.type != wanted && !conversionCost(named.type, wanted))
      throw Error(fmt::format("{} is {}; what can be drawn is a scalarfield, such as .x of a vectorfield",
                              quoted(text, 60), articledName(named.type)));
    return converted(named.value, wanted).as<ScalarField>();
  }

  Vec3f vectorOf(const std::string& text) {
    const Named named = entered(text);
    if (named.type != felt::Type{Kind::vector})
      throw Error(quoted(text, 60) + " is no vector such as (1, 0, 0)");
    return felt::toFloat(named.value.as<Vec3d>());
  }

  /// Takes "from A to B" off the end of `text`.
  std::optional<std::pair<Vec3f, Vec3f>> takeEnds(std::string& text) {
    const std::size_t from = text.rfind(" from "), to = text.rfind(" to ");
    if (from == std::string::npos || to == std::string::npos || to < from) return std::nullopt;
    const std::pair ends{vectorOf(text.substr(from + 6, to - from - 6)), vectorOf(text.substr(to + 4))};
    text = trimmed(text.substr(0, from));
    return ends;
  }

  void plot(std::string text) {
    const auto ends = takeEnds(text);
    if (!ends) throw Error("write :plot FIELD from (x, y, z) to (x, y, z)");
    for (const std::string& line : plotted(fieldOf(text), ends->first, ends->second)) run_.result(line);
  }

  void slice(std::string text) {
    std::string picture;
    std::optional<std::pair<int, float>> plane;
    std::optional<std::pair<Vec3f, Vec3f>> ends;
    // What stands behind the field comes in any order.
    while (true) {
      const bool isQuoted = text.size() > 1 && text.ends_with('"');
      const std::size_t space = isQuoted ? text.rfind('"', text.size() - 2) : text.rfind(' ');
      std::string word = space == std::string::npos ? "" : text.substr(space + 1);
      if (isQuoted && !word.empty()) word.pop_back();
      const bool isPlane = word.size() > 2 && word[0] >= 'x' && word[0] <= 'z' && word[1] == '=';
      if (word.ends_with(".png"))
        picture = word;
      else if (isPlane && parseNumber(word.substr(2)))
        plane = {word[0] - 'x', float(*parseNumber(word.substr(2)))};
      else if (!ends && (ends = takeEnds(text)))
        continue;
      else
        break;
      text = trimmed(text.substr(0, space));
    }
    Slice slice{ends ? Box{}.including(ends->first).including(ends->second) : boxOfSession()};
    const Vec3f size = slice.box.max - slice.box.min;
    slice.axis = plane ? plane->first : 2;
    slice.place = plane ? plane->second : 0.5f * (slice.box.min.z + slice.box.max.z);
    if (!(size[slice.right()] > 0 && size[slice.up()] > 0)) throw Error("the box has no extent");
    const ScalarField field = fieldOf(text);
    if (picture.empty()) {
      for (const std::string& line : drawn(field, slice)) run_.result(line);
      return;
    }
    writePng(picture, pictureOf(field, slice, kPicturePixels), {.shoulder = 0.999f}, run_.metadata());
    run_.result("wrote " + picture);
  }

  Box boxOfSession() {
    std::vector<Named> variables;
    for (const std::string& name : session_.names()) variables.push_back(valueOf(name));
    return boxOfInterest(variables);
  }

  std::vector<std::string> words() const {
    std::vector<std::string> all = session_.names();
    for (const std::string& name : feltFunctions().names()) all.push_back(name);
    for (const char* word : {":plot", ":slice", ":help", ":names", ":quit"}) all.emplace_back(word);
    return all;
  }

  Run& run_;
  felt::Context context_;
  felt::Session session_;
  /// Lines that were read, and the first of those that are being answered.
  int lines_ = 0, line_ = 0;
  bool hasQuit_ = false;
};

}  // namespace

void answerLines(const felt::Limits& limits, Run& run) {
  if (!Repl(limits, run).answerAll()) throw AlreadyTold{kUsage};
}

}  // namespace nephele::apps
