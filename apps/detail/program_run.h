#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <set>

#include "apps/app.h"
#include "apps/detail/time_left.h"

namespace nephele::apps {

/// Options that every verb takes.
struct CommonOptions {
  int threads = 0;
  bool quiet = false;
  bool verbose = false;
  bool overwrite = true;
  /// Of sequences, which turntables have on their own.
  std::string frames, only, shard;
  bool skipExisting = false;
  std::vector<std::string> wedges;
  std::string contactSheet;
  std::string config, look;
  std::string stats;
  std::string progress = "auto";
  std::string memoryLimit = "80%";
};

/// The Run behind a verb: shows progress on stderr, times the stages, learns of signals.
class ProgramRun : public Run {
 public:
  ProgramRun(std::string verb, const CommonOptions& options);

  void begin(std::string_view stage) const override;
  void count(std::string_view name, double value) const override;
  void advance(double fraction) const override;
  void note(std::string_view message) const override;
  bool cancelled() const override;
  void expect(double from, double to, int stages) const override;
  void detail(std::string_view message) const override;
  void result(const std::string& line) const override;

  /// From here on stages and statistics are those of one part of the whole run, which takes the progress from
  /// the share `from` to `to`. Messages name it.
  void beginPart(const std::string& name, double from, double to);
  /// Ends it. Its stages and statistics, with its seconds, which are taken out of this run's.
  nlohmann::json endPart();

  /// Whether lines of result are shown.
  bool tellsResults = true;

  /// Ends the last stage and clears the bar. Call before anything else is printed.
  void endStages() const;
  /// The same where all is done, which farm software is told.
  void finish() const;

  /// The whole statistics object, with what the program itself knows filled in.
  nlohmann::json statistics() const;

 private:
  using Clock = std::chrono::steady_clock;

  void endStage() const;
  void draw(double fraction) const;
  void clearBar() const;

  std::string verb_, who_;
  CommonOptions options_;
  bool terminal_ = false;
  Clock::time_point start_ = Clock::now();

  mutable std::mutex mutex_;
  mutable std::string stage_;
  mutable Clock::time_point stageStart_;
  mutable TimeLeft timeLeft_;
  mutable nlohmann::json stages_ = nlohmann::json::array();
  mutable bool barShown_ = false;
  mutable std::set<std::string> said_;
  double partFrom_ = 0, partTo_ = 1;
  Clock::time_point partStart_ = start_;
  mutable double from_ = 0, to_ = 1;
  mutable int expectedStages_ = 0;
  mutable std::size_t expectedFrom_ = 0;  // stages before the expected ones
  mutable int farmPercent_ = -1;
  mutable std::int64_t lastLine_ = 0;
  mutable std::atomic<std::int64_t> lastDrawn_{0};
};

/// Bytes that `text` ("8G", "512M", "80%") allows this process. @throws CLI::ValidationError
double parseMemoryLimit(const std::string& text);

/// From here on SIGINT and SIGTERM make `cancelled` true; a second one ends the process at once, leaving no
/// partial output.
void installSignalHandlers();

/// The signal that asked the program to stop, or 0.
int stopSignal();

}  // namespace nephele::apps
