#include "apps/options/cut_quantities.h"

#include <fmt/format.h>

namespace nephele::apps {

void addPlanes(CLI::App& app, std::vector<BladePlane>& planes) {
  app.add_option_function<std::vector<std::string>>(
         "--plane",
         [&planes](const std::vector<std::string>& texts) {
           const std::string form = "PX,PY,PZ,NX,NY,NZ: a point and a normal that is not 0";
           for (const std::string& text : texts) {
             const std::vector<double> n = parseNumbers("--plane", text, form);
             if (n.size() != 6) refuseValue("--plane", text, form);
             const BladePlane plane{{float(n[0]), float(n[1]), float(n[2])},
                                    {float(n[3]), float(n[4]), float(n[5])}};
             if (!isFinite(plane.point) || !(length(Vec3d(plane.normal)) > 0) || !isFinite(plane.normal))
               refuseValue("--plane", text, form);
             planes.push_back(plane);
           }
         },
         "Cut by the plane through a point, across a normal; may be given again.")
      ->type_name("PX,PY,PZ,NX,NY,NZ")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void addVolume(CLI::App& app, std::optional<Length>& target) {
  app.add_option_function<std::string>(
         "--min-volume",
         [&target](const std::string& text) {
           const auto volume = parseLength(text);
           if (!volume || volume->value < 0)
             refuseValue("--min-volume", text, "a volume >= 0 in world units or percent of the whole (0.1%)");
           target = volume;
         },
         fmt::format(
             "Leave out pieces that are smaller: world units cubed, or percent of the whole; 0 keeps all. "
             "Splinters have less than {:g} % of the median piece and {:g} % of the whole.",
             100 * kSplinterOfMedian, 100 * kSplinterOfWhole))
      ->type_name("VOLUME")
      ->default_str("splinters, or a voxel of level sets");
}

}  // namespace nephele::apps
