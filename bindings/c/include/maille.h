/* maille: compressed meshes of any size, any part of them within reach. The library for C, and for all that
 * speaks C.
 *
 * A program that compresses and brings back: examples/c/roundtrip.c. A tour: docs/c.md.
 *
 * Objects are opaque: what *_create, *_open and all functions that give a pointer to an object make is given
 * back by the *_free of its type, which takes NULL. Objects that others were given (a source, a sink,
 * options) must live as long as these use them; each function says where that is longer than the call.
 *
 * Errors: functions that do something give a MAILLE_... code, MAILLE_OK where all went well; functions that
 * make an object give NULL where they could not. `error`, which may be NULL, then has the code and a sentence
 * that a user can act on; it is left alone where nothing went wrong. NULL for an object that is not optional
 * is MAILLE_USAGE, never a crash. Functions that only look at an object give 0, NULL or an empty list for a
 * number that is out of range.
 *
 * Strings are UTF-8 and end with a zero. Strings and numbers that a function points to belong to its object:
 * they stay until it is freed or changed. What is passed in is copied, except where a function says that it
 * borrows.
 *
 * Threads: functions may run in several threads at once, each with objects of its own. A mesh, a source,
 * options and what maille_inspect() gave may be read by several at once as long as none changes them. The
 * library starts threads only where
 * *_set_threads asks for them; results never depend on their number. After fork() make new options in the
 * child.
 *
 * Callbacks get the `user` they were given with. They must return: no exception, no longjmp. (An exception of
 * C++ that reaches the library is an error of the call, no crash.)
 *
 * The functions here are kept: a program goes on running with every libmaille.so.0 that is newer than the one
 * it was linked with. maille_abi_version() tells how far a library goes.
 */
#ifndef MAILLE_H
#define MAILLE_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32) || !defined(__GNUC__)
#define MAILLE_API
#else
#define MAILLE_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Numbers that stand for something. All are int32_t where they are passed. ---- */

/** What went wrong: the exit codes of the command, and MAILLE_INTERNAL. */
enum {
  MAILLE_OK = 0,
  MAILLE_DIFFERS = 1,         /**< a comparison found a difference */
  MAILLE_USAGE = 2,           /**< arguments that contradict each other or make no sense */
  MAILLE_CANNOT_READ = 3,     /**< the input is missing or unreadable */
  MAILLE_MALFORMED_INPUT = 4, /**< a foreign file, or a mesh, breaks its own rules */
  MAILLE_UNSUPPORTED = 5,     /**< needs another maille, or a feature that does not exist */
  MAILLE_CORRUPT = 6,         /**< a .maille file is damaged */
  MAILLE_MEMORY_BOUND = 7,    /**< not within the memory allowed, or there is */
  MAILLE_ERROR_BOUND = 8,     /**< an error bound that cannot be kept */
  MAILLE_WRITE_FAILED = 9,    /**< the output could not be written */
  MAILLE_NETWORK = 10,        /**< a web server failed */
  MAILLE_INTERNAL = 70,       /**< an exception where there should be none: please report it */
  MAILLE_CANCELLED = 130      /**< the caller's progress function asked to stop */
};

/** Type of one number. */
enum {
  MAILLE_I8 = 0,
  MAILLE_U8 = 1,
  MAILLE_I16 = 2,
  MAILLE_U16 = 3,
  MAILLE_I32 = 4,
  MAILLE_U32 = 5,
  MAILLE_I64 = 6,
  MAILLE_U64 = 7,
  MAILLE_F32 = 8,
  MAILLE_F64 = 9
};

/** What the tuples of an array belong to. */
enum {
  MAILLE_POINT = 0,  /**< one tuple for each point */
  MAILLE_CORNER = 1, /**< one for each entry of the connectivity, blocks one after the other */
  MAILLE_CELL = 2,   /**< one for each cell, blocks one after the other */
  MAILLE_MESH = 3    /**< any number of tuples, of the mesh as a whole */
};

/** What an array means. */
enum {
  MAILLE_NO_ROLE = 0,
  MAILLE_NORMAL = 1,
  MAILLE_COLOUR = 2,
  MAILLE_TEXTURE_COORDINATE = 3,
  MAILLE_TANGENT = 4,
  MAILLE_LABEL = 5 /**< the value v stands for the v-th of maille_array_label() */
};

/** Cell types have the numbers of VTK, and its order of nodes: 5 triangle, 7 polygon, 9 quad, 10 tetrahedron,
 * 12 hexahedron, 13 wedge, 14 pyramid, 42 polyhedron, 21 to 37 quadratic, 68 to 74 Lagrange ... */
enum {
  MAILLE_TRIANGLE = 5,
  MAILLE_POLYGON = 7,
  MAILLE_QUAD = 9,
  MAILLE_TETRAHEDRON = 10,
  MAILLE_HEXAHEDRON = 12,
  MAILLE_WEDGE = 13,
  MAILLE_PYRAMID = 14,
  MAILLE_POLYHEDRON = 42,
  MAILLE_MIXED = 255 /**< one type for each cell */
};

/** What a file is for. */
enum {
  MAILLE_USUAL = -1, /**< stream for meshes with solids, else single */
  MAILLE_SINGLE = 0, /**< the smallest file */
  MAILLE_STREAM = 1, /**< little memory on both sides, time steps, pieces */
  MAILLE_RANDOM = 2  /**< surfaces: any region at any level of detail */
};

