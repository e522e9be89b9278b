#pragma once

#include <string>

#include "nephele/render/scene/camera_motion.h"

namespace nephele {

/// Files of animated cameras. Positions are world units, angles degrees, frames may be fractions.
///
/// `.chan`, as Nuke and Houdini write it: a line per frame of seven or eight numbers, apart by blanks,
///     frame tx ty tz rx ry rz [vertical angle of view]
/// the rotation in an order that the file does not say; the camera looks along its own -z. Lines that are
/// empty or start with # are skipped.
///
/// `.json`: an object with `frames`, a list of objects with `frame`, `position`, and `rotation` or `look_at`
/// [with `up`], optionally `fov` (horizontal), `vertical_fov` or `focal_length`, `orthographic_width`,
/// `f_stop` or `lens_radius`, `focus_distance`. Beside `frames`: `rotation_order` ("ZXY"), `interpolation`
/// ("smooth" or "linear"), `film_width` (36, millimetres as `focal_length`). Other names are refused.

/// Reads a file by its extension; `order` is for .chan files.
/// @throws Error as "path:line: what is wrong".
CameraMotion readCameraFile(const std::string& path, const RotationOrder& order = {});

/// The same from text; `name` stands for the path in messages.
CameraMotion parseChan(const std::string& text, const std::string& name, const RotationOrder& order = {});
CameraMotion parseCameraJson(const std::string& text, const std::string& name);

/// Text that the functions above read back to 12 digits. Of the keys, .chan holds position, rotation and
/// angle of view, made upright for a picture of `aspect` (width / height).
std::string chanText(const CameraMotion& motion, double aspect, const RotationOrder& order = {});
std::string cameraJsonText(const CameraMotion& motion);

}  // namespace nephele
