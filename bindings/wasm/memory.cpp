// memcpy() and its like with the instructions that WebAssembly has for them (every browser with SIMD has
// these, too): emscripten 3.1.6 comes with loops over words. A call for a few bytes costs less as a loop.
#include <cstddef>

extern "C" {

constexpr size_t few = 32;

void* memcpy(void* __restrict to, const void* __restrict from, size_t size) {
  if (size >= few) {
    asm volatile("local.get %0\n local.get %1\n local.get %2\n memory.copy 0, 0"
                 :
                 : "r"(to), "r"(from), "r"(size)
                 : "memory");
    return to;
  }
  auto* out = static_cast<unsigned char*>(to);
  const auto* in = static_cast<const unsigned char*>(from);
  for (; size >= 8; size -= 8, out += 8, in += 8) {
    unsigned long long word;
    __builtin_memcpy(&word, in, 8);
    __builtin_memcpy(out, &word, 8);
  }
  for (; size > 0; --size) *out++ = *in++;
  return to;
}

void* memmove(void* to, const void* from, size_t size) {
  asm volatile("local.get %0\n local.get %1\n local.get %2\n memory.copy 0, 0"
               :
               : "r"(to), "r"(from), "r"(size)
               : "memory");
  return to;
}

void* memset(void* to, int value, size_t size) {
  asm volatile("local.get %0\n local.get %1\n local.get %2\n memory.fill 0"
               :
               : "r"(to), "r"(value), "r"(size)
               : "memory");
  return to;
}

}  // extern "C"
