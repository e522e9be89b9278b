#include "apps/options/picture/camera_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/render/scene/camera_file.h"

namespace nephele::apps {
namespace {

constexpr double kAny = std::numeric_limits<double>::max();
// Poses of a moving camera while its shutter is open: a turn of half a circle is still in steps of 11
// degrees.
constexpr int kPoses = 17;

void addPicture(CLI::App& app, CameraOptions& options) {
  addSize(app, "--size", options.frame.width, options.frame.height, "Pixels across and down.");
  app.add_option_function<std::string>(
         "--crop",
         [&options](const std::string& text) {
           const std::string form =
               "X0,Y0,X1,Y1 in whole pixels from the upper left corner, X0 < X1, Y0 < Y1";
           const std::vector<double> n = parseNumbers("--crop", text, form);
           bool fits = n.size() == 4;
           for (const double number : n)
             fits = fits && number >= 0 && number <= 65536 && number == std::floor(number);
           if (!fits || n[0] >= n[2] || n[1] >= n[3]) refuseValue("--crop", text, form);
           options.frame.crop = PixelBox{int(n[0]), int(n[1]), int(n[2]), int(n[3])};
         },
         "Make only these pixels of the picture, X1 and Y1 not included; the EXR says where they belong.")
      ->type_name("X0,Y0,X1,Y1");
}

void addPlace(CLI::App& app, CameraOptions& options) {
  CLI::Option* view =
      addNumbers(
          app, "--view", "AZIMUTH,ELEVATION", 2, -360, 360,
          [&options](const Vec3d& v) {
            options.view = Vec3f(v);
            options.viewGiven = true;
          },
          "Where the camera stands, in degrees, at the distance that frames the volume: azimuth from the "
          "front (+z) towards +x, elevation from the horizon.")
          ->default_str(fmt::format("{:g},{:g}", options.view.x, options.view.y));
  CLI::Option* position =
      addNumbers(
          app, "--camera-position", "X,Y,Z", 3, -kAny, kAny,
          [&options](const Vec3d& v) { options.position = Vec3f(v); }, "Where the camera stands.")
          ->excludes(view);
  addNumbers(
      app, "--look-at", "X,Y,Z", 3, -kAny, kAny, [&options](const Vec3d& v) { options.lookAt = Vec3f(v); },
      "What it looks at; default: the middle of the volume.")
      ->needs(position);
  addNumbers(
      app, "--up", "X,Y,Z", 3, -kAny, kAny, [&options](const Vec3d& v) { options.up = Vec3f(v); },
      "What is up in the picture.")
      ->default_str("0,1,0")
      ->needs(position);
  CLI::Option* file =
      app.add_option("--camera", options.file, "Animated camera: .chan (Nuke, Houdini) or .json.")
          ->type_name("FILE")
          ->excludes(view)
          ->excludes(position);
  app.add_option_function<std::string>(
         "--rotation-order",
         [&options](const std::string& text) {
           try {
             options.rotationOrder = RotationOrder::parse(text);
           } catch (const Error&) {
             refuseValue("--rotation-order", text, "XYZ, XZY, YXZ, YZX, ZXY or ZYX");
           }
         },
         "Order in which the angles of a .chan turn; ZXY is Nuke's, XYZ Houdini's.")
      ->type_name("ORDER")
      ->default_str(options.rotationOrder.name())
      ->needs(file);
  addOptional(app, "--frame", options.frameNumber, -1e9, 1e9, "Frame of --camera; default: its first.")
      ->needs(file);
}

void addLens(CLI::App& app, CameraOptions& options) {
  CLI::Option* fov =
      addOptional(app, "--fov", options.fovDegrees, 0.1, 170, "Horizontal angle of view in degrees.")
          ->default_str(fmt::format("{:g}", options.frame.fovDegrees));
  addOptional(app, "--focal-length", options.focalLength, 0.1, 1e5,
              "Focal length in millimetres, instead of --fov.")
      ->excludes(fov);
  addOptional(app, "--film-width", options.filmWidth, 0.1, 1e5, "Width of the film in millimetres.")
      ->default_str(fmt::format("{:g}", CameraKey::kFilmWidth));
  addChoice<Camera::Projection>(
      app, "--projection", options.frame.projection,
      {{"perspective", Camera::Projection::perspective}, {"orthographic", Camera::Projection::orthographic}},
      "How space becomes a picture.");
  addLength(app, "--orthographic-width", options.orthographicWidth,
            "Width of an orthographic picture; default: what shows the volume.", Sign::positive);
  CLI::Option* fStop =
      addOptional(app, "--f-stop", options.fStop, 0.01, 1e6,
                  "Depth of field of a lens whose diameter is its focal length / this, where "
                  "world units are metres.");
  addLength(app, "--lens-radius", options.lensRadius, "Depth of field of a lens with this radius.")
      ->excludes(fStop);
  addLength(app, "--focus-distance", options.focusDistance,
            "What is sharp, along the line of sight; default: the middle of the volume.", Sign::positive);
}

void addTime(CLI::App& app, CameraOptions& options) {
  addShutter(
      app, "frames",
      [&options](double open, double close) {
        options.shutter = {open, close};
      },
      "When the shutter opens and closes, in frames from the frame: -0.25,0.25 is the usual blur, 0,0 none.");
  app.add_option_function<std::string>(
         "--volume-motion",
         [&options](const std::string& text) {
           const std::string form = "DX,DY,DZ[,RX,RY,RZ]: world units and degrees per frame";
           const std::vector<double> n = parseNumbers("--volume-motion", text, form);
           if (n.size() != 3 && n.size() != 6) refuseValue("--volume-motion", text, form);
           options.volumeMotion = RigidMotion{{n[0], n[1], n[2]}, {}, {}};
           if (n.size() == 6) options.volumeMotion->spinDegrees = {n[3], n[4], n[5]};
         },
         "How the volume moves per frame, for --shutter: world units, and degrees of a turn about the axis "
         "RX,RY,RZ through its middle, as many as the axis is long.")
      ->type_name("DX,DY,DZ[,RX,RY,RZ]");
}

Vec3f middleOf(const Extent& seen) {
  return seen.box.isEmpty() ? Vec3f{} : seen.box.center();
}

// Of an orthographic picture that shows all that is seen to a camera like `camera`, with a margin of 4 %.
float widthFor(const Extent& seen, const Camera& camera) {
  double half = 0;
  const double pixels = camera.width() / camera.screenWidth();
  for (const Vec3f& point : seen.outline) {
    const Vec3d p = camera.project(Vec3d(point));
    half = std::max({half, std::fabs(p.x - 0.5 * camera.width()) / pixels,
                     std::fabs(p.y - 0.5 * camera.height()) / pixels * camera.width() / camera.height()});
  }
  return half > 0 ? float(2 * half / 0.92) : 1.0f;
}

// The options and a key of a file, put together.
class Placement {
 public:
  explicit Placement(const CameraOptions& options) : options_(options) {}

