#include "apps/detail/time_left.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace nephele::apps {
namespace {

constexpr double kLeastFraction = 0.1, kLeastSeconds = 5, kLeastOfLong = 0.01, kMostApart = 4.0 / 3;
constexpr std::size_t kMostMoments = 512;

}  // namespace

void TimeLeft::note(double seconds, double fraction) {
  // A sum of parts that begins again from 0 tells nothing of the whole.
  if (!moments_.empty() && fraction < moments_.back().fraction) moments_.clear();
  moments_.push_back({seconds, fraction});
  if (moments_.size() < kMostMoments) return;
  // Every other one is enough to find the middle by.
  for (std::size_t i = 0; i != kMostMoments / 2; ++i) moments_[i] = moments_[2 * i + 1];
  moments_.resize(kMostMoments / 2);
}

std::optional<double> TimeLeft::seconds() const {
  if (moments_.size() < 3) return std::nullopt;
  const Moment now = moments_.back();
  const bool isLong = now.seconds >= kLeastSeconds && now.fraction >= kLeastOfLong;
  if (now.fraction < kLeastFraction && !isLong) return std::nullopt;
  const auto middle = std::find_if(moments_.begin(), moments_.end(),
                                   [&](const Moment& m) { return m.seconds >= now.seconds / 2; });
  if (middle->seconds >= now.seconds || middle->fraction >= now.fraction) return std::nullopt;
  const double whole = now.fraction / now.seconds,
               last = (now.fraction - middle->fraction) / (now.seconds - middle->seconds);
  if (std::max(whole, last) > kMostApart * std::min(whole, last)) return std::nullopt;
  return (1 - now.fraction) / last;
}

}  // namespace nephele::apps