/** How far decoded values may be from the original ones, with a value x. */
enum {
  MAILLE_LOSSLESS = 0, /**< bit for bit */
  MAILLE_ABSOLUTE = 1, /**< each component within x, in units of the file */
  MAILLE_RELATIVE =
      2,           /**< absolute: x times the diagonal of the box (positions), or the range of the values */
  MAILLE_BITS = 3, /**< a lattice of 2^x steps over the longest side, or the range */
  MAILLE_NORM = 4, /**< the length of the difference of tuples within x */
  MAILLE_PSNR = 5, /**< peak signal to noise ratio of at least x decibels */
  MAILLE_POINTWISE = 6 /**< each value within x times itself; mode stream */
};

/** Memory that is handed over: MAILLE_COPY takes a copy; MAILLE_BORROW reads where it lies, without a copy,
 * so it must stay until the mesh, and meshes that were cut out of it, are freed. What changes there between
 * calls changes in the mesh. Numbers lie at a multiple of their size. */
enum { MAILLE_COPY = 0, MAILLE_BORROW = 1 };

/* ---- Versions and errors ---- */

/** Rises by one where functions are added. Now 1. */
MAILLE_API uint32_t maille_abi_version(void);
/** "major.minor.patch" of the library. */
MAILLE_API const char* maille_library_version(void);
/** Version of the file format that it writes. Either pointer may be NULL. */
MAILLE_API void maille_format_version(uint32_t* major, uint32_t* minor);

/** An error, for any number of calls one after the other. NULL: no memory. */
typedef struct maille_error maille_error;
MAILLE_API maille_error* maille_error_create(void);
MAILLE_API void maille_error_free(maille_error* error);
/** Of the last call that failed; MAILLE_OK before. */
MAILLE_API int32_t maille_error_code(const maille_error* error);
/** One sentence: which file, byte, cell or array; what was found; what to do. "" before the first error. */
MAILLE_API const char* maille_error_message(const maille_error* error);
/** Forgets it. */
MAILLE_API void maille_error_clear(maille_error* error);

/* ---- Where bytes come from and go to ---- */

/** Bytes that can be read at any offset. */
typedef struct maille_source maille_source;
/** Memory, which is borrowed until the source is freed. */
MAILLE_API maille_source* maille_source_memory(const void* bytes, uint64_t size, maille_error* error);
/** A file, mapped into memory; or what an address ("http://...", "https://...") has, fetched by ranges as
 * they are wanted. */
MAILLE_API maille_source* maille_source_open(const char* path_or_url, maille_error* error);
/** Fills `out` with the `size` bytes from `offset` on; 0, or any other number where that is not possible: the
 * call that asked then fails with MAILLE_CANNOT_READ. Called by several threads at once where several are
 * allowed. */
typedef int32_t (*maille_read_at)(void* user, uint64_t offset, void* out, uint64_t size);
/** `size` bytes that a function gives. `name` is what messages call it; may be NULL. */
MAILLE_API maille_source* maille_source_callbacks(uint64_t size, maille_read_at read_at, void* user,
                                                  const char* name, maille_error* error);
/** `size` bytes from `offset` on of another source, which must outlive this one: a .maille file inside
 * another file. */
MAILLE_API maille_source* maille_source_part(const maille_source* source, uint64_t offset, uint64_t size,
                                             maille_error* error);
MAILLE_API uint64_t maille_source_size(const maille_source* source);
MAILLE_API int32_t maille_source_read(const maille_source* source, uint64_t offset, void* out, uint64_t size,
                                      maille_error* error);
MAILLE_API void maille_source_free(maille_source* source);

/** Where bytes are written to, front to back. Each takes one file. */
typedef struct maille_sink maille_sink;
/** Memory: see maille_sink_bytes(). */
MAILLE_API maille_sink* maille_sink_memory(maille_error* error);
/** A file that appears whole or not at all. */
MAILLE_API maille_sink* maille_sink_file(const char* path, maille_error* error);
/** Takes bytes; 0, or any other number to fail with MAILLE_WRITE_FAILED. */
typedef int32_t (*maille_write)(void* user, const void* bytes, uint64_t size);
/** All was written. As above. */
typedef int32_t (*maille_commit)(void* user);
/** `commit` may be NULL. */
MAILLE_API maille_sink* maille_sink_callbacks(maille_write write, maille_commit commit, void* user,
                                              const char* name, maille_error* error);
/** What was written so far, by all kinds of sinks. */
MAILLE_API uint64_t maille_sink_size(const maille_sink* sink);
/** The bytes of a sink in memory, maille_sink_size() of them; NULL for others. They stay until the sink is
 * written to or freed. */
MAILLE_API const void* maille_sink_bytes(const maille_sink* sink);
MAILLE_API void maille_sink_free(maille_sink* sink);

/* ---- Meshes ---- */

/** Points, blocks of cells over them, and arrays. Below 2^32 points; any number of cells. */
typedef struct maille_mesh maille_mesh;
/** One without points. */
MAILLE_API maille_mesh* maille_mesh_create(maille_error* error);
MAILLE_API void maille_mesh_free(maille_mesh* mesh);

/** Positions: `count` points of 3 numbers of a type (MAILLE_F32 ...), one point after the other. `how`:
 * MAILLE_COPY or MAILLE_BORROW. Replaces what was there. */
MAILLE_API int32_t maille_mesh_set_points(maille_mesh* mesh, int32_t type, uint64_t count,
                                          const void* positions, int32_t how, maille_error* error);
