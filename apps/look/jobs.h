#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace nephele::apps {

/// Command lines of this program that run beside the viewer, in processes of their own, so that what they
/// write and how they end is as ever.
class LookJobs {
 public:
  /// `tell` takes messages {"type": "job", ...} from other threads; every line ends with `limits`.
  LookJobs(std::function<void(const nlohmann::json&)> tell, std::vector<std::string> limits)
      : tell_(std::move(tell)), limits_(std::move(limits)) {}
  /// Stops all, which leave no partial output.
  ~LookJobs();
  LookJobs(const LookJobs&) = delete;
  LookJobs& operator=(const LookJobs&) = delete;

  static constexpr int kMostAtOnce = 4;
  /// Runs the lines one after the other, and removes the files of `temporary` in the end.
  /// Returns the number of the job. @throws Error where too many run.
  int start(const std::string& what, std::vector<std::vector<std::string>> lines,
            std::vector<std::string> temporary);
  /// False where there is no such job.
  bool stop(int id);

 private:
  struct Job {
    int process = 0;
    bool isStopped = false, isDone = false;
    std::thread thread;
  };
  void run(int id, const std::string& what, const std::vector<std::vector<std::string>>& lines,
           const std::vector<std::string>& temporary);
  int runLine(int id, const std::vector<std::string>& line, const std::function<void(double)>& advance,
              std::string& last);

  std::function<void(const nlohmann::json&)> tell_;
  std::vector<std::string> limits_;
  std::mutex mutex_;
  std::map<int, Job> jobs_;
  int last_ = 0;
};

}  // namespace nephele::apps
