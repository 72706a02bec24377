// Streams: portions of a mesh as they are decoded, and a writer for meshes that are made bit by bit.
#include <maille/stream.h>

#include "codec.h"
#include "handle.h"
#include "mesh.h"
#include "regions.h"
#include "values.h"

namespace maille::python {

namespace {

using Reader = Handle<StreamReader>;

std::unique_ptr<Reader> open_stream(const py::object& input, uint64_t step, bool any_order, uint64_t memory) {
  auto opened = std::make_unique<Reader>(input);
  StreamReadOptions options;
  options.limits.mesh_bytes = memory;
  options.any_order = any_order;
  options.executor = executor();
  const Source& source = opened->input().source();
  opened->set(run(opened->input(), py::none(),
                  [&](const Progress&) { return StreamReader::open(source, step, options); }));
  return opened;
}

/// Name, domain, dtype, components.
py::tuple declared(const StreamArray& array) {
  return py::make_tuple(array.name, name_of(array.domain), dtype_of(array.type), array.components);
}

py::dict description_of(const Reader& self) {
  const StreamDescription& description = self.file().description();
  py::dict all;
  all["positions"] = declared(description.positions);
  py::list arrays;
  for (const StreamArray& array : description.arrays) arrays.append(declared(array));
  all["arrays"] = arrays;
  all["metadata"] = description.metadata;
  all["order_apart"] = description.order_apart;
  return all;
}

/// Bytes of tuples as an array of them.
py::array values_of(std::vector<std::byte>&& bytes, const StreamArray& array) {
  const uint64_t tuples = array.tuple_size() == 0 ? 0 : bytes.size() / array.tuple_size();
  const auto kept = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
  return view_of(kept, kept->data(), dtype_of(array.type), shape_of(tuples, array.components));
}

py::dict values_of(std::vector<std::vector<std::byte>>&& values, const StreamDescription& description,
                   Domain domain) {
  py::dict all;
  size_t next = 0;
  for (const StreamArray& array : description.arrays) {
    if (array.domain == domain) all[py::str(array.name)] = values_of(std::move(values[next++]), array);
  }
  return all;
}

py::list blocks_of(const StreamPortion& portion) {
  py::list blocks;
  for (const StreamPortion::Block& block : portion.blocks)
    blocks.append(py::make_tuple(block.first_cell, block.name, static_cast<int>(block.type)));
  return blocks;
}

/// The next portion, taken apart into views; None behind the last one.
py::object next(Reader& self) {
  StreamPortion portion;
  if (!self.with(py::none(), [&](StreamReader& reader) { return reader.next(portion); })) return py::none();
  const StreamDescription& description = self.file().description();
  std::vector<uint8_t> types(portion.types.size());
  for (size_t i = 0; i < types.size(); ++i) types[i] = static_cast<uint8_t>(portion.types[i]);
  py::dict all;
  all["blocks"] = blocks_of(portion);
  all["first_cell"] = portion.first_cell;
  all["types"] = view_of(std::move(types));
  all["offsets"] = view_of(std::move(portion.offsets));
  all["connectivity"] = view_of(std::move(portion.connectivity));
  all["slots"] = view_of(std::move(portion.slots));
  all["face_sizes"] = view_of(std::move(portion.face_sizes));
  all["cell_faces"] = view_of(std::move(portion.cell_faces));
  all["cell_data"] = values_of(std::move(portion.cell_arrays), description, Domain::cell);
  all["points"] = view_of(std::move(portion.points));
  all["point_slots"] = view_of(std::move(portion.point_slots));
  all["positions"] = values_of(std::move(portion.positions), description.positions);
  all["point_data"] = values_of(std::move(portion.point_arrays), description, Domain::point);
  all["ended_slots"] = view_of(std::move(portion.ended_slots));
  all["slot_count"] = portion.slot_count;
  return all;
}

}  // namespace

void bind_stream(py::module_& module) {
  py::class_<Reader>(module, "StreamReader")
      .def(py::init(&open_stream), py::arg("input"), py::arg("step"), py::arg("any_order"), py::arg("memory"))
      .def("description", &description_of)
      .def("next", &next);
}

}  // namespace maille::python
