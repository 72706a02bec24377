#include "io/gltf/gltf_accessors.h"

#include <algorithm>
#include <optional>

#include "base/result.h"
#include "io/buffered_writer.h"

namespace maille {
namespace {

std::optional<Scalar> scalar_of(int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return Scalar::i8;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return Scalar::u8;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return Scalar::i16;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return Scalar::u16;
    case TINYGLTF_COMPONENT_TYPE_INT:  // not in the standard, but seen in custom attributes
      return Scalar::i32;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return Scalar::u32;
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return Scalar::f32;
    case TINYGLTF_COMPONENT_TYPE_DOUBLE:
      return Scalar::f64;
    default:
      return std::nullopt;
  }
}

/// The library's messages are lines; ours are one sentence, of bounded length.
std::string one_sentence(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.substr(0, 300);
}

}  // namespace

Result<tinygltf::Model> load_gltf_model(GltfFile& file) {
  tinygltf::Model model;
  tinygltf::TinyGLTF loader;
  std::string error, warning;
  const bool parsed = loader.LoadASCIIFromString(&model, &error, &warning, file.scene.data(),
                                                 static_cast<unsigned>(file.scene.size()), "");
  // It skips primitives it cannot parse and goes on, so what it says counts, not only what it returns.
  if (!parsed || !error.empty())
    return failure(ErrorCode::malformed_input, file.name + ": " + one_sentence(error));
  file.scene = {};
  return model;
}

Result<const tinygltf::Accessor*> GltfAccessors::get(int index, const std::string& where) const {
  if (index < 0 || static_cast<size_t>(index) >= model_.accessors.size()) {
    return malformed(where + " uses accessor " + std::to_string(index) + ", but there are " +
                     std::to_string(model_.accessors.size()));
  }
  return &model_.accessors[static_cast<size_t>(index)];
}

Result<GltfLayout> GltfAccessors::layout(const tinygltf::Accessor& accessor, const std::string& where) const {
  const std::optional<Scalar> type = scalar_of(accessor.componentType);
  if (!type)
    return malformed(where + " has the unknown componentType " + std::to_string(accessor.componentType));
  GltfLayout layout;
  layout.type = *type;
  layout.normalized = accessor.normalized && !is_float(*type);
  const uint32_t matrix = accessor.type == TINYGLTF_TYPE_MAT2   ? 2
                          : accessor.type == TINYGLTF_TYPE_MAT3 ? 3
                          : accessor.type == TINYGLTF_TYPE_MAT4 ? 4
                                                                : 0;
  // TINYGLTF's numbers of VEC2 to VEC4 are 2 to 4.
  layout.rows = matrix != 0                             ? matrix
                : accessor.type == TINYGLTF_TYPE_SCALAR ? 1
                                                        : static_cast<uint32_t>(accessor.type);
  layout.columns = matrix != 0 ? matrix : 1;
  return layout;
}

// An accessor without a buffer view is all zeros, which its sparse part then changes (glTF 2.0, 3.6.2.3).
Result<> GltfAccessors::read(const tinygltf::Accessor& accessor, const GltfLayout& layout,
                             const std::string& where, std::span<std::byte> out) const {
  std::fill(out.begin(), out.end(), std::byte{0});
  if (accessor.bufferView >= 0) {
    uint64_t stride = 0;
    const Bytes from = MAILLE_TRY(elements(accessor.bufferView, accessor.byteOffset, accessor.count,
                                           layout.element_size(), stride, where));
    for (uint64_t i = 0; i < accessor.count; ++i) {
      copy_element(layout, from.data() + i * stride, out.data() + i * layout.tuple_size());
    }
  }
  return accessor.sparse.isSparse ? read_sparse(accessor, layout, where, out) : Result<>{};
}

tl::unexpected<Error> GltfAccessors::malformed(const std::string& what) const {
  return failure(ErrorCode::malformed_input, file_.name + ": " + what);
}

