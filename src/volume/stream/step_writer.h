#pragma once

#include <maille/stream.h>

#include <vector>

#include "container/file_reader.h"
#include "container/file_writer.h"
#include "volume/stream/step_partners.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// Codes the values of step `number` behind the cells, which are decoded once more for that (CellReplay).
/// `partners`: what compare_with_earlier() found. The header of the step is written last, as it has the
/// errors: a step that was cut off is not there for a reader. Errors: corrupt, those of `values`,
/// write_failed.
Result<StepReport> write_step(const FileReader& file, const StreamHeader& mesh, StepHeader& step,
                              uint64_t number, const std::vector<Partner>& partners, StepSource& values,
                              const StepOptions& options, FileWriter writer);

}  // namespace maille
