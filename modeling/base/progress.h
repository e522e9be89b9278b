#pragma once

#include <string_view>

#include "nephele/modeling/base/error.h"

namespace nephele {

/// How long work reports how far it is and learns that it should stop.
///
/// Work opens each part with `begin`, calls `advance` from any thread while it runs, and tests `cancelled` at
/// intervals well under a second. The base class reports nothing and never cancels.
class Progress {
 public:
  virtual ~Progress() = default;

  /// A new stage starts; the one before it, if any, has ended. `stage` is a short noun phrase ("layer 2").
  virtual void begin(std::string_view stage) const { static_cast<void>(stage); }

  /// A count that belongs to the current stage, for statistics ("active_voxels").
  virtual void count(std::string_view name, double value) const {
    static_cast<void>(name);
    static_cast<void>(value);
  }

  /// The current stage is done up to `fraction` (0 to 1). Thread-safe; may be called out of order.
  virtual void advance(double fraction) const { static_cast<void>(fraction); }

  /// Something the user should know that is not an error ("filled 5 holes").
  virtual void note(std::string_view message) const { static_cast<void>(message); }

  /// True once the work should stop. Thread-safe.
  virtual bool cancelled() const { return false; }

  /// @throws Cancelled if `cancelled()`.
  void check() const {
    if (cancelled()) throw Cancelled();
  }
};

/// A part of the current stage of longer work: what it advances takes the stage from the share `from` to
/// `to`. Its own stages and counts are not told; notes and cancelling go through.
class SubProgress : public Progress {
 public:
  /// `whole` must outlive this. 0 <= from <= to <= 1.
  SubProgress(const Progress& whole, double from, double to) : whole_(whole), from_(from), to_(to) {}

  void advance(double fraction) const override { whole_.advance(from_ + (to_ - from_) * fraction); }
  void note(std::string_view message) const override { whole_.note(message); }
  bool cancelled() const override { return whole_.cancelled(); }

 private:
  const Progress& whole_;
  double from_, to_;
};

/// A Progress that reports nothing, for default arguments.
inline const Progress& silent() {
  static const Progress progress;
  return progress;
}

}  // namespace nephele
