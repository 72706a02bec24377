#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace maille {

/// What each effort switches on. Only encoders ask: a file says how it is coded, whatever the effort was.
struct Effort {
  int first, last;  ///< efforts of one row write the same streams

  // Descriptions.

  /// Short descriptions are written as they are: decoding one takes as long as hundreds of triangles.
  bool plain_description;

  // Surfaces.

  /// Connectivity by the polygon front, and positions, by mixing many models for each bit (docs/format.md,
  /// 10.5 and 14) instead of static tables over fans: files are a sixth smaller (median of build/data/tri and
  /// poly, 14 bits), and are decoded at a thirtieth of the speed.
  bool mixed_surface;
  /// A mesh of more cells is cut into parts, so that threads have work. Each new start of mixed models costs
  /// 3 to 4 % of the file (measured on meshes above 400,000 cells), so these get what fits one patch in
  /// triangles or quads: 2^27 quads have 2^29 corners. With static tables parts cost little: dragon is 0.5 to
  /// 0.8 % smaller in two parts than in one, and iso_mri 0.8 to 1.9 % larger (docs/history.md, 3b04fcd).
  uint64_t cells_per_part;
  /// Weights of positions follow the valences around a vertex, and values may come again; all connectivity
  /// must then be decoded before the positions: 3.5 % smaller in the median, 8.5 % in the mean (the same
  /// meshes), decoded at two thirds of the speed.
  bool valence_rows;
  /// What rows by valences must save of the lengths of residuals, and repeats of the bytes, to be used. With
  /// a tenth for repeats, -3 decodes 1.15 times as fast for 1.4 % more bytes (9d88ba9); with 15 %, cycloidal
  /// is a fifth larger.
  double least_gain_of_valences, least_gain_of_repeats;
  /// Tables of positions depend on how far predictions lie apart: 0.2 % smaller in the median, 0.5 % in the
  /// mean (the same meshes), for a tenth of the encoder's time.
  bool spread;

  // Volumes.

  /// An order that is kept is written as plain differences, and not compared with that of the front: twice as
  /// fast both ways, the order 5 to 30 % larger (docs/streaming.md).
  bool plain_order;
  /// Cells in no good order come at gates without a trial of the order of the front, which takes as long as
  /// coding them.
  bool gates_untried;
  /// Decisions about cells like none before are mixed: a third to more than a half smaller where cells come
  /// in a good order, a tenth to a fifth elsewhere, at 0.7 of the speed (docs/streaming.md).
  bool mixed_cells;
  /// Mixing makes values 2 to 8 % smaller, and their coding ten times slower, 1 us a number: `where_fast` it
  /// takes no long time (mixing_is_fast()).
  enum class Mixed : uint8_t { never, where_fast, always } mixed_values;
};

inline constexpr std::array<Effort, 4> efforts = {{
    {.first = 1,
     .last = 1,
     .plain_description = true,
     .mixed_surface = false,
     .cells_per_part = 400'000,
     .valence_rows = false,
     .least_gain_of_valences = 0,
     .least_gain_of_repeats = 0,
     .spread = false,
     .plain_order = true,
     .gates_untried = true,
     .mixed_cells = false,
     .mixed_values = Effort::Mixed::never},
    {.first = 2,
     .last = 3,
     .plain_description = true,
     .mixed_surface = false,
     .cells_per_part = 400'000,
     .valence_rows = true,
     .least_gain_of_valences = 0.05,
     .least_gain_of_repeats = 0.1,
     .spread = false,
     .plain_order = false,
     .gates_untried = true,
     .mixed_cells = false,
     .mixed_values = Effort::Mixed::never},
    {.first = 4,
     .last = 6,
     .plain_description = false,
     .mixed_surface = false,
     .cells_per_part = 400'000,
     .valence_rows = true,
     .least_gain_of_valences = 0.01,
     .least_gain_of_repeats = 0.02,
     .spread = true,
     .plain_order = false,
     .gates_untried = false,
     .mixed_cells = true,
     .mixed_values = Effort::Mixed::where_fast},
    {.first = 7,
     .last = 9,
     .plain_description = false,
     .mixed_surface = true,
     .cells_per_part = uint64_t{1} << 27,
     .valence_rows = true,
     .least_gain_of_valences = 0.01,
     .least_gain_of_repeats = 0.02,
     .spread = true,
     .plain_order = false,
     .gates_untried = false,
     .mixed_cells = true,
     .mixed_values = Effort::Mixed::always},
}};

/// The row of an effort; of the nearest one where it is not from 1 to 9. Rows are in the order of efforts and
/// leave none out.
constexpr const Effort& effort_of(int effort) {
  size_t row = 0;
  while (row + 1 < efforts.size() && efforts[row].last < effort) ++row;
  return efforts[row];
}

}  // namespace maille
