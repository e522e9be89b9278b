#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nephele/render/image/pixel_box.h"

namespace nephele {

/// A picture as named channels of floats, rows from the top.
///
/// R, G, B are linear light premultiplied by the opacity A; layers are named as in EXR files: "light_sun.R".
struct Image {
  struct Channel {
    std::string name;
    /// Stored as 16 bit in files.
    bool half = true;
    std::vector<float> values;
  };

  /// Where the pixels lie in a larger picture, the display window of EXR files.
  struct Display {
    /// Of the upper left pixel in it.
    int x = 0, y = 0;
    int width = 0, height = 0;
    bool operator==(const Display&) const = default;
  };

  int width = 0, height = 0;
  /// The whole picture, where this is only a part of it or more than it.
  std::optional<Display> display{};
  std::vector<Channel> channels;

  /// Before channels are added: makes this the part `window` of a picture of displayWidth x displayHeight.
  void setWindow(const PixelBox& window, int displayWidth, int displayHeight);

  /// Appends a channel of zeros; the reference is valid until the next one is added.
  Channel& add(const std::string& name, bool half = true);
  /// The channel called `name`, or null.
  const Channel* find(const std::string& name) const;
  /// @throws Error naming the channel if it is not there.
  const Channel& channel(const std::string& name) const;
  /// What writes or shows images begins with this. @throws Error naming what is wrong unless there are
  /// pixels, every channel has width * height values, and a name of its own of up to 255 bytes.
  void check() const;
  float at(const std::string& name, int x, int y) const {
    return channel(name).values[std::size_t(y) * width + x];
  }
};

/// Values that no file can hold as what they are: NaN, and infinity but in depths ("Z", "Z_median", "Z_mean",
/// where it says that nothing is there).
std::size_t notFiniteCount(const Image& image);

}  // namespace nephele
