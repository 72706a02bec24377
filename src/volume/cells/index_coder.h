#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "entropy/mixing.h"
#include "volume/cells/cell_shape.h"
#include "volume/cells/decisions.h"

namespace maille {

/// Numbers of points of a cell predicted from those of the cells before, after HexZip (Lindstrom and
/// Isenburg, "Lossless Compression of Hexahedral Meshes", 2008) as its paper describes it: for each node a
/// table of what the last two steps there, and the step just made at the node before, led to last time. It
/// knows nothing of the mesh, so it is small where numbers follow a rule, whatever the cells do.
///
/// What is added: *steps*, the differences between the numbers of two cells that follow each other, are kept,
/// and a cell may take the same step as the one before, or the one a row or a layer back, by one decision;
/// one decision also for a cell all of whose numbers are as the tables have them; other guesses where a table
/// is wrong; models for hits and misses.
template <class Coder>
class IndexCoder {
 public:
  explicit IndexCoder(Mixing mixing) : decisions_(mixing) {}

  static constexpr uint32_t no_step = 0xffffffff;

  /// The nodes of a cell of known shape, and a bit for each that ends, if the cell takes one of the steps of
  /// these cells (or no_step), the most likely first. False: nothing is coded but that it does not.
  bool code_step(Coder& coder, unsigned kind, const std::array<uint32_t, 3>& steps,
                 std::span<uint64_t> numbers, uint32_t& ends) {
    const Rows& rows = rows_for(kind, numbers.size());
    likely_ = steps;
    const unsigned agreement = (steps[0] == steps[1] ? 1u : 0u) + (steps[0] == steps[2] ? 2u : 0u);
    for (unsigned k = 0; k < steps.size(); ++k) {
      if (steps[k] == no_step || (k > 0 && steps[k] == steps[0]) || (k > 1 && steps[k] == steps[1])) continue;
      const uint64_t* const step = rows.steps.data() + steps[k] * numbers.size();
      bool hit = Coder::encoding && ends == rows.ends[steps[k]];
      for (size_t i = 0; i < numbers.size() && hit; ++i) hit = numbers[i] == rows.before[i] + step[i];
      hit = step_flags_[(k * 4 + agreement) * 64 + outcomes_].code(coder, hit);
      outcomes_ = (outcomes_ * 2 + hit) & 63;
      if (!hit) continue;
      for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = rows.before[i] + step[i];
      ends = rows.ends[steps[k]];
      return true;
    }
    return false;
  }

  /// The cell as it was coded is now the last one. Returns its step.
  uint32_t finish_cell(unsigned kind, std::span<const uint64_t> numbers, uint32_t ends) {
    Rows& rows = *rows_[kind];
    uint32_t id = ends;
    for (size_t i = 0; i < numbers.size(); ++i)
      id = hashed(id, static_cast<uint32_t>(numbers[i] - rows.before[i]));
    id >>= 32 - table_bits;
    rows.ends[id] = ends;
    for (size_t i = 0; i < numbers.size(); ++i) {
      rows.steps[id * numbers.size() + i] = numbers[i] - rows.before[i];
      next_ = std::max(next_, numbers[i] + 1);
    }
    rows.earlier = rows.before;
    std::copy(numbers.begin(), numbers.end(), rows.before.begin());
    return id;
  }

  /// The nodes of a cell that takes no such step.
  void code(Coder& coder, unsigned kind, std::span<uint64_t> numbers) {
    Rows& rows = rows_for(kind, numbers.size());
    std::array<uint64_t, most_nodes> guess{};
    uint64_t step = rows.last_step;
    bool sure = true;
    for (size_t i = 0; i < numbers.size(); ++i) {
      const Entry& entry = rows.entry(i, step);
      guess[i] = rows.before[i] + rows.along(i) + entry.correction;
      step = guess[i] - rows.before[i];
      sure = sure && entry.sure;
    }
    bool all = Coder::encoding && std::equal(numbers.begin(), numbers.end(), guess.begin());
    RunModel& flag = all_[(misses_ & 63) * 256 + rows.outcomes * 2 + sure];
    all = flag.code(coder, all);
    rows.outcomes = (rows.outcomes * 2 + all) & 127;
    step = rows.last_step;
    uint32_t missed = 0;
    for (size_t i = 0; i < numbers.size(); ++i) {
      Entry& entry = rows.entry(i, step);
      const uint64_t along = rows.along(i);
      const uint64_t expected = rows.before[i] + along + entry.correction;
      bool hit = all;
      if (all) {
        numbers[i] = expected;
      } else {
        const uint32_t place = rows.place(i, step);
        hit = code_node(coder, rows, kind, numbers, i, expected, entry.sure, place, missed);
      }
      if (!hit && !entry.sure) entry.correction = numbers[i] - rows.before[i] - along;
      entry.sure = hit;
      missed = missed * 2 + !hit;
      step = numbers[i] - rows.before[i];
    }
    rows.last_step = step;
    misses_ = missed == 0 ? 0 : hashed(missed, 1) >> 26 | 1;
    last_missed_ = missed;
  }

