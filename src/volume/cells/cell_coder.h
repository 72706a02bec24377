#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/unfilled.h"
#include "volume/cells/assembly.h"
#include "volume/cells/decisions.h"
#include "volume/cells/face_coder.h"
#include "volume/cells/gates.h"
#include "volume/cells/numbering.h"
#include "volume/cells/patterns.h"
#include "volume/cells/swept_pattern.h"

namespace maille {

/// A cell on its way in or out, its nodes as cell_shapes numbers them. An encoder fills all of it; a decoder
/// fills what it decoded, which the caller reads before the next cell overwrites it. One object is used for
/// all cells, so that its vectors keep their room.
/// Kinds below shape_count have `number` and `final`; a point without cells, and the end of a point, have
/// `number[0]` only.
struct StreamedCell {
  unsigned kind = 0;
  std::array<uint64_t, most_nodes> number{};  ///< of its points
  uint32_t final = 0;                         ///< a bit for each node that is not used again
  /// Loose cells, and those given by faces, have these instead.
  CellType type = CellType::vertex;
  std::vector<uint64_t> numbers;
  std::vector<uint8_t> finals;
  std::vector<uint32_t> sizes;  ///< corners of each face of a polyhedron
};

/// A point that came up with a cell. The list of these in CodedCells is the order of points in the file: the
/// tuples of all arrays on points follow it.
struct NewPoint {
  uint32_t slot = 0;
  uint32_t cell = no_slot;  ///< within the block; no_slot: isolated
  uint64_t number = 0;
  uint8_t node = 0;
  uint8_t fresh = 0;  ///< a bit for each corner of the cell that is new, or repeats a new one
  /// Where the cell does not have all but this corner: by axis neighbour (in the order of corners), the point
  /// behind it.
  std::array<uint32_t, 3> behind{no_slot, no_slot, no_slot};
};

/// Some thousand cells as slots: what the other stages of coder and reader work on. Encoder and decoder fill
/// it alike, which is what lets one predictor of values serve both. Until the block ends a slot names one
/// point, because slots of removed points are free only after end_block().
/// `kinds`, `begin`, `cell_slots` and `across` have one entry for each cell; `kinds` has none for points
/// without cells and for ends of points, which are records but no cells.
struct CodedCells {
  Unfilled<uint8_t> kinds;
  std::vector<CellType> loose_types;                  ///< one for each loose cell
  Unfilled<uint32_t> begin;                           ///< by cell: first of its nodes in `nodes`
  Unfilled<uint32_t> nodes;                           ///< slots, by cell
  Unfilled<uint32_t> cell_slots;                      ///< by cell; no_slot for loose ones
  Unfilled<std::array<uint32_t, most_faces>> across;  ///< by cell: slots of its neighbours
  std::vector<NewPoint> points;
  std::vector<uint32_t> removed;  ///< points used for the last time

  size_t size() const { return kinds.size(); }
  void clear();
};

/// Connectivity: each cell as it joins those in memory, then the numbers of its new points. One routine
/// serves both directions, so that they cannot drift: what a decoder reads, an encoder writes in the same
/// place, and both then do the same to the hull. Only `wanted_`, `target_`, `partners_` and the tables of
/// input numbers exist for the encoder alone; nothing that both sides rely on may be derived from them.
/// docs/format.md, 16.3 to 16.6.
///
/// The fast path: the cell is the pattern of the cell one row, or one layer, back, one step on: one decision,
/// nearly free in a sweep. The slow path: an anchor cell, its face, how the cell is turned on it, glued or
/// not at each edge of that face, the remaining corners new or old; what the slow path finds becomes a
/// pattern.
/// Memory is that of the hull and of the tables by slot: it follows the largest front, not the length of the
/// stream. Work for one cell is bounded whatever the input: every search looks at a fixed number of
/// candidates.
template <class Coder>
class CellCoder {
 public:
  static constexpr bool encoding = Coder::encoding;

  /// `mixing`: of slow decisions. `numbered`: numbers of points are kept.
  CellCoder(Mixing mixing, bool numbered) : numbered_(numbered), decisions_(mixing), mixing_(mixing) {}
  /// From the first cell on solids and polygons come at gates; only if points are numbered anew. `borders`:
  /// for an encoder, by cell a bit for each face that no later one meets.
  void use_gates(const std::vector<uint8_t>* borders) {
    gates_ = std::make_unique<Gates>();
    gate_models_ = std::make_unique<GateModels>();
    borders_ = borders;
  }

