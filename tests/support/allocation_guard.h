// Counts heap allocations of this executable, Eigen's (malloc) and operator new alike.
#pragma once

#include <cstddef>

namespace counterpoint::test {

/// False under AddressSanitizer, which owns malloc; the count then stands still.
bool counts_allocations();

/// Calls of malloc, calloc, realloc, aligned_alloc, posix_memalign since the program began.
std::size_t allocation_count();

}  // namespace counterpoint::test
