#pragma once

#include <fstream>
#include <string>

namespace nephele::test {

/// Writes an OpenColorIO configuration of three views by closed forms: "screen/Half" (the default), half the
/// light, "screen/Soft/Film", its square root, and "projector/Broken", by a table that is not there.
inline void writeViewConfig(const std::string& path, const std::string& linear = "lin_rec709") {
  std::ofstream(path) << R"(ocio_profile_version: 2
search_path: ""
strictparsing: true
roles: {default: )" << linear
                      << ", scene_linear: " << linear << R"(}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
displays:
  screen:
    - !<View> {name: Half, colorspace: half}
    - !<View> {name: Soft/Film, colorspace: root}
  projector:
    - !<View> {name: Broken, colorspace: broken}
active_displays: [screen, projector]
active_views: []
colorspaces:
  - !<ColorSpace>
    name: )" << linear << R"(
  - !<ColorSpace>
    name: half
    from_scene_reference: !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1]}
  - !<ColorSpace>
    name: root
    from_scene_reference: !<ExponentTransform> {value: [0.5, 0.5, 0.5, 1]}
  - !<ColorSpace>
    name: broken
    from_scene_reference: !<FileTransform> {src: no_such_table.spi1d}
)";
}

}  // namespace nephele::test
