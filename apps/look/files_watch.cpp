#include "apps/look/files_watch.h"

#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "apps/file_hashes.h"
#include "apps/look/subject.h"

namespace nephele::apps {

FilesWatch::FilesWatch() : notices_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {}

FilesWatch::~FilesWatch() {
  if (notices_ >= 0) close(notices_);
}

void FilesWatch::watch(const std::vector<std::string>& paths) {
  std::map<std::string, std::string> stamps;
  for (const std::string& path : paths) {
    const auto known = stamps_.find(path);
    stamps[path] = known != stamps_.end() ? known->second : fileStamp(path);
    std::string folder = std::filesystem::path(path).parent_path().string();
    if (folder.empty()) folder = ".";
    if (!folders_.contains(folder))
      folders_[folder] =
          inotify_add_watch(notices_, folder.c_str(), IN_CLOSE_WRITE | IN_MOVED_TO | IN_DELETE | IN_CREATE);
  }
  stamps_ = std::move(stamps);
}

std::vector<std::string> FilesWatch::wait(int milliseconds) {
  std::vector<std::string> changed;
  pollfd ready{notices_, POLLIN, 0};
  if (poll(&ready, 1, milliseconds) <= 0) return changed;
  constexpr std::chrono::milliseconds kBurst(40);
  std::this_thread::sleep_for(kBurst);
  char events[4096];
  while (read(notices_, events, sizeof(events)) > 0) {
  }
  for (auto& [path, stamp] : stamps_)
    if (std::string now = fileStamp(path); now != stamp) {
      stamp = std::move(now);
      changed.push_back(path);
    }
  return changed;
}

}  // namespace nephele::apps
