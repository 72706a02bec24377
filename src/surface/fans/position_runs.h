#pragma once

// Points of a patch through the coder, as an encoder that has choices needs it.

#include <memory>
#include <optional>

#include "surface/fans/position_writer.h"

namespace maille::positions {

/// One patch while its positions are coded.
struct Patch {
  const FanSurface* fans;
  Codes codes;
  std::optional<ElementPlaces> places = {};  ///< not of positions

  uint32_t size() const { return static_cast<uint32_t>(codes.size()); }
};

/// What residuals of points would be.
struct Measured {
  struct OfCentre {
    std::array<std::array<uint32_t, 66>, most_components> lengths{};  ///< by component
    std::array<uint32_t, 128> octaves{};                              ///< of how far predictions lie apart
    uint64_t bits() const;                                            ///< the sum of lengths
  };
  std::array<OfCentre, 2> by_centre;
  /// Numbers that a point before or a parallelogram has, too, and all that were looked at.
  uint64_t repeated = 0, all = 0;

  const OfCentre& of(Centre centre) const { return by_centre[static_cast<size_t>(centre)]; }
};

/// All points through the coder, or a sample for a trial. One object codes any number of times, and keeps its
/// points between samples. Not for several threads at once.
class Runs {
 public:
  /// `patch` stays where it is.
  static std::unique_ptr<Runs> make(const Patch& patch, const Bias& bias, std::span<const NumberMap> maps,
                                    Scalar type, bool wide);
  virtual ~Runs() = default;
  /// As a decoder meets them.
  virtual void all(const Coding& coding, Writer& writer) = 0;
  /// Those that choices are made by, in pieces that are evenly spread. Returns how many there were.
  virtual uint32_t sample(const Coding& coding, Writer& writer) = 0;
  /// The same ones, by rows and placement of a coding.
  virtual Measured measure(const Coding& coding) = 0;
  /// Is the sample everything?
  virtual bool is_small() const = 0;
};

}  // namespace maille::positions
