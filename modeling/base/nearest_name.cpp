#include "nephele/modeling/base/nearest_name.h"

#include <algorithm>

namespace nephele {

namespace {

/// Edits that make `a` of `b`: a letter more, a letter less, another letter, two letters exchanged.
std::size_t editsBetween(std::string_view a, std::string_view b) {
  std::vector<std::size_t> last2(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        now[j] = std::min(now[j], last2[j - 2] + 1);
    }
    last2 = last;
    last = now;
  }
  return last[b.size()];
}

}  // namespace

std::string nearestName(std::string_view name, const std::vector<std::string>& names) {
  if (name.size() > 64) return {};
  const auto lowered = [](std::string text) {
    for (char& c : text)
      if (c >= 'A' && c <= 'Z') c += 'a' - 'A';
    return text;
  };
  const std::string lower = lowered(std::string(name));
  std::string nearest;
  std::size_t fewest = std::max<std::size_t>(1, name.size() / 3) + 1;
  for (const std::string& other : names) {
    if (other.size() > 64) continue;
    const std::size_t edits = editsBetween(lower, lowered(other));
    if (edits < fewest) {
      fewest = edits;
      nearest = other;
    }
  }
  return nearest;
}

}  // namespace nephele