  Camera camera(const CameraKey& key) {
    const Camera::Frame frame = frameOf(key);
    const Vec3d right = key.rotation({1, 0, 0}), up = key.rotation({0, 1, 0});
    return withLens(
        fitted(frame, [&](const Camera::Frame& f) { return Camera::facing(key.position, right, up, f); }),
        frame, key);
  }

  Camera camera() {
    const Camera::Frame frame = frameOf({});
    if (!options_.position)
      return withLens(Camera::framing(options_.seen.outline, options_.view.x, options_.view.y, frame), frame,
                      {});
    return withLens(fitted(frame,
                           [&](const Camera::Frame& f) {
                             return Camera::lookingAt(*options_.position,
                                                      options_.lookAt.value_or(middleOf(options_.seen)),
                                                      options_.up, f);
                           }),
                    frame, {});
  }

  Camera::Frame frameOf(const CameraKey& key) const {
    Camera::Frame frame = options_.frame;
    if (options_.fovDegrees)
      frame.fovDegrees = float(*options_.fovDegrees);
    else if (options_.focalLength)
      frame.fovDegrees = float(fovDegreesOf(*options_.focalLength, filmWidth(key)));
    else if (key.fovDegrees && key.hasFocalLength && options_.filmWidth)
      frame.fovDegrees =
          float(fovDegreesOf(focalLengthOf(*key.fovDegrees, key.filmWidth.value_or(CameraKey::kFilmWidth)),
                             *options_.filmWidth));
    else if (key.fovDegrees)
      frame.fovDegrees = float(*key.fovDegrees);
    else if (key.verticalFovDegrees) {
      frame.fovDegrees =
          float(fovDegreesOf(focalLengthOf(*key.verticalFovDegrees, frame.height), frame.width));
      if (!(frame.fovDegrees >= 0.01f && frame.fovDegrees <= 179.0f))
        refuse(key, "fov", "must be from 0.01 to 179 degrees across the picture");
    }
    const std::optional<double> width = chosen(options_.orthographicWidth, key.orthographicWidth);
    if (width) frame.orthographicWidth = float(*width);
    return frame;
  }

 private:
  std::optional<double> chosen(const std::optional<Length>& option, std::optional<double> ofFile) const {
    // Of nothing, a percentage may be anything.
    const double side = options_.seen.longestSide;
    return option ? option->worldUnits(side > 0 ? side : 1) : ofFile;
  }

  double filmWidth(const CameraKey& key) const {
    return options_.filmWidth.value_or(key.filmWidth.value_or(CameraKey::kFilmWidth));
  }

  // A camera that does not frame anything needs a width; all of a moving one's poses have the same.
  template <class Make>
  Camera fitted(Camera::Frame frame, const Make& make) {
    const bool parallel = frame.projection == Camera::Projection::orthographic;
    if (parallel && !frame.orthographicWidth) {
      if (options_.isOneOfMany && !options_.file.empty())
        throw CLI::ValidationError("--orthographic-width", "a sequence seen by --camera needs one for all");
      frame.orthographicWidth = width_.value_or(1.0f);
      if (!width_) frame.orthographicWidth = width_ = widthFor(options_.seen, make(frame));
    }
    return make(frame);
  }