  /// Codes one cell and adds it to `out`, which may already hold cells of the block. False: the stream is
  /// damaged (decoder only), and all further calls return false, too.
  bool code(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out);
  /// Codes hexahedra by the first of the patterns that they may have, `most` of them at most: the same bytes
  /// and the same state as code() for each, at a third of the time. Returns how many it did, which may be 0;
  /// the caller goes on with code() for the next one. `points`, `last_use`: eight for each cell, in the order
  /// of the corners (encoder only). A damaged stream is reported by the next code().
  size_t sweep(Coder& topology, Coder& numbers, const uint64_t* points, const uint8_t* last_use, size_t most,
               CodedCells& out);
  /// Slots of points that left memory are free again: between blocks.
  void end_block() { hull_.free_points(); }
  const Hull& hull() const { return hull_; }
  /// Decoder: what the points and cells in memory take, while so many cells of corners all new come in.
  uint64_t bytes(uint64_t cells) const {
    const uint64_t faces = faces_ ? faces_->bytes() : 0, gates = gates_ ? gates_->bytes() : 0;
    const uint64_t nodes = extra_.empty() ? 0 : bytes_to_hold(extra_, hull_.cell_capacity() + cells);
    return hull_.bytes(cells * most_corners, cells) + table_.bytes() + bytes_held(dense_) +
           bytes_held(joined_places_) + nodes + faces + gates;
  }
  /// Decoder: a cell of more corners than allowed ends decoding, as one would of a damaged stream, and then
  /// is_beyond(). Cells of faces may have millions of corners, and may come from few bytes. So does the first
  /// cell with nodes behind its corners, if their table would take more than `bytes`: it has rows for all
  /// cells in memory.
  void allow(uint64_t corners, uint64_t bytes) {
    allowed_corners_ = corners;
    allowed_bytes_ = bytes;
  }
  bool is_beyond() const { return beyond_; }
  /// Encoder: is the point with the caller's number in memory?
  bool is_alive(uint64_t number) { return slot_of_input(number, 0) != no_slot; }

 private:
  friend class FaceCoder<Coder>;
  // Numbered as docs/format.md, 16.6, has them (Q). The number is hashed into every context and chooses the
  // row of the mixer, so that a question may be added at the end, but none may move without a change of the
  // format.
  enum Question : unsigned {
    same_kind,
    kind_bit,
    anchor_listed,
    anchor_here,
    any_anchor,
    which_cell,
    face_here,
    same_turn,
    turn_bit,
    glued_here,
    is_new,
    repeats,
    joined_here,
    over_face,
    is_final,
    node_known,
    border_here,
    question_count
  };
  /// A cell that may be the anchor. There are 48 at most, so that the rank among those of one origin fits a
  /// byte.
  struct Candidate {
    uint32_t cell;
    uint8_t origin;
    uint8_t rank;
  };
  /// A face that could lie on own face `own` at an edge: `slot` has what its corners would be, in the cycle
  /// of the own face.
  struct EdgeFace {
    FaceRef face;
    std::array<uint32_t, 4> slot;  ///< by corner of the own face
  };
  /// An open face beyond an edge, and the points in it that come next to the ends of the edge.
  struct Opposite {
    FaceRef face;
    unsigned size = 0, around = 0;  ///< corners; cells on the way
    uint32_t next_to_a = no_slot, next_to_b = no_slot;
  };
  using Turn = unsigned;  ///< own face * 8 + mirrored * 4 + rotation
  // Turns are below 8 * most_faces = 48: this is none of them, and six bits tell one.
  static constexpr Turn no_turn = 255;

  // The fast path (cell_coder.cpp), with sweep()'s own versions of its steps (cell_coder_sweep.cpp).
  void find_sources();
  bool code_by_pattern(Coder& coder, const StreamedCell& cell);
  bool fits(const PatternPlan& pattern, const Assembly& guess, const StreamedCell& cell);
  /// Sources as sweep() uses them. Entries of absent sources keep what they had for an earlier cell, as
  /// clearing seven pointers for each cell would cost time; `there` has a bit for each that counts.
  struct SweptSources {
    std::array<const Hull::Cell*, source_count> cell{};
    std::array<uint32_t, source_count> slot{};
    unsigned there = 0;
  };
  uint32_t find_swept_sources(SweptSources& sources);
  bool put_together(const SweptPattern& plan, const SweptSources& sources, HexahedronSlots& corners);
  bool has_corners(const SweptPattern& plan, const HexahedronSlots& corners, const uint64_t* points);
  void create_swept_corners(const SweptPattern& plan, const SweptSources& sources, HexahedronSlots& corners,
                            Coder& numbers, const uint64_t* points, uint32_t cell, CodedCells& out);
  void enter_swept(const SweptPattern& plan, const SweptSources& sources, const HexahedronSlots& corners,
                   size_t at, size_t first_node, CodedCells& out);

