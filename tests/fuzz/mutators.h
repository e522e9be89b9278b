#pragma once

#include <cstddef>
#include <cstdint>

#include "tests/fuzz/formats.h"

// Changes that get past what hides a file's contents from random ones: compressed blocks, checksums, lengths
// that must agree. As Mutator.
namespace nephele::fuzz {

/// Changes what a stream of zlib or Blosc unpacks to, packs it again and corrects the length before it and
/// all places in the file that are told from its start.
std::size_t mutateBlocks(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change);
/// The same, and switches checksums of NanoVDB grids off.
std::size_t mutateNanoVdb(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change);
/// The same for the pixels of PNG files, with the checksums of all chunks made right.
std::size_t mutatePng(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change);
/// Changes the JSON or the buffer of a GLB file and corrects the lengths of both.
std::size_t mutateGlb(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change);

}  // namespace nephele::fuzz
