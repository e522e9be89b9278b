// Movies through ffmpeg.
//
// The program is started with posix_spawn and a list of arguments; frames go to its standard input, its
// messages to a file without a name. It runs in a process group of its own, so that Ctrl-C reaches us alone
// and the movie is thrown away rather than ended early. If we are killed its input ends, and ffmpeg with it.
#include "nephele/render/image/movie.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>
#include <vector>

#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/system.h"
#include "nephele/render/image/detail/movie_check.h"

extern char** environ;

namespace nephele {
namespace {

int even(int size) {
  return size + size % 2;
}

// A descriptor that closes itself.
struct Descriptor {
  int number = -1;
  Descriptor() = default;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  void close() {
    if (number >= 0) ::close(number);
    number = -1;
  }
};

std::vector<std::string> arguments(int width, int height, const MovieWriter::Options& options,
                                   const std::string& path) {
  return {options.program, "-nostdin", "-hide_banner", "-loglevel", "error", "-y",
          // What comes in.
          "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size",
          fmt::format("{}x{}", even(width), even(height)), "-framerate",
          fmt::format("{}", options.framesPerSecond), "-i", "pipe:0",
          // What goes out. The scaler's own default would be the matrix of Rec. 601.
          "-vf", "scale=out_color_matrix=bt709:out_range=tv", "-c:v", "libx264", "-crf",
          std::to_string(options.quality), "-pix_fmt", "yuv420p", "-colorspace", "bt709", "-color_primaries",
          "bt709", "-color_trc", "iec61966-2-1", "-color_range", "tv", "-movflags", "+faststart", path};
}

}  // namespace

struct MovieWriter::Process {
  explicit Process(const std::string& path) : output(path) {}

  OutputFile output;
  Descriptor input, messages;
  pid_t id = -1;

  // What ffmpeg said, on one line.
  std::string said() const {
    std::string text(2000, '\0');
    const ssize_t count = ::pread(messages.number, text.data(), text.size(), 0);
    text.resize(std::size_t(std::max<ssize_t>(count, 0)));
    while (!text.empty() && text.back() == '\n') text.pop_back();
    for (char& c : text) c = c == '\n' ? ';' : c;
    return text.empty() ? "it gave no reason" : text;
  }
};

MovieWriter::MovieWriter(const std::string& path, int width, int height, const Options& options)
    : path_(path), width_(width), height_(height) {
  require(width >= 1 && height >= 1 && width <= 16384 && height <= 16384,
          fmt::format("movie: expected a size of 1x1 to 16384x16384, got {}x{}", width, height));
  require(options.framesPerSecond >= 0.1 && options.framesPerSecond <= 1000,
          fmt::format("movie: expected 0.1 to 1000 frames per second, got {}", options.framesPerSecond));
  require(options.quality >= 0 && options.quality <= 51,
          fmt::format("movie: expected a quality from 0 to 51, got {}", options.quality));
  process_ = std::make_unique<Process>(path);

  // A pair of sockets and not a pipe: it can be written to without a signal where nobody reads any more.
  Descriptor reading;
  int ends[2];
  require(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0,
          fmt::format("{}: no way to send ffmpeg its frames", path));
  reading.number = ends[0];
  process_->input.number = ends[1];
  process_->messages.number = memoryFile("messages of ffmpeg");
  require(process_->messages.number >= 0, fmt::format("{}: no place for ffmpeg's messages", path));

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, reading.number, STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, process_->messages.number, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t usual;
  sigemptyset(&usual);
  posix_spawnattr_setsigmask(&attributes, &usual);
  for (const int signal : {SIGPIPE, SIGXFSZ, SIGINT, SIGTERM}) sigaddset(&usual, signal);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  std::vector<std::string> words = arguments(width, height, options, process_->output.temporaryPath());
  // A path that starts with a dash would be an option.
  if (words.back().starts_with('-')) words.back().insert(0, "./");
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const int error =
      ::posix_spawnp(&process_->id, options.program.c_str(), &actions, &attributes, pointers.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) process_->id = -1;
  require(error != ENOENT,
          fmt::format("{}: movies are made by the program '{}', which is not installed; install the package "
                      "ffmpeg, or make no movie",
                      path, options.program));
  require(error == 0, fmt::format("{}: the program '{}' cannot be started: {}", path, options.program,
                                  std::generic_category().message(error)));
}

MovieWriter::~MovieWriter() {
  if (!process_ || process_->id < 0) return;
  ::kill(process_->id, SIGKILL);
  while (::waitpid(process_->id, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void MovieWriter::write(const std::vector<std::uint8_t>& bytes) {
  for (std::size_t done = 0; done != bytes.size();) {
    const ssize_t count =
        ::send(process_->input.number, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      end();
      throw Error(fmt::format("{}: cannot be written: ffmpeg stopped early: {}", path_, process_->said()));
    }
    done += std::size_t(count);
  }
}

void MovieWriter::end() {
  process_->input.close();
  int status = 0;
  while (::waitpid(process_->id, &status, 0) < 0 && errno == EINTR) {
  }
  process_->id = -1;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    // ffmpeg says nothing of a disk that is full.
    require(detail::isWholeMovie(process_->output.temporaryPath()),
            fmt::format("{}: cannot be written whole; the disk may be full", path_));
    return;
  }
  // The system ends it so where a file may not grow any more.
  const char* ended = WIFSIGNALED(status) ? sigdescr_np(WTERMSIG(status)) : nullptr;
  throw Error(
      fmt::format("{}: cannot be written: ffmpeg failed: {}", path_, ended ? ended : process_->said()));
}

void MovieWriter::add(const Image& frame, const ViewTransform& view) {
  require(frame.width == width_ && frame.height == height_,
          fmt::format("{}: expected a frame of {}x{}, got {}x{}", path_, width_, height_, frame.width,
                      frame.height));
  require(process_->id >= 0, fmt::format("{}: cannot be written: ffmpeg has stopped", path_));
  const std::vector<std::uint8_t> bytes = screenBytes(frame, view);
  const auto across = std::size_t(width_) * 3, evenAcross = std::size_t(even(width_)) * 3;
  if (across == evenAcross && height_ % 2 == 0) return write(bytes);
  std::vector<std::uint8_t> padded(evenAcross * std::size_t(even(height_)));
  for (std::size_t y = 0; y != std::size_t(even(height_)); ++y) {
    const std::uint8_t* from = bytes.data() + std::min(y, std::size_t(height_) - 1) * across;
    std::memcpy(padded.data() + y * evenAcross, from, across);
    if (across != evenAcross) std::memcpy(padded.data() + y * evenAcross + across, from + across - 3, 3);
  }
  write(padded);
}

void MovieWriter::finish() {
  require(process_->id >= 0, fmt::format("{}: cannot be written: ffmpeg has stopped", path_));
  end();
  process_->output.commit();
}

void MovieWriter::tryOut(const std::string& path, int width, int height, const Options& options) {
  MovieWriter movie(path, width, height, options);
  movie.write(std::vector<std::uint8_t>(std::size_t(even(width)) * std::size_t(even(height)) * 3));
  movie.end();
}

}  // namespace nephele
