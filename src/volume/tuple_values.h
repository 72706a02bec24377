#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/rans.h"
#include "entropy/residual_model.h"
#include "predict/online_least_squares.h"
#include "volume/number_space.h"
#include "volume/point_stencil.h"

namespace maille {

/// One array of a stream: what its numbers are, and how far they may be off.
struct StreamedArray {
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  std::vector<NumberMap> maps;  ///< one per component
  double bound = 0;             ///< largest error allowed; 0: the same bits

  size_t tuple_size() const { return size_of(type) * components; }
};

/// About what a coder of the array takes before it has met any number: a description could ask for thousands.
uint64_t tuple_coder_bytes(const StreamedArray& array);

/// The numbers of one array, tuple after tuple, each predicted from those of points or cells in memory. Both
/// directions; the values in memory are in slots, as those of the hull are. `Bits`: 32, or 64 for types of
/// eight bytes.
template <class Coder, unsigned Bits>
class TupleValueCoder {
 public:
  static constexpr bool encoding = Coder::encoding;

  explicit TupleValueCoder(const StreamedArray& array);

  static unsigned lanes_of(const StreamedArray& array) { return array.components < 3 ? array.components : 3; }

  /// One tuple: what the stencil suggests, then the difference. It goes to `slot`.
  void code(Coder& coder, const PointStencil& stencil, uint32_t slot, std::byte* tuple);
  /// A hint that the value in a slot is wanted soon: those of the last layer are far away.
  void prefetch(uint32_t slot) const {
    const size_t at = size_t{slot} * components_;
    if (at < values_.size()) __builtin_prefetch(&values_[at]);
  }

 private:
  static constexpr unsigned most_candidates = 4;
  struct Value {
    double place = 0;
    float twist = 0;   ///< of points whose cell had all other corners: what the stencil's first sum missed
    int16_t size = 0;  ///< half octaves of the residual, in units of the place
  };
  /// How well each candidate has done lately in a situation, in 1/16 half octaves, and how large residuals
  /// were.
  struct Record {
    std::array<int32_t, most_candidates> miss{};
  };
  struct Expectation {
    std::array<double, most_candidates> candidate;
    unsigned count = 0;
    double base = 0;
    OnlineLeastSquares<8>::Features twists;  ///< if the stencil is full
  };

  Value& value(uint32_t slot, unsigned component) { return values_[size_t{slot} * components_ + component]; }
  Expectation expect(const PointStencil& stencil, unsigned component);
  unsigned choose(const Expectation& expectation, const Record& record) const;
  ResidualContext context_of(const PointStencil& stencil, unsigned component, double place);
  /// Up to three components at a time: what does not depend on the coder is done for all of them first, so
  /// that a processor can do it at once.
  struct Number {
    Expectation expectation;
    Record* record;
    ResidualContext context;
    double expected;
    int64_t guess;
    int64_t residual;
    unsigned length;
    bool exception;
  };
  static constexpr unsigned group_size = 3;
  void code_group(Coder& coder, const PointStencil& stencil, unsigned first, unsigned count, uint32_t slot,
                  std::byte* numbers);
  void prepare(Coder& coder, const PointStencil& stencil, unsigned component, const std::byte* bytes,
               Number& number);
  void finish(const PointStencil& stencil, unsigned component, uint32_t slot, std::byte* bytes,
              Number& number);
  bool code_exception(Coder& coder, unsigned component, const std::byte* number);
  void code_bits(Coder& coder, std::byte* bytes);
  void learn(const PointStencil& stencil, const Expectation& expectation, unsigned component, double place,
             Record& record);
  bool keeps(unsigned component, const std::byte* number) const;

  StreamedArray array_;
  unsigned components_;
  std::vector<NumberSpace> spaces_;
  std::vector<Value> values_;
  std::vector<double> last_;
  std::vector<int> last_size_;
  std::vector<Record> records_;              ///< by component and situation
  std::vector<OnlineLeastSquares<8>> fits_;  ///< by component and corner
  ResidualModel<Bits> residuals_;
  std::vector<BitModel> exceptions_;
  uint32_t samples_ = 0;
};

}  // namespace maille
