#include "entropy/byte_model.h"

#include <algorithm>
#include <array>
#include <memory>

#include "entropy/bit_model.h"
#include "entropy/rans.h"

namespace maille {
namespace {

template <class Coder>
class ByteModel {
 public:
  explicit ByteModel(Coder& coder) : coder_(coder) {}

  std::byte code(std::byte byte) {
    // A tree per byte before; short texts meet few of the 256.
    std::unique_ptr<Tree>& tree = trees_[before_];
    if (!tree) tree = std::make_unique<Tree>();
    unsigned node = 1;
    for (int bit = 7; bit >= 0; --bit) {
      const bool set = (static_cast<unsigned>(byte) >> bit & 1) != 0;
      node = node << 1 | static_cast<unsigned>((*tree)[node].code(coder_, set));
    }
    before_ = node & 0xff;
    return static_cast<std::byte>(before_);
  }

 private:
  using Tree = std::array<BitModel, 256>;

  Coder& coder_;
  std::array<std::unique_ptr<Tree>, 256> trees_;
  unsigned before_ = 0;
};

}  // namespace

std::vector<std::byte> encode_bytes(Bytes bytes) {
  RansEncoder encoder;
  ByteModel<RansEncoder> model(encoder);
  for (const std::byte byte : bytes) model.code(byte);
  std::vector<std::byte> coded = encoder.finish();
  coded.resize(std::max<size_t>(coded.size(), bytes.size() / most_bytes_per_coded_byte));
  return coded;
}

std::vector<std::byte> decode_bytes(Bytes coded, uint64_t size) {
  std::vector<std::byte> bytes;
  if (coded.size() < size / most_bytes_per_coded_byte) return bytes;
  RansDecoder decoder(coded);
  ByteModel<RansDecoder> model(decoder);
  while (bytes.size() < size && !decoder.exhausted()) bytes.push_back(model.code({}));
  // The byte in which the sequence ended is partly made up.
  if (decoder.exhausted()) bytes.pop_back();
  return bytes;
}

}  // namespace maille
