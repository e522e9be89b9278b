#include "apps/options/picture/live_picture.h"

#include <fmt/format.h>

namespace nephele::apps {

void addDisplayServer(CLI::App& app, std::optional<DisplayServer::Options>& server) {
  app.add_option_function<std::string>(
         "--display-server",
         [&server](const std::string& text) {
           try {
             server = DisplayServer::parse(text);
           } catch (const Error&) {
             refuseValue("--display-server", text, "HOST or HOST:PORT, with a port from 1 to 65535");
           }
         },
         "Viewer (tev, HDRView) that shows the picture while it is made; PORT is 14158 if it is not given.")
      ->type_name("HOST[:PORT]");
}

LivePicture::LivePicture(const std::optional<DisplayServer::Options>& server, const std::string& name,
                         FilmOptions& film) {
  if (!server) return;
  address_ = fmt::format("{}:{}", server->host, server->port);
  display_ = std::make_shared<DisplayServer>(*server, name);
  film.onTile = [display = display_](const PixelBox& tile, const Image& image) {
    display->show(tile, image);
  };
}

void LivePicture::complete(const Image& picture) {
  if (display_) display_->showUnlessBegun(picture);
}

void LivePicture::finish(const Run& run) {
  if (!display_) return;
  const std::string wrong = display_->finish();
  if (!wrong.empty())
    run.note(fmt::format("--display-server: the viewer at {} {}; the picture is written all the same",
                         address_, wrong));
}

}  // namespace nephele::apps
