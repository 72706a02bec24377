// Volumes of mode stream by parts, in the full decoder: what index and description say, cells of a query, and
// of one piece after another its surface or what a plane cuts out of it. web/src/decoder.js packs queries.
#include <maille/slice.h>
#include <maille/volume_file.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "reader.h"

namespace maille::wasm {
namespace {

/// What a call is about. Numbers that are not there are NaN, lists begin with their size (-1: none); names of
/// conditions and arrays stand in a text, each behind a 0.
struct Request {
  uint64_t step = 0;
  size_t kept_bytes = 0;  ///< of pieces that may be asked for again
  std::optional<Vector3> origin;
  VolumeQuery query;
  std::optional<std::vector<std::string>> arrays;
};

class Unpacker {
 public:
  Unpacker(std::span<const double> numbers, std::string_view text) : numbers_(numbers), text_(text) {}

  double number() {
    return at_ < numbers_.size() ? numbers_[at_++] : std::numeric_limits<double>::quiet_NaN();
  }
  uint64_t count() {
    const double value = number();
    return value >= 0 && value < 9e15 ? static_cast<uint64_t>(value) : 0;
  }
  Vector3 vector() {
    Vector3 v;
    for (double& x : v.x) x = number();
    return v;
  }
  /// Of a list, whose elements follow.
  size_t size() { return static_cast<size_t>(std::min<uint64_t>(count(), numbers_.size() - at_)); }
  std::string name() {
    const size_t end = std::min(text_.find('\0'), text_.size());
    std::string name(text_.substr(0, end));
    text_.remove_prefix(std::min(end + 1, text_.size()));
    return name;
  }
  bool has_list() const { return at_ < numbers_.size() && numbers_[at_] >= 0; }

