// Pictures: linear light in named channels.
#include <pybind11/stl.h>

#include "apps/python/values.h"
#include "apps/python/watch.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"

namespace nephele::python {
namespace {

using pybind11::literals::operator""_a;
using Self = std::shared_ptr<ExrContent>;

/// Channels side by side, (height, width, count).
py::array_t<float> interleaved(const Image& image, const std::vector<const Image::Channel*>& channels) {
  const std::size_t count = channels.size(), pixels = std::size_t(image.width) * std::size_t(image.height);
  py::array_t<float> array(std::vector<py::ssize_t>{image.height, image.width, py::ssize_t(count)});
  float* to = array.mutable_data();
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t i = 0; i < pixels; ++i) to[i * count + c] = channels[c]->values[i];
  return array;
}

py::array_t<float> colours(const Self& self) {
  const Image& image = self->image;
  return interleaved(image,
                     {&image.channel("R"), &image.channel("G"), &image.channel("B"), &image.channel("A")});
}

/// All channels but the four, by the name before the point: (height, width), or (height, width, n) of
/// several.
py::dict layersOf(const Self& self) {
  std::vector<std::pair<std::string, std::vector<const Image::Channel*>>> layers;
  for (const Image::Channel& channel : self->image.channels) {
    if (channel.name == "R" || channel.name == "G" || channel.name == "B" || channel.name == "A") continue;
    const std::string name = channel.name.substr(0, channel.name.rfind('.'));
    if (layers.empty() || layers.back().first != name) layers.push_back({name, {}});
    layers.back().second.push_back(&channel);
  }
  py::dict all;
  for (const auto& [name, channels] : layers) {
    py::array_t<float> array = interleaved(self->image, channels);
    if (channels.size() == 1)
      array = array.reshape(std::vector<py::ssize_t>{self->image.height, self->image.width});
    all[py::cast(name)] = array;
  }
  return all;
}

/// Behind what is not opaque: a clear sky.
constexpr std::array<float, 3> kSky{0.1f, 0.17f, 0.28f};

ViewTransform viewOfName(const std::string& name, double exposure, const std::array<float, 3>& behind) {
  const Vec3f background{behind[0], behind[1], behind[2]};
  for (const ViewCurve curve : {ViewCurve::standard, ViewCurve::filmic, ViewCurve::agx, ViewCurve::raw}) {
    const ViewTransform view{.exposureStops = float(exposure), .background = background, .curve = curve};
    if (view.name() == name) return view;
  }
  throw py::value_error("view must be standard, filmic, agx or raw, got '" + name + "'");
}

py::array screenOf(const Self& self, const std::string& view, double exposure,
                   const std::array<float, 3>& background) {
  const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(
      screenBytes(self->image, viewOfName(view, exposure, background)));
  const py::ssize_t width = self->image.width;
  return viewOf(bytes->data(), {self->image.height, width, 3}, {3 * width, 3, 1}, bytes);
}

/// That of a picture which says nothing of one: at the origin, and no matrix of zeros.
ImageCamera standardCamera() {
  constexpr Mat44 kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  return {kIdentity, kIdentity};
}

Self makePicture(const py::object& object, const std::optional<py::dict>& layers) {
  const Packed<float> array = packedFrom<float>(object, "picture");
  if (array.ndim() != 3 || array.shape(2) < 3 || array.shape(2) > 4 || array.size() == 0)
    throw py::value_error("picture: (height, width, 3 or 4) is needed, got " + shapeText(array));
  auto content = std::make_shared<ExrContent>();
  content->camera = standardCamera();
  Image& image = content->image;
  image.height = int(array.shape(0));
  image.width = int(array.shape(1));
  const auto pixels = std::size_t(image.width) * std::size_t(image.height);
  const auto add = [&](const std::string& name, bool half, const float* from, std::size_t step) {
    Image::Channel& channel = image.add(name, half);
    for (std::size_t i = 0; i < pixels; ++i) channel.values[i] = from[i * step];
  };
  const auto count = std::size_t(array.shape(2));
  for (std::size_t c = 0; c < count; ++c) add(std::string(1, "RGBA"[c]), true, array.data() + c, count);
  const float one = 1.0f;
  if (count == 3) add("A", true, &one, 0);
  if (layers)
    for (const auto& [key, value] : *layers) {
      const std::string name = nameFrom(key, "a layer");
      const Packed<float> layer = packedFrom<float>(value, "layer");
      if (layer.ndim() < 2 || layer.ndim() > 3 || layer.shape(0) != image.height ||
          layer.shape(1) != image.width)
        throw py::value_error("layer '" + name + "': got " + shapeText(layer) + " for a picture of " +
                              std::to_string(image.height) + " rows of " + std::to_string(image.width));
      const auto width = std::size_t(layer.ndim() == 3 ? layer.shape(2) : 1);
      if (width > 4) throw py::value_error("a layer has at most 4 channels");
      for (std::size_t c = 0; c < width; ++c) {
        add(layer.ndim() == 2 ? name : name + "." + (width <= 3 && name.size() == 1 ? "XYZ" : "RGBA")[c],
            false, layer.data() + c, width);
      }
    }
  return content;
}

/// The path that a text, bytes or a path of pathlib is.
std::string pathFrom(const py::handle& path) {
  const auto text = py::reinterpret_steal<py::object>(PyOS_FSPath(path.ptr()));
  if (!text) throw py::error_already_set();
  return text.cast<std::string>();
}

void save(const Self& self, const py::object& file, const std::string& view, double exposure,
          const std::array<float, 3>& background) {
  const std::string path = pathFrom(file);
  Watch watch;
  const ViewTransform transform = viewOfName(view, exposure, background);
  const bool isScreen = path.ends_with(".png") || path.ends_with(".PNG");
  if (!isScreen && !path.ends_with(".exr") && !path.ends_with(".EXR"))
    throw Error(path + ": unknown picture format; .exr and .png can be written");
  watched(watch, py::none(), [&] {
    if (isScreen)
      writePng(path, self->image, transform, self->metadata);
    else
      writeExr(path, self->image, self->camera, self->metadata);
  });
}

/// R, G, B and A of grey and of opaque pictures, too.
void complete(Image& image) {
  const auto copy = [&](const char* name, std::vector<float> values) {
    if (!image.find(name)) image.add(name).values = std::move(values);
  };
  if (const Image::Channel* grey = image.find("Y")) {
    const std::vector<float> values = grey->values;
    for (const char* name : {"R", "G", "B"}) copy(name, values);
  }
  if (image.find("R"))
    copy("A", std::vector<float>(std::size_t(image.width) * std::size_t(image.height), 1.0f));
}

}  // namespace

