#pragma once

#include <string>
#include <vector>

#include "apps/look/settings.h"
#include "apps/look/subject.h"

namespace nephele::apps {

/// What goes out of the viewer: the same look as command lines and as files.
struct LookExports {
  LookSubject subject;
  LookSettings settings;
  LookShow::What what = LookShow::What::cloud;
  int width = 1280, height = 720;

  /// Arguments of `nephele cloud` or `nephele wisps`, for what is grown. `output`: its volume.
  std::vector<std::string> volumeLine(const std::string& output) const;
  /// Arguments of `nephele cut` or `nephele transfer`, without outputs, and of the preview of its picture.
  std::vector<std::string> shapesLine() const;
  std::vector<std::string> previewLine(const std::string& preview) const;
  /// Arguments of `nephele VERB` (render or turntable) without outputs; `volume`: where the cloud was
  /// written.
  std::vector<std::string> pictureLine(const std::string& verb, const std::string& volume) const;
  /// Both as one would type them.
  std::vector<std::string> typed() const;
  /// As a file for --config.
  std::string recipe() const;
  /// The script with the values of its parameters in their places. @throws Error if it cannot be read.
  std::string script() const;
};

/// Where looks are saved by name: settings that the user has kept, without what belongs to another shape than
/// `subject`. @throws Error where that cannot be.
nlohmann::json savedLooks(const LookSubject& subject);
void saveLook(const std::string& name, const LookSettings& settings);

/// `name` if it can be the name of a file in a folder, with one of `extensions`. @throws LookFault.
std::string plainFileName(const std::string& name, const std::vector<std::string>& extensions);

}  // namespace nephele::apps
