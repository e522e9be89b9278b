#pragma once

#include <cstddef>

/// What only the operating system can do and POSIX leaves open: memory in pages, limits and use of memory.
/// Another system needs another system.cpp.
namespace nephele {

/// The memory that the process may use, bytes: the machine's, or less where a control group or a resource
/// limit says so.
double allowedMemory();
/// The most memory that the process has used so far, bytes.
double peakMemory();

/// From now on the allocator gives large blocks back to the system as soon as they are freed. Left alone it
/// raises its limit by itself and then keeps what large vectors leave behind, stage after stage.
void returnLargeBlocksAtOnce();
/// A nameless file in memory, as a descriptor that programs started later do not inherit; -1 if there is no
/// room.
int memoryFile(const char* name);

namespace detail {

/// Zeros in pages of their own. @throws std::bad_alloc
void* newPages(std::size_t bytes);
/// Gives them back to the system at once. `bytes` as asked for.
void freePages(void* pages, std::size_t bytes);

/// Asks for huge pages where memory has not been touched yet: first touch then costs a fifth. A hint.
void adviseHugePages(void* first, void* last);
/// Gives the whole pages in between back to the system; they read as 0 from then on.
void dropPages(void* first, void* last);
/// Gives back what the allocator keeps of memory that was freed.
void trimAllocator();

}  // namespace detail
}  // namespace nephele
