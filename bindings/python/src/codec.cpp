// Whole meshes: files, bytes, foreign formats, steps of time.
#include "codec.h"

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/folder.h>
#include <maille/io.h>
#include <maille/limits.h>
#include <maille/series.h>
#include <maille/stream.h>
#include <pybind11/stl.h>

#include "mesh.h"
#include "sources.h"

namespace maille::python {

namespace {

using Bound = std::pair<int, double>;  ///< kind and value of a Tolerance

Tolerance tolerance_of(const Bound& bound) {
  return {static_cast<Tolerance::Kind>(bound.first), bound.second};
}

/// What the Python side chose, in one tuple.
// Its entries are in the order of maille/_codec.py.
EncodeOptions encode_options(const py::tuple& given) {
  EncodeOptions options;
  options.mode = static_cast<Mode>(given[0].cast<int>());
  options.effort = given[1].cast<int>();
  options.order = given[2].cast<bool>() ? Order::keep : Order::canonical;
  if (!given[3].is_none()) options.positions = tolerance_of(given[3].cast<Bound>());
  for (const auto& [name, bound] : given[4].cast<std::map<std::string, Bound>>())
    options.arrays[name] = tolerance_of(bound);
  options.most_cells_per_part = given[5].cast<std::optional<uint64_t>>();
  options.provenance = given[6].cast<std::string>();
  options.time = given[7].cast<std::optional<double>>();
  options.executor = executor();
  return options;
}

/// What an ArrayReport and an ArrayInfo both tell.
template <class About>
py::dict common_dict_of(const About& array) {
  py::dict all;
  all["name"] = array.name;
  all["domain"] = name_of(array.domain);
  all["type"] = name_of(array.type);
  all["components"] = array.components;
  all["coded_bytes"] = array.coded_bytes;
  all["lossless"] = array.lossless;
  all["bound"] = array.bound;
  all["maximum_error"] = array.maximum_error;
  return all;
}

py::dict dict_of(const ArrayReport& array) {
  py::dict all = common_dict_of(array);
  all["elements"] = array.elements;
  all["raw_bytes"] = array.raw_bytes;
  return all;
}

py::dict dict_of(const EncodeReport& report) {
  py::dict all;
  all["points"] = report.points;
  all["cells"] = report.cells;
  all["file_bytes"] = report.file_bytes;
  all["connectivity"] = dict_of(report.connectivity);
  all["positions"] = dict_of(report.positions);
  py::list arrays;
  for (const ArrayReport& array : report.arrays) arrays.append(dict_of(array));
  all["arrays"] = arrays;
  return all;
}

// The bytes are copied once, into an object of Python; the vector cannot be given away.
py::tuple encode_to_bytes(const SharedMesh& self, const py::tuple& given, const py::object& progress) {
  EncodeOptions options = encode_options(given);
  std::vector<std::byte> bytes;
  const EncodeReport report = run(progress, [&](const Progress& told) {
    options.progress = told;
    return encode(*self.mesh, *memory_sink(bytes), options);
  });
  return py::make_tuple(py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size()),
                        dict_of(report));
}

py::dict encode_to_file(const SharedMesh& self, const std::string& path, const py::tuple& given,
                        const py::object& progress) {
  EncodeOptions options = encode_options(given);
  return dict_of(run(progress, [&](const Progress& told) -> Result<EncodeReport> {
    options.progress = told;
    const auto sink = file_sink(path);
    if (!sink) return tl::unexpected(sink.error());
    return encode(*self.mesh, **sink, options);
  }));
}

SharedMesh decode_input(const Input& input, std::optional<std::vector<std::string>> arrays, uint64_t step,
                        uint64_t memory, const py::object& progress) {
  DecodeOptions options;
  options.limits.mesh_bytes = memory;
  options.arrays = std::move(arrays);
  options.step = step;
  options.executor = executor();
  return shared(run(input, progress, [&](const Progress& told) {
    options.progress = told;
    return decode(input.source(), options);
  }));
}

py::tuple salvage_input(const Input& input, uint64_t memory, const py::object& progress) {
  DecodeOptions options;
  options.limits.mesh_bytes = memory;
  options.executor = executor();
  Salvaged salvaged = run(input, progress, [&](const Progress& told) {
    options.progress = told;
    return salvage(input.source(), options);
  });
  const py::object damage = salvaged.damage ? py::object(py::str(salvaged.damage->message)) : py::none();
  return py::make_tuple(shared(std::move(salvaged.mesh)), damage);
}

py::tuple with_notes(ReadResult&& read) {
  return py::make_tuple(shared(std::move(read.mesh)), read.notes);
}

py::tuple read_foreign(const std::string& path, const std::string& format, std::optional<uint64_t> step,
                       uint64_t memory, const py::object& progress) {
  ReadOptions options;
  options.format = format;
  options.limits.mesh_bytes = memory;
  return with_notes(run(progress, [&](const Progress& told) -> Result<ReadResult> {
    options.progress = told;
    if (!step) return read_mesh(path, options);
    const auto entries = read_series(path);
    if (!entries) return tl::unexpected(entries.error());
    if (*step >= entries->size())
      return failure(ErrorCode::usage,
                     path + ": has " + std::to_string(entries->size()) + " steps; they are counted from 0");
    return read_series_entry((*entries)[*step], options);
  }));
}

std::vector<double> foreign_times(const std::string& path) {
  std::vector<double> times;
  if (!may_be_series(path)) return times;
  for (const SeriesEntry& entry : run(py::none(), [&](const Progress&) { return read_series(path); }))
    times.push_back(entry.time);
  return times;
}

/// The format of a path that is to be written; empty: there is none of this name.
std::string format_to_write(const std::string& path) {
  for (const FormatInfo& format : formats()) {
    for (const std::string& extension : format.extensions) {
      if (format.writable && path.size() > extension.size() && path.ends_with(extension)) return format.name;
    }
  }
  return {};
}

std::vector<std::string> write_foreign(const SharedMesh& self, const std::string& path,
                                       const std::string& format, bool ascii) {
  return run(py::none(), [&](const Progress&) -> Result<std::vector<std::string>> {
    return write_mesh(*self.mesh, path, {.format = format, .ascii = ascii});
  });
}

bool input_is_maille(const Input& input) {
  return run(input, py::none(), [&](const Progress&) -> Result<bool> { return is_maille(input.source()); });
}

py::dict dict_of(const ArrayInfo& array) {
  py::dict all = common_dict_of(array);
  all["role"] = name_of(array.role);
  all["count"] = array.count;
  all["ranges"] = array.ranges;
  return all;
}

py::list steps_of(const FileInfo& info) {
  py::list steps;
  for (const StepInfo& step : info.steps) {
    py::dict all;
    all["time"] = step.time;
    all["arrays"] = step.arrays;
    all["maximum_errors"] = step.maximum_errors;
    all["coded_bytes"] = step.coded_bytes;
    steps.append(all);
  }
  return steps;
}

py::dict inspect_input(const Input& input) {
  const FileInfo info = run(input, py::none(), [&](const Progress&) { return inspect(input.source()); });
  py::dict all;
  all["format"] = std::to_string(info.format_major) + "." + std::to_string(info.format_minor);
  all["mode"] = static_cast<int>(info.mode);
  all["effort"] = info.effort;
  all["order_kept"] = info.order == Order::keep;
  all["file_bytes"] = info.file_bytes;
  all["points"] = info.points;
  all["cells"] = info.cells;
  all["corners"] = info.corners;
  all["parts"] = info.parts;
  all["blocks"] = info.blocks;
  py::list types;
  for (const auto& [type, cells] : info.types) types.append(py::make_tuple(name_of(type), cells));
  all["types"] = types;
  all["time"] = info.time;
  all["faces_of_level"] = info.faces_of_level;
  all["charts_of_level"] = info.charts_of_level;
  all["bound_of_level"] = info.bound_of_level;
  all["positions"] = dict_of(info.positions);
  py::list arrays;
  for (const ArrayInfo& array : info.arrays) arrays.append(dict_of(array));
  all["arrays"] = arrays;
  all["steps"] = steps_of(info);
  all["metadata"] = info.metadata;
  all["provenance"] = info.provenance;
  all["problems"] = info.problems;
  return all;
}

std::vector<std::string> verify_input(const Input& input) {
  return run(input, py::none(), [&](const Progress&) { return verify_checksums(input.source()); });
}

py::dict append_to_file(const std::string& path, double time, const SharedMesh& mesh,
                        const py::tuple& given) {
  const EncodeOptions options = encode_options(given);
  const StepReport report =
      run(py::none(), [&](const Progress&) { return append_step(path, time, *mesh.mesh, options); });
  py::dict all;
  all["number"] = report.number;
  all["file_bytes"] = report.file_bytes;
  all["errors"] = report.errors;
  return all;
}

py::list known_formats() {
  py::list all;
  for (const FormatInfo& format : formats())
    all.append(py::make_tuple(format.name, format.extensions, format.description, format.writable));
  return all;
}

}  // namespace

