#include "apps/detail/program_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <optional>

#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/base/system.h"

namespace nephele::apps {
namespace {

// Any thread may be the one that is interrupted, and others look at it.
std::atomic<int> receivedSignal = 0;
static_assert(std::atomic<int>::is_always_lock_free, "what a signal handler may write");

extern "C" void onStopSignal(int signal) {
  if (receivedSignal != 0) {
    discardAllOutputs();
    // Only what signal handlers may call.
    constexpr char message[] = "nephele: stopped at once; no partial output was left\n";
    static_cast<void>(!write(STDERR_FILENO, message, sizeof(message) - 1));
    _exit(128 + signal);
  }
  receivedSignal = signal;
}

/// On stderr. What cannot be printed is lost: a note must not fail a job.
template <class... Values>
void say(fmt::format_string<Values...> format, Values&&... values) {
  std::fputs(fmt::format(format, std::forward<Values>(values)...).c_str(), stderr);
}

std::string inUnits(double bytes) {
  return bytes >= 1e9 ? fmt::format("{:.1f} GB", bytes / 1e9) : fmt::format("{:.0f} MB", bytes / 1e6);
}

}  // namespace

void installSignalHandlers() {
  std::signal(SIGINT, onStopSignal);
  std::signal(SIGTERM, onStopSignal);
  // A full file or a closed pipe is then an error of the write, which is reported, not a silent death.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

int stopSignal() {
  return receivedSignal;
}

double parseMemoryLimit(const std::string& text) {
  std::optional<double> bytes = parseBytes(text);
  if (text.ends_with('%'))
    if (const auto percent = parseNumber(std::string_view(text).substr(0, text.size() - 1)))
      bytes = *percent / 100 * allowedMemory();
  if (!bytes || *bytes <= 0)
    throw CLI::ValidationError("--memory-limit",
                               fmt::format("got '{}', allowed: a size such as 8G, 512M or 80%", text));
  return *bytes;
}

std::map<std::string, std::string> Run::metadata() const {
  std::map<std::string, std::string> all{
      {"creator", "nephele"}, {"version", NEPHELE_VERSION}, {"command_line", commandLine}};
  if (!configOptions.empty()) all["config_options"] = configOptions;
  if (part && part->frame) all["frame"] = std::to_string(*part->frame);
  if (part && !part->digest.empty()) all[kPartDigest] = part->digest;
  return all;
}

double Run::longestSide(const Box& own) const {
  return part && part->range ? part->range->longestSide : double(own.longestSide());
}

Box Run::box(const Box& own) const {
  return part && part->range ? part->range->box : own;
}

void Run::requireMemory(double estimatedBytes, const std::string& remedy) const {
  require(estimatedBytes <= memoryLimitBytes,
          fmt::format(
              "this needs {} of memory and may use {}; {} or raise --memory-limit",
              std::isfinite(estimatedBytes) ? "about " + inUnits(estimatedBytes) : "more than can be told",
              inUnits(memoryLimitBytes), remedy));
}

ProgramRun::ProgramRun(std::string verb, const CommonOptions& options)
    : verb_(std::move(verb)), who_(verb_), options_(options), terminal_(isatty(STDERR_FILENO) != 0) {
  memoryLimitBytes = parseMemoryLimit(options.memoryLimit);
}

void ProgramRun::begin(std::string_view stage) const {
  const std::lock_guard lock(mutex_);
  endStage();
  stage_ = stage;
  stageStart_ = Clock::now();
  timeLeft_ = {};
  stages_.push_back({{"name", stage_}});
}

void ProgramRun::count(std::string_view name, double value) const {
  const std::lock_guard lock(mutex_);
  if (!stages_.empty()) stages_.back()[std::string(name)] = value;
}

void ProgramRun::endStage() const {
  if (stage_.empty()) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - stageStart_).count();
  stages_.back()["seconds"] = seconds;
  stages_.back()["peak_memory_bytes"] = peakMemory();
  clearBar();
  const bool slow = seconds >= 2;
  if (options_.verbose || (slow && !options_.quiet && !terminal_))
    say("nephele {}: {}: {:.2f} s\n", who_, stage_, seconds);
  stage_.clear();
}

void ProgramRun::expect(double from, double to, int stages) const {
  const std::lock_guard lock(mutex_);
  from_ = partFrom_ + (partTo_ - partFrom_) * from;
  to_ = partFrom_ + (partTo_ - partFrom_) * to;
  expectedStages_ = stages;
  expectedFrom_ = stages_.size();
}

void ProgramRun::beginPart(const std::string& name, double from, double to) {
  {
    const std::lock_guard lock(mutex_);
    endStage();
    stages_.clear();
    who_ = verb_ + ": " + name;
    partFrom_ = from;
    partTo_ = to;
    partStart_ = Clock::now();
  }
  stats = nlohmann::json::object();
  expect(0, 1, 0);
}

nlohmann::json ProgramRun::endPart() {
  const std::lock_guard lock(mutex_);
  endStage();
  nlohmann::json result = {{"seconds", std::chrono::duration<double>(Clock::now() - partStart_).count()},
                           {"stages", stages_}};
  result.update(stats);
  stages_.clear();
  stats = nlohmann::json::object();
  who_ = verb_;
  return result;
}

void ProgramRun::advance(double fraction) const {
  const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - start_).count();
  auto last = lastDrawn_.load(std::memory_order_relaxed);
  if (now - last < 100 || !lastDrawn_.compare_exchange_strong(last, now)) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (lock.owns_lock()) draw(std::clamp(fraction, 0.0, 1.0));
}

