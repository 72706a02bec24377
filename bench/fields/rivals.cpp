// Cells have no grid that other codecs could use, so each component is one row in the order of the file.
#include "rivals.h"

#include <lzma.h>
#include <zfp.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace maille::bench {
namespace {

using Buffer = std::vector<uint8_t>;

size_t size_with_zstd(const Buffer& bytes) {
  Buffer out(ZSTD_compressBound(bytes.size()));
  return ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 19);
}
size_t size_with_xz(const Buffer& bytes) {
  Buffer out(lzma_stream_buffer_bound(bytes.size()));
  size_t size = 0;
  const lzma_ret done = lzma_easy_buffer_encode(9, LZMA_CHECK_NONE, nullptr, bytes.data(), bytes.size(),
                                                out.data(), &size, out.size());
  return done == LZMA_OK ? size : out.size();
}

double as_stored(double value, bool wide) {
  return wide ? value : static_cast<double>(static_cast<float>(value));
}

// ---- zfp, its own rate for the accuracy

template <class Number>
Packed zfp_row(const std::vector<double>& row, double bound) {
  std::vector<Number> values(row.begin(), row.end());
  Packed packed;
  zfp_stream* stream = zfp_stream_open(nullptr);
  const zfp_type type = sizeof(Number) == 8 ? zfp_type_double : zfp_type_float;
  zfp_field* field = zfp_field_1d(values.data(), type, values.size());
  zfp_stream_set_accuracy(stream, bound);
  Buffer buffer(zfp_stream_maximum_size(stream, field));
  bitstream* bits = stream_open(buffer.data(), buffer.size());
  zfp_stream_set_bit_stream(stream, bits);
  zfp_stream_rewind(stream);
  packed.bytes = zfp_compress(stream, field);
  zfp_stream_rewind(stream);
  zfp_decompress(stream, field);
  for (size_t i = 0; i < row.size(); ++i)
    packed.largest_error = std::max(packed.largest_error, std::fabs(static_cast<double>(values[i]) - row[i]));
  zfp_field_free(field);
  zfp_stream_close(stream);
  stream_close(bits);
  return packed;
}

Packed with_zfp(const Rows& field, double bound) {
  Packed all;
  for (const auto& row : field.rows) {
    const Packed one = field.wide ? zfp_row<double>(row, bound) : zfp_row<float>(row, bound);
    all.bytes += one.bytes;
    all.largest_error = std::max(all.largest_error, one.largest_error);
  }
  return all;
}

// ---- SZ: what is left of a prediction from decoded values, in steps of twice the bound; then zstd

/// Codes of two bytes; what they do not hold stands as it is.
class Quantizer {
 public:
  Quantizer(const std::vector<double>& row, double bound, bool wide)
      : row_(row), decoded_(row.size()), bound_(bound), wide_(wide) {}
  double decoded(size_t i) const { return decoded_[i]; }
  void code(size_t i, double predicted) {
    const double steps = std::floor((row_[i] - predicted) / (2 * bound_) + 0.5);
    const double back = as_stored(predicted + steps * 2 * bound_, wide_);
    if (std::fabs(steps) < 32767 && std::fabs(back - row_[i]) <= bound_) {
      put(codes_, static_cast<uint16_t>(static_cast<int>(steps) + 32768));
      decoded_[i] = back;
      largest_ = std::max(largest_, std::fabs(back - row_[i]));
      return;
    }
    put(codes_, uint16_t{0});
    decoded_[i] = row_[i];
    if (wide_) {
      put(raw_, row_[i]);
    } else {
      put(raw_, static_cast<float>(row_[i]));
    }
  }
  Packed finish() const { return {size_with_zstd(codes_) + size_with_zstd(raw_), largest_}; }

 private:
  template <class T>
  static void put(Buffer& out, T value) {
    uint8_t bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    out.insert(out.end(), bytes, bytes + sizeof(T));
  }
  const std::vector<double>& row_;
  std::vector<double> decoded_;
  Buffer codes_, raw_;
  double bound_, largest_ = 0;
  bool wide_;
};

Packed with_lorenzo(const std::vector<double>& row, double bound, bool wide) {
  Quantizer quantizer(row, bound, wide);
  for (size_t i = 0; i < row.size(); ++i) quantizer.code(i, i == 0 ? 0 : quantizer.decoded(i - 1));
  return quantizer.finish();
}
/// Values half way between known ones, ever closer; cubic where there are four.
Packed with_interpolation(const std::vector<double>& row, double bound, bool wide) {
  Quantizer quantizer(row, bound, wide);
  const size_t count = row.size();
  size_t stride = 1;
  while (stride < count) stride *= 2;
  if (count > 0) quantizer.code(0, 0);
  for (; stride >= 2; stride /= 2) {
    const size_t half = stride / 2;
    for (size_t i = half; i < count; i += stride) {
      const double a = quantizer.decoded(i - half);
      double predicted = a;
      if (i + half < count) {
        const double b = quantizer.decoded(i + half);
        predicted = (a + b) / 2;
        if (i >= 3 * half && i + 3 * half < count)
          predicted = (9 * (a + b) - quantizer.decoded(i - 3 * half) - quantizer.decoded(i + 3 * half)) / 16;
      }
      quantizer.code(i, predicted);
    }
  }
  return quantizer.finish();
}
Packed like_sz(const Rows& field, double bound) {
  Packed all;
  for (const auto& row : field.rows) {
    const Packed one = with_lorenzo(row, bound, field.wide);
    const Packed other = with_interpolation(row, bound, field.wide);
    const Packed& best = one.bytes < other.bytes ? one : other;
    all.bytes += best.bytes;
    all.largest_error = std::max(all.largest_error, best.largest_error);
  }
  return all;
}

// ---- codes of a lattice, as they are or as first or second differences, in planes of bytes

Packed on_lattice(const Rows& field, double bound, size_t (*pack)(const Buffer&)) {
  Packed all;
  for (const auto& row : field.rows) {
    std::vector<int64_t> codes(row.size());
    for (size_t i = 0; i < row.size(); ++i) {
      codes[i] = static_cast<int64_t>(std::floor(row[i] / (2 * bound) + 0.5));
      const double back = as_stored(static_cast<double>(codes[i]) * 2 * bound, field.wide);
      all.largest_error = std::max(all.largest_error, std::fabs(back - row[i]));
    }
    size_t least = SIZE_MAX;
    for (int order = 0; order <= 2; ++order) {
      if (order > 0) {
        for (size_t i = codes.size(); i-- > 1;)
          codes[i] =
              static_cast<int64_t>(static_cast<uint64_t>(codes[i]) - static_cast<uint64_t>(codes[i - 1]));
      }
      Buffer planes;
      for (unsigned plane = 0; plane < 8; ++plane) {
        for (const int64_t code : codes) {
          const uint64_t zigzag = static_cast<uint64_t>(code) << 1 ^ (code < 0 ? ~uint64_t{0} : 0);
          planes.push_back(static_cast<uint8_t>(zigzag >> 8 * plane));
        }
      }
      least = std::min(least, pack(planes));
    }
    all.bytes += least;
  }
  return all;
}

}  // namespace

const std::vector<Rival>& rivals() {
  static const std::vector<Rival> all = {
      {"zfp", with_zfp},
      {"SZ-like", like_sz},
      {"lattice + zstd",
       [](const Rows& field, double bound) { return on_lattice(field, bound, size_with_zstd); }},
      {"lattice + xz",
       [](const Rows& field, double bound) { return on_lattice(field, bound, size_with_xz); }},
  };
  return all;
}

}  // namespace maille::bench
