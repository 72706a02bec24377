// What packs any bytes: as VTK does it, and with differences and shuffled bytes before the packer.
#include <lz4.h>
#include <lzma.h>
#include <zlib.h>
#include <zstd.h>
#include <algorithm>
#include "array_codec.h"

namespace maille::bench {
namespace {

using Buffer = std::vector<std::byte>;

uint8_t* bytes_of(Buffer& buffer) {
  return reinterpret_cast<uint8_t*>(buffer.data());
}
const uint8_t* bytes_of(Bytes bytes) {
  return reinterpret_cast<const uint8_t*>(bytes.data());
}
tl::unexpected<Error> broken(const char* what) {
  return failure(ErrorCode::corrupt, what);
}

/// vtkXMLUnstructuredGridWriter, appended raw: blocks of 32 KiB behind a header of u32 (their number, size,
/// size of the last one, packed sizes).
class VtkBlocks final : public ArrayCodec {
 public:
  explicit VtkBlocks(bool lz4) : lz4_(lz4) {}
  std::string name() const override { return lz4_ ? "VTU lz4" : "VTU zlib"; }
  bool as_vtk() const override { return true; }

  Result<Buffer> pack(const Part& part) const override {
    const size_t blocks = (part.bytes.size() + block_size - 1) / block_size;
    std::vector<uint32_t> header = {static_cast<uint32_t>(blocks), block_size,
                                    static_cast<uint32_t>(part.bytes.size() % block_size)};
    Buffer packed, one(std::max<size_t>(compressBound(block_size), LZ4_compressBound(block_size)));
    for (size_t at = 0; at < part.bytes.size(); at += block_size) {
      const Bytes block = Bytes(part.bytes).subspan(at, std::min(block_size, part.bytes.size() - at));
      const size_t size = pack_block(block, one);
      if (size == 0) return broken("VTU: a block");
      header.push_back(static_cast<uint32_t>(size));
      packed.insert(packed.end(), one.begin(), one.begin() + static_cast<ptrdiff_t>(size));
    }
    const auto* front = reinterpret_cast<const std::byte*>(header.data());
    packed.insert(packed.begin(), front, front + header.size() * 4);
    return packed;
  }

  Result<Buffer> unpack(Bytes packed, const Part& like) const override {
    Buffer out(like.bytes.size());
    const auto blocks = (out.size() + block_size - 1) / block_size;
    size_t in = (3 + blocks) * 4;
    for (size_t i = 0; i < blocks; ++i) {
      uint32_t size = 0;
      std::memcpy(&size, packed.data() + (3 + i) * 4, 4);
      const size_t at = i * block_size, length = std::min(block_size, out.size() - at);
      if (!unpack_block(packed.subspan(in, size), out.data() + at, length)) return broken("VTU: a block");
      in += size;
    }
    return out;
  }

 private:
  static constexpr size_t block_size = 32768;
  size_t pack_block(Bytes block, Buffer& out) const {
    if (lz4_) {
      return static_cast<size_t>(LZ4_compress_default(
          reinterpret_cast<const char*>(block.data()), reinterpret_cast<char*>(out.data()),
          static_cast<int>(block.size()), static_cast<int>(out.size())));
    }
    uLongf size = out.size();
    return compress2(bytes_of(out), &size, bytes_of(block), block.size(), Z_DEFAULT_COMPRESSION) == Z_OK
               ? size
               : 0;
  }
  bool unpack_block(Bytes block, std::byte* out, size_t length) const {
    if (lz4_) {
      return LZ4_decompress_safe(reinterpret_cast<const char*>(block.data()), reinterpret_cast<char*>(out),
                                 static_cast<int>(block.size()),
                                 static_cast<int>(length)) == static_cast<int>(length);
    }
    uLongf size = length;
    return uncompress(reinterpret_cast<uint8_t*>(out), &size, bytes_of(block), block.size()) == Z_OK &&
           size == length;
  }

