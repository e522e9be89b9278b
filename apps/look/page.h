#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

namespace nephele::apps {

/// What waits to be sent to one page of the viewer.
class LookPage {
 public:
  /// Puts a message at the end. A picture takes the place of one that has not been sent, and so does
  /// progress; nothing is kept for a page that does not read.
  void send(const nlohmann::json& header, std::string payload = {});
  /// The next message as it goes over the wire, both lengths first; an empty one after `seconds` without.
  /// False once the page is closed and all is sent.
  bool next(std::string& bytes, double seconds);
  /// No more messages come.
  void close();
  bool isClosed() const;

 private:
  struct Message {
    std::string kind, bytes;
  };
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Message> messages_;
  bool closed_ = false;
};

}  // namespace nephele::apps
