#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/cells/decisions.h"
#include "volume/cells/face_store.h"

namespace maille {

template <class Coder>
class CellCoder;
struct StreamedCell;
struct CodedCells;

/// A polyhedron has no more corners, those of each face counted, and no more faces. It bounds what a damaged
/// stream can claim of one cell; at 2^22 each count of corners also fits the 32 bits that places have here.
inline constexpr uint32_t most_face_corners = uint32_t{1} << 22;

/// Where the first point of `own` is in `other`, and whether it goes on in the same direction. False if they
/// are not the same cycle.
bool lay_on(std::span<const uint32_t> own, std::span<const uint32_t> other, uint32_t& start, bool& same_way);

/// Cells given by their faces: polyhedra, and polygons of any size. Which faces are those of cells in memory
/// is told by going from the first such face over edges; what remains follows the edges that only one face
/// has so far. docs/format.md, 16.8.
/// It belongs to a CellCoder (`Host`), which has the hull, the points and their numbers; the coder's own
/// memory is the FaceStore. The state of the cell being coded is kept in members, whose vectors keep their
/// room. As with CellCoder, both directions run the same code; `matches_`, `member_of_` and `begin_` exist
/// for the encoder alone.
template <class Coder>
class FaceCoder {
 public:
  static constexpr bool encoding = Coder::encoding;
  using Host = CellCoder<Coder>;

  explicit FaceCoder(Mixing mixing) : decisions_(mixing) {}

  /// Codes one cell and adds it to `out`. False: the stream is damaged (decoder only).
  bool code(Host& host, Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out);
  /// Encoder: does a polygon with these points lie on an open face of a polyhedron in memory?
  bool lies_on_face(Host& host, std::span<const uint64_t> numbers);
  FaceStore& store() { return store_; }
  uint64_t bytes() const { return store_.bytes() + bytes_held(met_) + bytes_held(final_); }
  /// A cell of the hull came: its open faces close those of polyhedra that they lie on.
  void close_under(Host& host, uint32_t cell);

 private:
  // Numbered as docs/format.md, 16.8, has them (Q).
  enum Question : unsigned {
    same_type,
    has_anchor,
    anchor_here,
    by_point,
    is_member,
    turned_over,
    start_bit,
    from_members,
    member_here,
    is_end,
    over_edge,
    corner_here,
    is_new,
    joined_here,
    face_ends,
    below_here,
    is_final,
    question_count
  };
  /// An open face in memory, of a polyhedron or of a cell of the hull.
  struct OpenFace {
    uint32_t id = no_slot;  ///< no_slot: `of_hull` has it
    FaceRef of_hull;
    bool operator==(const OpenFace& other) const {
      return id == other.id && of_hull.cell == other.of_hull.cell && of_hull.face == other.of_hull.face;
    }
  };
  /// A total order of open faces: those of the store by id, then those of the hull by cell and face. For the
  /// encoder's own search only.
  static uint64_t key_of(const OpenFace& face) {
    return face.id != no_slot ? face.id : (uint64_t{face.of_hull.cell} + 1) << 32 | face.of_hull.face;
  }
  /// Encoder: one of the cell's faces that is open in memory.
  struct Match {
    OpenFace face;
    uint32_t own;
  };
  struct Member {
    OpenFace face;
    bool same_way = false;  ///< the cell has it in the same order, not turned over
    bool used = false;
    uint32_t place = 0;      ///< in line_
    uint32_t own = no_slot;  ///< encoder: which of the cell's faces
    uint32_t start = 0;      ///< encoder: where its first corner is
  };
  struct Place {
    uint32_t member, next, back;
  };
  struct Edge {
    uint32_t from, to;
  };
  struct Candidate {
    OpenFace face;
    uint8_t origin;
    uint8_t rank;
  };

  bool decide(bool bit, Question question, uint32_t local, uint32_t nearby, uint32_t valence) {
    return decisions_.code(*coder_, bit, question, {local, nearby, valence});
  }
  void begin(Host& host, Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out);
  void code_type();
  // Faces of both memories behind one interface.
  void load(const OpenFace& face, std::vector<uint32_t>& loop) const;
  uint32_t cell_of(const OpenFace& face) const;
  uint32_t size_of(const OpenFace& face) const;
  uint32_t met_points(const OpenFace& face, uint32_t cell) const;
  template <class Visit>
  void open_faces_around(uint32_t slot, Visit visit) const;
  OpenFace find_open(std::span<const uint32_t> loop);
  void close(const OpenFace& face);

