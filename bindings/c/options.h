#pragma once

#include <maille.h>

#include <maille/decode.h>
#include <maille/encode.h>
#include <memory>

struct maille_encode_options {
  maille::EncodeOptions options;
  std::unique_ptr<maille::Executor> executor;  ///< of `options`
};

struct maille_decode_options {
  maille::DecodeOptions options;
  std::unique_ptr<maille::Executor> executor;  ///< of `options`
};

namespace maille::c {

inline EncodeOptions options_of(const maille_encode_options* options) {
  return options ? options->options : EncodeOptions();
}
inline DecodeOptions options_of(const maille_decode_options* options) {
  return options ? options->options : DecodeOptions();
}

}  // namespace maille::c
