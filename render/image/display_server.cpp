// Tiles of a picture on their way to a viewer.
//
// A copy of the picture and a list of boxes that have changed stand between those who make it and the thread
// that sends: the list is bounded by the number of tiles, and a box that changes again before it is sent is
// sent once. Neighbours in a row of tiles go together.
//
// The protocol is that of tev (github.com/Tom94/tev, include/tev/Ipc.h): 32 bit length with itself, 8 bit
// operation, then its fields; texts end with a zero byte.
#include "nephele/render/image/display_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "nephele/modeling/base/assertion.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

using Clock = std::chrono::steady_clock;

enum class Operation : std::uint8_t { closeImage = 2, createImage = 4, updateImage = 6 };

// A packet as it is being written.
class Packet {
 public:
  explicit Packet(Operation operation) {
    add(std::uint32_t(0));
    bytes_.push_back(char(operation));
  }
  void add(bool flag) { bytes_.push_back(flag ? 1 : 0); }
  void add(std::uint32_t value) { addBytes(value, 4); }
  void add(int value) { add(std::uint32_t(value)); }
  void add(std::int64_t value) { addBytes(std::uint64_t(value), 8); }
  void add(const std::string& text) {
    bytes_.insert(bytes_.end(), text.c_str(), text.c_str() + text.size() + 1);
  }
  void add(const float* values, std::size_t count) {
    if constexpr (std::endian::native == std::endian::little) {
      const char* first = reinterpret_cast<const char*>(values);
      bytes_.insert(bytes_.end(), first, first + count * sizeof(float));
    } else {
      for (std::size_t i = 0; i != count; ++i) add(std::bit_cast<std::uint32_t>(values[i]));
    }
  }

  // With its length.
  const std::vector<char>& whole() {
    for (std::size_t i = 0; i != 4; ++i) bytes_[i] = char(bytes_.size() >> (8 * i));
    return bytes_;
  }

 private:
  void addBytes(std::uint64_t value, int count) {
    for (int i = 0; i != count; ++i) bytes_.push_back(char(value >> (8 * i)));
  }

  std::vector<char> bytes_;
};

Packet creation(const std::string& name, const Image& image) {
  Packet packet(Operation::createImage);
  packet.add(true);  // grabs the focus
  packet.add(name);
  packet.add(image.width);
  packet.add(image.height);
  packet.add(int(image.channels.size()));
  for (const Image::Channel& channel : image.channels) packet.add(channel.name);
  return packet;
}

// Channel after channel.
Packet update(const std::string& name, const Image& image, const PixelBox& box) {
  Packet packet(Operation::updateImage);
  packet.add(false);
  packet.add(name);
  packet.add(int(image.channels.size()));
  for (const Image::Channel& channel : image.channels) packet.add(channel.name);
  for (const int value : {box.x0, box.y0, box.width(), box.height()}) packet.add(value);
  const std::int64_t pixels = std::int64_t(box.width()) * box.height();
  for (std::size_t c = 0; c != image.channels.size(); ++c) packet.add(std::int64_t(c) * pixels);
  for (std::size_t c = 0; c != image.channels.size(); ++c) packet.add(std::int64_t(1));
  for (const Image::Channel& channel : image.channels)
    for (int y = box.y0; y != box.y1; ++y)
      packet.add(channel.values.data() + std::size_t(y) * std::size_t(image.width) + box.x0,
                 std::size_t(box.width()));
  return packet;
}

// A socket that never blocks and raises no signal.
class Connection {
 public:
  Connection() = default;
  ~Connection() {
    if (socket_ >= 0) ::close(socket_);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // False if there is nobody; `error` says why.
  bool open(const addrinfo& address, double patience, std::string& error) {
    if (socket_ >= 0) ::close(socket_);
    socket_ =
        ::socket(address.ai_family, address.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, address.ai_protocol);
    if (socket_ < 0) return failed(error, errno);
    // What the system would hold back is not seen by anyone.
    const int bytes = 1 << 18;
    ::setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    if (::connect(socket_, address.ai_addr, address.ai_addrlen) == 0) return true;
    if (errno != EINPROGRESS) return failed(error, errno);
    if (!wait(patience)) {
      error = "does not answer";
      return false;
    }
    int code = 0;
    socklen_t size = sizeof code;
    ::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &code, &size);
    return code == 0 || failed(error, code);
  }

  // Viewers say nothing, so that what can be read is the end.
  bool send(const std::vector<char>& bytes, double patience, std::string& error) {
    for (std::size_t sent = 0; sent != bytes.size();) {
      char answer = 0;
      const bool isClosed = ::recv(socket_, &answer, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
      const ssize_t count =
          isClosed ? -1 : ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count >= 0) {
        sent += std::size_t(count);
      } else if (isClosed || errno == EPIPE || errno == ECONNRESET) {
        error = "has closed the connection";
        return false;
      } else if (errno == EAGAIN) {
        if (wait(patience)) continue;
        error = "takes nothing any more";
        return false;
      } else if (errno != EINTR) {
        return failed(error, errno);
      }
    }
    return true;
  }

 private:
  // Until something can be written.
  bool wait(double seconds) const {
    pollfd ready{socket_, POLLOUT, 0};
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    while (true) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
      const int count = ::poll(&ready, 1, int(std::max<long long>(left, 0)));
      if (count > 0) return true;
      if (count == 0 || errno != EINTR) return false;
    }
  }

  static bool failed(std::string& error, int code) {
    error = code == ECONNREFUSED ? "is not there" : fmt::format("cannot be reached: {}", std::strerror(code));
    return false;
  }

  int socket_ = -1;
};