  Camera withLens(const Camera& camera, const Camera::Frame& frame, const CameraKey& key) const {
    const bool fromOptions = options_.fStop || options_.lensRadius;
    const std::optional<double> fStop = fromOptions ? options_.fStop : key.fStop;
    double radius = chosen(options_.lensRadius, fromOptions ? std::nullopt : key.lensRadius).value_or(0);
    if (fStop) {
      if (camera.isOrthographic())
        refuse(key, "--f-stop", "an orthographic camera has no focal length; give --lens-radius");
      radius = 1e-3 * focalLengthOf(double(frame.fovDegrees), filmWidth(key)) / (2 * *fStop);
    }
    if (radius == 0) return camera;
    const std::optional<double> focus = chosen(options_.focusDistance, key.focusDistance);
    const double distance = focus ? *focus : camera.project(Vec3d(middleOf(options_.seen))).z;
    if (!(distance > 0))
      refuse(key, "--focus-distance",
             "the middle of the volume is not in front of the camera, so that there must be one");
    return camera.withLens({radius, distance});
  }

  // A camera of a file is named with the frame that it is wrong at.
  [[noreturn]] void refuse(const CameraKey& key, const char* option, const char* fault) const {
    if (options_.file.empty()) throw CLI::ValidationError(option, fault);
    throw Error(fmt::format("{}: frame {:g}: {}: {}", options_.file, key.frame, option, fault));
  }

  const CameraOptions& options_;
  std::optional<float> width_;
};

}  // namespace

void addCameraOptions(CLI::App& app, CameraOptions& options) {
  addPicture(app, options);
  addPlace(app, options);
  addLens(app, options);
  addTime(app, options);
}

CameraOptions CameraOptions::placed(const Extent& own, const Run& run) const {
  CameraOptions result = *this;
  result.seen = run.part && run.part->range ? *run.part->range : own;
  result.isOneOfMany = run.part.has_value();
  if (run.part && run.part->frame && !frameNumber) result.frameNumber = *run.part->frame;
  return result;
}

double CameraOptions::time(const Run& run) const {
  return run.frame() ? double(*run.frame()) : frameNumber.value_or(0);
}

std::vector<Vec3f> CameraOptions::outermost(const std::vector<Vec3f>& points) const {
  if (file.empty() && !position)
    return Camera::outermost(points, view.x, view.y, Placement(*this).frameOf({}));
  Box box;
  for (const Vec3f& point : points) box = box.including(point);
  std::vector<Vec3f> corners;
  for (int corner = 0; corner < 8 && !box.isEmpty(); ++corner)
    corners.push_back({corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                       corner & 4 ? box.max.z : box.min.z});
  return corners;
}

std::optional<Camera> CameraOptions::laterCamera(double frames) const {
  if (file.empty()) return std::nullopt;
  return camera(frames);
}

Camera CameraOptions::camera(double framesLater) const {
  if (const auto& c = frame.crop; c && (c->x1 > frame.width || c->y1 > frame.height))
    refuseValue("--crop", fmt::format("{},{},{},{}", c->x0, c->y0, c->x1, c->y1),
                fmt::format("within the picture, 0,0,{},{}", frame.width, frame.height));
  if (orthographicWidth && frame.projection != Camera::Projection::orthographic)
    throw CLI::ValidationError("--orthographic-width", "is for --projection orthographic alone");
  if (!shutter.isInstant() && file.empty() && !volumeMotion && !volumeFlows)
    throw CLI::ValidationError(
        "--shutter",
        "nothing moves; give --camera, --volume-motion, --velocity-grid or a script with a velocity");
  if (volumeMotion && shutter.isInstant())
    throw CLI::ValidationError("--volume-motion", "shows only while the shutter is open; give --shutter");
  Placement placement(*this);
  if (file.empty()) return placement.camera();

  const CameraMotion motion = readCameraFile(file, rotationOrder);
  const double now = frameNumber.value_or(motion.firstFrame());
  if (now < motion.firstFrame() || now > motion.lastFrame())
    refuseValue("--frame", fmt::format("{:g}", now),
                fmt::format("{:g} to {:g}, which {} holds", motion.firstFrame(), motion.lastFrame(), file));
  if (framesLater != 0) return placement.camera(motion.at(now + framesLater));
  const Camera camera = placement.camera(motion.at(now));
  std::vector<Camera> poses;
  for (int i = 0; !shutter.isInstant() && i != kPoses; ++i)
    poses.push_back(
        placement.camera(motion.at(now + shutter.open + (shutter.close - shutter.open) * i / (kPoses - 1))));
  return camera.withShutter(poses);
}

std::optional<RigidMotion> CameraOptions::motion() const {
  if (!volumeMotion || shutter.isInstant()) return std::nullopt;
  RigidMotion result = *volumeMotion;
  result.centre = Vec3d(middleOf(seen));
  return result;
}

}  // namespace nephele::apps
