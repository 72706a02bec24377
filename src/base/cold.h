#pragma once

// What runs once a file or patch, in files that are compiled for speed: on the web its size counts.
#ifdef __EMSCRIPTEN__
#define MAILLE_COLD __attribute__((minsize, noinline))
#else
#define MAILLE_COLD
#endif
