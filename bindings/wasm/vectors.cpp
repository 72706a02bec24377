// Members of vectors of plain numbers, compiled for speed: compiled for size they fill and copy byte by byte.
// The linker takes these, as the first that it sees.
#include <cstddef>
#include <cstdint>
#include <vector>

template class std::vector<std::byte>;
template class std::vector<uint8_t>;
template class std::vector<uint32_t>;