 private:
  std::span<const double> numbers_;
  std::string_view text_;
  size_t at_ = 0;
};

bool is_there(double number) {
  return !std::isnan(number);
}

Region::Plane plane_of(Unpacker& from) {
  const Vector3 normal = from.vector();
  return {normal, from.number()};
}

Request unpacked(const double* numbers, uint32_t count, const char* text, uint32_t text_size) {
  Unpacker from({numbers, count}, {text, text_size});
  Request request;
  request.step = from.count();
  request.kept_bytes = static_cast<size_t>(std::min<uint64_t>(from.count(), uint64_t{1} << 31));
  if (const Vector3 origin = from.vector(); is_there(origin[0])) request.origin = origin;
  VolumeQuery& query = request.query;
  const Vector3 low = from.vector(), high = from.vector(), centre = from.vector();
  if (is_there(low[0])) query.region.box = Box{low, high};
  if (const double radius = from.number(); is_there(radius)) query.region.sphere = Sphere{centre, radius};
  if (const Region::Plane plane = plane_of(from); is_there(plane.offset)) query.plane = plane;
  const bool has_cells = from.has_list();
  const uint64_t first_cell = from.count(), end_cell = from.count();
  if (has_cells) query.cells = {first_cell, end_cell};
  for (size_t planes = from.size(); planes > 0; --planes) query.region.planes.push_back(plane_of(from));
  for (size_t conditions = from.size(); conditions > 0; --conditions) {
    ValueCondition condition;
    condition.low = from.number();
    condition.high = from.number();
    if (from.has_list())
      condition.component = static_cast<uint32_t>(from.count());
    else
      from.number();
    condition.array = from.name();
    query.conditions.push_back(std::move(condition));
  }
  const bool has_pieces = from.has_list();
  std::vector<uint32_t> pieces(from.size());
  for (uint32_t& piece : pieces) piece = static_cast<uint32_t>(from.count());
  if (has_pieces) query.pieces = std::move(pieces);
  if (!from.has_list()) return request;
  request.arrays.emplace();
  for (uint64_t arrays = std::min<uint64_t>(from.count(), text_size); arrays > 0; --arrays)
    request.arrays->push_back(from.name());
  return request;
}

/// A whole piece. The last array of its mesh has the numbers of its cells in the input, or where the order is
/// not kept, in the piece.
struct ReadPiece {
  uint32_t number = 0;
  Mesh mesh;
  std::vector<uint32_t> point_numbers;  ///< in the input; none where the order is not kept
  size_t bytes = 0;
};

struct OpenVolume final : Volume {
  OpenVolume(VolumeFile opened, const Request& request)
      : file(std::move(opened)), step(request.step), arrays(request.arrays) {}
  VolumeFile file;
  uint64_t step;
  std::optional<std::vector<std::string>> arrays;
  std::vector<ReadPiece> read;  ///< what was used last comes last
  struct Made {
    std::vector<uint32_t> cell_numbers, point_numbers;  ///< in the input
    std::vector<double> border_keys;                    ///< by face
  };
  Made made;  ///< what the reader has no place for
};

/// Opens the volume, unless it is open with the same arrays.
int32_t open(Reader& reader, const Request& request, OpenVolume*& volume) {
  volume = static_cast<OpenVolume*>(reader.volume.get());
  if (volume != nullptr) volume->made = {};
  if (volume != nullptr && volume->step == request.step && volume->arrays == request.arrays) return done;
  reader.volume.reset();
  DecodeOptions options = reader.options();
  options.arrays = request.arrays;
  options.step = request.step;
  auto opened = VolumeFile::open(reader.bytes, options);
  if (!opened) return reader.outcome(opened.error());
  reader.bytes.take_wanted();
  reader.volume = std::make_unique<OpenVolume>(std::move(*opened), request);
  volume = static_cast<OpenVolume*>(reader.volume.get());
  return done;
}

bool has_order(const VolumeFile& file) {
  return file.description().order_apart || !file.description().any_order;
}

size_t size_of(const ReadPiece& piece) {
  size_t size = piece.mesh.points.bytes.size() + 4 * piece.point_numbers.size();
  for (const Array& array : piece.mesh.arrays) size += array.bytes.size();
  for (const CellBlock& block : piece.mesh.blocks)
    size += 4 * (block.connectivity.size() + block.face_sizes.size()) +
            8 * (block.offsets.size() + block.cell_faces.size()) + block.types.size();
  return size;
}

ReadPiece with_numbers(uint32_t number, ExtractedVolume&& extracted) {
  ReadPiece piece;
  piece.number = number;
  piece.mesh = std::move(extracted.mesh);
  piece.point_numbers = std::move(extracted.point_numbers);
  Array numbers = make_array("", Domain::cell, Scalar::u32, 1);
  numbers.resize(piece.mesh.cell_count());
  const std::span<uint32_t> values = numbers.values<uint32_t>();
  for (size_t i = 0; i < values.size(); ++i)
    values[i] = i < extracted.cell_numbers.size() ? extracted.cell_numbers[i] : static_cast<uint32_t>(i);
  piece.mesh.arrays.push_back(std::move(numbers));
  piece.bytes = size_of(piece);
  return piece;
}

/// The oldest pieces go until the others fit.
void make_room(std::vector<ReadPiece>& read, size_t most) {
  size_t bytes = 0;
  auto first = read.end();
  while (first != read.begin() && bytes + std::prev(first)->bytes <= most) bytes += (--first)->bytes;
  read.erase(read.begin(), first);
}

/// The piece that a request names, out of those that are here or out of the file.
int32_t read_piece(Reader& reader, const Request& request, OpenVolume*& volume) {
  if (const int32_t outcome = open(reader, request, volume); outcome != done) return outcome;
  std::vector<ReadPiece>& read = volume->read;
  const uint32_t number =
      request.query.pieces && !request.query.pieces->empty() ? (*request.query.pieces)[0] : 0;
  const auto known =
      std::find_if(read.begin(), read.end(), [&](const ReadPiece& piece) { return piece.number == number; });
  if (known != read.end()) {
    std::rotate(known, known + 1, read.end());
    return done;
  }
  VolumeQuery all;
  all.pieces = {number};
  make_room(read, request.kept_bytes / 2);  // the piece that comes takes memory, too
  ExtractedVolume extracted;
  if (const int32_t outcome = reader.keep(volume->file.extract(all), extracted); outcome != done)
    return outcome;
  if (!extracted.problems.empty()) return reader.outcome({ErrorCode::corrupt, extracted.problems.front()});
  read.push_back(with_numbers(number, std::move(extracted)));
  return done;
}

/// Cells by their numbers in the input instead of those in what is drawn; they are the last array.
void take_numbers_of_cells(Drawable& drawable) {
  const Array& numbers = drawable.of_triangles.back();
  std::copy_n(numbers.values<uint32_t>().begin(), drawable.cells.size(), drawable.cells.begin());
  drawable.of_triangles.pop_back();
}

uint64_t mixed(uint64_t x) {
  x += 0x9E3779B97F4A7C15;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EB;
  return x ^ (x >> 31);
}

/// Faces of a piece that are no surface where others have them, too: those whose corners all lie in the box
/// of another piece, flat cells, and faces of solids that lie on these. The same faces have the same key in
/// all pieces, an even number that JavaScript has exactly; that of a flat cell is one more; others have -1.
class BorderKeys {
 public:
  BorderKeys(const VolumeFile& file, const ReadPiece& piece) : piece_(piece) {
    const auto own = file.info(piece.number);
    if (!own || !own->box || file.pieces() < 2) return;
    Region around;
    around.box = own->box;
    for (uint32_t other = 0; other < file.pieces(); ++other) {
      const auto info = file.info(other);
      if (other != piece.number && info && info->box && around.meets(*info->box))
        boxes_.push_back(*info->box);
    }
  }