  // Cells at gates (cell_coder_gates.cpp).
  bool code_by_gates(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out);
  bool code_gate(Coder& coder, const StreamedCell& cell, bool& at_gate);
  void join_gate(Coder& coder, FaceRef gate, unsigned turn);
  unsigned turn_at(FaceRef gate) const;
  Opposite open_face_around(FaceRef from, uint32_t a, uint32_t b) const;
  void set_opposite(FaceRef face, unsigned edge, uint32_t a, Opposite& found) const;
  void join_beside(Coder& coder, FaceRef gate, unsigned own_face);
  void glue_beside();
  unsigned corners_on_border() const;
  unsigned code_borders(Coder& coder);
  void code_ends_at_gates(Coder& coder, StreamedCell& cell);
  /// A decision at a gate: with the model alone, or mixed where slow decisions are.
  bool decide_by(BitModel& model, Coder& coder, bool bit, Question question, uint32_t local, uint32_t nearby,
                 uint32_t valence) {
    if (mixing_ == Mixing::none) return model.code(coder, bit);
    return decide(coder, bit, question, local, nearby, valence);
  }

  // The slow path: where a cell lies (cell_coder_slow.cpp), then the points that this leaves open
  // (cell_coder_corners.cpp).
  void code_slowly(Coder& coder, StreamedCell& cell);
  void join_slowly(Coder& coder, const StreamedCell& cell);
  unsigned code_kind(Coder& coder, unsigned kind);
  void find_targets(const StreamedCell& cell);
  void find_partners();
  void add_partner(uint32_t cell, unsigned faces);
  bool is_partner(uint32_t cell) const;
  bool collect_anchors(unsigned round);
  void add_anchors_ahead();
  void add_anchors_after();
  void add_anchors_beside();
  uint64_t age_and_slot(uint32_t cell) const {
    return uint64_t{ordinal_ - hull_.cell(cell).ordinal} << 32 | cell;
  }
  void add_anchor(uint32_t cell, unsigned origin);
  void add_anchors_around(uint64_t number, unsigned origin);
  FaceRef code_anchor(Coder& coder);
  FaceRef code_distant_anchor(Coder& coder);
  FaceRef code_face_of(Coder& coder, uint32_t anchor);
  uint32_t code_face(Coder& coder, uint32_t anchor);
  void code_turn(Coder& coder, FaceRef anchor);
  Turn match(const Hull::Cell& other, unsigned face, Turn preferred) const;
  bool matches_turn(const Hull::Cell& other, unsigned face, Turn turn) const;
  void place(FaceRef anchor, Turn turn);
  void code_edges(Coder& coder, FaceRef anchor, unsigned own_face);
  unsigned faces_at_edge(uint32_t anchor, unsigned own, unsigned a, unsigned b);
  bool lay_over(const Hull::Cell& other, unsigned face, unsigned own, unsigned a, unsigned b,
                EdgeFace& found) const;
  void code_faces_below(Coder& coder, FaceRef anchor);
  void code_corners(Coder& coder);
  bool code_repeat(Coder& coder, unsigned corner);
  bool code_joined(Coder& coder, unsigned corner);
  unsigned joined_points(unsigned corner);
  uint32_t code_old_point(Coder& coder, uint32_t slot, uint64_t base);
  void glue_the_rest();

  // New points, entering memory, and leaving it: common to all paths.
  void create_corners(Coder& numbers, StreamedCell& cell, CodedCells& out);
  /// `corner`: of the cell being coded; most_corners for other nodes.
  uint32_t create_point(Coder& numbers, uint64_t number, bool has_expected, uint64_t expected,
                        unsigned context, unsigned corner = most_corners);
  /// A point into memory; `input`: the caller's number (encoder).
  [[gnu::always_inline]] uint32_t enter_point(uint64_t number, uint64_t input) {
    ++counted_;
    const uint32_t slot = hull_.add_point(number);
    // No point is there twice; an encoder looked before.
    if (in_table_ && !table_.insert(number, slot, 8)) [[unlikely]] {
      damaged_ = true;
      return 0;
    }
    if (encoding && !numbered_) {
      if (!gates_) inputs_.insert(input, slot, 8);
      if (slot >= input_numbers_.size()) [[unlikely]]
        input_numbers_.resize(hull_.point_capacity());
      input_numbers_[slot] = input;
    }
    return slot;
  }
  /// And out of it.
  [[gnu::always_inline]] void leave_point(uint32_t slot, CodedCells& out) {
    out.removed.push_back(slot);
    if (in_table_) table_.erase(number_of(slot), 9);
    if (encoding && !numbered_ && !gates_) inputs_.erase(input_numbers_[slot], 9);
    hull_.remove_point(slot);
  }
  bool expected_number(unsigned corner, uint64_t& number) const;
  template <class Suggest>
  void suggest_as_last(unsigned corner, Suggest suggest) const;
  void points_behind(NewPoint& point, unsigned corner) const;
  void code_extra_nodes(Coder& coder, Coder& numbers, StreamedCell& cell, CodedCells& out);
  uint32_t extra_node_on(unsigned node) const;
  void enter(CodedCells& out);
  void code_finals(Coder& coder, StreamedCell& cell, bool corners_too);
  void remove_final(const StreamedCell& cell, CodedCells& out);
  void follow_group();
  bool code_without_shape(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out);
  bool code_end(Coder& coder, StreamedCell& cell, CodedCells& out);
  bool code_isolated(Coder& numbers, StreamedCell& cell, CodedCells& out);
  void prefer_faces(StreamedCell& cell);
  bool code_by_faces(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out);
  bool code_loose(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out);

