#include "options.h"

#include "guard.h"

#include <cmath>

namespace maille::c {
namespace {

/// A callback of C as a function of the library. It returns 0 to go on.
Progress told(maille_progress progress, void* user) {
  if (!progress) return {};
  return [progress, user](const ProgressReport& report) {
    try {
      return progress(user, report.stage, report.fraction) == 0;
    } catch (...) {
      return false;  // the job ends, as cancelled
    }
  };
}

template <class Options>
Result<> set_threads(Options& options, uint32_t threads) {
  // The options own the threads, which live as long as they do; 0 is the number of processors.
  options.executor = threads == 1 ? nullptr : thread_executor(threads);
  options.options.executor = options.executor.get();
  return {};
}

template <class Options>
Result<std::unique_ptr<Options>> make_options() {
  return std::make_unique<Options>();
}

/// Whether a value fits a kind of bound at all; what an array makes of it is the encoder's to say.
Result<Tolerance> bound_of(int32_t kind, double value) {
  const auto chosen_kind = chosen<Tolerance::Kind>(kind, Tolerance::kind_count, "the kind of bound");
  if (!chosen_kind) return tl::unexpected(chosen_kind.error());
  const bool sensible = *chosen_kind == Tolerance::Kind::lossless || (std::isfinite(value) && value >= 0);
  if (!sensible) return failure(ErrorCode::usage, "a bound is a finite number that is not negative");
  return Tolerance{*chosen_kind, value};
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_encode_options* maille_encode_options_create(maille_error* error) {
  return make(error, {}, [] { return make_options<maille_encode_options>(); });
}
void maille_encode_options_free(maille_encode_options* options) {
  delete options;
}

int32_t maille_encode_options_set_mode(maille_encode_options* options, int32_t mode, maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    if (mode == MAILLE_USUAL) {
      options->options.mode.reset();
      return {};
    }
    const auto value = chosen<Mode>(mode, 3, "the mode");
    if (!value) return tl::unexpected(value.error());
    options->options.mode = *value;
    return {};
  });
}

int32_t maille_encode_options_set_effort(maille_encode_options* options, int32_t effort,
                                         maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    if (effort < 1 || effort > 9) return wrong("effort is 1 to 9, not " + std::to_string(effort));
    options->options.effort = effort;
    return {};
  });
}

int32_t maille_encode_options_set_keep_order(maille_encode_options* options, int32_t keep,
                                             maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    options->options.order = keep != 0 ? Order::keep : Order::canonical;
    return {};
  });
}

int32_t maille_encode_options_set_bound(maille_encode_options* options, const char* array, int32_t kind,
                                        double value, maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    const auto bound = bound_of(kind, value);
    if (!bound) return tl::unexpected(bound.error());
    (array ? options->options.arrays[array] : options->options.positions) = *bound;
    return {};
  });
}

int32_t maille_encode_options_set_part_cells(maille_encode_options* options, uint64_t cells,
                                             maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    options->options.most_cells_per_part.reset();
    if (cells != 0) options->options.most_cells_per_part = cells;
    return {};
  });
}

int32_t maille_encode_options_set_threads(maille_encode_options* options, uint32_t threads,
                                          maille_error* error) {
  return run(error, {{options, "options"}}, [&] { return set_threads(*options, threads); });
}

int32_t maille_encode_options_set_progress(maille_encode_options* options, maille_progress progress,
                                           void* user, maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    options->options.progress = told(progress, user);
    return {};
  });
}

int32_t maille_encode_options_set_time(maille_encode_options* options, double time, maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    if (std::isinf(time)) return wrong("a time is finite, or NaN for none");
    options->options.time.reset();
    if (!std::isnan(time)) options->options.time = time;
    return {};
  });
}

int32_t maille_encode_options_set_provenance(maille_encode_options* options, const char* given,
                                             maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    options->options.provenance = text(given);
    return {};
  });
}

maille_decode_options* maille_decode_options_create(maille_error* error) {
  return make(error, {}, [] { return make_options<maille_decode_options>(); });
}
void maille_decode_options_free(maille_decode_options* options) {
  delete options;
}

int32_t maille_decode_options_set_memory(maille_decode_options* options, uint64_t bytes,
                                         maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    options->options.limits.mesh_bytes = bytes;
    return {};
  });
}

int32_t maille_decode_options_set_arrays(maille_decode_options* options, const char* const* names,
                                         uint64_t count, maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    options->options.arrays.reset();
    if (!names) return {};
    std::vector<std::string> wanted;
    for (uint64_t i = 0; i < count; ++i) {
      if (!names[i]) return wrong("names[" + std::to_string(i) + "] is NULL");
      wanted.emplace_back(names[i]);
    }
    options->options.arrays = std::move(wanted);
    return {};
  });
}

int32_t maille_decode_options_set_step(maille_decode_options* options, uint64_t step, maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    options->options.step = step;
    return {};
  });
}

int32_t maille_decode_options_set_threads(maille_decode_options* options, uint32_t threads,
                                          maille_error* error) {
  return run(error, {{options, "options"}}, [&] { return set_threads(*options, threads); });
}

int32_t maille_decode_options_set_progress(maille_decode_options* options, maille_progress progress,
                                           void* user, maille_error* error) {
  return run(error, {{options, "options"}}, [&]() -> Result<> {
    options->options.progress = told(progress, user);
    return {};
  });
}