  std::vector<double> of(const Drawable& drawable) {
    std::vector<double> keys;
    for (size_t face = 0; face < drawable.faces.size(); ++face) {
      const size_t end = face + 1 < drawable.faces.size() ? drawable.faces[face + 1] : drawable.cells.size();
      keys.push_back(key_of(drawable, drawable.faces[face], end, face < drawable.flat_faces));
      if (face + 1 == drawable.flat_faces) std::sort(flat_.begin(), flat_.end());
    }
    return keys;
  }

 private:
  /// Triangles of a face go around its first corner.
  double key_of(const Drawable& drawable, size_t first, size_t end, bool is_flat) {
    if (first == end) return -1;
    in_all_.assign(boxes_.size(), 1);
    uint64_t sum = 0;
    const auto add = [&](uint32_t vertex) {
      for (size_t b = 0; b < boxes_.size(); ++b)
        in_all_[b] = in_all_[b] != 0 && is_in(boxes_[b], drawable, vertex);
      sum += mixed(id_of(drawable.points[vertex]));
    };
    for (size_t k = 0; k < 2; ++k) add(drawable.triangles[3 * first + k]);
    for (size_t triangle = first; triangle < end; ++triangle) add(drawable.triangles[3 * triangle + 2]);
    const uint64_t key = mixed(sum) >> 12 << 1;
    if (is_flat) {
      flat_.push_back(key);
      return static_cast<double>(key + 1);
    }
    const bool counts = std::find(in_all_.begin(), in_all_.end(), 1) != in_all_.end() ||
                        std::binary_search(flat_.begin(), flat_.end(), key);
    return counts ? static_cast<double>(key) : -1;
  }
  /// Where points have no numbers in the input they are known by their place, bit for bit.
  uint64_t id_of(uint32_t point) const {
    if (!piece_.point_numbers.empty()) return piece_.point_numbers[point];
    const size_t size = piece_.mesh.points.tuple_size();
    uint64_t id = 0;
    for (size_t at = 0; at < size; at += 4) {
      uint32_t word = 0;
      std::memcpy(&word, piece_.mesh.points.bytes.data() + point * size + at, std::min<size_t>(4, size - at));
      id = mixed(id ^ word);
    }
    return id;
  }
  /// What is drawn is rounded: boxes are taken a little larger.
  static bool is_in(const Box& box, const Drawable& drawable, uint32_t vertex) {
    for (unsigned k = 0; k < 3; ++k) {
      const double x = drawable.positions[3 * size_t{vertex} + k] + drawable.origin[k];
      const double more = 1e-5 * (std::abs(box.low[k]) + std::abs(box.high[k]));
      if (x < box.low[k] - more || x > box.high[k] + more) return false;
    }
    return true;
  }

