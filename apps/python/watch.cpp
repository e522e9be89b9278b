// Work runs in a thread of its own and in an arena of TBB of its own. So the thread of Python has nothing to
// do but to look for interrupts, and each thread that enters the arena knows whose work it does: exceptions
// of functions of Python come back where the work was asked for, also where several threads of Python ask at
// once.
#include "apps/python/watch.h"

#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <thread>

namespace nephele::python {
namespace {

/// Whose work it is, null once that has ended.
using Owner = std::atomic<const Watch*>;

thread_local std::shared_ptr<const Owner> ownerHere;

/// Sets it for this thread, and afterwards as it was.
class OwnerScope {
 public:
  explicit OwnerScope(std::shared_ptr<const Owner> owner)
      : before_(std::exchange(ownerHere, std::move(owner))) {}
  ~OwnerScope() { ownerHere = std::move(before_); }
  OwnerScope(const OwnerScope&) = delete;
  OwnerScope& operator=(const OwnerScope&) = delete;

 private:
  std::shared_ptr<const Owner> before_;
};

/// Lets the threads of an arena know. Those that leave it after the work are told of no exit: what they know
/// outlives this, and says that the work has ended.
class Announcer final : public tbb::task_scheduler_observer {
 public:
  Announcer(tbb::task_arena& arena, const Watch& watch)
      : task_scheduler_observer(arena), owner_(std::make_shared<Owner>(&watch)) {
    observe(true);
  }
  ~Announcer() override {
    observe(false);
    *owner_ = nullptr;
  }
  void on_scheduler_entry(bool) override { ownerHere = owner_; }
  void on_scheduler_exit(bool) override { ownerHere.reset(); }

 private:
  std::shared_ptr<Owner> owner_;
};

void inArena(const Watch& watch, const std::function<void()>& work) {
  tbb::task_arena arena;
  const Announcer announcer(arena, watch);
  arena.execute(work);
}

/// Does `work` in this thread and the threads that help it, and raises what went wrong.
void hereAndNow(Watch& watch, const std::function<void()>& work) {
  std::exception_ptr fault;
  {
    const OwnerScope scope(std::make_shared<Owner>(&watch));
    const py::gil_scoped_release release;
    try {
      work();
    } catch (...) {
      fault = std::current_exception();
    }
  }
  watch.report(py::none());
  watch.throwPythonError();
  if (fault) std::rethrow_exception(fault);
}

}  // namespace

Watch::Watch() {
  if (const Watch* around = watchOfThisThread()) depth_ = around->depth_ + 1;
}

void Watch::begin(std::string_view stage) const {
  const std::lock_guard lock(mutex_);
  stage_ = stage;
  stages_.push_back(stage_);
  fraction_ = 0;
}

void Watch::note(std::string_view message) const {
  constexpr std::string_view kWarning = "warning: ";
  const bool isWarning = message.starts_with(kWarning);
  tell(isWarning ? 30 : 20, isWarning ? message.substr(kWarning.size()) : message);
}

void Watch::tell(int level, std::string_view message) const {
  const std::lock_guard lock(mutex_);
  messages_.push_back({level, std::string(message)});
}

void Watch::keepPythonError() const {
  py::error_already_set error;
  const std::lock_guard lock(mutex_);
  if (!error_) error_.emplace(std::move(error));
  stop();
}

void Watch::throwPythonError() {
  if (error_) throw py::error_already_set(*error_);
}

void Watch::report(const py::object& callback) {
  std::vector<Message> messages;
  std::vector<std::string> stages;
  std::string stage;
  {
    const std::lock_guard lock(mutex_);
    messages.swap(messages_);
    stages.swap(stages_);
    stage = stage_;
  }
  const double fraction = std::min(1.0, std::max(0.0, fraction_.load()));
  try {
    if (!messages.empty()) {
      const py::object logger = py::module_::import("logging").attr("getLogger")("nephele");
      for (const Message& message : messages) logger.attr("log")(message.level, "%s", message.text);
    }
    if (callback.is_none()) return;
    for (const std::string& begun : stages) {
      if (begun == stage) continue;
      callback(begun, 1.0);
    }
    if (stage.empty() || reported_ == std::pair(stage, fraction)) return;
    reported_ = {stage, fraction};
    callback(stage, fraction);
  } catch (py::error_already_set& error) {
    error.restore();
    keepPythonError();
  }
}

const Watch* watchOfThisThread() {
  return ownerHere ? ownerHere->load() : nullptr;
}

void watched(Watch& watch, const py::object& callback, const std::function<void()>& work) {
  using namespace std::chrono_literals;
  std::exception_ptr fault;
  std::mutex mutex;
  std::condition_variable changed;
  bool isDone = false;
  {
    const py::gil_scoped_release release;
    std::thread worker([&] {
      try {
        inArena(watch, work);
      } catch (...) {
        fault = std::current_exception();
      }
      const std::lock_guard lock(mutex);
      isDone = true;
      changed.notify_one();
    });
    std::unique_lock lock(mutex);
    while (!changed.wait_for(lock, 50ms, [&] { return isDone; })) {
      lock.unlock();
      {
        const py::gil_scoped_acquire acquire;
        if (PyErr_CheckSignals() != 0) watch.keepPythonError();
        watch.report(callback);
      }
      lock.lock();
    }
    lock.unlock();
    worker.join();
  }
  watch.report(callback);
  watch.throwPythonError();
  if (fault) std::rethrow_exception(fault);
}

void atOnce(Watch& watch, const std::function<void()>& work) {
  hereAndNow(watch, work);
}

void atOnceOnAllThreads(Watch& watch, const std::function<void()>& work) {
  hereAndNow(watch, [&] { inArena(watch, work); });
}

}  // namespace nephele::python