void addPictures(py::module_& module) {
  py::class_<ExrContent, Self>(module, "Picture",
                               "Linear light, premultiplied by its opacity, with named layers beside it.")
      .def(py::init(&makePicture), "array"_a, "layers"_a = py::none(),
           "From (height, width, 3 or 4), rows from the top, and layers by name. Everything is copied.")
      .def_property_readonly("array", colours, "R, G, B, A as (height, width, 4), rows from the top; a copy.")
      .def_property_readonly("layers", layersOf,
                             "The other channels by name: (height, width) or (height, width, n).")
      .def_property_readonly(
          "width", [](const Self& s) { return s->image.width; }, "Pixels in a row.")
      .def_property_readonly(
          "height", [](const Self& s) { return s->image.height; }, "Rows.")
      .def_property_readonly(
          "metadata", [](const Self& s) { return s->metadata; }, "Text that files carry.")
      .def("screen", screenOf, "view"_a = "filmic", "exposure"_a = 0.0, "background"_a = kSky,
           "The picture for the screen, (height, width, 3) bytes. Views are those of --view-transform; "
           "background is linear light behind what is not opaque.")
      .def("save", save, "path"_a, py::kw_only(), "view"_a = "filmic", "exposure"_a = 0.0,
           "background"_a = kSky, "Writes .exr (linear, all layers) or .png (for the screen).")
      .def("__repr__", [](const Self& s) {
        return "<nephele.Picture of " + std::to_string(s->image.width) + " x " +
               std::to_string(s->image.height) + ">";
      });
  module.def("_read_picture", [](const std::string& path) {
    auto content = std::make_shared<ExrContent>();
    Watch watch;
    watched(watch, py::none(), [&] {
      content->image = readLinearImage(path);
      complete(content->image);
      const bool isExr = path.ends_with(".exr") || path.ends_with(".EXR");
      content->camera = (isExr ? readImageCamera(path) : std::nullopt).value_or(standardCamera());
    });
    return content;
  });
}

}  // namespace nephele::python
