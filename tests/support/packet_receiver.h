#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace nephele::test {

/// A viewer that shows nothing: listens on a port of its own and rebuilds pictures from the packets that come
/// in, after the description of the protocol in tev's Ipc.h, independently of what sends them.
class PacketReceiver {
 public:
  enum class Habit { takesAll, takesNothing, closesEarly };

  struct Picture {
    int width = 0, height = 0;
    std::map<std::string, std::vector<float>> channels;
    std::size_t updates = 0, pixels = 0;
  };

  explicit PacketReceiver(Habit habit = Habit::takesAll) : habit_(habit) {
    listening_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int bytes = 4096;
    if (habit == Habit::takesNothing) ::setsockopt(listening_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    if (::bind(listening_, generic, size) != 0 || ::listen(listening_, 1) != 0 ||
        ::getsockname(listening_, generic, &size) != 0)
      throw std::runtime_error("no port to listen on");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  ~PacketReceiver() { finish(); }
  PacketReceiver(const PacketReceiver&) = delete;
  PacketReceiver& operator=(const PacketReceiver&) = delete;

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  int port() const { return port_; }

  /// After the sender has closed; the pictures by name. `problem` is empty if all packets were sound.
  void finish() {
    isEnding_ = true;
    if (thread_.joinable()) thread_.join();
    if (listening_ >= 0) ::close(listening_);
    listening_ = -1;
  }

  std::map<std::string, Picture> pictures;
  std::string problem;
  std::size_t closings = 0;

 private:
  void run() {
    try {
      if (!isReady(listening_)) return;
      const int socket = ::accept(listening_, nullptr, nullptr);
      receive(socket);
      ::close(socket);
    } catch (const std::exception& error) {
      problem = error.what();
    }
  }

  // Waits; false where the test has ended before anything came.
  bool isReady(int socket) const {
    while (true) {
      pollfd ready{socket, POLLIN, 0};
      if (::poll(&ready, 1, 20) > 0) return true;
      if (isEnding_) return false;
    }
  }

  void receive(int socket) {
    while (habit_ == Habit::takesNothing && !isEnding_) ::usleep(10000);
    if (habit_ == Habit::takesNothing) return;
    std::vector<char> bytes;
    while (isReady(socket)) {
      char buffer[65536];
      const ssize_t count = ::recv(socket, buffer, sizeof buffer, 0);
      if (count <= 0) break;
      bytes.insert(bytes.end(), buffer, buffer + count);
      if (habit_ == Habit::closesEarly) return;
      std::size_t at = 0;
      for (std::uint32_t size = 0; bytes.size() - at >= 4; at += size) {
        std::memcpy(&size, bytes.data() + at, 4);
        if (size < 5) throw std::runtime_error("a packet is shorter than its head");
        if (bytes.size() - at < size) break;
        take({bytes.data() + at + 4, bytes.data() + at + size});
      }
      bytes.erase(bytes.begin(), bytes.begin() + std::ptrdiff_t(at));
    }
    if (!bytes.empty()) throw std::runtime_error("the last packet is not whole");
  }

  struct Reader {
    const char* at;
    const char* end;

    template <class T>
    T number() {
      T value;
      if (end - at < std::ptrdiff_t(sizeof value)) throw std::runtime_error("a packet is too short");
      std::memcpy(&value, at, sizeof value);
      at += sizeof value;
      return value;
    }
    std::string text() {
      std::string result;
      while (const char c = number<char>()) result += c;
      return result;
    }
  };

  void take(Reader packet) {
    const auto operation = packet.number<std::uint8_t>();
    if (operation == 2) {
      pictures.erase(packet.text());
      ++closings;
      return;
    }
    packet.number<std::uint8_t>();  // whether it wants the focus
    const std::string name = packet.text();
    if (operation == 4) {
      Picture& picture = pictures[name] = {};
      picture.width = packet.number<std::int32_t>();
      picture.height = packet.number<std::int32_t>();
      for (auto count = packet.number<std::int32_t>(); count > 0; --count)
        picture.channels[packet.text()].assign(std::size_t(picture.width * picture.height), 0);
    } else if (operation == 6) {
      if (!pictures.contains(name)) throw std::runtime_error("an update of a picture that is not there");
      update(packet, pictures[name]);
    } else {
      throw std::runtime_error("an operation that is not known");
    }
    if (packet.at != packet.end) throw std::runtime_error("a packet is longer than its contents");
  }

  static void update(Reader& packet, Picture& picture) {
    std::vector<std::string> names(std::size_t(packet.number<std::int32_t>()));
    for (std::string& name : names) name = packet.text();
    const auto x = packet.number<std::int32_t>(), y = packet.number<std::int32_t>(),
               width = packet.number<std::int32_t>(), height = packet.number<std::int32_t>();
    if (x < 0 || y < 0 || x + width > picture.width || y + height > picture.height)
      throw std::runtime_error("pixels outside of the picture");
    std::vector<std::int64_t> offsets(names.size()), strides(names.size());
    for (auto& offset : offsets) offset = packet.number<std::int64_t>();
    for (auto& stride : strides) stride = packet.number<std::int64_t>();
    const char* data = packet.at;
    for (std::size_t c = 0; c != names.size(); ++c)
      for (std::int64_t i = 0; i != std::int64_t(width) * height; ++i) {
        Reader value{data + (offsets[c] + i * strides[c]) * 4, packet.end};
        picture.channels.at(names[c])[std::size_t((y + i / width) * picture.width + x + i % width)] =
            value.number<float>();
        packet.at = std::max(packet.at, value.at);
      }
    ++picture.updates;
    picture.pixels += std::size_t(width) * std::size_t(height);
  }

  Habit habit_;
  int listening_ = -1, port_ = 0;
  std::atomic<bool> isEnding_{false};
  std::thread thread_;
};

}  // namespace nephele::test