/** A block of `cells` cells of one type behind those that are there. `connectivity`: numbers of points,
 * `entries` of them. `offsets`: NULL for types with a fixed number of nodes; else cells + 1 places in
 * `connectivity` where cells begin, the first 0, the last `entries`. `types`: for MAILLE_MIXED one for each
 * cell, else NULL. Polyhedra: see maille_mesh_set_faces(). `name` may be NULL. `how` is for all three. */
MAILLE_API int32_t maille_mesh_add_block(maille_mesh* mesh, const char* name, int32_t cell_type,
                                         uint64_t cells, const uint64_t* offsets,
                                         const uint32_t* connectivity, uint64_t entries, const uint8_t* types,
                                         int32_t how, maille_error* error);
/** The faces of the polyhedra of a block: `face_sizes`, the number of corners of each face, face after face;
 * `cell_faces`, one more than cells, where the cells' faces begin in it. The connectivity of a polyhedron are
 * the corners of its faces. */
MAILLE_API int32_t maille_mesh_set_faces(maille_mesh* mesh, uint64_t block, const uint32_t* face_sizes,
                                         uint64_t faces, const uint64_t* cell_faces, int32_t how,
                                         maille_error* error);
/** An array of `tuples` tuples of `components` numbers each; points, corners and cells have one tuple each.
 * Arrays of one domain have different names. */
MAILLE_API int32_t maille_mesh_add_array(maille_mesh* mesh, const char* name, int32_t domain, int32_t type,
                                         uint32_t components, uint64_t tuples, const void* values,
                                         int32_t role, int32_t how, maille_error* error);
/** One more name of a value of an array of MAILLE_LABEL. */
MAILLE_API int32_t maille_mesh_add_label(maille_mesh* mesh, uint64_t array, const char* label,
                                         maille_error* error);
/** A comment, a unit, the name of another file: key and value, in the order in which they were added. */
MAILLE_API int32_t maille_mesh_add_metadata(maille_mesh* mesh, const char* key, const char* value,
                                            maille_error* error);
/** Whether the mesh keeps its own rules: sizes, offsets, nodes of types, numbers of points.
 * MAILLE_MALFORMED_INPUT names block, cell or array. All functions that write check it themselves. */
MAILLE_API int32_t maille_mesh_validate(const maille_mesh* mesh, maille_error* error);

MAILLE_API uint64_t maille_mesh_points(const maille_mesh* mesh); /**< number of points */
MAILLE_API uint64_t maille_mesh_cells(const maille_mesh* mesh);  /**< of all blocks */
MAILLE_API uint64_t
maille_mesh_corners(const maille_mesh* mesh); /**< entries of the connectivity of all blocks */
MAILLE_API int32_t maille_mesh_position_type(const maille_mesh* mesh); /**< MAILLE_F32 ... */
/** 3 numbers for each point, in place. */
MAILLE_API const void* maille_mesh_positions(const maille_mesh* mesh);

MAILLE_API uint64_t maille_mesh_blocks(const maille_mesh* mesh); /**< number of blocks */
MAILLE_API const char* maille_block_name(const maille_mesh* mesh, uint64_t block);
MAILLE_API int32_t maille_block_type(const maille_mesh* mesh, uint64_t block); /**< -1: no such block */
MAILLE_API uint64_t maille_block_cells(const maille_mesh* mesh, uint64_t block);
/** Lists of a block, in place, as maille_mesh_add_block() and maille_mesh_set_faces() take them; `count`,
 * which may be NULL, becomes their length. NULL and 0 where the type needs none. */
MAILLE_API const uint32_t* maille_block_connectivity(const maille_mesh* mesh, uint64_t block,
                                                     uint64_t* count);
MAILLE_API const uint64_t* maille_block_offsets(const maille_mesh* mesh, uint64_t block, uint64_t* count);
MAILLE_API const uint8_t* maille_block_types(const maille_mesh* mesh, uint64_t block, uint64_t* count);
MAILLE_API const uint32_t* maille_block_face_sizes(const maille_mesh* mesh, uint64_t block, uint64_t* count);
MAILLE_API const uint64_t* maille_block_cell_faces(const maille_mesh* mesh, uint64_t block, uint64_t* count);

MAILLE_API uint64_t
maille_mesh_arrays(const maille_mesh* mesh); /**< number of arrays, without the positions */
/** The place of an array; maille_mesh_arrays() where there is none of this name. */
MAILLE_API uint64_t maille_mesh_find(const maille_mesh* mesh, const char* name, int32_t domain);
MAILLE_API const char* maille_array_name(const maille_mesh* mesh, uint64_t array);
MAILLE_API int32_t maille_array_domain(const maille_mesh* mesh, uint64_t array); /**< -1: no such array */
MAILLE_API int32_t maille_array_type(const maille_mesh* mesh, uint64_t array);   /**< -1: no such array */
MAILLE_API int32_t maille_array_role(const maille_mesh* mesh, uint64_t array);   /**< -1: no such array */
MAILLE_API uint32_t maille_array_components(const maille_mesh* mesh, uint64_t array);
MAILLE_API uint64_t maille_array_tuples(const maille_mesh* mesh, uint64_t array);
/** tuples * components numbers, in place. */
MAILLE_API const void* maille_array_values(const maille_mesh* mesh, uint64_t array);
MAILLE_API uint64_t maille_array_labels(const maille_mesh* mesh, uint64_t array); /**< number of labels */
MAILLE_API const char* maille_array_label(const maille_mesh* mesh, uint64_t array, uint64_t label);
MAILLE_API uint64_t maille_mesh_metadata(const maille_mesh* mesh); /**< number of keys */
MAILLE_API const char* maille_mesh_metadata_key(const maille_mesh* mesh, uint64_t i);
MAILLE_API const char* maille_mesh_metadata_value(const maille_mesh* mesh, uint64_t i);
/** What a user should know of how the mesh was read or extracted, one sentence each: points welded, pieces
 * that are damaged and left out. No errors. */
