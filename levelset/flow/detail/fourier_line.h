#pragma once

#include <cstddef>
#include <memory>

/// Fourier transforms of single rows and of blocks of columns, by the library that the build has.
namespace nephele::detail {

/// Columns that are transformed together, side by side: numbers of one column lie kBlock apart.
inline constexpr std::size_t kBlock = 16;

inline constexpr std::size_t kAlignment = 64;

/// Numbers at a multiple of kAlignment bytes, not set.
struct AlignedFree {
  void operator()(float* values) const;
};
using AlignedFloats = std::unique_ptr<float[], AlignedFree>;
AlignedFloats alignedFloats(std::size_t count);

enum class Direction { forward, inverse };

enum class Layout {
  /// n reals, which become n / 2 + 1 complex numbers.
  row,
  /// n times kBlock / 2 complex numbers.
  block,
};

/// Sums of f(j) e^(-+ 2 pi i j k / n), in place; forward and back again is n times what was there.
class FourierLine {
 public:
  FourierLine(int n, Direction direction, Layout layout);
  ~FourierLine();
  FourierLine(FourierLine&&) noexcept;

  /// `values` lies at a multiple of kAlignment bytes. May be called from several threads at once.
  void run(float* values) const;

 private:
  struct Plan;
  std::unique_ptr<Plan> plan_;
};

}  // namespace nephele::detail