void bind_codec(py::module_& module) {
  module.def("encode", &encode_to_bytes, py::arg("mesh"), py::arg("options"), py::arg("progress"));
  module.def("encode_to_file", &encode_to_file, py::arg("mesh"), py::arg("path"), py::arg("options"),
             py::arg("progress"));
  module.def("default_mesh_bytes", &default_mesh_bytes);
  module.def("decode", &decode_input, py::arg("input"), py::arg("arrays"), py::arg("step"), py::arg("memory"),
             py::arg("progress"));
  module.def("salvage", &salvage_input, py::arg("input"), py::arg("memory"), py::arg("progress"));
  module.def("read_foreign", &read_foreign, py::arg("path"), py::arg("format"), py::arg("step"),
             py::arg("memory"), py::arg("progress"));
  module.def("foreign_times", &foreign_times, py::arg("path"));
  module.def("format_to_write", &format_to_write, py::arg("path"));
  module.def("write_foreign", &write_foreign, py::arg("mesh"), py::arg("path"), py::arg("format"),
             py::arg("ascii"));
  module.def("is_maille", &input_is_maille, py::arg("input"));
  module.def("inspect", &inspect_input, py::arg("input"));
  module.def("verify", &verify_input, py::arg("input"));
  module.def("append", &append_to_file, py::arg("path"), py::arg("time"), py::arg("mesh"),
             py::arg("options"));
  module.def("formats", &known_formats);
  module.def("set_threads", &set_threads, py::arg("count"));
  module.attr("cells_of_volume_piece") = cells_of_volume_piece;
}

}  // namespace maille::python
