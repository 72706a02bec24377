#include "io/vtk/vtk_data.h"

#include <fast_float/fast_float.h>
#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <climits>

#include "base/bytes.h"
#include "io/base64.h"
#include "io/buffered_writer.h"
#include "io/byte_order.h"
#include "io/vtk/vtk_field_data.h"

namespace maille {
namespace {

tl::unexpected<Error> malformed(const std::string& where, const std::string& what) {
  return failure(ErrorCode::malformed_input, where + ": " + what);
}

/// The bytes of binary data, wherever (in the tag or appended) and however (raw or base64) they are stored,
/// read front to back.
class Payload {
 public:
  Payload(Bytes bytes, bool base64)
      : raw_(bytes), text_({reinterpret_cast<const char*>(bytes.data()), bytes.size()}), base64_(base64) {}

  bool read(std::span<std::byte> out) {
    if (base64_) return text_.read(out);
    if (out.size() > raw_.size()) return false;
    std::copy_n(raw_.begin(), out.size(), out.begin());
    raw_ = raw_.subspan(out.size());
    return true;
  }
  uint64_t most_left() const { return base64_ ? text_.most_left() : raw_.size(); }

 private:
  Bytes raw_;
  Base64Reader text_;
  bool base64_;
};

/// Decodes one array's bytes; every size that is claimed is checked against what is there before use. Layout:
/// without a compressor, the number of bytes, then these; with one, the number of blocks, the size of a whole
/// block, that of the last one (0: whole), the packed size of each block, then the blocks. Each number has
/// header_size bytes.
class Decoder {
 public:
  Decoder(const VtkXml& xml, const std::string& where, Budget& budget, Payload payload)
      : xml_(xml), where_(where), budget_(budget), payload_(payload) {}

  Result<std::vector<std::byte>> decode() {
    return xml_.compressor == VtkCompressor::none ? plain() : compressed();
  }

 private:
  Result<uint64_t> number() {
    std::byte bytes[8] = {};
    const std::span<std::byte> part(bytes, xml_.header_size);
    if (!payload_.read(part)) return malformed(where_, "its binary data end inside their header");
    if (xml_.swapped) swap_numbers(part, part.size());
    return load<uint64_t>(bytes);
  }

  Result<std::vector<std::byte>> plain() {
    const uint64_t size = MAILLE_TRY(number());
    if (size > payload_.most_left()) return too_short(size);
    MAILLE_CHECK(budget_.take(size, 1));
    std::vector<std::byte> data(size);
    if (!payload_.read(data)) return too_short(size);
    return data;
  }

  Result<std::vector<std::byte>> compressed() {
    const uint64_t blocks = MAILLE_TRY(number());
    const uint64_t block_size = MAILLE_TRY(number());
    const uint64_t last_size = MAILLE_TRY(number());
    if (blocks > payload_.most_left() / xml_.header_size) return too_short(blocks);
    std::vector<uint64_t> sizes;
    for (uint64_t i = 0; i < blocks; ++i) sizes.push_back(MAILLE_TRY(number()));
    std::vector<std::byte> data, packed;
    for (uint64_t i = 0; i < blocks; ++i) {
      if (sizes[i] > payload_.most_left()) return too_short(sizes[i]);
      packed.resize(sizes[i]);
      if (!payload_.read(packed)) return too_short(sizes[i]);
      const bool partial = i + 1 == blocks && last_size != 0;
      MAILLE_CHECK(inflate_block(i, packed, partial ? last_size : block_size, data));
    }
    return data;
  }

  Result<> inflate_block(uint64_t block, Bytes packed, uint64_t size, std::vector<std::byte>& data) {
    // Deflate never gains more than a factor of 1032, LZ4 255; 1040 and the 1 leave room for headers. Only
    // the budget bounds LZMA, which has no such limit.
    if (xml_.compressor != VtkCompressor::lzma && size / 1040 > packed.size() + 1) return bad_block(block);
    MAILLE_CHECK(budget_.take(size, 1));
    const size_t at = data.size();
    data.resize(at + size);
    if (!unpack_vtk_block(xml_.compressor, packed, std::span(data).subspan(at))) return bad_block(block);
    return {};
  }

