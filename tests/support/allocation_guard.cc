#include "support/allocation_guard.h"

#include <atomic>
#include <cerrno>

namespace {
std::atomic<std::size_t> g_allocations{0};
}

#if defined(__SANITIZE_ADDRESS__)

namespace counterpoint::test {
bool counts_allocations() { return false; }
}  // namespace counterpoint::test

#else

// glibc lets a program replace malloc and friends; its own are then available under these names.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
  ++g_allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++g_allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* p, std::size_t size) {
  ++g_allocations;
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++g_allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  ++g_allocations;
  *out = __libc_memalign(alignment, size);
  return *out == nullptr ? ENOMEM : 0;
}
}

namespace counterpoint::test {
bool counts_allocations() { return true; }
}  // namespace counterpoint::test

#endif

namespace counterpoint::test {
std::size_t allocation_count() { return g_allocations; }
}  // namespace counterpoint::test
