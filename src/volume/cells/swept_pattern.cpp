#include "volume/cells/swept_pattern.h"

namespace maille {

SweptPattern::SweptPattern(const PatternPlan& plan, uint32_t number, uint32_t how)
    : id(number),
      signature(how),
      fresh(plan.fresh),
      known(plan.known),
      glued(plan.glued),
      final(plan.final),
      glues(plan.glues),
      first_fresh(plan.fresh == 0 ? uint8_t{0} : static_cast<uint8_t>(__builtin_ctz(plan.fresh))),
      several((plan.fresh & (plan.fresh - 1)) != 0),
      glue(plan.glue) {
  // A new corner takes the slot of a known one, so that loads by `from` are always valid; sweeps have a known
  // corner.
  from.fill({plan.corner[0].source, plan.corner[0].corner});
  for (unsigned k = 0; k < plan.corners; ++k) {
    from[plan.corner[k].own] = {plan.corner[k].source, plan.corner[k].corner};
    is_known[plan.corner[k].own] = ~uint64_t{0};
  }
  const CellShape& shape = cell_shapes[plan.kind];
  unsigned there = known;
  for (unsigned i = 0; i < shape.corners; ++i) {
    const unsigned at = shape.faces_at[i];
    ends |= uint64_t{final >> i & 1u} << (8 * i + 7);
    // Faces that are not glued open at the corner, and each glued one closes one that was open: at - 2 * (at
    // & glued).
    entered[i] = Hull::entry(static_cast<int>(bits_in(at)) - 2 * static_cast<int>(bits_in(at & glued)));
    if ((fresh >> i & 1) == 0) continue;
    // Backwards, so that the first parallelogram wins.
    for (unsigned j = shape.parallelograms[i]; j-- > 0;) {
      const auto& p = shape.parallelogram[i][j];
      if ((there >> p.a & there >> p.b & there >> p.opposite & 1) == 0) continue;
      expected[i] = p;
      expects = static_cast<uint8_t>(expects | 1u << i);
    }
    // A new corner counts as known for those behind it, as create_corners() has it.
    there |= 1u << i;
  }
}

}  // namespace maille
