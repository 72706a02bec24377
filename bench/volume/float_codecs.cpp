// Codecs of floating-point fields. Cells have no grid that these could use, so each component is one row.
#include <fpzip.h>
#include <zfp.h>
#include "array_codec.h"

namespace maille::bench {
namespace {

using Buffer = std::vector<std::byte>;

Buffer component_of(const Part& part, size_t component) {
  const size_t size = size_of(part.type);
  Buffer out(part.tuples() * size);
  for (size_t i = 0; i < part.tuples(); ++i) {
    std::memcpy(out.data() + i * size, part.bytes.data() + (i * part.components + component) * size, size);
  }
  return out;
}

/// One component after the other, each led by its size.
class ByComponent : public ArrayCodec {
 public:
  bool takes(const Part& part) const override { return is_float(part.type) && part.tuples() > 0; }
  Result<Buffer> pack(const Part& part) const override {
    Buffer out;
    for (size_t c = 0; c < part.components; ++c) {
      Buffer values = component_of(part, c);
      Buffer packed(values.size() * 2 + 4096);
      const uint64_t size = pack_row(values, packed, part.type == Scalar::f64);
      if (size == 0) return failure(ErrorCode::unsupported, "not packed");
      const auto* front = reinterpret_cast<const std::byte*>(&size);
      out.insert(out.end(), front, front + 8);
      out.insert(out.end(), packed.begin(), packed.begin() + static_cast<ptrdiff_t>(size));
    }
    return out;
  }
  Result<Buffer> unpack(Bytes packed, const Part& like) const override {
    const size_t size = size_of(like.type);
    Buffer out(like.bytes.size()), row(like.tuples() * size);
    for (size_t c = 0; c < like.components; ++c) {
      uint64_t length = 0;
      std::memcpy(&length, packed.data(), 8);
      if (!unpack_row(packed.subspan(8, length), row, like.type == Scalar::f64))
        return failure(ErrorCode::corrupt, "not unpacked");
      packed = packed.subspan(8 + length);
      for (size_t i = 0; i < like.tuples(); ++i)
        std::memcpy(out.data() + (i * like.components + c) * size, row.data() + i * size, size);
    }
    return out;
  }

 protected:
  /// Bytes written, 0 when it failed.
  virtual size_t pack_row(Buffer& values, Buffer& out, bool wide) const = 0;
  virtual bool unpack_row(Bytes packed, Buffer& values, bool wide) const = 0;
};

class Zfp final : public ByComponent {
 public:
  std::string name() const override { return "zfp reversible"; }

 private:
  static size_t run(Buffer& values, std::byte* buffer, size_t size, bool wide, bool pack) {
    zfp_field* field =
        zfp_field_1d(values.data(), wide ? zfp_type_double : zfp_type_float, values.size() / (wide ? 8 : 4));
    zfp_stream* stream = zfp_stream_open(nullptr);
    zfp_stream_set_reversible(stream);
    bitstream* bits = stream_open(buffer, size);
    zfp_stream_set_bit_stream(stream, bits);
    zfp_stream_rewind(stream);
    const size_t done = pack ? zfp_compress(stream, field) : zfp_decompress(stream, field);
    zfp_field_free(field);
    zfp_stream_close(stream);
    stream_close(bits);
    return done;
  }
  size_t pack_row(Buffer& values, Buffer& out, bool wide) const override {
    return run(values, out.data(), out.size(), wide, true);
  }
  bool unpack_row(Bytes packed, Buffer& values, bool wide) const override {
    Buffer copy(packed.begin(), packed.end());
    copy.resize(copy.size() + 64);  // zfp reads whole words
    return run(values, copy.data(), copy.size(), wide, false) != 0;
  }
};

class Fpzip final : public ByComponent {
 public:
  std::string name() const override { return "fpzip"; }

 private:
  size_t pack_row(Buffer& values, Buffer& out, bool wide) const override {
    FPZ* stream = fpzip_write_to_buffer(out.data(), out.size());
    describe(stream, values, wide);
    const size_t size = fpzip_write_header(stream) != 0 ? fpzip_write(stream, values.data()) : 0;
    fpzip_write_close(stream);
    return size;
  }
  bool unpack_row(Bytes packed, Buffer& values, bool wide) const override {
    FPZ* stream = fpzip_read_from_buffer(packed.data());
    const bool ok = fpzip_read_header(stream) != 0;
    describe(stream, values, wide);
    const bool read = ok && fpzip_read(stream, values.data()) != 0;
    fpzip_read_close(stream);
    return read;
  }
  static void describe(FPZ* stream, const Buffer& values, bool wide) {
    stream->type = wide ? FPZIP_TYPE_DOUBLE : FPZIP_TYPE_FLOAT;
    stream->prec = 0;  // all bits
    stream->nx = static_cast<int>(values.size() / (wide ? 8 : 4));
    stream->ny = stream->nz = stream->nf = 1;
  }
};

}  // namespace

void add_float_codecs(ArrayCodecs& codecs) {
  codecs.push_back(std::make_unique<Zfp>());
  codecs.push_back(std::make_unique<Fpzip>());
}

}  // namespace maille::bench
