// Working memory of evaluation: a stack of lanes in chunks that never move, one per thread. It grows when an
// expression is deeper than any before; after that, taking a lane is an index and a pointer.
#include "nephele/modeling/field/scratch.h"

#include "nephele/modeling/base/assertion.h"

namespace nephele {
namespace {

constexpr std::size_t kLanesPerChunk = 64;
constexpr std::size_t kMemoEntries = 64;

struct alignas(64) Chunk {
  float lanes[kLanesPerChunk][kBlockSize] = {};
};

}  // namespace

struct Scratch::Storage {
  std::vector<std::unique_ptr<Chunk>> chunks;
  std::array<MemoEntry, kMemoEntries> memo;
  std::uint64_t lastId = 0;
};

Scratch::Scratch() : storage_(std::make_unique<Storage>()) {}
Scratch::~Scratch() = default;

Scratch& Scratch::local() {
  thread_local Scratch scratch;
  return scratch;
}

float* Scratch::take() {
  const std::size_t chunk = used_ / kLanesPerChunk;
  if (chunk == storage_->chunks.size()) storage_->chunks.push_back(std::make_unique<Chunk>());
  return storage_->chunks[chunk]->lanes[used_++ % kLanesPerChunk];
}

PointBlock Scratch::pointBlock(const BlockLanes<3>& xyz, int count) {
  NEPHELE_ASSERT(count >= 0 && count <= kBlockSize);
  const PointBlock block{xyz[0], xyz[1], xyz[2], count, ++storage_->lastId};
  for (float* lane : xyz)
    for (int i = count; i < block.paddedCount(); ++i) lane[i] = lane[count - 1];
  return block;
}

Scratch::MemoEntry& Scratch::memoEntry(std::uint64_t nodeSerial) {
  NEPHELE_ASSERT(nodeSerial > 0);
  return storage_->memo[nodeSerial % kMemoEntries];
}

}  // namespace nephele
