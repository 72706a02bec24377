#pragma once

#include <maille/io.h>

// What reader and writer of OFF share. The header's keyword is [ST][C][N][4]OFF: vertices have, in this
// order, a position, a fourth number "weight" (4), "normal" (N), "colour" (C), "texcoord" (ST). Faces may
// have a colour of 1 (number in a colour map), 3 or 4 numbers behind their vertices: "colour_index" or
// "colour" on cells, and "colour.count" where not all faces have the same number of them. Colours written as
// whole numbers up to 255 are u8. Other numbers are f32 unless the text of one says more, see numbers.h, or a
// comment "# maille f64 NAME..." says so. A "#" ends whatever it stands behind: "0#red" is the number 0.

namespace maille {

enum class OffArray : uint8_t { position, weight, normal, colour, texcoord, face_colour };
inline constexpr size_t off_array_count = 6;
inline constexpr const char* off_array_names[off_array_count] = {"position", "weight",   "normal",
                                                                 "colour",   "texcoord", "face_colour"};

/// Format::read and Format::write of OFF.
Result<ReadResult> read_off(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_off(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