  const ReadPiece& piece_;
  std::vector<Box> boxes_;  ///< of pieces that touch this one
  std::vector<uint64_t> flat_;
  std::vector<uint8_t> in_all_;  ///< by box: all corners of a face so far
};

void add_info(const PieceInfo& info, std::vector<double>& numbers) {
  for (const uint64_t count : {info.cells, info.points, info.bytes})
    numbers.push_back(static_cast<double>(count));
  for (unsigned k = 0; k < 6; ++k) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    numbers.push_back(!info.box ? none : k < 3 ? info.box->low[k] : info.box->high[k - 3]);
  }
  for (const PieceInfo::Field& field : info.fields) {
    numbers.push_back(static_cast<double>(field.nans));
    numbers.push_back(static_cast<double>(field.components.size()));
    for (const PieceInfo::Field::Component& range : field.components)
      numbers.insert(numbers.end(), {range.low, range.high, range.mean});
  }
}

}  // namespace

/// numbers: cells, points, whether the order is kept, number of pieces; then of each piece cells, points,
/// bytes, box (6), and of each array on points and cells its NaN and number of components with least, largest
/// and mean of each. Of a file that is not in pieces nothing is known of its one piece.
MAILLE_EXPORT int32_t maille_open_volume(Reader* reader, const double* packed, uint32_t count,
                                         const char* text, uint32_t text_size) {
  OpenVolume* volume = nullptr;
  if (const int32_t outcome = open(*reader, unpacked(packed, count, text, text_size), volume);
      outcome != done)
    return outcome;
  const VolumeFile& file = volume->file;
  std::vector<double> numbers = {static_cast<double>(file.cells()), static_cast<double>(file.points()),
                                 double(has_order(file)), double(file.pieces())};
  for (uint32_t piece = 0; piece < file.pieces(); ++piece) {
    const auto info = file.info(piece);
    if (!info) return reader->outcome(info.error());
    add_info(*info, numbers);
  }
  reader->numbers = std::move(numbers);
  return done;
}

/// The arrays on points and cells of what maille_open_volume() opened, as maille_buffers() lists them,
/// without values.
MAILLE_EXPORT const Buffer* maille_volume_fields(Reader* reader) {
  reader->buffers.clear();
  if (const auto* const volume = static_cast<OpenVolume*>(reader->volume.get())) {
    for (const StreamArray& array : volume->file.description().arrays)
      add_array(reader->buffers, BufferKind::array, array, {});
  }
  return reader->buffers.data();
}

/// numbers: the pieces that may have cells of a query.
MAILLE_EXPORT int32_t maille_select_pieces(Reader* reader, const double* packed, uint32_t count,
                                           const char* text, uint32_t text_size) {
  const Request request = unpacked(packed, count, text, text_size);
  OpenVolume* volume = nullptr;
  if (const int32_t outcome = open(*reader, request, volume); outcome != done) return outcome;
  const auto pieces = volume->file.select(request.query);
  if (!pieces) return reader->outcome(pieces.error());
  reader->numbers.assign(pieces->begin(), pieces->end());
  return done;
}

/// numbers: offset and size of the ranges that a query begins with, whether they are here or not.
MAILLE_EXPORT int32_t maille_ranges_of_pieces(Reader* reader, const double* packed, uint32_t count,
                                              const char* text, uint32_t text_size) {
  const Request request = unpacked(packed, count, text, text_size);
  OpenVolume* volume = nullptr;
  if (const int32_t outcome = open(*reader, request, volume); outcome != done) return outcome;
  reader->bytes.pretend_empty(true);
  const auto extracted = volume->file.extract(request.query);
  reader->bytes.pretend_empty(false);
  const std::vector<ByteRange> wanted = reader->bytes.take_wanted();
  if (!extracted && wanted.empty()) return reader->outcome(extracted.error());
  reader->numbers.clear();
  for (const ByteRange& range : wanted)
    reader->numbers.insert(reader->numbers.end(), {double(range.offset), double(range.size)});
  return done;
}

