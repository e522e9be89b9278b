// Ways through a field on its lattice, and its evaluation in batches.
//
// A walk crosses empty space in boxes as wide as the distance to the nearest brick that holds anything, and
// bricks that hold something cell by cell. Every exit is computed from the planes of the lattice, so that
// errors do not add up along the ray.
//
// Points of many rays are evaluated together, sorted by the part of space whose expression they need.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "nephele/render/volume/field_density.h"

namespace nephele {

FieldDensity::Walk::Walk(const FieldDensity& density, const Line& line, Detail detail)
    : density_(&density),
      length_(line.length),
      isDone_(!(line.length > 0)),
      hasCells_(detail == Detail::cells) {
  origin_ = (line.origin - density.box_.min) / density.cell_;
  direction_ = line.direction / density.cell_;
  for (int axis = 0; axis != 3; ++axis) {
    inverse_[axis] = 1.0f / direction_[axis];
    brick_[axis] = std::clamp(int(std::floor(origin_[axis] / kBrick)), 0, density.bricks_[axis] - 1);
  }
}

// Where the line leaves the box of `size` cells from `low` on.
float FieldDensity::Walk::exitOf(const Vec3i& low, int size, int& axis) const {
  float out = std::numeric_limits<float>::infinity();
  for (int a = 0; a != 3; ++a) {
    if (direction_[a] == 0) continue;
    const int plane = direction_[a] > 0 ? low[a] + size : low[a];
    const float at = (float(plane) - origin_[a]) * inverse_[a];
    if (at < out) out = at, axis = a;
  }
  // Rounding must not turn the line back.
  return std::max(out, s_);
}

void FieldDensity::Walk::enterCells() {
  for (int a = 0; a != 3; ++a) {
    cell_[a] =
        std::clamp(int(std::floor(origin_[a] + s_ * direction_[a])) - brick_[a] * kBrick, 0, kBrick - 1);
    exit_[a] = direction_[a] == 0
                   ? std::numeric_limits<float>::infinity()
                   : (float(brick_[a] * kBrick + cell_[a] + (direction_[a] > 0)) - origin_[a]) * inverse_[a];
  }
}

// Enters the brick behind the box of bricks `radius` around this one; false at the end.
bool FieldDensity::Walk::leaveBricks(int axis, int radius, float out) {
  s_ = out;
  const Vec3i centre = brick_;
  if (radius > 0)
    for (int a = 0; a != 3; ++a) {
      const int at = int(std::floor((origin_[a] + s_ * direction_[a]) / kBrick));
      brick_[a] =
          std::clamp(std::clamp(at, centre[a] - radius, centre[a] + radius), 0, density_->bricks_[a] - 1);
    }
  brick_[axis] = direction_[axis] > 0 ? centre[axis] + radius + 1 : centre[axis] - radius - 1;
  isDone_ = !(out < length_) || brick_[axis] < 0 || brick_[axis] >= density_->bricks_[axis];
  return !isDone_;
}

bool FieldDensity::Walk::next(Span& span) {
  while (!isDone_) {
    const std::size_t entry = density_->entryOf(brick_);
    int axis = 0;
    if (pool_ < 0) {
      const int away = density_->emptiness_[entry];
      if (away == 0 && hasCells_ && density_->pool_[entry] >= 0) {
        pool_ = density_->pool_[entry];
        enterCells();
        continue;
      }
      const int radius = std::max(away - 1, 0);
      const float begin = s_, out = exitOf((brick_ - Vec3i{radius, radius, radius}) * kBrick,
                                           (2 * radius + 1) * kBrick, axis);
      leaveBricks(axis, radius, out);
      if (away > 0) continue;
      span = {begin, std::min(out, length_), density_->ranges_[entry], density_->region_[entry]};
      return true;
    }
    const Cells& cells = density_->cells_[std::size_t(pool_)];
    const auto index = [&] { return std::size_t((cell_.z * kBrick + cell_.y) * kBrick + cell_.x); };
    const Codes codes = cells.codes[index()];
    const bool isFlat = cells.isFlat[index()];
    const float begin = s_;
    // As far as all cells are the same.
    do {
      axis = exit_.x <= exit_.y ? (exit_.x <= exit_.z ? 0 : 2) : (exit_.y <= exit_.z ? 1 : 2);
      s_ = std::max(exit_[axis], s_);
      const bool isUp = direction_[axis] > 0;
      cell_[axis] += isUp ? 1 : -1;
      exit_[axis] = (float(brick_[axis] * kBrick + cell_[axis] + isUp) - origin_[axis]) * inverse_[axis];
      isDone_ = !(s_ < length_);
      if (cell_[axis] < 0 || cell_[axis] >= kBrick) {
        pool_ = -1;
        leaveBricks(axis, 0, s_);
      }
    } while (!isDone_ && pool_ >= 0 && cells.codes[index()] == codes && cells.isFlat[index()] == isFlat);
    const Interval range = density_->rangeOf(density_->ranges_[entry], codes);
    if (range.max == 0) continue;
    span = {begin, std::min(s_, length_), range, density_->region_[entry], isFlat};
    return true;
  }
  return false;
}

void FieldDensity::Batch::add(const FieldDensity& density, const Line& line, float s, std::int32_t region) {
  const Vec3f p = line.at(s);
  if (region == kAnyRegion) {
    region = density.regionAt(p);
    // The ends of what is walked along may lie on the far side of the last cell.
    for (float way = -1; region == 0 && way <= 1; way += 2)
      region = density.regionAt(line.at(s + way * 0.5f * kMargin * density.cell_));
  }
  if (count_ == x_.size()) {
    const std::size_t room = std::max<std::size_t>(2 * count_, 1024);
    for (auto* lane : {&x_, &y_, &z_}) lane->resize(room);
    regions_.resize(room);
  }
  x_[count_] = p.x, y_[count_] = p.y, z_[count_] = p.z;
  regions_[count_++] = region;
}

std::span<const float> FieldDensity::Batch::eval(const FieldDensity& density) {
  if (values_.size() < x_.size()) {
    values_.resize(x_.size());
    order_.resize(x_.size());
    for (auto& lane : sorted_) lane.resize(x_.size());
  }
  // Regions in the order in which they first occur, points of one region in their order.
  slots_.resize(density.fields_.size(), -1);
  touched_.clear();
  firsts_.clear();
  for (std::size_t i = 0; i != count_; ++i) {
    std::int32_t& slot = slots_[std::size_t(regions_[i])];
    if (slot < 0) {
      slot = std::int32_t(touched_.size());
      touched_.push_back(regions_[i]);
      firsts_.push_back(0);
    }
    ++firsts_[std::size_t(slot)];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& first : firsts_) sum += std::exchange(first, sum);
  for (std::size_t i = 0; i != count_; ++i) {
    const std::uint32_t to = firsts_[std::size_t(slots_[std::size_t(regions_[i])])]++;
    order_[to] = std::uint32_t(i);
    sorted_[0][to] = x_[i], sorted_[1][to] = y_[i], sorted_[2][to] = z_[i];
  }
  // What were the firsts are the ends now.
  std::size_t begin = 0;
  for (std::size_t slot = 0; slot != touched_.size(); ++slot) {
    const std::size_t end = firsts_[slot];
    const auto part = [&](std::vector<float>& lane) {
      return std::span<float>(lane.data() + begin, end - begin);
    };
    density.fields_[std::size_t(touched_[slot])].eval({part(sorted_[0]), part(sorted_[1]), part(sorted_[2])},
                                                      part(sorted_[3]));
    slots_[std::size_t(touched_[slot])] = -1;
    begin = end;
  }
  for (std::size_t i = 0; i != count_; ++i) {
    const float value = sorted_[3][i];
    values_[order_[i]] = value > 0 ? std::min(value, kMostDensity) : 0.0f;
  }
  return {values_.data(), count_};
}

}  // namespace nephele
