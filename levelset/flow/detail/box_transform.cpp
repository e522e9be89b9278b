// Columns are copied in blocks of one cache line each: strided transforms of large boxes would wait for
// memory at every number.
#include "nephele/levelset/flow/detail/box_transform.h"

#include <algorithm>
#include <cstring>
#include <new>

#include "nephele/modeling/base/system.h"

namespace nephele::detail {

namespace {

std::size_t roundedUp(std::size_t count, std::size_t step) {
  return (count + step - 1) / step * step;
}

}  // namespace

void AlignedFree::operator()(float* values) const {
  ::operator delete[](values, std::align_val_t(kAlignment));
}

AlignedFloats alignedFloats(std::size_t count) {
  return AlignedFloats(
      static_cast<float*>(::operator new[](count * sizeof(float), std::align_val_t(kAlignment))));
}

BoxValues::BoxValues(const Vec3i& count)
    : count_(count), rowLength_(roundedUp(std::size_t(count.x) / 2 * 2 + 2, kBlock)) {
  const std::size_t size = planeLength() * std::size_t(count.z);
  values_ = alignedFloats(size);
  adviseHugePages(values_.get(), values_.get() + size);
}

void gather(const float* from, std::size_t stride, int count, float* block) {
  for (int i = 0; i < count; ++i)
    std::memcpy(block + std::size_t(i) * kBlock, from + std::size_t(i) * stride, kBlock * sizeof(float));
}

void scatter(const float* block, int count, float* to, std::size_t stride) {
  for (int i = 0; i < count; ++i)
    std::memcpy(to + std::size_t(i) * stride, block + std::size_t(i) * kBlock, kBlock * sizeof(float));
}

WaveTransform::WaveTransform(int cells, Waves waves, Layout layout)
    : cells_(std::size_t(cells)),
      waves_(waves),
      layout_(layout),
      forward_(waves == Waves::exponentials ? cells : 2 * cells, Direction::forward, layout),
      inverse_(waves == Waves::exponentials ? cells : 1, Direction::inverse, layout) {}

std::size_t WaveTransform::roomSize() const {
  if (waves_ == Waves::exponentials) return 0;
  return layout_ == Layout::row ? 2 * cells_ + 2 : 2 * cells_ * kBlock;
}

void WaveTransform::run(Direction direction, float* values, float* room) const {
  if (waves_ == Waves::exponentials)
    return (direction == Direction::forward ? forward_ : inverse_).run(values);
  const bool isSine = waves_ == Waves::sines;
  const std::size_t stride = layout_ == Layout::row ? 1 : kBlock, last = cells_ * stride;
  if (isSine) {
    std::fill_n(values, stride, 0.0f);
    std::fill_n(values + last, stride, 0.0f);
  }
  std::copy_n(values, last + stride, room);
  for (std::size_t i = 1; i < cells_; ++i)
    for (std::size_t column = 0; column < stride; ++column) {
      const float value = values[i * stride + column];
      room[(2 * cells_ - i) * stride + column] = isSine ? -value : value;
    }
  forward_.run(room);
  // Of numbers that are their own mirror image the transform is real, and i times that of the others is. A
  // block's complex numbers are two columns each, which keeps them apart.
  if (layout_ == Layout::row)
    for (std::size_t k = 0; k <= cells_; ++k) values[k] = isSine ? -room[2 * k + 1] : room[2 * k];
  else if (isSine)
    for (std::size_t k = 0; k < last + stride; k += 2) values[k] = -room[k + 1], values[k + 1] = room[k];
  else
    std::copy_n(room, last + stride, values);
}

BoxTransform::BoxTransform(const Vec3i& cells, const std::array<Waves, 3>& waves)
    : x_(cells.x, waves[0], Layout::row),
      y_(cells.y, waves[1], Layout::block),
      z_(cells.z, waves[2], Layout::block) {}

void BoxTransform::inPlane(Direction direction, const BoxValues& values, int z) const {
  const int count = values.count().y;
  const AlignedFloats block = alignedFloats(std::size_t(count) * kBlock),
                      room = alignedFloats(std::max(x_.roomSize(), y_.roomSize()));
  const auto alongX = [&] {
    for (int y = 0; y < count; ++y) x_.run(direction, values.row(y, z), room.get());
  };
  if (direction == Direction::forward) alongX();
  for (std::size_t x = 0; x < values.rowLength(); x += kBlock) {
    float* const columns = values.row(0, z) + x;
    gather(columns, values.rowLength(), count, block.get());
    y_.run(direction, block.get(), room.get());
    scatter(block.get(), count, columns, values.rowLength());
  }
  if (direction == Direction::inverse) alongX();
}

}  // namespace nephele::detail
