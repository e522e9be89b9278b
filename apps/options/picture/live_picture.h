#pragma once

#include <memory>
#include <optional>
#include <string>

#include "apps/app.h"
#include "nephele/render/image/display_server.h"
#include "nephele/render/march/render_options.h"

namespace nephele::apps {

/// Declares --display-server on `app`.
void addDisplayServer(CLI::App& app, std::optional<DisplayServer::Options>& server);

/// A picture, or one after the other, in a viewer while they are made.
class LivePicture {
 public:
  /// Hands the tiles of `film` on; does nothing where there is no server.
  LivePicture(const std::optional<DisplayServer::Options>& server, const std::string& name,
              FilmOptions& film);
  /// After each picture, for those that have no tiles.
  void complete(const Image& picture);
  /// After the last one. Says so if the viewer has not taken all.
  void finish(const Run& run);

 private:
  std::string address_;
  std::shared_ptr<DisplayServer> display_;
};

}  // namespace nephele::apps