  // Encoder: which of the cell's own faces are open in memory.
  uint32_t wanted_slot(uint32_t own, uint32_t place);
  bool load_own(uint32_t own);
  void find_matches();
  uint32_t own_face_on(const OpenFace& face) const;

  // The first face, from which the others are found.
  void add_anchor(const OpenFace& face, unsigned origin);
  void collect_anchors();
  void code_anchor();
  OpenFace code_distant_anchor();
  uint32_t point_with(const OpenFace& wanted);
  OpenFace code_around(uint32_t point, const OpenFace& wanted);

  // The other faces in memory, over edges.
  void add_member(const OpenFace& face);
  uint8_t* asked_about(const OpenFace& face);
  void flood();
  void flood_edge(uint32_t owner, uint32_t a, uint32_t b);

  void code_faces();
  void line_up_members();
  void code_member(uint32_t own);
  void append_turned(uint32_t start, bool same_way);
  uint32_t code_start(uint32_t start, uint32_t size);

  // Faces that are new, corner by corner (face_coder_loops.cpp).
  void code_loop(uint32_t own);
  void find_next();
  void code_corner(uint32_t wanted, uint64_t number);
  void find_joined();
  void create(uint64_t number);
  void add_edge(uint32_t from, uint32_t to);
  void meet(uint32_t slot);

  void code_polygon();
  OpenFace code_below(const OpenFace& wanted);
  void enter();
  uint32_t bring_faces();
  void code_finals();

  FaceStore store_;
  Decisions<question_count> decisions_;
  DifferenceModel rank_model_, start_model_;
  std::vector<uint32_t> met_;    ///< by slot of point: the last cell that has it, counted from 1
  std::vector<uint32_t> final_;  ///< by slot of point: the cell with which it ended
  uint32_t cells_ = 0;

  CellType last_type_ = CellType::polyhedron;
  std::vector<uint32_t> last_faces_;   ///< that the last cell brought
  std::vector<uint32_t> last_points_;  ///< of the last cell
  // Hashes of the shapes of the last three cells: snappyHexMesh and polyhedral meshers repeat a few shapes,
  // and how a cell ends its points follows from them.
  std::array<uint32_t, 3> last_shapes_{};
  uint64_t last_anchor_point_ = 0, last_old_ = 0;
  uint32_t last_choice_ = 0, last_start_ = 0, last_rank_ = 0, last_size_ = 0, last_below_ = 0;
  bool last_way_ = false;

  // The cell being coded.
  Host* host_ = nullptr;
  Coder* coder_ = nullptr;
  Coder* numbers_ = nullptr;
  StreamedCell* cell_ = nullptr;
  CodedCells* out_ = nullptr;
  bool damaged_ = false;
  uint32_t recent_ = 0;
  std::vector<uint32_t> begin_;      ///< encoder: where the cell's faces begin, and the end of the last
  std::vector<Match> matches_;       ///< encoder: by face in memory
  std::vector<uint32_t> member_of_;  ///< encoder: by own face
  std::vector<Candidate> anchors_;
  std::vector<Member> members_;
  std::vector<std::pair<OpenFace, uint8_t>> hull_faces_;  ///< of the hull: how often asked about
  std::vector<Place> line_;
  uint32_t members_left_ = 0, at_ = 0;
  std::vector<Edge> border_;      ///< edges that one face has so far
  std::vector<uint32_t> points_;  ///< each once
  std::vector<uint32_t> loop_;    ///< the face being coded, as slots
  std::vector<uint32_t> joined_;
  std::array<uint32_t, 3> next_{};
  uint32_t next_count_ = 0;
  bool closes_ = false, last_fresh_ = false;
  std::vector<uint32_t> scratch_;
  std::vector<uint32_t> nodes_;  ///< slots of all corners
  std::vector<uint32_t> sizes_;
  std::vector<std::pair<uint32_t, uint32_t>> brought_;  ///< faces that are new: begin and size in nodes_
  std::vector<OpenFace> closing_;
};

}  // namespace maille