MAILLE_API uint64_t maille_mesh_notes(const maille_mesh* mesh);
MAILLE_API const char* maille_mesh_note(const maille_mesh* mesh, uint64_t i);
/** Of cells and points that came from maille_volume_extract() and a file that keeps the order: their numbers
 * in the input, rising. Else NULL and 0. */
MAILLE_API const uint32_t* maille_mesh_cell_numbers(const maille_mesh* mesh, uint64_t* count);
MAILLE_API const uint32_t* maille_mesh_point_numbers(const maille_mesh* mesh, uint64_t* count);

/** Whether two meshes are equal, bit for bit in every array: up to the order of points and cells, or with
 * `same_order` (not 0) in the same one. MAILLE_OK, or MAILLE_DIFFERS and in `error` the most telling
 * difference. */
MAILLE_API int32_t maille_compare(const maille_mesh* a, const maille_mesh* b, int32_t same_order,
                                  maille_error* error);

/* ---- Encoding ---- */

/** How far a job has come: the stage ("positions", "reading", ...) and the fraction of it that is done, 0
 * to 1. Returns 0 to go on; any other number ends the call with MAILLE_CANCELLED. Called on the
 * thread that called the library, also where several work. */
typedef int32_t (*maille_progress)(void* user, const char* stage, double fraction);

/** How to encode. Setters give MAILLE_USAGE for what makes no sense by itself; the rest is found when it is
 * used. Functions take NULL for the defaults. */
typedef struct maille_encode_options maille_encode_options;
MAILLE_API maille_encode_options* maille_encode_options_create(maille_error* error);
MAILLE_API void maille_encode_options_free(maille_encode_options* options);
/** MAILLE_USUAL (default), MAILLE_SINGLE, MAILLE_STREAM or MAILLE_RANDOM. */
MAILLE_API int32_t maille_encode_options_set_mode(maille_encode_options* options, int32_t mode,
                                                  maille_error* error);
/** 1 (fast) to 9 (small); default 5. */
MAILLE_API int32_t maille_encode_options_set_effort(maille_encode_options* options, int32_t effort,
                                                    maille_error* error);
/** Not 0: points and cells come back in the order in which they are given. Default 0: in the order that costs
 * least. */
MAILLE_API int32_t maille_encode_options_set_keep_order(maille_encode_options* options, int32_t keep,
                                                        maille_error* error);
/** A bound (MAILLE_ABSOLUTE ...) of the positions (`array` NULL) or of the arrays of this name. Without one
 * they are lossless. */
MAILLE_API int32_t maille_encode_options_set_bound(maille_encode_options* options, const char* array,
                                                   int32_t kind, double value, maille_error* error);
/** Cells of a part, at least 1; 0 (default): as it suits. Mode stream: the cells are in pieces of about so
 * many, which maille_volume reads one by one; 262144 suits most. Mode random: triangles of a chart. */
MAILLE_API int32_t maille_encode_options_set_part_cells(maille_encode_options* options, uint64_t cells,
                                                        maille_error* error);
/** 1 (default): the calling thread alone; 0: as many as the machine has. */
MAILLE_API int32_t maille_encode_options_set_threads(maille_encode_options* options, uint32_t threads,
                                                     maille_error* error);
/** NULL: none (default). */
MAILLE_API int32_t maille_encode_options_set_progress(maille_encode_options* options,
                                                      maille_progress progress, void* user,
                                                      maille_error* error);
/** Mode stream: the time of the mesh's own values, those of step 0; NaN: none (default). */
MAILLE_API int32_t maille_encode_options_set_time(maille_encode_options* options, double time,
                                                  maille_error* error);
/** What `maille info` shows of where the file comes from; default "". */
MAILLE_API int32_t maille_encode_options_set_provenance(maille_encode_options* options, const char* text,
                                                        maille_error* error);

/** Writes a .maille file. The same mesh and options give the same bytes, with any number of threads. */
MAILLE_API int32_t maille_encode(const maille_mesh* mesh, const maille_encode_options* options,
                                 maille_sink* sink, maille_error* error);
/** Writes a mesh to a file of any format that the library writes, by the name's extension (.maille, .ply,
 * .vtu, .stl, .glb ...). What the format cannot hold is left out: `notes`, which may be NULL, is called with
 * a sentence for each such thing. `options` are for .maille. */
MAILLE_API int32_t maille_write_mesh(const maille_mesh* mesh, const char* path,
                                     const maille_encode_options* options,
                                     void (*notes)(void* user, const char* sentence), void* user,
                                     maille_error* error);

/* ---- Decoding ---- */

/** How to decode, and which arrays. Functions take NULL for the defaults. */
typedef struct maille_decode_options maille_decode_options;
MAILLE_API maille_decode_options* maille_decode_options_create(maille_error* error);
MAILLE_API void maille_decode_options_free(maille_decode_options* options);
/** Bytes that a mesh may take; default half of the machine's memory. */
MAILLE_API int32_t maille_decode_options_set_memory(maille_decode_options* options, uint64_t bytes,
                                                    maille_error* error);
/** The arrays wanted, by name; positions and cells always come. NULL: all (default). */
MAILLE_API int32_t maille_decode_options_set_arrays(maille_decode_options* options, const char* const* names,
                                                    uint64_t count, maille_error* error);
