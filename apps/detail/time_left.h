#pragma once

#include <optional>
#include <vector>

namespace nephele::apps {

/// How long a stage will still take, once that can be told.
///
/// A stage's first steps say little: they fill caches, or are the cheapest or dearest of all. So nothing is
/// said before a tenth of the work or five seconds have passed, nor while the speed of the last half of the
/// time and that of the whole differ by more than a third. Then what is left goes on at the speed of the
/// last half.
class TimeLeft {
 public:
  /// `fraction` of the stage was done after `seconds`; later calls have later times.
  void note(double seconds, double fraction);
  /// Seconds left after the last note; nothing where that cannot be told.
  std::optional<double> seconds() const;

 private:
  struct Moment {
    double seconds, fraction;
  };
  std::vector<Moment> moments_;
};

}  // namespace nephele::apps