  /// One decision of the slow path. The signature is a hash of all answers that this cell has got so far: it
  /// is evidence for the cell's own later decisions, and, kept with the cell in the hull, for those of its
  /// neighbours. It wraps modulo 2^32 on both sides alike.
  bool decide(Coder& coder, bool bit, Question question, uint32_t local, uint32_t nearby, uint32_t valence) {
    bit = decisions_.code(coder, bit, question, {local, nearby, valence, signature_});
    signature_ = hashed(signature_, static_cast<uint32_t>(bit));
    return bit;
  }
  uint64_t number_of(uint32_t slot) const { return hull_.point(slot).number; }
  /// Encoder: the slot of a point by the caller's number; that number, if points are numbered anew.
  uint32_t slot_of_input(uint64_t number, unsigned corner) {
    if (gates_) return number < dense_.size() ? dense_[number] : no_slot;
    return numbered_ ? table_.find(number, corner) : inputs_.find(number, corner);
  }
  uint64_t input_number(uint32_t slot) const { return numbered_ ? number_of(slot) : input_numbers_[slot]; }
  void end_point(uint32_t slot, CodedCells& out);
  /// The slot of a point by its number.
  uint32_t slot_of(uint64_t number, unsigned corner) {
    if (!in_table_) [[unlikely]]
      fill_table();
    return table_.find(number, corner);
  }
  void fill_table();

  // Fixed for the whole stream (any_order of the header): it decides which of the tables below exist.
  bool numbered_;
  bool exceeds(uint64_t corners) {
    beyond_ = beyond_ || corners > allowed_corners_;
    return beyond_;
  }
  /// Decoder: is there no memory for the table of nodes, which may grow once more before bytes() is asked?
  bool has_no_room_for_nodes() {
    constexpr uint64_t grown = 3;  // the old room, and twice as much
    const uint64_t rows = extra_.empty() ? uint64_t{hull_.cell_capacity()} : 0;
    beyond_ = beyond_ || grown * rows * sizeof extra_[0] > allowed_bytes_;
    return beyond_;
  }

  bool damaged_ = false;
  bool beyond_ = false;
  uint64_t allowed_corners_ = ~uint64_t{0}, allowed_bytes_ = ~uint64_t{0};
  /// Points that are numbered as they come up can only be there once, and at gates mostly nobody asks for a
  /// number: then the table waits until someone does.
  bool in_table_ = numbered_;
  Hull hull_;
  PointTable table_;                     ///< by number, if `in_table_`
  PointTable inputs_;                    ///< encoder that numbers anew: by the caller's number
  std::vector<uint64_t> input_numbers_;  ///< encoder that numbers anew: by slot, the caller's number
  // Encoder with gates, instead of `inputs_`: slots by the caller's number, which there is a mesh's own. It
  // has as many entries as the mesh has points. Gates are used only by encoders that hold the whole mesh
  // anyway, and a hashed table would cost more for each of eight corners.
  std::vector<uint32_t> dense_;
  Patterns patterns_;
  // By id modulo 32: two patterns that share an entry only cost making the entry again. A structured mesh
  // alternates between few patterns (inner cells, ends of rows, ends of layers).
  std::vector<SweptPattern> swept_ = std::vector<SweptPattern>(32);  ///< by id: those met last
  Decisions<question_count> decisions_;
  Numbering numbering_;
  DifferenceModel old_point_, loose_count_;
  // By pattern (modulo 512), its place among the three candidates, which of the candidates agree, and the
  // last two outcomes. Patterns that share a row also share its statistics, which costs bits but never
  // correctness.
  std::vector<RunModel> pattern_flags_ = std::vector<RunModel>(512 * 3 * 4 * 4);
  Mixing mixing_;
  std::unique_ptr<FaceCoder<Coder>> faces_;  ///< from the first cell on that is given by faces
  std::unique_ptr<Gates> gates_;
  std::unique_ptr<GateModels> gate_models_;
  const std::vector<uint8_t>* borders_ = nullptr;
  unsigned entered_by_ = 0;     ///< the own face at the gate; 7: none
  unsigned outcomes_ = 0;       ///< of the last two pattern flags
  unsigned places_passed_ = 0;  ///< of the candidates of the next cell, by sweep()

