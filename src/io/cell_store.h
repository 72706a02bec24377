#pragma once

#include <maille/mesh.h>
#include <span>
#include <string>
#include <vector>
#include "io/cells.h"

namespace maille {

/// Cells that follow each other, to be made one block. `mixed` claims nothing about their types.
struct NamedRun {
  uint64_t cells = 0;
  CellType type = CellType::mixed;
  std::string name;
};

/// Cells of any types in the order of a file, before it is known which blocks they make. Takes no memory per
/// cell beyond its nodes and a byte for its type as long as all have the same number of nodes.
class CellStore {
 public:
  /// Append a cell's nodes, then call end_cell(): a cell has what was appended since the last call. Of a
  /// polyhedron append the corners of its faces, one face behind the other, and the number of each one's
  /// corners to `face_sizes`.
  std::vector<uint32_t> nodes;
  std::vector<uint32_t> face_sizes;

  void end_cell(CellType type) {
    types_.push_back(static_cast<uint8_t>(type));
    lengths_.add(nodes.size() - lengths_.total());
    faces_.add(face_sizes.size() - faces_.total());
  }
  /// `count` cells without faces whose nodes were appended, `length` each.
  void end_cells(uint64_t count, CellType type, uint64_t length) {
    types_.insert(types_.end(), count, static_cast<uint8_t>(type));
    lengths_.add_run(count, length);
    faces_.add_run(count, 0);
  }
  uint64_t count() const { return types_.size(); }
  CellType type(uint64_t cell) const { return static_cast<CellType>(types_[cell]); }
  uint64_t length(uint64_t cell) const { return lengths_.length(cell); }
  uint64_t bytes() const {
    return (nodes.size() + face_sizes.size()) * sizeof(uint32_t) + types_.size() + lengths_.bytes() +
           faces_.bytes();
  }

  /// All cells as one block: of their type when they have one, mixed otherwise. No block when there are no
  /// cells.
  std::vector<CellBlock> take();
  /// These blocks in this order; their cells must add up to count(). A block whose cells are not all of its
  /// type becomes mixed. Call it once: nodes may have been moved out of the store.
  std::vector<CellBlock> take(std::span<const NamedRun> shapes);
  /// Whether the blocks add up to count() and all cells of each have its type. For shapes that come from a
  /// file's own metadata, which anybody can have changed.
  bool fits(std::span<const NamedRun> shapes) const;

 private:
  bool is_uniform(uint64_t first, uint64_t count, CellType type) const;
  CellType common_type(uint64_t first, uint64_t count) const;
  CellBlock make_block(uint64_t first, const NamedRun& shape);

  std::vector<uint8_t> types_;
  Lengths lengths_, faces_;
};

/// Blocks for cells that come one by one with a name: those that follow each other with the same type and
/// name. Where the type changes often under one name there is one mixed block; where the name changes often,
/// one block without a name. So a file with a name or type that changes at each cell costs a bounded number
/// of blocks.
class BlockShapes {
 public:
  void add(uint64_t cells, CellType type, const std::string& name) {
    if (cells == 0 || too_many()) return;
    if (sections_.empty() || sections_.back().name != name) sections_.push_back({name, {}, 0});
    Section& section = sections_.back();
    section.cells += cells;
    if (!section.runs.empty() && section.runs.back().type == type) {
      section.runs.back().cells += cells;
    } else if (section.runs.size() <= most_runs) {
      section.runs.push_back({cells, type, name});
    }
  }
  bool too_many() const { return sections_.size() > most_sections; }
  std::vector<CellBlock> take(CellStore& cells) { return too_many() ? cells.take() : cells.take(runs()); }
  /// None where there are too many.
  std::vector<NamedRun> runs() const {
    std::vector<NamedRun> shapes;
    if (too_many()) return shapes;
    for (const Section& section : sections_) {
      if (section.runs.size() > most_runs) {
        shapes.push_back({section.cells, CellType::mixed, section.name});
      } else {
        shapes.insert(shapes.end(), section.runs.begin(), section.runs.end());
      }
    }
    return shapes;
  }

 private:
  // Both chosen, not swept (a21d6d6). More than 4096 sections would keep the names of more parts, but each
  // block costs the reader memory and every file its name. More than 16 runs under a name would save a mixed
  // block's types and offsets (nine bytes a cell in memory) where types change rarely.
  static constexpr size_t most_sections = 4096;
  static constexpr size_t most_runs = 16;
  struct Section {
    std::string name;
    std::vector<NamedRun> runs;
    uint64_t cells;
  };
  std::vector<Section> sections_;
};

}  // namespace maille
