#pragma once

namespace maille {

/// Version of the library, "major.minor.patch".
const char* library_version();

/// Version of the file format this library writes. Before 1.0 it reads no other one, from then on every one
/// up to this.
inline constexpr unsigned format_major = 0;
inline constexpr unsigned format_minor = 2;

}  // namespace maille
