#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "nephele/render/image/image.h"

namespace nephele {

/// A picture that an image viewer shows while it is made: what changes is sent through a socket in the
/// packets of tev, which HDRView takes as well. Little-endian, each begins with its length.
///
/// Sending is a thread's work. Who has a tile to show only copies it; a slow viewer gets later what it cannot
/// take now, and the newest values of it. A viewer that is not there, takes nothing for a second, or goes
/// away is left alone from then on. Memory: the picture once more.
class DisplayServer {
 public:
  struct Options {
    std::string host;
    int port = 14158;
    /// How long the viewer may take to answer or to read on, seconds; `finish` waits twice as long at most.
    double patience = 1;
  };
  /// "HOST", "HOST:PORT" or, for IPv6, "[HOST]:PORT". @throws Error if `text` is none of these.
  static Options parse(const std::string& text);

  /// Connects in the background. The viewer calls the picture `name`; one that it already shows under this
  /// name is replaced.
  DisplayServer(Options options, const std::string& name);
  /// Leaves unsent what `finish` has not waited for.
  ~DisplayServer();
  DisplayServer(const DisplayServer&) = delete;
  DisplayServer& operator=(const DisplayServer&) = delete;

  /// Pixels of `image`, whose size and channels must be those of the first call; channels that come later are
  /// not shown. Thread-safe; neither waits for the viewer nor throws for its sake.
  void show(const PixelBox& tile, const Image& image);
  /// All of it, if nothing has been shown yet.
  void showUnlessBegun(const Image& image);

  /// Waits until all is sent. Returns what went wrong, in a sentence without the address, or "". Nothing is
  /// shown afterwards.
  std::string finish();

 private:
  struct State;

  static void run(State& state);

  std::shared_ptr<State> state_;
};

}  // namespace nephele
