#pragma once

#include <map>
#include <string>
#include <vector>

namespace nephele::apps {

/// Learns of changes of files on disk, without looking while there are none.
class FilesWatch {
 public:
  FilesWatch();
  ~FilesWatch();
  FilesWatch(const FilesWatch&) = delete;
  FilesWatch& operator=(const FilesWatch&) = delete;

  /// From now on these are watched, whether they are there or not.
  void watch(const std::vector<std::string>& paths);
  /// Waits as long as this for changes, and until a burst of them is over, and returns the files that have
  /// another size or time than before.
  std::vector<std::string> wait(int milliseconds);

 private:
  int notices_ = -1;
  std::map<std::string, std::string> stamps_;
  // Of folders: editors put new files in the place of old ones.
  std::map<std::string, int> folders_;
};

}  // namespace nephele::apps
