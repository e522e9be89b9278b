#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/strings.h"
#include "nephele/modeling/base/progress.h"

/// How work of C++ runs while Python stays alive.
namespace nephele::python {

namespace py = pybind11;

/// What is known of one piece of work, from all threads that it runs on: how far it is, whether it is to
/// stop, and what went wrong in a function of Python that it called.
class Watch : public Progress {
 public:
  Watch();

  /// A line for people, and how important it is, as Python's logging counts: 10 detail, 20 note, 30 warning.
  struct Message {
    int level;
    std::string text;
  };

  void begin(std::string_view stage) const override;
  void advance(double fraction) const override { fraction_.store(fraction, std::memory_order_relaxed); }
  void note(std::string_view message) const override;
  bool cancelled() const override { return stops_.load(std::memory_order_relaxed); }
  void tell(int level, std::string_view message) const;

  void stop() const { stops_ = true; }
  /// Keeps the exception of Python that is under way, the first of them, and stops. Needs the GIL.
  void keepPythonError() const;
  /// Throws it, if there is one. Needs the GIL.
  void throwPythonError();
  /// How many pieces of work wait for this one: functions of Python that they called asked for it.
  int depth() const { return depth_; }

  /// Calls `callback(stage, fraction)` if that has changed, and Python's logging with messages. Needs the
  /// GIL.
  void report(const py::object& callback);

 private:
  mutable std::atomic<bool> stops_{false};
  mutable std::atomic<double> fraction_{0};
  mutable std::mutex mutex_;
  mutable std::string stage_;
  mutable std::vector<Message> messages_;
  mutable std::vector<std::string> stages_;
  mutable std::optional<py::error_already_set> error_;
  std::pair<std::string, double> reported_{"", -1};
  int depth_ = 0;
};

/// The work that this thread is part of, or null.
const Watch* watchOfThisThread();

/// Does `work`, without the GIL, in threads of its own: interrupts and `callback` (None, or called with stage
/// and fraction) are looked after every twentieth of a second. @throws what the work throws; what the
/// callback, a function of Python that the work called, or an interrupt raises.
void watched(Watch& watch, const py::object& callback, const std::function<void()>& work);

/// The same in this thread, for what takes no time to speak of and calls functions of Python from here alone.
void atOnce(Watch& watch, const std::function<void()>& work);
/// Likewise for what calls them from the threads that help, too.
void atOnceOnAllThreads(Watch& watch, const std::function<void()>& work);

}  // namespace nephele::python
