#pragma once

#include <string>

#include "apps/options/options.h"
#include "nephele/render/image/view_transform.h"

namespace nephele::apps {

/// How previews, movies and contact sheets are shown, as typed.
struct ViewOptions {
  /// Of a curve, or of a view of the configuration.
  std::string name;
  /// An OpenColorIO configuration; $OCIO if it is not given.
  std::string config;
  float exposureStops = 0;

  /// Reads the configuration where the view is one of it; `otherwise` where none was asked for.
  /// @throws CLI::ValidationError or Error if there is no such view.
  ViewTransform read(ViewCurve otherwise) const;
  /// Of the view, as configViewIdentity; "" where it is a curve. @throws as `read`.
  std::string identity() const;

 private:
  /// That the view is of; "" where it is a curve.
  std::string configuration() const;
};

/// Declares --view-transform, --ocio-config and --exposure on `app`.
void addViewOptions(CLI::App& app, ViewOptions& options);

}  // namespace nephele::apps
