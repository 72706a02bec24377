#pragma once

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <string>
#include <vector>

#include "options.h"

// The verbs and their options as CLI11 has them. Only for the files of the parser and command_line.cpp: CLI11
// takes long to compile.
namespace maille::tool {

/// What CLI11 writes to that is not an option of a verb as it stands.
struct Raw {
  std::string mode;
  std::vector<int> effort;
  bool keep_order = false;
  bool any_order = false;
  bool no_provenance = false;
  bool no_arrays = false;
  bool lossless = false;
  bool no_whole_file = false;
  bool no_browser = false;
  std::string arrays;
  std::string drop;
  std::string purpose;
  std::string memory;
  std::string fetch_limit;
  std::string progress = "auto";
  std::string shell;
  std::string covariance;
  std::string scheme = "butterfly";
};

/// The tree of verbs and options. Each add_...() makes one verb, whose words CLI11 writes into the options
/// beside it or into `raw`; command_line.cpp turns these into a Command. Help, manual and completions are
/// made from the same tree.
struct Parser {
  CLI::App app{
      "maille compresses meshes: any polygons, every array, bit for bit unless a tolerance is given."};
  Raw raw;
  CompressOptions compress;
  DecompressOptions decompress;
  AppendOptions append;
  InfoOptions info;
  VerifyOptions verify;
  DiffOptions diff;
  ConvertOptions convert;
  StencilOptions stencil;
  SubdivideOptions subdivide;
  GenerateOptions generate;
  ExtractOptions extract;
  SliceOptions slice;
  ProbeOptions probe;
  ServeOptions serve;
  ViewOptions view;
  BenchOptions bench;

  Parser();
  CLI::App* verb(const std::string& name, const std::string& description, const std::string& examples);
  /// --quiet and --json: verbs that are done at once.
  void add_answer(CLI::App* verb, CommonOptions& common);
  /// Those, and threads, memory, progress: verbs that work for a while.
  void add_work(CLI::App* verb, CommonOptions& common);
  void add_quiet(CLI::App* verb, CommonOptions& common);
  void add_json(CLI::App* verb, CommonOptions& common);
  void add_memory(CLI::App* verb);
  void add_progress(CLI::App* verb);
  void add_compress();
  void add_decompress();
  void add_append();
  void add_info();
  void add_verify();
  void add_diff();
  void add_convert();
  void add_stencil();
  void add_subdivide();
  void add_generate();
  void add_extract();
  void add_slice();
  void add_probe();
  void add_fetch_limit(CLI::App* verb);
  void add_serve();
  void add_view();
  void add_bench();
  void add_completion();
};

}  // namespace maille::tool
