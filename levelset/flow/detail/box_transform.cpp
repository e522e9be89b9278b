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

BoxTransform::BoxTransform(const Vec3i& cells, const std::array<Waves, 3>& waves)
    : lines_{LineTransform(cells.x, waves[0], Direction::forward, LineTransform::Layout::row),
             LineTransform(cells.y, waves[1], Direction::forward, LineTransform::Layout::block),
             LineTransform(cells.z, waves[2], Direction::forward, LineTransform::Layout::block),
             LineTransform(cells.x, waves[0], Direction::inverse, LineTransform::Layout::row),
             LineTransform(cells.y, waves[1], Direction::inverse, LineTransform::Layout::block),
             LineTransform(cells.z, waves[2], Direction::inverse, LineTransform::Layout::block)} {}

void BoxTransform::forwardInPlane(const BoxValues& values, int z) const {
  for (int y = 0; y < values.count().y; ++y) lines_[0].run(values.row(y, z));
  alongY(lines_[1], values, z);
}

void BoxTransform::inverseInPlane(const BoxValues& values, int z) const {
  alongY(lines_[4], values, z);
  for (int y = 0; y < values.count().y; ++y) lines_[3].run(values.row(y, z));
}

void BoxTransform::alongY(const LineTransform& line, const BoxValues& values, int z) const {
  const int count = values.count().y;
  const AlignedFloats block = alignedFloats(std::size_t(count) * kBlock);
  for (std::size_t x = 0; x < values.rowLength(); x += kBlock) {
    float* const columns = values.row(0, z) + x;
    gather(columns, values.rowLength(), count, block.get());
    line.run(block.get());
    scatter(block.get(), count, columns, values.rowLength());
  }
}

}  // namespace nephele::detail