bool connected(Connection& connection, const DisplayServer::Options& options, std::string& error) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (::getaddrinfo(options.host.c_str(), std::to_string(options.port).c_str(), &hints, &found) != 0) {
    error = "is not known by this name";
    return false;
  }
  bool isOpen = false;
  for (const addrinfo* one = found; one && !isOpen; one = one->ai_next)
    isOpen = connection.open(*one, options.patience, error);
  ::freeaddrinfo(found);
  return isOpen;
}

}  // namespace

struct DisplayServer::State {
  Options options;
  std::string name;

  std::mutex mutex;
  std::condition_variable changed;
  // What has been shown; no channels before the first tile.
  Image picture{};
  std::deque<PixelBox> waiting{};
  bool isEnding = false, isDone = false;
  std::string error{};
  std::thread thread{};

  // The next box, with its neighbours in the row; called with the mutex held.
  PixelBox take() {
    PixelBox box = waiting.front();
    waiting.pop_front();
    const auto isNext = [&](const PixelBox& other) {
      return other.y0 == box.y0 && other.y1 == box.y1 && other.x0 == box.x1;
    };
    for (auto next = std::ranges::find_if(waiting, isNext); next != waiting.end();
         next = std::ranges::find_if(waiting, isNext)) {
      box.x1 = next->x1;
      waiting.erase(next);
    }
    return box;
  }
};

DisplayServer::Options DisplayServer::parse(const std::string& text) {
  Options options;
  std::string port;
  const std::size_t colon = text.rfind(':');
  if (text.starts_with('[') && text.find(']') != std::string::npos) {
    const std::size_t end = text.find(']');
    options.host = text.substr(1, end - 1);
    port = text.substr(end + 1);
  } else {
    options.host = text.substr(0, colon);
    if (colon != std::string::npos) port = text.substr(colon);
  }
  const bool hasPort = port.starts_with(':');
  const char *first = port.data() + (hasPort ? 1 : 0), *last = port.data() + port.size();
  const auto [end, failure] = std::from_chars(first, last, options.port);
  const bool isRight = port.empty() || (hasPort && failure == std::errc() && end == last &&
                                        options.port > 0 && options.port < 65536);
  require(
      isRight && !options.host.empty() && options.host.find_first_of(" /[]") == std::string::npos &&
          (text.starts_with('[') || options.host.find(':') == std::string::npos),
      fmt::format("display server: expected HOST or HOST:PORT with a port from 1 to 65535, got '{}'", text));
  return options;
}

// The thread that sends.
void DisplayServer::run(State& state) {
  Connection connection;
  std::string error;
  bool isGood = connected(connection, state.options, error), isCreated = false;
  std::unique_lock lock(state.mutex);
  while (isGood) {
    state.changed.wait(lock, [&] { return state.isEnding || !state.waiting.empty(); });
    if (state.waiting.empty()) break;
    std::vector<Packet> packets;
    if (!isCreated) {
      packets.emplace_back(Operation::closeImage).add(state.name);
      packets.push_back(creation(state.name, state.picture));
      isCreated = true;
    }
    packets.push_back(update(state.name, state.picture, state.take()));
    lock.unlock();
    for (Packet& packet : packets)
      isGood = isGood && connection.send(packet.whole(), state.options.patience, error);
    lock.lock();
  }
  state.error = error;
  state.waiting.clear();
  state.isDone = true;
  state.changed.notify_all();
}

DisplayServer::DisplayServer(Options options, const std::string& name) : state_(std::make_shared<State>()) {
  require(options.patience > 0, "display server: expected a patience above 0");
  state_->options = std::move(options);
  // Texts end with their first zero.
  state_->name = name.c_str();
  state_->thread = std::thread([state = state_] { run(*state); });
}

DisplayServer::~DisplayServer() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->isEnding = true;
    state_->waiting.clear();
    state_->changed.notify_all();
  }
  finish();
}

void DisplayServer::show(const PixelBox& tile, const Image& image) {
  const std::lock_guard lock(state_->mutex);
  if (state_->isDone || state_->isEnding || tile.width() <= 0 || tile.height() <= 0) return;
  Image& picture = state_->picture;
  if (picture.channels.empty()) {
    picture.width = image.width;
    picture.height = image.height;
    for (const Image::Channel& channel : image.channels) picture.add(channel.name, channel.half);
  }
  NEPHELE_ASSERT(image.width == picture.width && image.height == picture.height);
  for (std::size_t c = 0; c != picture.channels.size(); ++c)
    for (int y = tile.y0; y != tile.y1; ++y) {
      const std::size_t first = std::size_t(y) * std::size_t(image.width) + std::size_t(tile.x0);
      std::copy_n(image.channels[c].values.begin() + std::ptrdiff_t(first), tile.width(),
                  picture.channels[c].values.begin() + std::ptrdiff_t(first));
    }
  if (std::ranges::find(state_->waiting, tile) == state_->waiting.end()) state_->waiting.push_back(tile);
  state_->changed.notify_all();
}

void DisplayServer::showUnlessBegun(const Image& image) {
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->picture.channels.empty()) return;
  }
  show({0, 0, image.width, image.height}, image);
}

std::string DisplayServer::finish() {
  std::unique_lock lock(state_->mutex);
  if (!state_->thread.joinable()) return state_->error;
  state_->isEnding = true;
  state_->changed.notify_all();
  const std::chrono::duration<double> most(2 * state_->options.patience);
  if (!state_->changed.wait_for(lock, most, [&] { return state_->isDone; })) {
    // Whether it sends or asks for a name: it ends by itself, and has nothing but the state.
    state_->waiting.clear();
    state_->thread.detach();
    return state_->error = "is too slow; the rest of the picture is not shown";
  }
  std::thread thread = std::move(state_->thread);
  lock.unlock();
  thread.join();
  return state_->error;
}

}  // namespace nephele