/** Of time, see maille_info_steps(); default 0, what the mesh was written with. */
MAILLE_API int32_t maille_decode_options_set_step(maille_decode_options* options, uint64_t step,
                                                  maille_error* error);
/** 1 (default): the calling thread alone; 0: as many as the machine has. */
MAILLE_API int32_t maille_decode_options_set_threads(maille_decode_options* options, uint32_t threads,
                                                     maille_error* error);
/** NULL: none (default). */
MAILLE_API int32_t maille_decode_options_set_progress(maille_decode_options* options,
                                                      maille_progress progress, void* user,
                                                      maille_error* error);

/** Decompresses a whole .maille file: a valid mesh or an error, whatever the bytes are. */
MAILLE_API maille_mesh* maille_decode(const maille_source* source, const maille_decode_options* options,
                                      maille_error* error);
/** What is left of a damaged file, as exact as ever; what is damaged, and what is lost, is among the notes.
 */
MAILLE_API maille_mesh* maille_salvage(const maille_source* source, const maille_decode_options* options,
                                       maille_error* error);
/** Reads a mesh from a file: .maille, also by its address, or any format that the library reads (see
 * maille_format_name()), by its extension, then by its first bytes. */
MAILLE_API maille_mesh* maille_read_mesh(const char* path_or_url, const maille_decode_options* options,
                                         maille_error* error);
/** Foreign formats by number: "ply", "vtu" ...; NULL behind the last. */
MAILLE_API const char* maille_format_name(uint64_t number);
/** Not 0: maille_write_mesh() knows it, too. */
MAILLE_API int32_t maille_format_writable(uint64_t number);

/* ---- What a file says of itself ---- */

typedef struct maille_info maille_info;
/** Reads header, index and description, no values. */
MAILLE_API maille_info* maille_inspect(const maille_source* source, maille_error* error);
MAILLE_API void maille_info_free(maille_info* info);
MAILLE_API int32_t maille_info_mode(const maille_info* info); /**< -1 for NULL */
MAILLE_API int32_t maille_info_effort(const maille_info* info);
MAILLE_API int32_t maille_info_keeps_order(const maille_info* info); /**< not 0: in the order of the input */
MAILLE_API uint64_t maille_info_file_bytes(const maille_info* info);
MAILLE_API uint64_t maille_info_points(const maille_info* info);
MAILLE_API uint64_t maille_info_cells(const maille_info* info);
MAILLE_API uint64_t maille_info_blocks(const maille_info* info);
MAILLE_API const char* maille_info_block_name(const maille_info* info, uint64_t block); /**< "name (type)" */
MAILLE_API uint64_t maille_info_block_cells(const maille_info* info, uint64_t block);
/** Number of arrays. Below, `array` is one of these, or MAILLE_POSITIONS. */
MAILLE_API uint64_t maille_info_arrays(const maille_info* info);
#define MAILLE_POSITIONS UINT64_MAX
MAILLE_API const char* maille_info_array_name(const maille_info* info, uint64_t array);
MAILLE_API int32_t maille_info_array_domain(const maille_info* info,
                                            uint64_t array);                        /**< -1: no such array */
MAILLE_API int32_t maille_info_array_type(const maille_info* info, uint64_t array); /**< -1: no such array */
MAILLE_API uint32_t maille_info_array_components(const maille_info* info, uint64_t array);
MAILLE_API uint64_t maille_info_array_bytes(const maille_info* info, uint64_t array); /**< in the file */
MAILLE_API double maille_info_array_bound(const maille_info* info,
                                          uint64_t array); /**< largest error promised; 0: lossless */
/** Least and largest value of a component as it was compressed: 1, or 0 where the file (mode stream has them)
 * does not tell. */
MAILLE_API int32_t maille_info_array_range(const maille_info* info, uint64_t array, uint32_t component,
                                           double* low, double* high);
/** Cells by type, also of mixed blocks: how many types there are, and the i-th of them, with its number of
 * cells, which may be NULL; -1: no such type. */
MAILLE_API uint64_t maille_info_cell_types(const maille_info* info);
MAILLE_API int32_t maille_info_cell_type(const maille_info* info, uint64_t i, uint64_t* cells);
/** Steps of time behind the mesh. They are numbered from 1 on; 0 is what it came with. */
MAILLE_API uint64_t maille_info_steps(const maille_info* info);
MAILLE_API double maille_info_step_time(const maille_info* info, uint64_t step); /**< of steps from 1 on */
/** The file as a series of times, step 0 among them where it is a time of its own: how many there are; 0 for
 * one mesh of no known time. */
MAILLE_API uint64_t maille_info_times(const maille_info* info);
/** The i-th time; `step`, which may be NULL, becomes the step to decode. NaN: no such time. */
MAILLE_API double maille_info_time(const maille_info* info, uint64_t i, uint64_t* step);
/** Levels of detail of mode random, 0 the mesh itself. */
MAILLE_API uint64_t maille_info_levels(const maille_info* info);
MAILLE_API uint64_t maille_info_level_faces(const maille_info* info, uint64_t level);
/** No point of the mesh is farther than this from the level. */
MAILLE_API double maille_info_level_bound(const maille_info* info, uint64_t level);
/** What is missing or damaged as far as headers show, one sentence each. maille_verify() looks at all. */
MAILLE_API uint64_t maille_info_problems(const maille_info* info);
MAILLE_API const char* maille_info_problem(const maille_info* info, uint64_t i);
/** Checks every checksum. MAILLE_CORRUPT, with the first damage in `error`. */
MAILLE_API int32_t maille_verify(const maille_source* source, maille_error* error);

