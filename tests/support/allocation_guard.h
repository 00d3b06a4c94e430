// Counts heap allocations of this executable, Eigen's (malloc) and operator new alike.
#pragma once

#include <cstddef>

namespace counterpoint::test {

/// False under AddressSanitizer, which replaces malloc; the count then stays constant.
bool counts_allocations();

/// Number of calls of malloc, calloc, realloc, aligned_alloc and posix_memalign since program
/// start.
std::size_t allocation_count();

}  // namespace counterpoint::test
