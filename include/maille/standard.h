#pragma once

// Headers that use C++20 include this one first: clang stops after twenty errors, and a program for an older
// standard would be shown twenty of the library's own instead of the reason.
#if __cplusplus < 202002L
#error "maille needs C++20: compile with -std=c++20"
#endif