/* ---- Which part of a mesh ---- */

/** A question to a file: everything, cut down by what is set. */
typedef struct maille_query maille_query;
MAILLE_API maille_query* maille_query_create(maille_error* error);
MAILLE_API void maille_query_free(maille_query* query);
/** What meets the box. In units of the mesh, as all places here; x, y, z. */
MAILLE_API int32_t maille_query_set_box(maille_query* query, const double low[3], const double high[3],
                                        maille_error* error);
/** What meets the sphere. */
MAILLE_API int32_t maille_query_set_sphere(maille_query* query, const double centre[3], double radius,
                                           maille_error* error);
/** What meets the half-space normal . x + offset >= 0; the normal need not have length 1. Six are a frustum.
 */
MAILLE_API int32_t maille_query_add_plane(maille_query* query, const double normal[3], double offset,
                                          maille_error* error);
/** Mode random, how fine: the coarsest charts that keep within all that is set. Without any of these the mesh
 * itself. */
/** No charts coarser than this level. */
MAILLE_API int32_t maille_query_set_level(maille_query* query, uint32_t level, maille_error* error);
/** No point of the mesh farther than this from what comes. */
MAILLE_API int32_t maille_query_set_error(maille_query* query, double bound, maille_error* error);
/** An error that is seen from `eye` under at most `pixels`. `pixels_per_radian`: height of the picture in
 * pixels / (2 tan(vertical angle of view / 2)). */
MAILLE_API int32_t maille_query_set_view(maille_query* query, const double eye[3], double pixels_per_radian,
                                         double pixels, maille_error* error);
/** The finest charts of at most so many faces in all. Of the above only the view counts then. */
MAILLE_API int32_t maille_query_set_most_faces(maille_query* query, uint64_t faces, maille_error* error);
/** Volumes: cells with points on both sides of the plane normal . x + offset = 0. */
MAILLE_API int32_t maille_query_set_cut(maille_query* query, const double normal[3], double offset,
                                        maille_error* error);
/** Volumes: cells with a value from `low` to `high`, or with a point that has one. `component` -1: the length
 * of the tuple. Several: cells that meet all. */
MAILLE_API int32_t maille_query_add_condition(maille_query* query, const char* array, int32_t component,
                                              double low, double high, maille_error* error);
/** Volumes: these pieces alone. */
MAILLE_API int32_t maille_query_set_pieces(maille_query* query, const uint32_t* pieces, uint64_t count,
                                           maille_error* error);
/** Volumes that keep the order: cells first ... last - 1 of the input. */
MAILLE_API int32_t maille_query_set_cells(maille_query* query, uint64_t first, uint64_t last,
                                          maille_error* error);

/* ---- Surfaces of mode random ---- */

/** An open file of mode random: charts, in groups, at levels of detail. Keeps its index in memory, not its
 * charts. Source and options must outlive it. */
typedef struct maille_file maille_file;
MAILLE_API maille_file* maille_file_open(const maille_source* source, const maille_decode_options* options,
                                         maille_error* error);
MAILLE_API void maille_file_free(maille_file* file);
MAILLE_API uint32_t maille_file_levels(const maille_file* file);
MAILLE_API uint64_t maille_file_faces(const maille_file* file, uint32_t level);
MAILLE_API uint32_t maille_file_charts(const maille_file* file, uint32_t level);
/** Around the mesh: centre and radius. */
MAILLE_API int32_t maille_file_sphere(const maille_file* file, double sphere[4], maille_error* error);
/** Charts that a query gives: together they have no cracks. `query` NULL: the mesh itself. Reads the index
 * only. */
typedef struct maille_selection maille_selection;
MAILLE_API maille_selection* maille_file_select(maille_file* file, const maille_query* query,
                                                maille_error* error);
MAILLE_API void maille_selection_free(maille_selection* selection);
MAILLE_API uint64_t maille_selection_charts(const maille_selection* selection); /**< how many */
MAILLE_API uint64_t maille_selection_faces(const maille_selection* selection);
/** The i-th chart: its group and its place in it. */
MAILLE_API int32_t maille_selection_chart(const maille_selection* selection, uint64_t i, uint32_t* group,
                                          uint32_t* chart, maille_error* error);
/** What is known of a chart without reading it: level, faces, bytes in the file, box as low x, y, z, high x,
 * y, z. Each may be NULL. */
MAILLE_API int32_t maille_file_chart(maille_file* file, uint32_t group, uint32_t chart, uint32_t* level,
                                     uint64_t* faces, uint64_t* bytes, double box[6], maille_error* error);
/** One chart as a mesh of its own. */
MAILLE_API maille_mesh* maille_file_read(maille_file* file, uint32_t group, uint32_t chart,
                                         maille_error* error);
/** Charts as one mesh: of level 0 bit for bit as in the original, with coarser ones triangles. `salvage` not
 * 0: without charts that are damaged, which the notes name. */
MAILLE_API maille_mesh* maille_file_extract(maille_file* file, const maille_selection* selection,
                                            int32_t salvage, maille_error* error);
/** A place on the surface. Set struct_size to sizeof(maille_place) before. */
typedef struct maille_place {
  uint32_t struct_size;
  uint32_t found; /**< 0: none; the rest is 0 then */
  uint32_t group, chart;
  uint64_t face;       /**< in the chart; of the mesh itself, never of a coarser level */
  uint32_t corners[3]; /**< points of the chart: the triangle (of a polygon's fan) */
  uint32_t reserved;
  double weights[3]; /**< of these corners */
  double position[3];
  double distance; /**< along the ray, in lengths of its direction; or from the point */
} maille_place;
/** The first place that a ray from `origin` hits. Decodes only charts that it passes. */
MAILLE_API int32_t maille_file_hit(maille_file* file, const double origin[3], const double direction[3],
                                   maille_place* place, maille_error* error);
