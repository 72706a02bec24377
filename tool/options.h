#pragma once

#include <maille/encode.h>
#include <maille/generate.h>
#include <maille/limits.h>
#include <maille/predict.h>
#include <maille/subdivide.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "selection.h"

// What the command line asks for, verb by verb. Filled by parser.cpp and command_line.cpp, the only places
// that know CLI11.
namespace maille::tool {

enum class ProgressStyle { automatic, always, never, json };

/// Options every verb has.
struct CommonOptions {
  unsigned threads = 0;  ///< 0: as many as the machine has
  uint64_t memory = Limits{}.mesh_bytes;
  bool quiet = false;
  bool verbose = false;
  bool json = false;
  ProgressStyle progress = ProgressStyle::automatic;
};

/// When only a part of an address is wanted, at most so many bytes are fetched beyond that part. It stops a
/// server that ignores ranges from sending a whole file unasked.
constexpr uint64_t default_fetch_limit = uint64_t{64} << 20;

/// Several inputs of one command line (batch.h).
struct Batch {
  std::vector<std::string> inputs;  ///< empty: there is one, as `input` of the verb
  std::string output_folder;        ///< empty: each output beside its input
  bool recursive = false;           ///< folders stand for the meshes in them and below
};

struct CompressOptions {
  CommonOptions common;
  Batch batch;
  bool brief = false;  ///< one line for the mesh: it is one of many
  std::string input;
  std::string series;  ///< whose first mesh the input is, if it is one
  std::string output;  ///< empty: beside the input
  std::string input_format;
  std::optional<Mode> mode;  ///< none: volumes are streams
  int effort = EncodeOptions{}.effort;
  bool keep_order = false;
  bool any_order = false;
  uint64_t delay = 0;  ///< cells held back; 0: none
  std::string pieces;  ///< "auto", "off", or cells of a piece, triangles of a chart; empty: off
  /// By kind, as typed: "X" for positions or "NAME=X".
  std::map<Tolerance::Kind, std::vector<std::string>> bounds;
  bool lossless = false;
  ArraySelection arrays;
  bool lenient =
      false;  ///< bounds are of settings for any mesh: arrays that it does not have are not mentioned
  bool force = false;
  std::optional<double> time = {};    ///< of the first mesh of a series
  std::optional<uint64_t> step = {};  ///< that gives it, where one file has all
  bool provenance = true;
};

struct DecompressOptions {
  CommonOptions common;
  Batch batch;
  std::string input;
  std::string output;  ///< empty: beside the input, as PLY, volumes as VTU
  std::string output_format;
  std::optional<std::vector<std::string>> arrays;
  std::optional<uint64_t> step;  ///< of time
  std::optional<double> time;    ///< the step that has it
  bool salvage = false;
  bool as_stored = false;  ///< nodes of a glTF scene are not applied
  bool ascii = false;
  bool force = false;
};

struct AppendOptions {
  CommonOptions common;
  std::string file;
  std::vector<std::string> steps;  ///< meshes with the values, or lists of them (.pvd)
  bool remove_last = false;        ///< instead of appending
  std::string input_format;
  std::optional<double> time;
  CompressOptions quality;  ///< only its bounds
  std::string series;       ///< a case of OpenFOAM, fields of which may be there at some times only
};

struct InfoOptions {
  CommonOptions common;
  std::string input;
  std::string input_format;
  uint64_t fetch_limit = default_fetch_limit;
  bool tree = false;
  bool pieces = false;
  bool chunks = false;
};

struct VerifyOptions {
  CommonOptions common;
  std::string input;
  std::string original;  ///< empty: checksums and decoding only
  std::string original_format;
};

struct DiffOptions {
  CommonOptions common;
  std::string a;
  std::string b;
  std::string input_format;
  bool same_order = false;
  bool arrays = true;
  bool metadata = false;
};

struct ConvertOptions {
  CommonOptions common;
  std::string input;
  std::string output;
  std::string input_format;
  std::string output_format;
  bool as_stored = false;  ///< as of DecompressOptions
  bool ascii = false;
  bool force = false;
};

struct StencilOptions {
  CommonOptions common;
  std::string name;  ///< empty: list what is known, or read `file`
  std::string file;
  std::string rule;  ///< empty: the stencil's own
  std::optional<Covariance> covariance;
  std::optional<unsigned> order;
  std::optional<double> noise;
  std::optional<unsigned> exact_order;
};

struct SubdivideOptions {
  CommonOptions common;
  std::string input;
  std::string output;
  std::string input_format;
  std::string output_format;
  SubdivisionOptions subdivision;
  bool force = false;
};

struct BenchOptions {
  CommonOptions common;
  std::vector<std::string> inputs;
  std::string input_format;
  int bits = 14;                    ///< 0: bit for bit
  std::vector<int> levels;          ///< empty: all
  std::vector<std::string> codecs;  ///< parts of names; empty: all
  std::string against;              ///< empty: the first peer there is
  size_t repeat = 5;
  bool whole_file = true;
};

struct GenerateOptions {
  CommonOptions common;
  std::string input;
  std::string output;  ///< empty with `count`
  std::string output_format;
  maille::GenerateOptions generation;
  std::string pieces;  ///< as of CompressOptions; empty: off
  bool count = false;
  bool force = false;
};

/// How a part of a mesh is written.
struct OutputOptions {
  std::string output;
  std::string output_format;
  bool ascii = false;
  bool force = false;
};

struct ExtractOptions : OutputOptions {
  CommonOptions common;
  std::string input;
  uint64_t fetch_limit = default_fetch_limit;
  std::vector<double> box;         ///< empty, or six numbers: the lowest corner, then the highest
  std::vector<double> sphere;      ///< empty, or four: centre, radius
  std::vector<double> plane;       ///< empty, or six: a point on it, its normal
  std::vector<std::string> where;  ///< "NAME>NUMBER" and the like
  std::string cells;               ///< empty, or "FIRST:END"
  std::optional<std::vector<std::string>> arrays;
  uint64_t step = 0;     ///< of time
  bool coarse = false;   ///< the coarse level of a volume, nothing else of it
  bool numbers = false;  ///< arrays with the numbers of cells and points in the input
  std::optional<double> error;
  std::optional<uint32_t> level;
  std::optional<uint64_t> triangles;
  std::vector<double> eye;  ///< empty, or three numbers
  double pixel_error = 1;
  std::vector<double> nearest;    ///< empty, or three numbers
  uint64_t count = 1;             ///< of points nearest to it
  std::vector<double> component;  ///< empty, or three numbers
  bool full = false;
  bool whole_charts = false;
  bool chart_numbers = false;
};

/// A volume in any format, of which cells are wanted.
struct VolumeOptions {
  CommonOptions common;
  std::string input;
  std::string input_format;
  uint64_t fetch_limit = default_fetch_limit;
  std::optional<std::vector<std::string>> arrays;
  uint64_t step = 0;  ///< of time
};

struct SliceOptions : VolumeOptions, OutputOptions {
  std::vector<double> plane;  ///< six: a point on it, its normal
};

struct ProbeOptions : VolumeOptions {
  std::vector<double> places;  ///< three for each
};

struct ServeOptions {
  CommonOptions common;
  std::string path;  ///< a folder, or one file
  std::string host = "127.0.0.1";
  unsigned port = 8080;  ///< 0: any that is free
};

struct ViewOptions {
  CommonOptions common;
  std::string input;    ///< a file, or an address
  unsigned port = 0;    ///< 0: any that is free
  bool browser = true;  ///< open it there
};

/// Help, version, completion scripts: to be printed as it is.
struct PrintText {
  std::string text;
};

using Command =
    std::variant<PrintText, CompressOptions, DecompressOptions, AppendOptions, InfoOptions, VerifyOptions,
                 DiffOptions, ConvertOptions, StencilOptions, SubdivideOptions, BenchOptions, GenerateOptions,
                 ExtractOptions, SliceOptions, ProbeOptions, ServeOptions, ViewOptions>;

}  // namespace maille::tool
