#include "apps/look/jobs.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string_view>

#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

/// What a line says is wrong, without who says it; nothing where it says something else.
std::optional<std::string> faultIn(const std::string& line) {
  constexpr std::string_view kMark = ": error: ";
  const std::size_t mark = line.find(kMark);
  if (mark == std::string::npos) return std::nullopt;
  // Of a script, what stands before it is the place of the fault.
  return line.starts_with("nephele ") ? line.substr(mark + kMark.size()) : line;
}

}  // namespace

LookJobs::~LookJobs() {
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, job] : jobs_) {
      job.isStopped = true;
      if (job.process > 0) kill(job.process, SIGTERM);
    }
  }
  for (auto& [id, job] : jobs_) job.thread.join();
}

int LookJobs::start(const std::string& what, std::vector<std::vector<std::string>> lines,
                    std::vector<std::string> temporary) {
  const std::lock_guard lock(mutex_);
  int running = 0;
  for (auto job = jobs_.begin(); job != jobs_.end();)
    if (job->second.isDone) {
      job->second.thread.join();
      job = jobs_.erase(job);
    } else {
      ++running;
      ++job;
    }
  require(running < kMostAtOnce, fmt::format("{} jobs run already; wait for one, or stop it", running));
  const int id = ++last_;
  jobs_[id].thread =
      std::thread([this, id, what, lines = std::move(lines), temporary = std::move(temporary)] {
        run(id, what, lines, temporary);
        const std::lock_guard done(mutex_);
        jobs_[id].isDone = true;
      });
  return id;
}

bool LookJobs::stop(int id) {
  const std::lock_guard lock(mutex_);
  const auto job = jobs_.find(id);
  if (job == jobs_.end() || job->second.isDone) return false;
  job->second.isStopped = true;
  if (job->second.process > 0) kill(job->second.process, SIGTERM);
  return true;
}

void LookJobs::run(int id, const std::string& what, const std::vector<std::vector<std::string>>& lines,
                   const std::vector<std::string>& temporary) {
  const auto say = [&](const char* state, double fraction, const std::string& message) {
    tell_({{"type", "job"},
           {"id", id},
           {"what", what},
           {"state", state},
           {"fraction", fraction},
           {"message", message}});
  };
  const auto end = [&](const char* state, double fraction, const std::string& message) {
    for (const std::string& path : temporary) {
      std::error_code ignored;
      std::filesystem::remove(path, ignored);
    }
    say(state, fraction, message);
  };
  say("running", 0, "");
  std::string last;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto advance = [&](double share) {
      say("running", (double(i) + share) / double(lines.size()), last);
    };
    const int code = runLine(id, lines[i], advance, last);
    const bool isStopped = [&] {
      const std::lock_guard lock(mutex_);
      return jobs_[id].isStopped;
    }();
    if (isStopped) return end("stopped", 0, last);
    if (code != 0) return end("failed", 0, last);
  }
  end("done", 1, last);
}

int LookJobs::runLine(int id, const std::vector<std::string>& line,
                      const std::function<void(double)>& advance, std::string& last) {
  int ends[2];
  if (pipe(ends) != 0) return 1;
  std::vector<std::string> words{"nephele"};
  words.insert(words.end(), line.begin(), line.end());
  words.insert(words.end(), limits_.begin(), limits_.end());
  words.insert(words.end(), {"--progress", "alf"});
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = -1;
  {
    const std::lock_guard lock(mutex_);
    if (!jobs_[id].isStopped) child = fork();
    if (child == 0) {
      // Only what may be called between fork and exec.
      dup2(ends[1], STDOUT_FILENO);
      dup2(ends[1], STDERR_FILENO);
      for (int other = STDERR_FILENO + 1; other < 1024; ++other) close(other);
      execv("/proc/self/exe", arguments.data());
      _exit(1);
    }
    if (child > 0) jobs_[id].process = child;
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    return 1;
  }
  std::FILE* output = fdopen(ends[0], "r");
  char* text = nullptr;
  std::size_t size = 0;
  // Hints and what else is said go after the error.
  bool hasFailed = false;
  while (output && getline(&text, &size, output) >= 0) {
    std::string said = text;
    while (!said.empty() && (said.back() == '\n' || said.back() == '\r')) said.pop_back();
    int percent = 0;
    if (std::sscanf(said.c_str(), "ALF_PROGRESS %d%%", &percent) == 1) {
      advance(percent / 100.0);
    } else if (!said.empty() && !hasFailed) {
      const std::optional<std::string> fault = faultIn(said);
      last = fault.value_or(said);
      hasFailed = fault.has_value();
    }
  }
  std::free(text);
  if (output) std::fclose(output);
  int status = 0;
  waitpid(child, &status, 0);
  const std::lock_guard lock(mutex_);
  jobs_[id].process = 0;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace nephele::apps