  CellRef last_;
  CellRef last_anchor_;
  // The last cell and its neighbours' successors are kept as references with ordinals, as any of these cells
  // may leave memory, and its slot be taken again, before the next cell asks.
  std::array<CellRef, most_faces> successors_{};  ///< of the last cell's neighbours
  unsigned followed_ = 0;                         ///< sweep(): a bit for each that there is
  unsigned swept_agreement_ = 0;                  ///< of the candidates
  Sources sources_;
  std::array<CellRef, 16> recent_cells_{};
  uint32_t ordinal_ = 0;
  unsigned last_kind_ = 0;
  unsigned dimensions_ = 0;  ///< of cells so far, a bit for each
  uint64_t counted_ = 0;     ///< points so far
  // Base of point numbers that are coded as differences (docs/format.md, 16.6: G).
  uint64_t group_ = 0;  ///< many generators write the cells around point 1, 2, 3, ...
  uint64_t last_loose_ = 0;
  uint32_t last_signature_ = 0;  ///< how the last cell was coded

  // The cell being coded.
  Assembly cell_;
  std::array<uint32_t, most_corners> target_{};    ///< encoder: slots of its corners, no_slot for new ones
  std::array<uint8_t, most_corners> repeat_of_{};  ///< for corners that repeat another
  unsigned repeated_ = 0;
  const StreamedCell* wanted_ = nullptr;
  uint32_t signature_ = 0, pattern_ = 0, anchor_signature_ = 0;
  std::array<uint32_t, most_nodes> node_{};
  // 48, 32, 8 and 24 below are parts of the format, except for the partners, which only an encoder has. Each
  // bounds the work for a cell in a mesh where thousands of cells meet at one point.
  std::array<Candidate, 48> anchors_{};
  std::array<uint8_t, 8> origin_ranks_{};
  std::array<uint32_t, 32> partners_{};
  unsigned anchor_count_ = 0, partner_count_ = 0, last_choice_ = 0, last_face_ = 0;
  std::array<EdgeFace, 8> edge_faces_{};
  unsigned edge_face_count_ = 0;
  std::array<std::pair<uint32_t, uint8_t>, 24> joined_{};
  std::vector<uint8_t> joined_places_;  ///< by point: 1 + its place in joined_; all 0 in between
  // By kind and face of the anchor and kind of this cell. In regular meshes the turn on a neighbour repeats.
  std::array<std::array<std::array<uint8_t, kind_count>, most_faces>, kind_count> last_turn_{};
  std::vector<std::array<uint32_t, most_nodes - 8 + 4>> extra_;  ///< by cell slot, once there are such nodes
};

/// Suggests numbers that are as far from each known neighbour of the corner as the last cell's corner is from
/// its own: rows and layers with gaps go on with the same distance. This took numbering of voxel bone from
/// 1.33 to 0.96 bits a hexahedron, and of armadillo from 0.46 to 0.33 (0638ec8). Sums wrap modulo 2^64 on
/// both sides, so that hostile numbers do no harm.
template <class Coder>
template <class Suggest>
void CellCoder<Coder>::suggest_as_last(unsigned corner, Suggest suggest) const {
  if (corner == most_corners || sources_.cell[0] == no_slot) return;
  const Hull::Cell& last = hull_.cell(sources_.cell[0]);
  if (last.kind != cell_.kind || last.corner[corner] == no_slot) return;
  unsigned left = Numbering::most_others;
  for (unsigned n = cell_.shape().neighbours[corner] & cell_.known; n != 0 && left > 0; n &= n - 1) {
    const auto neighbour = static_cast<unsigned>(__builtin_ctz(n));
    if (last.corner[neighbour] == no_slot) continue;
    suggest(number_of(cell_.corner[neighbour]) + number_of(last.corner[corner]) -
            number_of(last.corner[neighbour]));
    --left;
  }
}

}  // namespace maille