/// The cells of a query, for maille_volume_buffers(). numbers: pieces and cells that were read. message():
/// what is damaged, a line each.
MAILLE_EXPORT int32_t maille_extract_volume(Reader* reader, const double* packed, uint32_t count,
                                            const char* text, uint32_t text_size) {
  const Request request = unpacked(packed, count, text, text_size);
  OpenVolume* volume = nullptr;
  if (const int32_t outcome = open(*reader, request, volume); outcome != done) return outcome;
  volume->read.clear();
  ExtractedVolume extracted;
  if (const int32_t outcome = reader->keep(volume->file.extract(request.query), extracted); outcome != done)
    return outcome;
  reader->mesh = std::move(extracted.mesh);
  volume->made.cell_numbers = std::move(extracted.cell_numbers);
  volume->made.point_numbers = std::move(extracted.point_numbers);
  reader->numbers = {double(extracted.pieces), static_cast<double>(extracted.cells_read)};
  reader->message.clear();
  for (const std::string& problem : extracted.problems) reader->message += problem + '\n';
  return done;
}

/// A first picture of all: vertices with means of values, for maille_volume_buffers(). Nothing is read but
/// the index.
MAILLE_EXPORT int32_t maille_coarse_volume(Reader* reader, const double* packed, uint32_t count,
                                           const char* text, uint32_t text_size) {
  OpenVolume* volume = nullptr;
  if (const int32_t outcome = open(*reader, unpacked(packed, count, text, text_size), volume);
      outcome != done)
    return outcome;
  return reader->keep(volume->file.coarse(), reader->mesh);
}

/// What the plane of a query cuts out of its piece, for maille_volume_buffers().
MAILLE_EXPORT int32_t maille_slice_of_piece(Reader* reader, const double* packed, uint32_t count,
                                            const char* text, uint32_t text_size) {
  const Request request = unpacked(packed, count, text, text_size);
  OpenVolume* volume = nullptr;
  if (const int32_t outcome = read_piece(*reader, request, volume); outcome != done) return outcome;
  const Mesh sliced = slice(volume->read.back().mesh, request.query.plane.value_or(Region::Plane{}));
  reader->drawable = draw(sliced, request.origin);
  spread_cell_arrays(sliced, reader->drawable);
  take_numbers_of_cells(reader->drawable);
  reader->drawable.points.clear();  // no points of the mesh
  make_room(volume->read, request.kept_bytes);
  return done;
}

/// The faces of a piece that no other solid of it has, for maille_volume_buffers().
MAILLE_EXPORT int32_t maille_surface_of_piece(Reader* reader, const double* packed, uint32_t count,
                                              const char* text, uint32_t text_size) {
  const Request request = unpacked(packed, count, text, text_size);
  OpenVolume* volume = nullptr;
  if (const int32_t outcome = read_piece(*reader, request, volume); outcome != done) return outcome;
  const ReadPiece& piece = volume->read.back();
  Drawable& drawable = reader->drawable = draw(piece.mesh, request.origin);
  spread_cell_arrays(piece.mesh, drawable);
  take_numbers_of_cells(drawable);
  volume->made.border_keys = BorderKeys(volume->file, piece).of(drawable);
  if (!piece.point_numbers.empty()) {
    for (uint32_t& point : drawable.points) point = piece.point_numbers[point];
  }
  make_room(volume->read, request.kept_bytes);
  return done;
}

/// Lists what the calls above have made: cells, or what is drawn (numbers: origin, 3, and
/// the pieces that are here and need not be read again).
MAILLE_EXPORT const Buffer* maille_volume_buffers(Reader* reader, uint32_t drawn) {
  std::vector<Buffer>& list = reader->buffers;
  list.clear();
  reader->wide.clear();
  const auto* const volume = static_cast<OpenVolume*>(reader->volume.get());
  if (volume == nullptr) return list.data();
  if (drawn != 0) {
    list_drawn(*reader);
    for (const ReadPiece& piece : volume->read) reader->numbers.push_back(piece.number);
    list.push_back(numbers_of(BufferKind::drawn_faces, Scalar::u32, reader->drawable.faces));
    list.push_back(numbers_of(BufferKind::border_keys, Scalar::f64, volume->made.border_keys));
  } else {
    list_exact(*reader);
    list.push_back(numbers_of(BufferKind::cell_numbers, Scalar::u32, volume->made.cell_numbers));
    list.push_back(numbers_of(BufferKind::point_numbers, Scalar::u32, volume->made.point_numbers));
  }
  return list.data();
}

}  // namespace maille::wasm