/** The place of the surface that is nearest to a point. */
MAILLE_API int32_t maille_file_nearest(maille_file* file, const double point[3], maille_place* place,
                                       maille_error* error);
/** The `count` points of the mesh nearest to this one, the nearest first: `positions` has room for 3 * count,
 * `distances` (may be NULL) for count. `found` becomes how many there are. */
MAILLE_API int32_t maille_file_nearest_points(maille_file* file, const double point[3], uint64_t count,
                                              double* positions, double* distances, uint64_t* found,
                                              maille_error* error);
/** The faces of a mesh that have a point in box, sphere and half-spaces of the query, with the points they
 * use. */
MAILLE_API maille_mesh* maille_clip(const maille_mesh* mesh, const maille_query* query, maille_error* error);

/* ---- Volumes of mode stream ---- */

/** An open volume. In pieces (maille_encode_options_set_part_cells()) any part of it is read alone; else it
 * is one piece. Source and options must outlive it. */
typedef struct maille_volume maille_volume;
MAILLE_API maille_volume* maille_volume_open(const maille_source* source,
                                             const maille_decode_options* options, maille_error* error);
MAILLE_API void maille_volume_free(maille_volume* volume);
MAILLE_API uint64_t maille_volume_cells(const maille_volume* volume);
MAILLE_API uint64_t maille_volume_points(const maille_volume* volume);
MAILLE_API uint32_t maille_volume_pieces(const maille_volume* volume);
/** What is known of a piece without reading it: cells, points, bytes in the file, box as low x, y, z, high x,
 * y, z (NaN where it has none). Each may be NULL. */
MAILLE_API int32_t maille_volume_piece(const maille_volume* volume, uint32_t piece, uint64_t* cells,
                                       uint64_t* points, uint64_t* bytes, double box[6], maille_error* error);
/** Pieces that may have cells of a query: the first `room` of them to `pieces`, which may be NULL with 0;
 * `count` becomes how many there are. */
MAILLE_API int32_t maille_volume_select(const maille_volume* volume, const maille_query* query,
                                        uint32_t* pieces, uint64_t room, uint64_t* count,
                                        maille_error* error);
/** The cells of a query, exactly those of the original. `query` NULL: all. Pieces that are damaged are left
 * out, and the notes name them. */
MAILLE_API maille_mesh* maille_volume_extract(const maille_volume* volume, const maille_query* query,
                                              maille_error* error);
/** A first picture, from the index alone: vertices with mean values. For files in pieces. */
MAILLE_API maille_mesh* maille_volume_coarse(const maille_volume* volume, maille_error* error);
/** What the plane normal . x + offset = 0 cuts out of solids, as polygons with values; the normal need not
 * have length 1. */
MAILLE_API maille_mesh* maille_slice(const maille_mesh* mesh, const double normal[3], double offset,
                                     maille_error* error);

/* ---- Meshes that come and go in portions ---- */

/** Compresses a mesh of any size while it comes in. Points and cells have numbers of 64 bits. In this order:
 * create, declare arrays, begin, then points and cells in any order in which each point comes before the
 * first cell that uses it, finish. */
typedef struct maille_writer maille_writer;
/** `sink` must outlive it. `type` of the positions: MAILLE_F32 ... Of `options`, which may be NULL, effort,
 * time, order (none kept by default), threads, provenance and bounds count (a bound of kind relative or bits
 * needs a range). */
MAILLE_API maille_writer* maille_writer_create(maille_sink* sink, int32_t type,
                                               const maille_encode_options* options, maille_error* error);
/** What was written before maille_writer_finish() is no whole file; a sink of a file then leaves none. */
MAILLE_API void maille_writer_free(maille_writer* writer);
/** An array on points or cells. `low` to `high`: the values to come, for bounds of kind relative and bits;
 * NaN where unknown. */
MAILLE_API int32_t maille_writer_declare(maille_writer* writer, const char* name, int32_t domain,
                                         int32_t type, uint32_t components, double low, double high,
                                         maille_error* error);
/** The same range for the positions. */
MAILLE_API int32_t maille_writer_set_position_range(maille_writer* writer, double low, double high,
                                                    maille_error* error);
MAILLE_API int32_t maille_writer_begin(maille_writer* writer, maille_error* error);
/** Points first ... first + count - 1. `arrays`: for each array on points, in the order of declaration, its
 * `count` tuples; NULL where there is none. */
MAILLE_API int32_t maille_writer_add_points(maille_writer* writer, uint64_t first, uint64_t count,
                                            const void* positions, const void* const* arrays,
                                            maille_error* error);
/** The same with any numbers. */
MAILLE_API int32_t maille_writer_add_numbered_points(maille_writer* writer, const uint64_t* numbers,
                                                     uint64_t count, const void* positions,
                                                     const void* const* arrays, maille_error* error);
/** Cells from here on belong to a new block. Without it there is one, of MAILLE_MIXED. */
MAILLE_API int32_t maille_writer_begin_block(maille_writer* writer, const char* name, int32_t cell_type,
                                             maille_error* error);
/** `cells` cells of one type with `nodes` numbers of points each (0: as the type has). `last_use`: one flag
 * for each entry of the connectivity, not 0 where no later cell uses the point, so that it leaves memory; may
 * be NULL. `arrays`: as above, of arrays on cells. */
