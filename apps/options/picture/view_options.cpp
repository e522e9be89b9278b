#include "apps/options/picture/view_options.h"

#include <array>
#include <cstdlib>
#include <optional>

#include "nephele/render/image/config_view.h"

namespace nephele::apps {
namespace {

constexpr std::array kCurves{ViewCurve::standard, ViewCurve::filmic, ViewCurve::agx, ViewCurve::raw};

std::string fromEnvironment() {
  const char* path = std::getenv("OCIO");
  return path ? path : "";
}

std::optional<ViewCurve> curveOf(const std::string& name) {
  for (const ViewCurve curve : kCurves)
    if (ViewTransform{.curve = curve}.name() == name) return curve;
  return std::nullopt;
}

}  // namespace

std::string ViewOptions::configuration() const {
  if ((name.empty() && config.empty()) || curveOf(name)) return "";
  const std::string path = config.empty() ? fromEnvironment() : config;
  if (path.empty())
    refuseValue(
        "--view-transform", name,
        "standard, filmic, agx, raw, or a view of the configuration that --ocio-config or $OCIO names");
  return path;
}

ViewTransform ViewOptions::read(ViewCurve otherwise) const {
  const std::string path = configuration();
  return {.exposureStops = exposureStops,
          .curve = curveOf(name).value_or(otherwise),
          .configView = path.empty() ? nullptr : readConfigView(path, name)};
}

std::string ViewOptions::identity() const {
  const std::string path = configuration();
  return path.empty() ? "" : configViewIdentity(path, name);
}

void addViewOptions(CLI::App& app, ViewOptions& options) {
  app.add_option("--view-transform", options.name,
                 "How light is shown: by a curve, or by a view of an OpenColorIO configuration.")
      ->type_name("standard|filmic|agx|raw|[DISPLAY/]VIEW")
      ->default_str("filmic; standard of surfaces alone; the default view of --ocio-config if there is one");
  app.add_option("--ocio-config", options.config,
                 "OpenColorIO configuration (.ocio) that views are looked up in.")
      ->type_name("FILE")
      ->default_str("$OCIO");
  addNumber(
      app, "--exposure", -20, 20, [&options](double stops) { options.exposureStops = float(stops); },
      "Of the preview, in stops.")
      ->type_name("STOPS")
      ->default_str("0");
}

}  // namespace nephele::apps
