#include <OpenColorIO/OpenColorIO.h>

#include <fstream>
#include <limits>

#include "nephele/render/image/config_view.h"
#include "tests/fuzz/formats.h"
#include "tests/fuzz/harness.h"

namespace nephele::fuzz {

bool useViewConfig(const Input& input) {
  // Tables that were read under the same name before.
  OCIO_NAMESPACE::ClearAllCaches();
  constexpr std::string_view kEnd = "\n...\n";
  const std::size_t end = input.bytes.find(kEnd);
  const bool hasTable = end != input.bytes.npos;
  std::ofstream(input.path, std::ios::binary) << input.bytes.substr(0, end);
  std::ofstream(scratchPath("table"), std::ios::binary)
      << (hasTable ? input.bytes.substr(end + kEnd.size()) : "");

  constexpr const char* kViews[] = {"", "Half", "screen/Film", "Log"};
  const std::string name = kViews[input.hash % std::size(kViews)];
  ViewTransform view;
  if (!succeeds(input.path, [&] { view.configView = readConfigView(input.path, name); })) return false;
  constexpr float kLargest = std::numeric_limits<float>::max(),
                  kInfinity = std::numeric_limits<float>::infinity();
  Image image{.width = 8, .height = 1, .channels = {}};
  for (const char* channel : {"R", "G", "B", "A"}) image.add(channel, true);
  for (Image::Channel& channel : image.channels)
    channel.values = {0, 1e-38f, 0.18f, 1, 65504, -0.5f, kLargest, kInfinity};
  for (const float value : displayed(image, view))
    expect(value >= 0 && value <= 1, "a view shows what no screen can: " + std::to_string(value));
  runRender({ballFog(), "--preview", scratchPath("out.png"), "--ocio-config", input.path, "--view-transform",
             "Half"},
            input.path);
  return true;
}

}  // namespace nephele::fuzz
