#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "apps/app.h"
#include "apps/look/controls.h"
#include "apps/look/files_watch.h"
#include "apps/look/server.h"
#include "apps/options/layer_recipe.h"

namespace nephele::apps {
namespace {

struct LookArguments {
  std::string host = "127.0.0.1", folder = ".";
  int port = 8080;
  bool hasNoBrowser = false;
  const CLI::App* app = nullptr;
};

void bindOptions(CLI::App& app, LookArguments& options) {
  options.app = &app;
  addCount(app, "--port", options.port, 1, 65535,
           "Where to listen; the next one that is free, if it is taken.");
  app.add_option("--host", options.host,
                 "Address of this machine to listen on; others than 127.0.0.1 can be reached by anybody in "
                 "the network who knows the address.")
      ->type_name("ADDRESS")
      ->capture_default_str();
  app.add_option("--folder", options.folder, "Where files that the page asks for are written.")
      ->type_name("FOLDER")
      ->default_str("where it is started");
  app.add_flag("--no-browser", options.hasNoBrowser, "Only print the address.");
}

void openBrowser(const std::string& address) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return;
  const pid_t child = fork();
  if (child != 0) return;
  execlp("xdg-open", "xdg-open", address.c_str(), static_cast<char*>(nullptr));
  _exit(1);
}

/// The file that is looked at; the first argument that is no option and no value of one.
std::string takeInput(std::vector<std::string>& arguments) {
  if (arguments.empty() || arguments.front().starts_with('-')) return "";
  const std::string input = arguments.front();
  arguments.erase(arguments.begin());
  return input;
}

void look(const LookArguments& options, Run& run) {
  std::vector<std::string> arguments = options.app->remaining();
  for (const char* name : {"--config", "--look"})
    if (const CLI::Option* option = options.app->get_option(name); option->count() > 0)
      arguments.push_back(fmt::format("{}={}", name, option->as<std::string>()));
  std::string input = takeInput(arguments);
  if (input.ends_with(".toml")) {
    arguments.insert(arguments.begin(), {isLayerRecipe(input) ? "--recipe" : "--config", input});
    input.clear();
  }
  LookServerOptions server;
  server.subject = LookSubject::of(input);
  std::vector<std::string> others;
  server.settings = settingsOfLine(server.subject, arguments, others);
  if (!others.empty())
    throw CLI::ParseError(
        fmt::format("'{}' is no option of cloud or render, or a second file", others.front()),
        CLI::ExitCodes::ExtrasError);
  try {
    const LookPlan check(server.subject, server.settings);
  } catch (const LookFault& fault) {
    throw CLI::ParseError(fault.what(), CLI::ExitCodes::ValidationError);
  }
  if (!std::filesystem::is_directory(options.folder))
    throw Error("--folder: " + options.folder + ": there is no such folder");
  server.host = options.host;
  server.port = options.port;
  server.folder = options.folder;
  server.memoryLimitBytes = run.memoryLimitBytes;
  server.version = NEPHELE_VERSION;
  LookServer page(server);
  if (page.port() != options.port)
    run.note(fmt::format("port {} is taken; listening on {}", options.port, page.port()));
  if (options.host != "127.0.0.1" && options.host != "localhost" && options.host != "::1")
    run.note("warning: anybody in the network who knows the address can look, and write files into " +
             options.folder);
  run.result(page.address());
  std::fflush(stdout);
  if (!options.hasNoBrowser) openBrowser(page.address());
  FilesWatch files;
  files.watch(page.watched());
  constexpr int kBetweenLooks = 100;
  while (!run.cancelled())
    if (const std::vector<std::string> changed = files.wait(kBetweenLooks); !changed.empty())
      page.changed(changed);
}

}  // namespace

Verb lookVerb() {
  Verb verb = verbOf("look", "Shows the cloud in a browser while it is shaped and lit.",
                     "nephele look data/cloud_base.obj --resolution 256 --sun 90,38", bindOptions, look,
                     "What is looked at comes after these options: a mesh, a level set, a volume, a script "
                     "(.felt), a recipe or a file\n"
                     "of options (.toml), or nothing, for a cloud of its own; then any options of 'nephele "
                     "cloud' and 'nephele render'.\n");
  verb.passesOthersOn = true;
  return verb;
}

}  // namespace nephele::apps