  tl::unexpected<Error> bad_block(uint64_t block) {
    return malformed(where_, "its compressed block " + std::to_string(block) +
                                 " does not decompress to the size stated; the file is damaged");
  }
  tl::unexpected<Error> too_short(uint64_t size) {
    return malformed(where_, "its binary data should go on for " + std::to_string(size) +
                                 " bytes or blocks, but the file has fewer or holds foreign characters");
  }

  const VtkXml& xml_;
  const std::string& where_;
  Budget& budget_;
  Payload payload_;
};

template <class T>
const char* parse_value(const char* from, const char* to, T& value) {
  if constexpr (std::is_floating_point_v<T>) {
    const auto result = fast_float::from_chars(from, to, value);
    // Out of range means 0 or infinity, which VTK itself writes and reads so.
    return result.ec == std::errc() || result.ec == std::errc::result_out_of_range ? result.ptr : nullptr;
  } else {
    const auto result = std::from_chars(from, to, value);
    return result.ec == std::errc() ? result.ptr : nullptr;
  }
}

bool is_space(char c) {
  return c == ' ' || c == '\n' || c == '\r' || c == '\t';
}

template <class T>
Result<std::vector<std::byte>> parse_ascii(std::string_view text, const std::string& where, Budget& budget) {
  std::vector<std::byte> data;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (uint64_t index = 0;; ++index) {
    while (at != end && is_space(*at)) ++at;
    if (at == end) break;
    const char* word = at;
    if (*at == '+') ++at;
    T value{};
    const char* next = parse_value(at, end, value);
    if (!next || (next != end && !is_space(*next))) {
      const char* stop = std::find_if(word, end, is_space);
      return malformed(where, "value " + std::to_string(index) + " is \"" +
                                  std::string(word, std::min(stop, word + 40)) +
                                  "\", which does not fit its type");
    }
    const size_t size = data.size();
    data.resize(size + sizeof value);
    store(data.data() + size, value);
    at = next;
  }
  // Behind the loop, as text takes at least two bytes a value: memory grows with the text and no further than
  // 4-fold.
  MAILLE_CHECK(budget.take(data.size(), 1));
  return data;
}

Bytes bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// The array's values as bytes in native order. In text the file's byte order means nothing.
Result<std::vector<std::byte>> read_values(const VtkXml& xml, pugi::xml_node node, Scalar type,
                                           const std::string& where, Budget& budget) {
  const std::string_view format = node.attribute("format").as_string("ascii");
  const std::string_view text = node.text().get();
  if (format == "ascii") {
    return with_type(type, [&](auto zero) { return parse_ascii<decltype(zero)>(text, where, budget); });
  }
  std::vector<std::byte> data;
  if (format == "binary") {
    data = MAILLE_TRY(Decoder(xml, where, budget, Payload(bytes_of(text), true)).decode());
  } else if (format == "appended") {
    const uint64_t offset = node.attribute("offset").as_ullong(UINT64_MAX);
    if (offset > xml.appended.size()) {
      return malformed(where, "its offset points behind the end of the appended data (" +
                                  std::to_string(xml.appended.size()) + " bytes)");
    }
    const bool base64 = xml.appended_encoding == VtkXml::Encoding::base64;
    const Payload payload(xml.appended.subspan(static_cast<size_t>(offset)), base64);
    data = MAILLE_TRY(Decoder(xml, where, budget, payload).decode());
  } else {
    return malformed(where, "its format is \"" + std::string(format) + "\", not ascii, binary or appended");
  }
  if (xml.swapped) swap_numbers(data, size_of(type));
  return data;
}

size_t line_of(std::string_view text, size_t offset) {
  const std::string_view before = text.substr(0, std::min(offset, text.size()));
  return 1 + static_cast<size_t>(std::count(before.begin(), before.end(), '\n'));
}

bool ends_with_tag(std::string_view text, std::string_view tag) {
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text.size() >= tag.size() && text.substr(text.size() - tag.size()) == tag;
}

/// Cuts the appended data out and returns the XML before it: raw data are no XML, and a parser would stop at
/// the first zero or "<". The tag can be looked for in the text, as no value of an attribute may hold "<".
Result<std::string_view> cut_appended(VtkXml& xml, std::string_view text) {
  const size_t tag = text.find("<AppendedData");
  if (tag == std::string_view::npos) return text;
  const size_t close = text.find('>', tag);
  if (close == std::string_view::npos) return malformed(xml.file, "it ends inside the tag AppendedData");
  const std::string_view attributes = text.substr(tag, close - tag);
  const bool raw = attributes.find("\"raw\"") != std::string_view::npos ||
                   attributes.find("'raw'") != std::string_view::npos;
  xml.appended_encoding = raw ? VtkXml::Encoding::raw : VtkXml::Encoding::base64;
  size_t start = close + 1;
  while (start < text.size() && is_space(text[start])) ++start;
  if (start == text.size() || text[start] != '_') {
    return malformed(xml.file, "byte " + std::to_string(start) + ": appended data must start with \"_\"");
  }
  // Arrays are only decoded when they are wanted, so a file that was cut off might go unnoticed.
  if (!ends_with_tag(text, "</VTKFile>")) {
    return malformed(xml.file, "it does not end in </VTKFile>, so its end is missing");
  }
  std::string_view data = text.substr(start + 1);
  if (!raw) data = data.substr(0, data.find('<'));
  xml.appended = bytes_of(data);
  return text.substr(0, tag);
}

/// The names of compressors, in the order of VtkCompressor.
constexpr std::string_view vtk_compressors[] = {"", "vtkZLibDataCompressor", "vtkLZ4DataCompressor",
                                                "vtkLZMADataCompressor"};

// Byte order, size of header numbers and compressor are attributes of the root and hold for all arrays.
Result<> read_root(VtkXml& xml, std::initializer_list<std::string_view> types) {
  const pugi::xml_node root = xml.document.child("VTKFile");
  if (!root) return malformed(xml.file, "there is no VTKFile element, so this is not a VTK XML file");
  const std::string found = root.attribute("type").as_string();
  if (std::find(types.begin(), types.end(), found) == types.end()) {
    return failure(ErrorCode::unsupported, xml.file + ": it holds a VTK data set of type \"" + found +
                                               "\"; only " + std::string(*types.begin()) + " can be read");
  }
  xml.swapped = std::string_view(root.attribute("byte_order").as_string("LittleEndian")) == "BigEndian";
  const std::string header = root.attribute("header_type").as_string("UInt32");
  if (header != "UInt32" && header != "UInt64") {
    return malformed(xml.file, "its header_type is \"" + header + "\", not UInt32 or UInt64");
  }
  xml.header_size = header == "UInt64" ? 8 : 4;
  const std::string compressor = root.attribute("compressor").as_string();
  const auto known = std::find(std::begin(vtk_compressors), std::end(vtk_compressors), compressor);
  if (known == std::end(vtk_compressors)) {
    return failure(ErrorCode::unsupported, xml.file + ": its data are compressed by " + compressor +
                                               ", which cannot be read: save it again with zlib or without "
                                               "compression (in ParaView: Compressor Type)");
  }
  xml.compressor = static_cast<VtkCompressor>(known - std::begin(vtk_compressors));
  return {};
}

}  // namespace

bool unpack_vtk_block(VtkCompressor compressor, Bytes packed, std::span<std::byte> out) {
  switch (compressor) {
    case VtkCompressor::none:
      break;
    case VtkCompressor::zlib: {
      uLongf written = out.size();
      const int status = uncompress(reinterpret_cast<Bytef*>(out.data()), &written,
                                    reinterpret_cast<const Bytef*>(packed.data()), packed.size());
      return status == Z_OK && written == out.size();
    }
    case VtkCompressor::lz4: {
      if (packed.size() > INT_MAX || out.size() > INT_MAX) return false;
      const int size = LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()),
                                           reinterpret_cast<char*>(out.data()),
                                           static_cast<int>(packed.size()), static_cast<int>(out.size()));
      return size >= 0 && static_cast<size_t>(size) == out.size();
    }
    case VtkCompressor::lzma: {
      // What the dictionary of the decoder may take: more than xz -9 needs (65 MiB). Chosen, not swept.
      uint64_t memory = uint64_t{256} << 20;
      size_t read = 0, written = 0;
      const lzma_ret status = lzma_stream_buffer_decode(
          &memory, 0, nullptr, reinterpret_cast<const uint8_t*>(packed.data()), &read, packed.size(),
          reinterpret_cast<uint8_t*>(out.data()), &written, out.size());
      return status == LZMA_OK && written == out.size();
    }
  }
  return false;
}

