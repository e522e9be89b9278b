#include <fmt/format.h>

#include <filesystem>

#include "apps/app.h"
#include "apps/look/browser.h"
#include "apps/look/files_watch.h"
#include "apps/look/line.h"
#include "apps/look/server.h"
#include "apps/options/outputs.h"

namespace nephele::apps {
namespace {

struct LookArguments {
  std::string host = "127.0.0.1", folder = ".", show;
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
  allowWords(
      app.add_option("--show", options.show,
                     "What is shown first: the cloud, its surface, the mesh with a checker, wisps, "
                     "the pieces of a cut, or what is carried from the first of two meshes to the second.")
          ->type_name("WHAT")
          ->default_str("cloud; transfer for two meshes"),
      {"cloud", "surface", "checker", "wisps", "pieces", "transfer"});
  app.add_flag("--no-browser", options.hasNoBrowser, "Only print the address.");
}

void look(const LookArguments& options, Run& run) {
  const LookLine line = LookLine::of(*options.app);
  if (!std::filesystem::is_directory(options.folder))
    throw Error("--folder: " + options.folder + ": there is no such folder");
  LookServerOptions server;
  server.subject = line.subject;
  server.what = line.what;
  server.settings = line.settings;
  server.host = options.host;
  server.port = options.port;
  server.folder = options.folder;
  server.memoryLimitBytes = run.memoryLimitBytes;
  for (const std::string name : {"--memory-limit", "--threads"})
    if (const std::string value = givenValue(*options.app, name); !value.empty())
      server.limits.push_back(name + "=" + value);
  server.version = NEPHELE_VERSION;
  const std::unique_ptr<LookServer> page = makeLookServer(server);
  if (page->port() != options.port)
    run.note(fmt::format("port {} is taken; listening on {}", options.port, page->port()));
  if (options.host != "127.0.0.1" && options.host != "localhost" && options.host != "::1")
    run.note("warning: anybody in the network who knows the address can look, and write files into " +
             options.folder);
  run.result(page->address());
  std::fflush(stdout);
  if (!options.hasNoBrowser) openBrowser(page->address());
  FilesWatch files;
  constexpr int kBetweenLooks = 100;
  while (!run.cancelled()) {
    // The page may have named others.
    files.watch(page->watched());
    if (const std::vector<std::string> changed = files.wait(kBetweenLooks); !changed.empty())
      page->changed(changed);
  }
}

}  // namespace

Verb lookVerb() {
  Verb verb = verbOf(
      "look", "Shows the cloud in a browser while it is shaped and lit.",
      "nephele look data/cloud_base.obj --resolution 256 --sun 90,38", bindOptions, look,
      R"(What is looked at comes after these options: a mesh, two meshes, a level set, a volume, a script (.felt), a recipe
or a file of options (.toml), or nothing, for a cloud of its own; then any options of 'nephele render' and of the verb
of what is shown: 'nephele cloud', 'nephele wisps', 'nephele cut' for pieces, 'nephele transfer'.
)");
  verb.passesOthersOn = true;
  return verb;
}

}  // namespace nephele::apps
