# For WebAssembly the core alone.
include(cmake/debian_headers.cmake)
maille_debian_headers(tl xxhash.h)

# Sizes of 64 bits are checked against Limits before they become sizes of memory. With -msse2 emscripten has SSE2's
# intrinsics in SIMD of WebAssembly: the same lanes as natively.
add_compile_options(-fno-exceptions -fno-rtti -msimd128 -msse2 -Wno-shorten-64-to-32 -Wno-sign-conversion)

# Preset wasm compiles for size (-Oz; without -finline-functions emscripten 3.1.6 leaves inlining to its linker, and that
# makes code twice as large). What runs for each triangle or cell is compiled for speed.
set(maille_fast_on_web
  surface/fans/fast_fans.cpp surface/fans/positions_decoder.cpp entropy/mixing.cpp surface/gluing.cpp numbers/octahedral.cpp
  surface/arrays/corner_faces.cpp surface/arrays/normal_arrays.cpp surface/arrays/stencil.cpp
  surface/arrays/surface_normals.cpp surface/arrays/twin_coder.cpp
  surface/front/mixed_array.cpp surface/front/position_predictor.cpp volume/cells/cell_coder.cpp volume/cells/cell_coder_corners.cpp
  volume/cells/cell_coder_slow.cpp volume/values/mixed_values.cpp volume/values/tuple_values.cpp
  volume/cells/patterns.cpp volume/stream/stream_reader.cpp)

# Files that only encoders, writers and tools use are left out: what links one of them by accident does not link.
set(maille_left_out
  "base/(append_sink|opened_file|region_file|scratch_file|sink|unfinished|unmapped_source|version)"
  "base/posix/(open_within|pending_file|unfinished)"
  "mesh/compare"
  "(theory|generate|random/build)/"
  "random/read/(component_walk|nearest_points)"
  "container/(file_writer|verify)"
  "surface/(fans/(fit_shear|position_choice|position_runs|position_writer|positions_encoder|repeated_values)|parts/partition)"
  "volume/order/(delay_buffer|last_uses|reordered_source)"
  "volume/ranks/"
  "volume/pieces/(bisection|cell_merger|mesh_spool|packed_cells|pieces_to_sink|point_sharing|scratch_lists|shared_numbers|source_pieces)"
  "volume/stream/(append_step|mesh_stream|remove_step|source_|step_partners|step_writer|stream_file_encoder|stream_writer)")