uint64_t plausible_bytes(const VtkXml& xml, uint64_t file_bytes) {
  // Structured numbering and constant fields compress a hundredfold and more. With Budget's own factor of 64
  // this allows 1024-fold, about what deflate can do at best.
  return xml.compressor == VtkCompressor::none ? file_bytes : file_bytes * 16;
}

Result<VtkXml> parse_vtk_xml(Bytes bytes, std::string file, std::initializer_list<std::string_view> types) {
  VtkXml xml;
  xml.file = std::move(file);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string_view head = MAILLE_TRY(cut_appended(xml, text));
  pugi::xml_parse_result parsed;
  if (head.size() == text.size()) {
    parsed = xml.document.load_buffer(head.data(), head.size());
  } else {
    const std::string closed = std::string(head) + "</VTKFile>";
    parsed = xml.document.load_buffer(closed.data(), closed.size());
  }
  if (!parsed) {
    const auto offset = static_cast<size_t>(std::max<ptrdiff_t>(parsed.offset, 0));
    return malformed(xml.file, "line " + std::to_string(line_of(text, offset)) + ": not well-formed XML (" +
                                   parsed.description() + ")");
  }
  MAILLE_CHECK(read_root(xml, types));
  return xml;
}

Result<Array> read_data_array(const VtkXml& xml, pugi::xml_node node, const std::string& where,
                              Budget& budget) {
  const std::string type_name = node.attribute("type").as_string();
  const std::optional<Scalar> type = scalar_of_vtk(type_name);
  if (type_name == "Bit")
    return malformed(where, "bits, the type \"Bit\", are not read; save the array as UInt8");
  if (!type) return malformed(where, "its type is \"" + type_name + "\", which is no VTK number type");
  const long long components = node.attribute("NumberOfComponents").as_llong(1);
  if (components < 1 || components > 0xffff) {
    return malformed(where, "NumberOfComponents must be 1 to 65535");
  }
  Array array =
      make_array(node.attribute("Name").as_string(), Domain::mesh, *type, static_cast<uint32_t>(components));
  array.bytes = MAILLE_TRY(read_values(xml, node, *type, where, budget));
  if (array.bytes.size() % array.tuple_size() != 0) {
    return malformed(where, "its " + std::to_string(array.bytes.size()) +
                                " bytes are not a whole number of tuples of " +
                                std::to_string(array.tuple_size()) + " bytes");
  }
  return array;
}

Result<std::vector<std::string>> read_string_array(const VtkXml& xml, pugi::xml_node node,
                                                   const std::string& where, Budget& budget) {
  // Characters are stored as bytes (in ascii as their codes), each string ended by a zero.
  const std::vector<std::byte> bytes = MAILLE_TRY(read_values(xml, node, Scalar::u8, where, budget));
  const auto ends = std::count(bytes.begin(), bytes.end(), std::byte{0});
  MAILLE_CHECK(budget.take(static_cast<uint64_t>(ends) + 1, sizeof(std::string)));
  return split_texts(bytes);
}

}  // namespace maille