// Columns of small matrices begin at multiples of four bytes (glTF 2.0, 3.6.2.4), so there may be gaps
// between them.
void GltfAccessors::copy_element(const GltfLayout& layout, const std::byte* from, std::byte* to) {
  for (uint32_t c = 0; c < layout.columns; ++c) {
    std::memcpy(to + c * layout.column_size(), from + c * layout.column_stride(), layout.column_size());
  }
}

Result<Bytes> GltfAccessors::elements(int view_index, uint64_t offset, uint64_t count, uint64_t size,
                                      uint64_t& stride, const std::string& where) const {
  if (view_index < 0 || static_cast<size_t>(view_index) >= model_.bufferViews.size()) {
    return malformed(where + " uses buffer view " + std::to_string(view_index) + ", which does not exist");
  }
  const tinygltf::BufferView& view = model_.bufferViews[static_cast<size_t>(view_index)];
  const std::string in = where + ", buffer view " + std::to_string(view_index);
  if (view.buffer < 0 || static_cast<size_t>(view.buffer) >= file_.buffers.size()) {
    return malformed(in + " uses buffer " + std::to_string(view.buffer) + ", which does not exist");
  }
  // Compressed views may have a fallback buffer without bytes; with bytes they can be read.
  if (view.extensions.count("EXT_meshopt_compression") + view.extensions.count("KHR_meshopt_compression") !=
          0 &&
      file_.buffers[static_cast<size_t>(view.buffer)].empty()) {
    return failure(ErrorCode::unsupported,
                   file_.name + ": " + in +
                       " is compressed by EXT_meshopt_compression, which cannot be read "
                       "here; decompress it first, e.g. with \"gltf-transform copy\"");
  }
  const Bytes buffer = file_.buffers[static_cast<size_t>(view.buffer)];
  // Comparisons subtract and divide, so that no hostile offset, count or stride overflows.
  if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset) {
    return malformed(in + " goes beyond the " + std::to_string(buffer.size()) + " bytes of its buffer");
  }
  stride = view.byteStride == 0 ? size : view.byteStride;
  if (stride < size) return malformed(in + " has a byteStride smaller than the elements");
  const Bytes bytes = buffer.subspan(view.byteOffset, view.byteLength);
  if (count == 0) return bytes.first(0);
  if (offset > bytes.size() || size > bytes.size() - offset ||
      count - 1 > (bytes.size() - offset - size) / stride) {
    return malformed(in + ": " + std::to_string(count) + " elements of " + std::to_string(size) +
                     " bytes do not fit its " + std::to_string(bytes.size()) + " bytes");
  }
  return bytes.subspan(static_cast<size_t>(offset));
}

Result<> GltfAccessors::read_sparse(const tinygltf::Accessor& accessor, const GltfLayout& layout,
                                    const std::string& in, std::span<std::byte> out) const {
  const auto& sparse = accessor.sparse;
  const std::string where = in + ", its sparse part";
  const std::optional<Scalar> type = scalar_of(sparse.indices.componentType);
  if (!type || (*type != Scalar::u8 && *type != Scalar::u16 && *type != Scalar::u32)) {
    return malformed(where + " has indices that are not unsigned integers");
  }
  // The library reads these as signed numbers, whatever the file says.
  if (sparse.count < 0 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0) {
    return malformed(where + " has a negative count or offset");
  }
  const auto count = static_cast<uint64_t>(sparse.count);
  uint64_t index_stride = 0, value_stride = 0;
  const Bytes indices =
      MAILLE_TRY(elements(sparse.indices.bufferView, static_cast<uint64_t>(sparse.indices.byteOffset), count,
                          size_of(*type), index_stride, where));
  const Bytes values =
      MAILLE_TRY(elements(sparse.values.bufferView, static_cast<uint64_t>(sparse.values.byteOffset), count,
                          layout.element_size(), value_stride, where));
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t index = with_type(*type, [&](auto zero) {
      return static_cast<uint64_t>(load<decltype(zero)>(indices.data() + i * index_stride));
    });
    if (index >= accessor.count) {
      return malformed(where + " changes element " + std::to_string(index) + " of " +
                       std::to_string(accessor.count));
    }
    copy_element(layout, values.data() + i * value_stride, out.data() + index * layout.tuple_size());
  }
  return {};
}

}  // namespace maille
