// Man pages from the table of options.
#include "apps/manual/man_page.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/manual/option_table.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

/// Text as troff prints it.
std::string roff(const std::string& text) {
  std::string result;
  bool startsLine = true;
  for (const char c : text) {
    if (startsLine && (c == '.' || c == '\'')) result += "\\&";
    startsLine = c == '\n';
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else if (c == '\'')
      result += "\\(aq";
    else if (c == '`')
      result += "\\(ga";
    else if (c == '^')
      result += "\\(ha";
    else if (c == '~')
      result += "\\(ti";
    else
      result += c;
  }
  return result;
}

std::string heading(const std::string& page, const std::string& summary) {
  std::string lower = summary;
  if (!lower.empty()) lower[0] = char(std::tolower(static_cast<unsigned char>(lower[0])));
  if (lower.ends_with('.')) lower.pop_back();
  return fmt::format(".TH {} 1 \"\" \"nephele {}\" \"Nephele\"\n.ad l\n.nh\n.SH NAME\n{} \\- {}\n",
                     roff(page), NEPHELE_VERSION, roff(page), roff(lower));
}

std::string entry(const OptionRow& row) {
  std::string names = row.shortName.empty() ? "" : fmt::format("\\fB{}\\fR, ", roff(row.shortName));
  names += row.isInput ? fmt::format("\\fI{}\\fR", roff(row.name))
                       : fmt::format("\\fB{}\\fR", roff("--" + row.name));
  if (!row.type.empty() && !row.isInput) names += fmt::format(" \\fI{}\\fR", roff(row.type));
  std::string notes;
  if (row.isRequired) notes += " Required.";
  if (!row.standard.empty()) notes += fmt::format(" Default: {}.", roff(row.standard));
  return fmt::format(".TP\n{}\n{}{}\n", names, roff(row.help), notes);
}

/// Lines as they are, such as commands.
std::string verbatim(const std::string& text) {
  return ".PP\n.nf\n" + roff(text) + (text.ends_with('\n') ? "" : "\n") + ".fi\n";
}

std::string pageOf(const Verb& verb) {
  std::string page = heading("nephele-" + verb.name, verb.summary);
  const std::vector<OptionRow> rows = optionTable(verb);
  std::string inputs;
  for (const OptionRow& row : rows)
    if (row.isInput) inputs += fmt::format(" \\fI{}\\fR", roff(row.name));
  page += fmt::format(".SH SYNOPSIS\n\\fBnephele {}\\fR [\\fIOPTIONS\\fR]{}\n.SH DESCRIPTION\n{}\n",
                      verb.name, inputs, roff(verb.summary));
  std::string group;
  for (const OptionRow& row : rows) {
    const std::string title = row.isInput ? "Inputs" : row.group;
    if (title != group) page += fmt::format(".SH \"{}\"\n", roff(title));
    group = title;
    page += entry(row);
  }
  if (!verb.notes.empty()) page += ".SH NOTES\n" + verbatim(verb.notes);
  page += ".SH EXAMPLES\n" + verbatim(verb.example);
  return page +
         ".SH \"EXIT STATUS\"\n0 on success, 1 where the work failed, 2 where the command line cannot be "
         "used, and 128 plus "
         "its number after a signal.\n.SH \"SEE ALSO\"\n\\fBnephele\\fR(1)\n";
}

std::string overviewPage(const std::vector<Verb>& verbs) {
  std::string page = heading("nephele", "Clouds and level sets from meshes.");
  page +=
      ".SH SYNOPSIS\n\\fBnephele\\fR \\fIVERB\\fR [\\fIOPTIONS\\fR]\n.SH DESCRIPTION\nTurns meshes into "
      "clouds: level "
      "sets, layers of pyroclastic displacement, precomputed light and pictures.\n.SH VERBS\n";
  for (const Verb& verb : verbs)
    page += fmt::format(".TP\n\\fB{}\\fR\n{} See \\fBnephele\\-{}\\fR(1).\n", verb.name, roff(verb.summary),
                        verb.name);
  page += ".SH EXAMPLES\n";
  for (const char* name : {"cloud", "render"})
    page += verbatim(std::ranges::find(verbs, name, &Verb::name)->example);
  return page;
}

}  // namespace

std::string manPage(const std::string& name) {
  const std::vector<Verb> verbs = allVerbs();
  if (name.empty()) return overviewPage(verbs);
  const auto verb = std::ranges::find(verbs, name, &Verb::name);
  require(verb != verbs.end(), fmt::format("unknown verb '{}'", name));
  return pageOf(*verb);
}

}  // namespace nephele::apps
