#include "apps/options/first_day.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "apps/options/common_group.h"

namespace nephele::apps {

const std::vector<FirstDay>& firstDays() {
  static const std::vector<FirstDay> all{
      {"cloud", "Files", {"--output"}},
      {"cloud",
       "Shape",
       {"--species", "--shape-seed", "--resolution", "--layers", "--amplitude", "--frequency"}},
      {"cloud", "Detail", {"--roughness", "--billow", "--advect", "--seed"}},
      {"cloud", "Density", {"--edge-thickness", "--density", "--flat-base"}},
      {"cloud", "Sequences and wedges", {"--frames", "--wedge", "--contact-sheet"}},
      {"cut", "Files", {"--output", "--format"}},
      {"cut",
       "Knives",
       {"--plane", "--random-planes", "--voronoi", "--points", "--knife", "--roughness", "--kerf", "--seed"}},
      {"cut", "Pieces", {"--explode", "--min-volume"}},
      {"cut", "Picture", {"--preview", "--size", "--view"}},
      {"transfer", "Files", {"--from", "--to", "--output", "--attributes"}},
      {"transfer", "Map", {"--align", "--quality", "--method"}},
      {"transfer", "Texture", {"--texture", "--bake-texture", "--bake-size"}},
      {"transfer", "Picture", {"--preview", "--preview-paint", "--checker", "--size", "--view"}},
      {"wisps", "Files", {"--output", "--points"}},
      {"wisps",
       "Wisps",
       {"--shape", "--guides", "--wisp-size", "--density", "--color", "--dots", "--clump", "--amplitude",
        "--frequency", "--seed"}},
      {"wisps", "Grid", {"--resolution", "--velocity", "--shutter"}},
      {"render", "Files", {"--output", "--preview", "--grid"}},
      {"render", "Picture", {"--size", "--quality", "--exposure", "--view-transform"}},
      {"render", "Camera", {"--view", "--fov"}},
      {"render", "Sequences and wedges", {"--frames", "--wedge", "--contact-sheet"}},
      {"render", "Light and cloud", {"--sun", "--sky", "--extinction", "--phase"}},
      {"turntable",
       "Files",
       {"--output", "--frames", "--preview", "--movie", "--contact-sheet", "--skip-existing"}},
      {"turntable", "Picture", {"--size", "--quality", "--exposure", "--view-transform"}},
      {"turntable", "Camera", {"--view", "--orbit"}},
      {"turntable", "Light and cloud", {"--sun", "--sky", "--extinction"}},
  };
  return all;
}

namespace {

/// What is not shown is not named either.
void forgetHidden(CLI::Option& option) {
  for (CLI::Option* other : std::set<CLI::Option*>(option.get_excludes()))
    if (other->get_group().empty()) option.remove_excludes(other);
  for (CLI::Option* other : std::set<CLI::Option*>(option.get_needs()))
    if (other->get_group().empty()) option.remove_needs(other);
}

}  // namespace

int showFirstDay(CLI::App& app, std::string_view verb) {
  const std::vector<FirstDay>& all = firstDays();
  const bool isListed = std::ranges::any_of(all, [&](const FirstDay& day) { return day.verb == verb; });
  const std::vector<CLI::Option*> options = app.get_options();
  int count = 0;
  for (CLI::Option* option : options) {
    if (option->get_group().empty()) continue;
    ++count;
    const bool isCommon = option->get_group() == kCommonGroup;
    if (option->get_positional() || (!isListed && !isCommon)) continue;
    option->group("");
  }
  for (const FirstDay& day : all)
    for (const std::string_view name : day.options)
      if (day.verb == verb)
        if (CLI::Option* option = app.get_option_no_throw(std::string(name)))
          option->group(std::string(day.group));
  if (CLI::Option* option = app.get_option_no_throw("--contact-sheet"))
    if (option->get_group() == kSeveralGroup) option->group("");
  for (const char* name : {"--help", "--help-all", "--config"})
    if (CLI::Option* option = app.get_option_no_throw(name)) option->group("Help");
  for (CLI::Option* option : options) forgetHidden(*option);
  return count;
}

}  // namespace nephele::apps
