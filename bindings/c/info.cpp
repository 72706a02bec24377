#include "bytes.h"
#include "guard.h"
#include "mesh.h"

#include <maille/file.h>

#include <cmath>

struct maille_info {
  maille::FileInfo info;
  std::vector<maille::FileTime> times;
};

namespace maille::c {
namespace {

const ArrayInfo* array_of(const maille_info* info, uint64_t array) {
  if (!info) return nullptr;
  return array == MAILLE_POSITIONS ? &info->info.positions : at(info->info.arrays, array);
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_info* maille_inspect(const maille_source* source, maille_error* error) {
  return make(error, {{source, "source"}}, [&]() -> Result<std::unique_ptr<maille_info>> {
    auto info = inspect(*source->source);
    if (!info) return passed_on(std::move(info));
    auto made = std::make_unique<maille_info>();
    made->info = std::move(*info);
    made->times = times_of(made->info);
    return made;
  });
}
void maille_info_free(maille_info* info) {
  delete info;
}

int32_t maille_info_mode(const maille_info* info) {
  return info ? static_cast<int32_t>(info->info.mode) : -1;
}
int32_t maille_info_effort(const maille_info* info) {
  return info ? info->info.effort : 0;
}
int32_t maille_info_keeps_order(const maille_info* info) {
  return info && info->info.order == Order::keep ? 1 : 0;
}
uint64_t maille_info_file_bytes(const maille_info* info) {
  return info ? info->info.file_bytes : 0;
}
uint64_t maille_info_points(const maille_info* info) {
  return info ? info->info.points : 0;
}
uint64_t maille_info_cells(const maille_info* info) {
  return info ? info->info.cells : 0;
}
uint64_t maille_info_blocks(const maille_info* info) {
  return info ? info->info.blocks.size() : 0;
}
const char* maille_info_block_name(const maille_info* info, uint64_t block) {
  const auto* const found = info ? at(info->info.blocks, block) : nullptr;
  return found ? found->first.c_str() : nullptr;
}
uint64_t maille_info_block_cells(const maille_info* info, uint64_t block) {
  const auto* const found = info ? at(info->info.blocks, block) : nullptr;
  return found ? found->second : 0;
}

uint64_t maille_info_arrays(const maille_info* info) {
  return info ? info->info.arrays.size() : 0;
}
const char* maille_info_array_name(const maille_info* info, uint64_t array) {
  const ArrayInfo* const found = array_of(info, array);
  return found ? found->name.c_str() : nullptr;
}
int32_t maille_info_array_domain(const maille_info* info, uint64_t array) {
  const ArrayInfo* const found = array_of(info, array);
  return found ? static_cast<int32_t>(found->domain) : -1;
}
int32_t maille_info_array_type(const maille_info* info, uint64_t array) {
  const ArrayInfo* const found = array_of(info, array);
  return found ? static_cast<int32_t>(found->type) : -1;
}
uint32_t maille_info_array_components(const maille_info* info, uint64_t array) {
  const ArrayInfo* const found = array_of(info, array);
  return found ? found->components : 0;
}
uint64_t maille_info_array_bytes(const maille_info* info, uint64_t array) {
  const ArrayInfo* const found = array_of(info, array);
  return found ? found->coded_bytes : 0;
}
double maille_info_array_bound(const maille_info* info, uint64_t array) {
  const ArrayInfo* const found = array_of(info, array);
  return found ? found->bound : 0;
}
int32_t maille_info_array_range(const maille_info* info, uint64_t array, uint32_t component, double* low,
                                double* high) {
  const ArrayInfo* const found = array_of(info, array);
  const auto* const range = found ? at(found->ranges, component) : nullptr;
  if (!range) return 0;
  if (low) *low = range->first;
  if (high) *high = range->second;
  return 1;
}

uint64_t maille_info_steps(const maille_info* info) {
  return info ? info->info.steps.size() : 0;
}
double maille_info_step_time(const maille_info* info, uint64_t step) {
  const StepInfo* const found = info && step > 0 ? at(info->info.steps, step - 1) : nullptr;
  return found ? found->time : 0;
}
uint64_t maille_info_times(const maille_info* info) {
  return info ? info->times.size() : 0;
}
double maille_info_time(const maille_info* info, uint64_t i, uint64_t* step) {
  const FileTime* const found = info ? at(info->times, i) : nullptr;
  if (step) *step = found ? found->step : 0;
  return found ? found->time : std::nan("");
}
uint64_t maille_info_cell_types(const maille_info* info) {
  return info ? info->info.types.size() : 0;
}
int32_t maille_info_cell_type(const maille_info* info, uint64_t i, uint64_t* cells) {
  const auto* const found = info ? at(info->info.types, i) : nullptr;
  if (cells) *cells = found ? found->second : 0;
  return found ? static_cast<int32_t>(found->first) : -1;
}
uint64_t maille_info_levels(const maille_info* info) {
  return info ? info->info.faces_of_level.size() : 0;
}
uint64_t maille_info_level_faces(const maille_info* info, uint64_t level) {
  const uint64_t* const faces = info ? at(info->info.faces_of_level, level) : nullptr;
  return faces ? *faces : 0;
}
double maille_info_level_bound(const maille_info* info, uint64_t level) {
  const double* const bound = info ? at(info->info.bound_of_level, level) : nullptr;
  return bound ? *bound : 0;
}
uint64_t maille_info_problems(const maille_info* info) {
  return info ? info->info.problems.size() : 0;
}
const char* maille_info_problem(const maille_info* info, uint64_t i) {
  const std::string* const problem = info ? at(info->info.problems, i) : nullptr;
  return problem ? problem->c_str() : nullptr;
}
