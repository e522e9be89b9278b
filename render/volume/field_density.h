#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

/// A density that rays ask a field for, and the bounds that tell them where they need not.
///
/// The ranges of the field are kept for cells of a lattice over the box, so that rays pass what is empty or
/// settled, and expressions are kept restricted to parts of the box, so that a point costs what is near it.
/// Values below zero and NaN count as zero; outside of the box there is nothing.
class FieldDensity {
 public:
  /// Cells along each edge of a brick.
  static constexpr int kBrick = 8;
  /// Larger densities count as this: opaque at any extinction, and far from overflow.
  static constexpr float kMostDensity = 1e30f;

  /// Cost: ranges of the field over all cells that are neither empty nor constant, some microseconds each on
  /// all cores, and 1 kB per brick of 8^3 of them. The result does not depend on the number of threads.
  /// Where it `looksForFlat` parts, see Span, some 18 evaluations per cell besides.
  /// @throws Error if the box is empty or unbounded, `cell` (the edge of a cell, world units) is not above 0,
  /// or more than 2^24 bricks were needed; Cancelled.
  FieldDensity(const ScalarField& density, const Box& box, float cell, const Progress& progress = silent(),
               bool looksForFlat = true);

  const Box& box() const { return box_; }
  float cell() const { return cell_; }
  /// True where the ranges leave no room for density.
  bool isEmpty() const { return isEmpty_; }
  std::size_t memoryBytes() const;

  /// A line, s from 0 to `length`, world units; it should not leave the box.
  struct Line {
    Vec3f origin, direction;
    float length = 0.0f;

    Vec3f at(float s) const { return origin + direction * s; }
  };

  /// Parts of the box whose expressions have been simplified are known by numbers; this one stands for any.
  static constexpr std::int32_t kAnyRegion = -1;

  /// A part of a line, bounds of the density on it, and the region that it is in.
  struct Span {
    float begin = 0.0f, end = 0.0f;
    Interval range = Interval::of(0);
    std::int32_t region = kAnyRegion;
    /// Wherever the density was looked at, every half of a cell up to a cell away, it is the same: it is not
    /// likely to vary, but it may.
    bool isFlat = false;
  };

  enum class Detail { bricks, cells };

  /// Goes along a line from cell to cell, or over more than one where they are known together; or only from
  /// brick to brick.
  class Walk {
   public:
    Walk(const FieldDensity& density, const Line& line, Detail detail = Detail::cells);
    /// The next part of the line that may hold density, near to far; false at its end.
    bool next(Span& span);

   private:
    float exitOf(const Vec3i& low, int size, int& axis) const;
    void enterCells();
    bool leaveBricks(int axis, int radius, float out);

    const FieldDensity* density_;
    // In cells of the lattice.
    Vec3f origin_, direction_, inverse_;
    float length_, s_ = 0.0f;
    Vec3i brick_{}, cell_{};
    // Where the planes behind the cell are met.
    Vec3f exit_{};
    std::int32_t pool_ = -1;
    bool isDone_, hasCells_;
  };

  /// Points to evaluate, and the working memory for it. One for every thread.
  class Batch {
   public:
    void clear() { count_ = 0; }
    std::size_t size() const { return count_; }
    /// A point of `line` at s. `region` must be the one that it is in, or kAnyRegion.
    void add(const FieldDensity& density, const Line& line, float s, std::int32_t region = kAnyRegion);
    /// Densities in the order of the points, >= 0 and finite. A value does not depend on the other points.
    std::span<const float> eval(const FieldDensity& density);

   private:
    std::size_t count_ = 0;
    std::vector<float> x_, y_, z_, values_, sorted_[4];
    std::vector<std::int32_t> regions_, touched_;
    // By region: its place in touched_, -1 between calls.
    std::vector<std::int32_t> slots_;
    std::vector<std::uint32_t> order_, firsts_;
  };

 private:
  // Share of a cell by which points may lie outside of the part that they are counted to.
  static constexpr float kMargin = 0.02f;

  using Codes = std::array<std::uint8_t, 2>;
  struct Cells {
    std::array<Codes, kBrick * kBrick * kBrick> codes{};
    std::bitset<kBrick * kBrick * kBrick> isFlat{};
  };
  struct Build;

  std::size_t entryOf(const Vec3i& brick) const { return BrickBox{{}, bricks_}.numberOf(brick); }
  Box boxOf(const Vec3i& firstCell, int cells, int cellsAround = 0) const;
  Interval rangeOf(const Interval& brick, const Codes& codes) const;
  std::int32_t regionAt(const Vec3f& point) const;

  Box box_;
  float cell_, perBrick_;
  bool looksForFlat_;
  Vec3i bricks_{};
  bool isEmpty_ = true;
  // By brick: bounds, which cells it has (none: -1), which part of space it belongs to, and how many bricks
  // it is to the nearest one that may hold anything (0: in one).
  std::vector<Interval> ranges_;
  std::vector<std::int32_t> pool_;
  std::vector<std::int32_t> region_;
  std::vector<std::uint8_t> emptiness_;
  std::vector<Cells> cells_;
  // The whole field, then restricted ones.
  std::vector<ScalarField> fields_;
};

}  // namespace nephele
