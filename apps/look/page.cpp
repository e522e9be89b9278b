#include "apps/look/page.h"

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace nephele::apps {
namespace {

void addLength(std::string& bytes, std::size_t length) {
  for (int shift = 0; shift < 32; shift += 8) bytes += char(length >> shift & 0xff);
}

}  // namespace

void LookPage::send(const nlohmann::json& header, std::string payload) {
  constexpr std::size_t kMostWaiting = 200;
  const std::string text = header.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  Message message{header.value("type", ""), {}};
  message.bytes.reserve(8 + text.size() + payload.size());
  addLength(message.bytes, text.size());
  addLength(message.bytes, payload.size());
  message.bytes += text;
  message.bytes += payload;
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    if (message.kind == "picture" || message.kind == "progress")
      std::erase_if(messages_, [&](const Message& other) { return other.kind == message.kind; });
    if (messages_.size() >= kMostWaiting) messages_.pop_front();
    messages_.push_back(std::move(message));
  }
  changed_.notify_all();
}

bool LookPage::next(std::string& bytes, double seconds) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(seconds),
                    [&] { return closed_ || !messages_.empty(); });
  if (messages_.empty()) {
    bytes.assign(8, '\0');
    return !closed_;
  }
  bytes = std::move(messages_.front().bytes);
  messages_.pop_front();
  return true;
}

void LookPage::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
}

bool LookPage::isClosed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

}  // namespace nephele::apps