MAILLE_API int32_t maille_writer_add_cells(maille_writer* writer, int32_t cell_type, uint64_t cells,
                                           uint64_t nodes, const uint64_t* connectivity,
                                           const uint8_t* last_use, const void* const* arrays,
                                           maille_error* error);
/** One polyhedron: corners of each of its faces, and the points of these, face after face. */
MAILLE_API int32_t maille_writer_add_polyhedron(maille_writer* writer, const uint32_t* face_sizes,
                                                uint64_t faces, const uint64_t* connectivity,
                                                const uint8_t* last_use, const void* const* arrays,
                                                maille_error* error);
/** Points that no later cell uses, told after the fact. */
MAILLE_API int32_t maille_writer_end_points(maille_writer* writer, const uint64_t* numbers, uint64_t count,
                                            maille_error* error);
/** Writes what came so far, for a reader at the other end of a pipe. */
MAILLE_API int32_t maille_writer_flush(maille_writer* writer, maille_error* error);
/** Ends the file and commits the sink. Nothing can be added after it. */
MAILLE_API int32_t maille_writer_finish(maille_writer* writer, maille_error* error);

/** Decompresses a file of mode stream portion by portion: some thousand cells, and the points that come up
 * with them. */
typedef struct maille_reader maille_reader;
/** From a source, which must outlive it; of `options` memory, step and threads count. Cells come in the order
 * of the file; where the input's order stands apart in it, only maille_decode() gives that back. */
MAILLE_API maille_reader* maille_reader_open(const maille_source* source,
                                             const maille_decode_options* options, maille_error* error);
/** Reads at most `size` bytes, front to back, and returns how many; 0 at the end, less than 0 for an error.
 * May wait. */
typedef int64_t (*maille_read)(void* user, void* out, uint64_t size);
/** From a pipe or a socket. `name` is what messages call it; may be NULL. */
MAILLE_API maille_reader* maille_reader_callbacks(maille_read read, void* user, const char* name,
                                                  const maille_decode_options* options, maille_error* error);
MAILLE_API void maille_reader_free(maille_reader* reader);
MAILLE_API int32_t
maille_reader_position_type(const maille_reader* reader); /**< MAILLE_F32 ...; -1 for NULL */
/** Arrays on points and cells as they were declared. */
MAILLE_API uint64_t maille_reader_arrays(const maille_reader* reader);
MAILLE_API const char* maille_reader_array_name(const maille_reader* reader, uint64_t array);
MAILLE_API int32_t maille_reader_array_domain(const maille_reader* reader,
                                              uint64_t array); /**< -1: no such array */
MAILLE_API int32_t maille_reader_array_type(const maille_reader* reader,
                                            uint64_t array); /**< -1: no such array */
MAILLE_API uint32_t maille_reader_array_components(const maille_reader* reader, uint64_t array);
/** The next portion. `more` becomes 0 where that was all, and every checksum was right. What came before an
 * error is whole. */
MAILLE_API int32_t maille_reader_next(maille_reader* reader, int32_t* more, maille_error* error);
/** The portion; lists stay until the next one. `count`, which may be NULL, becomes their length. */
MAILLE_API uint64_t maille_reader_cells(const maille_reader* reader);
MAILLE_API uint64_t
maille_reader_first_cell(const maille_reader* reader); /**< its number, from the begin of the stream */
MAILLE_API const uint8_t* maille_reader_types(const maille_reader* reader,
                                              uint64_t* count); /**< one a cell */
MAILLE_API const uint64_t* maille_reader_offsets(const maille_reader* reader,
                                                 uint64_t* count); /**< cells + 1 */
MAILLE_API const uint64_t* maille_reader_connectivity(const maille_reader* reader,
                                                      uint64_t* count); /**< numbers of points */
/** The same as slots: numbers below maille_reader_slots() that no other point of the portion has, free again
 * once the point ended. */
MAILLE_API const uint32_t* maille_reader_connectivity_slots(const maille_reader* reader, uint64_t* count);
MAILLE_API const uint32_t* maille_reader_face_sizes(const maille_reader* reader, uint64_t* count);
MAILLE_API const uint64_t* maille_reader_cell_faces(const maille_reader* reader, uint64_t* count);
MAILLE_API const uint64_t* maille_reader_points(const maille_reader* reader,
                                                uint64_t* count); /**< that come up here */
MAILLE_API const uint32_t* maille_reader_point_slots(const maille_reader* reader,
                                                     uint64_t* count); /**< of these */
MAILLE_API const void* maille_reader_positions(const maille_reader* reader,
                                               uint64_t* bytes); /**< of these, 3 numbers each */
/** Values of an array for the points that come up, or for the cells. */
MAILLE_API const void* maille_reader_values(const maille_reader* reader, uint64_t array, uint64_t* bytes);
MAILLE_API const uint32_t* maille_reader_ended_slots(const maille_reader* reader, uint64_t* count);
MAILLE_API uint32_t maille_reader_slots(const maille_reader* reader); /**< so far */

/* ---- Steps of time ---- */

/** Appends the arrays on points and cells of a mesh, which has the points and cells of the file in their
 * order, as the values of a later time. The file is of mode stream and keeps the order. Of `options` bounds
 * and threads count. Until all of the step is there, also after a crash, the file reads as it was. `step`,
 * which may be NULL, becomes its number. */
MAILLE_API int32_t maille_append_step(const char* path, double time, const maille_mesh* mesh,
                                      const maille_encode_options* options, uint64_t* step,
                                      maille_error* error);

#ifdef __cplusplus
}
#endif

#endif
