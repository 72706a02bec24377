#pragma once

#include <maille/mesh.h>
#include <maille/stream.h>

#include <cstdint>
#include <vector>

#include "volume/pieces/piece_layout.h"

namespace maille {

// A volume in pieces as a cloud of points, for a first picture: each point stands for some thousand cells
// near each other. It is a part of the index, so whoever opens a file has it. docs/format.md, 16.14. The 56
// points of 206,208 tetrahedra without fields take 244 bytes of 399 kB.

/// Cells that a point stands for, in a mesh of so many. At least 4,096, where the cloud takes 0.1 % of the
/// file (tetrahedra at 16 bits a cell), and 8,192 points or so at most: with two fields these are 40 kB, so
/// that they come with the last 64 KiB of a file, which a distant reader fetches first.
uint64_t cells_of_coarse_point(uint64_t cells);

/// Adds the coarse points of a piece to its line of the index, which has the box and the ranges already: the
/// means of the corners of each group of cells, and of their values. Groups are those of group_cells(), so
/// neighbours come one after another. Labels, which have no mean, and arrays that have one range for all
/// components are left out.
void add_coarse_points(const Mesh& piece, uint64_t group, PieceRecord& record);

/// Whether numbers of coarse points are as many as they should be, for arrays on points and cells.
bool has_coarse_sizes(const PieceRecord& record, const std::vector<StreamArray>& arrays);

/// The coarse points of all pieces as vertices of floats. Arrays of points become those of points, arrays of
/// cells those of the vertices. Numbers are within a 250th of their range in the piece; NaN where no number
/// of a group was finite. The records have passed has_coarse_sizes().
Mesh coarse_mesh(const std::vector<PieceRecord>& records, const std::vector<StreamArray>& arrays);

}  // namespace maille
