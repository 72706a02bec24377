// The header as C++, twice.
#include <maille.h>

int32_t use_of_the_header_in_cpp();
int32_t use_of_the_header_in_cpp() {
  return MAILLE_OK + static_cast<int32_t>(maille_abi_version());
}
