#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "nephele/levelset/flow/detail/fourier_line.h"
#include "nephele/modeling/base/math.h"

/// Sums of waves along the axes of a box, in place. For the projection of flows.
namespace nephele::detail {

/// The functions of j that a row of numbers is a sum of; there are n cells between them. Forward and back
/// again is a multiple of what was there.
enum class Waves {
  /// e^(2 pi i k j / n) for n numbers. Along x, where numbers are real, those with k from 0 to n / 2. n
  /// times.
  exponentials,
  /// cos(pi k j / n), k from 0 to n, for n + 1 numbers. 2 n times.
  cosines,
  /// sin(pi k j / n), k from 0 to n, for n + 1 numbers, of which the first and the last count as 0. 2 n
  /// times.
  sines,
};

/// Along one axis.
class WaveTransform {
 public:
  WaveTransform(int cells, Waves waves, Layout layout);

  /// Of one row or block, at a multiple of kAlignment bytes. `room` is for roomSize() numbers, aligned
  /// likewise. May be called from several threads at once.
  void run(Direction direction, float* values, float* room) const;
  std::size_t roomSize() const;

 private:
  std::size_t cells_;
  Waves waves_;
  Layout layout_;
  /// Sums of cosines and of sines are their own inverse, and need the first alone.
  FourierLine forward_, inverse_;
};

/// A box of numbers, rows along x padded so that each begins at a multiple of kAlignment bytes.
class BoxValues {
 public:
  /// `count` numbers along each axis, and room for the complex numbers that rows become.
  explicit BoxValues(const Vec3i& count);

  const Vec3i& count() const { return count_; }
  /// Numbers from row to row, a multiple of kBlock, and from plane to plane.
  std::size_t rowLength() const { return rowLength_; }
  std::size_t planeLength() const { return rowLength_ * std::size_t(count_.y); }
  float* row(int y, int z) const {
    return values_.get() + std::size_t(z) * planeLength() + std::size_t(y) * rowLength_;
  }

 private:
  Vec3i count_;
  std::size_t rowLength_;
  AlignedFloats values_;
};

/// The transforms of a box, axis by axis.
class BoxTransform {
 public:
  BoxTransform(const Vec3i& cells, const std::array<Waves, 3>& waves);

  /// Along x and then y, or the other way round, of one plane of `values`. From several threads at once for
  /// different planes.
  void inPlane(Direction direction, const BoxValues& values, int z) const;
  /// Along z, of blocks of columns.
  const WaveTransform& alongZ() const { return z_; }

 private:
  WaveTransform x_, y_, z_;
};

/// Copies a block of `count` numbers per column from or to places `stride` apart.
void gather(const float* from, std::size_t stride, int count, float* block);
void scatter(const float* block, int count, float* to, std::size_t stride);

}  // namespace nephele::detail
