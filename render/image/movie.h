#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nephele/render/image/view_transform.h"

namespace nephele {

/// A movie made by the program ffmpeg: H.264, yuv420p, tagged as Rec. 709 colours with the sRGB curve,
/// whatever the view of its frames is.
///
/// Frames are piped to ffmpeg, which no shell ever sees; it writes beside `path`, and the movie is renamed
/// when it is whole. Sizes are made even, as the format needs, by repeating the last column or row.
class MovieWriter {
 public:
  struct Options {
    double framesPerSecond = 24.0;
    /// Of x264: 0 is lossless, 51 the worst; 18 hardly shows a difference.
    int quality = 18;
    /// Name or path of the program.
    std::string program = "ffmpeg";
  };

  /// Starts ffmpeg. The extension of `path` says what the file is: .mp4, .mov or .mkv.
  /// @throws Error if ffmpeg is not installed (naming the package), `path` cannot be written, a size is not
  /// within 1 .. 16384 or the frames per second are not within 0.1 .. 1000.
  MovieWriter(const std::string& path, int width, int height, const Options& options);
  MovieWriter(const std::string& path, int width, int height) : MovieWriter(path, width, height, Options()) {}
  /// Ends ffmpeg; without `finish` no movie stays.
  ~MovieWriter();
  MovieWriter(const MovieWriter&) = delete;
  MovieWriter& operator=(const MovieWriter&) = delete;

  /// Appends a frame as the screen shows it. @throws Error, with what ffmpeg says, if it has stopped, or if
  /// the size is another.
  void add(const Image& frame, const ViewTransform& view);

  /// Writes the end of the movie and renames it. @throws Error, with what ffmpeg says, if that fails.
  void finish();

  /// Encodes one black frame with the same settings and throws it away: finds out in a tenth of a second
  /// whether a movie can be made, before work is put into its frames. @throws Error as the others do.
  static void tryOut(const std::string& path, int width, int height, const Options& options);

 private:
  struct Process;

  void write(const std::vector<std::uint8_t>& bytes);
  void end();

  std::string path_;
  int width_, height_;
  std::unique_ptr<Process> process_;
};

}  // namespace nephele
