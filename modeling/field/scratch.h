#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

/// The data of evaluation in blocks: points, results and working memory. For the implementation of fields.
namespace nephele {

/// Points per block. Every lane handed to a node has room for this many floats and is 64-byte aligned.
inline constexpr int kBlockSize = 256;

/// Up to kBlockSize points, structure of arrays. Lanes are readable up to `count` rounded up to 16: what lies
/// past `count` repeats the last point, so that kernels need no tail. `id` names the point set: two blocks
/// with the same id on the same thread hold the same points.
struct PointBlock {
  const float* x;
  const float* y;
  const float* z;
  int count;
  std::uint64_t id;

  int paddedCount() const { return (count + 15) & ~15; }
};

/// N result lanes of one block.
template <int N>
using BlockLanes = std::array<float*, N>;

/// Per-thread working memory: a stack of lanes, given back when its Frame ends. It grows on first use and
/// keeps what it has, so that steady evaluation allocates nothing.
class Scratch {
 public:
  static Scratch& local();
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  /// Lanes taken through a Frame live as long as it.
  class Frame {
   public:
    explicit Frame(Scratch& scratch) : scratch_(scratch), mark_(scratch.used_) {}
    ~Frame() { scratch_.used_ = mark_; }
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

    float* lane() { return scratch_.take(); }
    template <int N>
    BlockLanes<N> lanes() {
      BlockLanes<N> result;
      for (float*& l : result) l = lane();
      return result;
    }

   private:
    Scratch& scratch_;
    std::size_t mark_;
  };

  /// A new point set over three filled lanes, with a fresh id; pads the tail by repeating the last point.
  PointBlock pointBlock(const BlockLanes<3>& xyz, int count);

  /// What a shared sub-expression has already given for a point set; see `memo`. Lanes: values, then
  /// gradients.
  struct MemoEntry {
    std::uint64_t nodeSerial = 0;
    std::uint64_t pointsId = 0;
    bool hasGradients = false;
    std::vector<float> lanes;
  };
  /// The place for node `nodeSerial` (> 0). A few places are shared by all nodes: check both ids before
  /// reading, and do not keep the reference while evaluating.
  MemoEntry& memoEntry(std::uint64_t nodeSerial);

 private:
  Scratch();
  float* take();

  struct Storage;
  std::unique_ptr<Storage> storage_;
  std::size_t used_ = 0;
};

}  // namespace nephele