  bool lz4_;
};

/// Differences to the same component of the tuple before, as integers of the type's size; then all first
/// bytes, all second bytes, ...
template <class T>
Buffer differences_shuffled(const Part& part) {
  const size_t count = part.bytes.size() / sizeof(T);
  Buffer out(part.bytes.size());
  const auto at = [&](size_t i) {
    T value;
    std::memcpy(&value, part.bytes.data() + i * sizeof(T), sizeof(T));
    return value;
  };
  for (size_t i = 0; i < count; ++i) {
    const T before = i < part.components ? T{0} : at(i - part.components);
    const auto difference = static_cast<T>(at(i) - before);
    for (size_t b = 0; b < sizeof(T); ++b) out[b * count + i] = static_cast<std::byte>(difference >> (8 * b));
  }
  return out;
}
template <class T>
Buffer sums_unshuffled(const Buffer& shuffled, size_t stride) {
  const size_t count = shuffled.size() / sizeof(T);
  std::vector<T> values(count);
  for (size_t i = 0; i < count; ++i) {
    uint64_t difference = 0;
    for (size_t b = 0; b < sizeof(T); ++b)
      difference |= static_cast<uint64_t>(shuffled[b * count + i]) << (8 * b);
    values[i] = static_cast<T>(difference + (i < stride ? T{0} : values[i - stride]));
  }
  Buffer out(shuffled.size());
  std::memcpy(out.data(), values.data(), out.size());
  return out;
}

Buffer differences_shuffled(const Part& part) {
  switch (size_of(part.type)) {
    case 1:
      return differences_shuffled<uint8_t>(part);
    case 2:
      return differences_shuffled<uint16_t>(part);
    case 4:
      return differences_shuffled<uint32_t>(part);
    default:
      return differences_shuffled<uint64_t>(part);
  }
}
Buffer sums_unshuffled(const Buffer& shuffled, const Part& like) {
  switch (size_of(like.type)) {
    case 1:
      return sums_unshuffled<uint8_t>(shuffled, like.components);
    case 2:
      return sums_unshuffled<uint16_t>(shuffled, like.components);
    case 4:
      return sums_unshuffled<uint32_t>(shuffled, like.components);
    default:
      return sums_unshuffled<uint64_t>(shuffled, like.components);
  }
}

class Zstd final : public ArrayCodec {
 public:
  explicit Zstd(int level) : level_(level) {}
  std::string name() const override { return "delta+shuffle+zstd -" + std::to_string(level_); }

  Result<Buffer> pack(const Part& part) const override {
    const Buffer raw = differences_shuffled(part);
    Buffer out(ZSTD_compressBound(raw.size()));
    const size_t size = ZSTD_compress(out.data(), out.size(), raw.data(), raw.size(), level_);
    if (ZSTD_isError(size) != 0) return broken("zstd");
    out.resize(size);
    return out;
  }
  Result<Buffer> unpack(Bytes packed, const Part& like) const override {
    Buffer raw(like.bytes.size());
    if (ZSTD_decompress(raw.data(), raw.size(), packed.data(), packed.size()) != raw.size())
      return broken("zstd");
    return sums_unshuffled(raw, like);
  }

 private:
  int level_;
};

class Xz final : public ArrayCodec {
 public:
  explicit Xz(bool differences) : differences_(differences) {}
  std::string name() const override { return differences_ ? "delta+shuffle+xz -9" : "xz -9"; }

  Result<Buffer> pack(const Part& part) const override {
    const Buffer raw = differences_ ? differences_shuffled(part) : part.bytes;
    Buffer out(lzma_stream_buffer_bound(raw.size()));
    size_t size = 0;
    if (lzma_easy_buffer_encode(9, LZMA_CHECK_CRC32, nullptr, bytes_of(Bytes(raw)), raw.size(), bytes_of(out),
                                &size, out.size()) != LZMA_OK) {
      return broken("liblzma");
    }
    out.resize(size);
    return out;
  }
  Result<Buffer> unpack(Bytes packed, const Part& like) const override {
    Buffer raw(like.bytes.size());
    uint64_t memory = UINT64_MAX;
    size_t in = 0, out = 0;
    if (lzma_stream_buffer_decode(&memory, 0, nullptr, bytes_of(packed), &in, packed.size(), bytes_of(raw),
                                  &out, raw.size()) != LZMA_OK) {
      return broken("liblzma");
    }
    return differences_ ? sums_unshuffled(raw, like) : raw;
  }

 private:
  bool differences_;
};

}  // namespace

void add_general_codecs(ArrayCodecs& codecs) {
  codecs.push_back(std::make_unique<VtkBlocks>(false));
  codecs.push_back(std::make_unique<VtkBlocks>(true));
  codecs.push_back(std::make_unique<Zstd>(3));
  codecs.push_back(std::make_unique<Zstd>(19));
  codecs.push_back(std::make_unique<Xz>(true));
  codecs.push_back(std::make_unique<Xz>(false));
}

}  // namespace maille::bench