void ProgramRun::draw(double fraction) const {
  if (options_.progress == "alf") {
    const double passed = double(stages_.size() - expectedFrom_) - 1 + fraction;
    // Where stages are not known ahead, the whole is taken to approach its end with each of them.
    const double share =
        expectedStages_ > 0 ? std::clamp(passed / expectedStages_, 0.0, 1.0) : 1 - std::pow(0.5, passed);
    const double whole = from_ + (to_ - from_) * share;
    // The last line is that of `finish`.
    const int percent = std::min(99, int(whole * 100));
    if (percent > farmPercent_) {
      farmPercent_ = percent;
      fmt::print("ALF_PROGRESS {}%\n", percent);
      std::fflush(stdout);
    }
    return;
  }
  if (options_.quiet || stage_.empty()) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - stageStart_).count();
  timeLeft_.note(seconds, fraction);
  if (seconds < 0.5) return;
  const std::optional<double> left = timeLeft_.seconds();
  if (terminal_) {
    constexpr int kWidth = 30;
    const int filled = int(fraction * kWidth);
    say("\r\033[K{}{} [{}{}] {:3.0f} %{}", who_ == verb_ ? "" : who_.substr(verb_.size() + 2) + ": ", stage_,
        std::string(filled, '#'), std::string(kWidth - filled, '.'), fraction * 100,
        left ? fmt::format("  {:.0f} s left", *left) : "");
    std::fflush(stderr);
    barShown_ = true;
  } else if (const auto now = lastDrawn_.load(); seconds >= 2 && now - lastLine_ >= 5000) {
    lastLine_ = now;
    say("nephele {}: {}: {:.0f} %{}\n", who_, stage_, fraction * 100,
        left ? fmt::format(", {:.0f} s left", *left) : "");
  }
}

void ProgramRun::clearBar() const {
  if (!barShown_) return;
  say("\r\033[K");
  std::fflush(stderr);
  barShown_ = false;
}

void ProgramRun::note(std::string_view message) const {
  if (options_.quiet) return;
  const std::lock_guard lock(mutex_);
  // What holds for all parts is said of the first.
  if (who_ != verb_ && !said_.emplace(message).second) return;
  clearBar();
  say("nephele {}: {}\n", who_, printable(message));
}

void ProgramRun::detail(std::string_view message) const {
  if (options_.verbose) note(message);
}

bool ProgramRun::cancelled() const {
  return receivedSignal != 0;
}

void ProgramRun::result(const std::string& line) const {
  if (options_.quiet || !tellsResults) return;
  const std::lock_guard lock(mutex_);
  clearBar();
  const std::string text = printable(line) + '\n';
  std::fwrite(text.data(), 1, text.size(), stdout);
}

void ProgramRun::endStages() const {
  const std::lock_guard lock(mutex_);
  endStage();
}

void ProgramRun::finish() const {
  endStages();
  if (options_.progress == "alf") {
    fmt::print("ALF_PROGRESS 100%\n");
    std::fflush(stdout);
  }
}

nlohmann::json ProgramRun::statistics() const {
  nlohmann::json all = {{"command", commandLine}, {"version", NEPHELE_VERSION}};
  if (!configOptions.empty()) all["config_options"] = configOptions;
  all["seconds"] = std::chrono::duration<double>(Clock::now() - start_).count();
  all["peak_memory_bytes"] = peakMemory();
  all["stages"] = stages_;
  all.update(stats);
  return all;
}

}  // namespace nephele::apps
