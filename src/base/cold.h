#pragma once

// What counts on the web is also the size of code.
#ifdef __EMSCRIPTEN__
/// A function that runs once a file or patch, in a file that is compiled for speed.
#define MAILLE_COLD __attribute__((minsize, noinline))
/// A table that is made when the program starts, by a function that begins with MAILLE_LATER.
#define MAILLE_TABLE const auto
#define MAILLE_LATER asm volatile("")
#else
#define MAILLE_COLD
#define MAILLE_TABLE constexpr auto
#define MAILLE_LATER static_cast<void>(0)
#endif