 private:
  static constexpr unsigned table_bits = 12;
  static constexpr uint32_t table_size = 1u << table_bits;
  static constexpr size_t most_references = 5;
  static constexpr unsigned most_guesses = 8;  // two steps, three parallelograms, three others
  struct Entry {
    uint64_t correction = 0;
    bool sure = false;
  };
  /// What the cells of one kind were.
  struct Rows {
    explicit Rows(size_t nodes)
        : tables(nodes * table_size),
          before(nodes),
          earlier(nodes),
          steps(nodes * table_size),
          ends(table_size) {}
    uint64_t along(size_t i) const { return before[i] - earlier[i]; }
    uint32_t place(size_t i, uint64_t step) const {
      return static_cast<uint32_t>((step << table_bits / 2) + along(i)) % table_size;
    }
    Entry& entry(size_t i, uint64_t step) { return tables[i * table_size + place(i, step)]; }

    std::vector<Entry> tables;
    std::vector<uint64_t> before, earlier;
    std::vector<uint64_t> steps;  ///< node by node, at a place that is their hash: later ones replace others
    std::vector<uint32_t> ends;   ///< of the last cell that took the step
    uint64_t last_step = 0;
    uint32_t outcomes = 0;
  };
  Rows& rows_for(unsigned kind, size_t nodes) {
    if (!rows_[kind]) rows_[kind] = std::make_unique<Rows>(nodes);
    return *rows_[kind];
  }
  enum Question : unsigned { as_table, as_guess, question_count };

  /// One node of a cell that is not as predicted. Returns whether the table was right.
  bool code_node(Coder& coder, const Rows& rows, unsigned kind, std::span<uint64_t> numbers, size_t i,
                 uint64_t expected, bool sure, uint32_t place, uint32_t missed) {
    const uint32_t node = static_cast<uint32_t>(i) | kind << 5;
    const Evidence how{node | (sure ? 1024u : 0),  missed,  place, last_missed_,
                       last_missed_ ^ missed << 8, history_};
    if (decisions_.code(coder, numbers[i] == expected, as_table, how)) {
      numbers[i] = expected;
      return true;
    }
    std::array<uint64_t, most_guesses> guess{};
    const unsigned guesses = other_guesses(rows, kind, numbers, i, expected, guess);
    for (unsigned k = 0; k < guesses; ++k) {
      const Evidence which{node << 4 | k, missed, guess[k] == next_ ? 1u : 0u, last_missed_, place, history_};
      if (!decisions_.code(coder, numbers[i] == guess[k], as_guess, which)) continue;
      numbers[i] = guess[k];
      history_ = (history_ * 16 + k) & 4095;
      return false;
    }
    history_ = (history_ * 16 + 15) & 4095;
    code_difference(coder, rows, numbers, i);
    return false;
  }

  /// By the steps a row and a layer back, the parallelograms, the largest number so far plus one, and as far
  /// from the node before as last time, or next to it. How many.
  unsigned other_guesses(const Rows& rows, unsigned kind, std::span<const uint64_t> numbers, size_t i,
                         uint64_t refused, std::array<uint64_t, most_guesses>& guess) const {
    unsigned guesses = 0;
    const auto add = [&](uint64_t value) {
      const auto end = guess.begin() + guesses;
      if (value != refused && std::find(guess.begin(), end, value) == end) guess[guesses++] = value;
    };
    for (unsigned k = 0; k < 2; ++k) {
      if (likely_[k] != no_step) add(rows.before[i] + rows.steps[likely_[k] * numbers.size() + i]);
    }
    const CellShape& shape = cell_shapes[kind];
    for (unsigned k = 0; i < shape.corners && k < shape.parallelograms[i]; ++k) {
      const auto& p = shape.parallelogram[i][k];
      if (p.a < i && p.b < i && p.opposite < i) add(numbers[p.a] + numbers[p.b] - numbers[p.opposite]);
    }
    add(next_);
    if (i > 0) add(numbers[i - 1] + rows.before[i] - rows.before[i - 1]);
    if (i > 0) add(numbers[i - 1] + 1);
    return guesses;
  }

  /// The difference to what came closest of late: the same node of the cell before, or the one, two, ...
  /// nodes before.
  void code_difference(Coder& coder, const Rows& rows, std::span<uint64_t> numbers, size_t i) {
    const size_t references = 1 + std::min<size_t>(i, most_references - 1);
    const auto reference = [&](size_t k) { return k == 0 ? rows.before[i] : numbers[i - k]; };
    const auto best =
        static_cast<size_t>(std::min_element(cost_.begin(), cost_.begin() + references) - cost_.begin());
    const auto difference = static_cast<int64_t>(numbers[i] - reference(best));
    numbers[i] = reference(best) + static_cast<uint64_t>(differences_[best].code(coder, difference));
    for (size_t k = 0; k < references; ++k) {
      const auto apart = static_cast<int64_t>(numbers[i] - reference(k));
      const uint64_t size = apart < 0 ? ~static_cast<uint64_t>(apart) : static_cast<uint64_t>(apart);
      cost_[k] = (cost_[k] * 7 + std::min<uint64_t>(size, uint64_t{1} << 48) * 16) / 8;
    }
  }

  std::array<std::unique_ptr<Rows>, shape_count> rows_;
  std::vector<RunModel> all_ = std::vector<RunModel>(64 * 256);
  Decisions<question_count> decisions_;
  std::array<DifferenceModel, most_references> differences_;
  std::array<uint64_t, most_references> cost_{};
  std::array<RunModel, 3 * 4 * 64> step_flags_;
  uint32_t outcomes_ = 0;  ///< of the last flags of steps
  std::array<uint32_t, 3> likely_{no_step, no_step, no_step};
  uint64_t next_ = 0;  ///< the largest number so far, plus one
  uint32_t misses_ = 0, last_missed_ = 0, history_ = 0;
};

}  // namespace maille
