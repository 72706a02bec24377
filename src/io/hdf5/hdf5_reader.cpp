// What the child process does: the only file that calls the library. Whatever it does wrong with a damaged
// file ends this process only, but its answers may be wrong, so Hdf5File checks them.
#include "io/hdf5/hdf5_reader.h"

#include <algorithm>

#include "base/bytes.h"

#include "io/buffered_writer.h"
#include "io/hdf5/hdf5_library.h"

namespace maille {
namespace {

/// Something of the library that must be closed. Negative: there is none.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// What the library reads is the source, by a driver of our own (H5FD, its virtual file layer). It opens
/// files by name, so this is the name of the only one, and every other name fails.
constexpr const char* only_name = "source";
struct SourceFile {
  H5FD_t base{};  // first: the library knows no more
  const Source* source = nullptr;
  haddr_t end_of_allocation = 0;
};

const SourceFile& of(const H5FD_t* file) {
  return *reinterpret_cast<const SourceFile*>(file);
}

/// `H5FD_class_t`, with the functions that a driver must have. There is one for the process.
const H5FD_class_t& source_driver(const Hdf5Library& h5) {
  static const Hdf5Library& library = h5;
  static const H5FD_class_t driver = [] {
    H5FD_class_t d{};
#ifdef H5FD_CLASS_VERSION
    d.version = H5FD_CLASS_VERSION;
    d.value = static_cast<H5FD_class_value_t>(512 + 0x6d61);  // of those that nobody has registered
#endif
    d.name = "maille_source";
    d.maxaddr = INT64_MAX;
    d.fc_degree = H5F_CLOSE_STRONG;
    d.fapl_size = sizeof(const Source*);
    d.open = [](const char* name, unsigned flags, hid_t access, haddr_t) -> H5FD_t* {
      const void* const info = library.p_get_driver_info(access);
      // A link to another file comes here, too.
      if (std::string_view(name) != only_name || flags != 0 || info == nullptr) return nullptr;
      auto* const file = new SourceFile;
      file->source = *static_cast<const Source* const*>(info);
      return &file->base;
    };
    d.close = [](H5FD_t* file) -> herr_t {
      delete reinterpret_cast<SourceFile*>(file);
      return 0;
    };
    d.get_eoa = [](const H5FD_t* file, H5FD_mem_t) { return of(file).end_of_allocation; };
    d.set_eoa = [](H5FD_t* file, H5FD_mem_t, haddr_t end) -> herr_t {
      reinterpret_cast<SourceFile*>(file)->end_of_allocation = end;
      return 0;
    };
    d.get_eof = [](const H5FD_t* file, H5FD_mem_t) -> haddr_t { return of(file).source->size(); };
    d.read = [](H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, size_t size, void* out) -> herr_t {
      const Source& source = *of(file).source;
      // Damaged files make the library read anywhere.
      if (at > source.size() || size > source.size() - at) return -1;
      return source.read_at(at, {static_cast<std::byte*>(out), size}) ? 0 : -1;
    };
    // Files are opened for reading; the library demands the function nevertheless.
    d.write = [](H5FD_t*, H5FD_mem_t, hid_t, haddr_t, size_t, const void*) -> herr_t { return -1; };
    return d;
  }();
  return driver;
}

/// Answers the questions of Hdf5File. Paths come from our own readers, names of members from the file.
class LoadedFile {
 public:
  LoadedFile(const Hdf5Library& h5, hid_t file, uint64_t bytes) : h5_(h5), file_(file), bytes_(bytes) {}

  void is_group(const std::string& path, ByteWriter& out) const {
    const Handle object = opened(path);
    out.put<uint8_t>(object >= 0 && h5_.i_get_type(object) == H5I_GROUP);
  }
  void members(const std::string& group, ByteWriter& out) const;
  void find(const std::string& path, ByteWriter& out) const {
    const Handle object = opened(path);
    const std::optional<Hdf5Dataset> dataset = object >= 0 ? described(object) : std::nullopt;
    out.put<uint8_t>(dataset.has_value());
    if (dataset) put_dataset(*dataset, out);
  }
  /// Nothing where they cannot be read.
  void rows(const std::string& path, uint64_t first, uint64_t count, uint64_t bytes, ByteWriter& out) const;
  void text(const std::string& object, const std::string& name, ByteWriter& out) const;
  void number(const std::string& object, const std::string& name, ByteWriter& out) const;

 private:
  Handle opened(const std::string& path) const {
    return {h5_.o_open(file_, path.c_str(), H5P_DEFAULT), h5_.o_close};
  }
  /// Negative where the object has no such attribute.
  Handle attribute(const std::string& object, const std::string& name) const {
    const Handle owner = opened(object);
    const bool has = owner >= 0 && h5_.a_exists(owner, name.c_str()) > 0;
    return {has ? h5_.a_open(owner, name.c_str(), H5P_DEFAULT) : hid_t{-1}, h5_.a_close};
  }
  /// Of the machine's numbers.
  Handle native(hid_t type) const { return {h5_.t_get_native_type(type, H5T_DIR_ASCEND), h5_.t_close}; }
  std::optional<Scalar> scalar_of(hid_t native_type) const;
  std::optional<Hdf5Dataset> described(hid_t object) const;
  void describe_storage(hid_t object, Hdf5Dataset& dataset) const;
  std::optional<std::string> text_of(const std::string& object, const std::string& name) const;
  std::optional<int64_t> number_of(const std::string& object, const std::string& name) const;

  const Hdf5Library& h5_;
  hid_t file_;
  uint64_t bytes_;
};

void LoadedFile::members(const std::string& group, ByteWriter& out) const {
  const Handle object = opened(group);
  H5G_info_t info{};
  if (object < 0 || h5_.i_get_type(object) != H5I_GROUP || h5_.g_get_info(object, &info) < 0) return;
  // Each link takes some bytes of the file, whatever the file says of their number.
  for (hsize_t i = 0; i < std::min<hsize_t>(info.nlinks, bytes_); ++i) {
    // Longer names are passed over: nothing that we look for has one.
    char name[4096];
    const ssize_t length =
        h5_.l_get_name_by_idx(object, ".", H5_INDEX_NAME, H5_ITER_INC, i, name, sizeof(name), H5P_DEFAULT);
    if (length < 0) break;
    if (static_cast<size_t>(length) < sizeof(name)) out.put_string({name, static_cast<size_t>(length)});
  }
}

std::optional<Scalar> LoadedFile::scalar_of(hid_t native_type) const {
  const H5T_class_t kind = h5_.t_get_class(native_type);
  const size_t size = h5_.t_get_size(native_type);
  if (kind == H5T_FLOAT && size == 4) return Scalar::f32;
  if (kind == H5T_FLOAT && size == 8) return Scalar::f64;
  if (kind != H5T_INTEGER) return std::nullopt;
  const bool sign = h5_.t_get_sign(native_type) == H5T_SGN_2;
  switch (size) {
    case 1:
      return sign ? Scalar::i8 : Scalar::u8;
    case 2:
      return sign ? Scalar::i16 : Scalar::u16;
    case 4:
      return sign ? Scalar::i32 : Scalar::u32;
    case 8:
      return sign ? Scalar::i64 : Scalar::u64;
    default:
      return std::nullopt;
  }
}

std::optional<Hdf5Dataset> LoadedFile::described(hid_t object) const {
  if (h5_.i_get_type(object) != H5I_DATASET) return std::nullopt;
  const Handle space(h5_.d_get_space(object), h5_.s_close);
  const Handle type(h5_.d_get_type(object), h5_.t_close);
  const int rank = space < 0 ? -1 : h5_.s_get_ndims(space);
  if (rank < 0 || rank > H5S_MAX_RANK || type < 0) return std::nullopt;
  Hdf5Dataset dataset;
  hsize_t shape[H5S_MAX_RANK] = {}, most[H5S_MAX_RANK] = {};
  if (h5_.s_get_dims(space, shape, most) < 0) return std::nullopt;
  dataset.shape.assign(shape, shape + rank);
  dataset.grows = rank > 0 && most[0] == H5S_UNLIMITED;
  if (h5_.t_get_class(type) == H5T_STRING) {
    if (h5_.t_is_variable_str(type) == 0) dataset.text_size = h5_.t_get_size(type);
  } else {
    const Handle machine = native(type);
    if (machine >= 0) dataset.type = scalar_of(machine);
  }
  describe_storage(object, dataset);
  return dataset;
}

void LoadedFile::describe_storage(hid_t object, Hdf5Dataset& dataset) const {
  const Handle properties(h5_.d_get_create_plist(object), h5_.p_close);
  // Where the library does not say how values are stored, they are taken to be elsewhere, and refused.
  dataset.elsewhere = true;
  if (properties < 0) return;
  const H5D_layout_t layout = h5_.p_get_layout(properties);
  dataset.elsewhere = h5_.p_get_external_count(properties) != 0 || layout == H5D_VIRTUAL || layout < 0;
  if (dataset.elsewhere) return;
  dataset.stored = h5_.d_get_storage_size(object);
  dataset.packed = h5_.p_get_nfilters(properties) > 0;
  if (layout != H5D_CHUNKED) return;
  hsize_t chunk[H5S_MAX_RANK] = {};
  const int rank = h5_.p_get_chunk(properties, H5S_MAX_RANK, chunk);
  dataset.chunk_size = 1;
  for (int k = 0; k < rank; ++k) {
    const uint64_t most = UINT32_MAX / std::max<uint64_t>(dataset.chunk_size, 1);
    dataset.chunk_size = chunk[k] > most ? UINT32_MAX : dataset.chunk_size * chunk[k];
  }
}

void LoadedFile::rows(const std::string& path, uint64_t first, uint64_t count, uint64_t bytes,
                      ByteWriter& out) const {
  const Handle object = opened(path);
  const std::optional<Hdf5Dataset> dataset = object < 0 ? std::nullopt : described(object);
  if (!dataset) return;
  const Handle space(h5_.d_get_space(object), h5_.s_close);
  const Handle type(h5_.d_get_type(object), h5_.t_close);
  const Handle machine = native(type);
  std::vector<hsize_t> from(dataset->shape.size()), size(dataset->shape.begin(), dataset->shape.end());
  if (!size.empty()) {
    from[0] = first;
    size[0] = count;
  }
  const auto rank = static_cast<int>(size.size());
  const bool chosen = rank == 0 || h5_.s_select_hyperslab(space, H5S_SELECT_SET, from.data(), nullptr,
                                                          size.data(), nullptr) >= 0;
  // A scalar has no dimensions to choose from: all of it is read.
  const Handle memory(rank == 0 ? -1 : h5_.s_create_simple(rank, size.data(), nullptr), h5_.s_close);
  std::vector<std::byte> values(bytes);
  const bool read = chosen && machine >= 0 && (rank == 0 || memory >= 0) &&
                    h5_.d_read(object, machine, rank == 0 ? H5S_ALL : hid_t{memory},
                               rank == 0 ? H5S_ALL : hid_t{space}, H5P_DEFAULT, values.data()) >= 0;
  if (read) out.put_bytes(values);
}

std::optional<std::string> LoadedFile::text_of(const std::string& object, const std::string& name) const {
  const Handle attribute = this->attribute(object, name);
  if (attribute < 0) return std::nullopt;
  const Handle space(h5_.a_get_space(attribute), h5_.s_close);
  const Handle type(h5_.a_get_type(attribute), h5_.t_close);
  if (space < 0 || type < 0 || h5_.s_get_npoints(space) != 1 || h5_.t_get_class(type) != H5T_STRING)
    return std::nullopt;
  std::string value;
  if (h5_.t_is_variable_str(type) > 0) {
    char* found = nullptr;
    if (h5_.a_read(attribute, type, &found) < 0 || found == nullptr) return std::nullopt;
    value = found;
    h5_.free_memory(found);
    return value;
  }
  const size_t size = h5_.t_get_size(type);
  if (size > 1u << 16) return std::nullopt;  // as long as an attribute may be where it is usually kept
  value.resize(size);
  if (h5_.a_read(attribute, type, value.data()) < 0) return std::nullopt;
  value.resize(std::min(value.size(), value.find('\0')));
  while (!value.empty() && value.back() == ' ') value.pop_back();
  return value;
}

std::optional<int64_t> LoadedFile::number_of(const std::string& object, const std::string& name) const {
  const Handle attribute = this->attribute(object, name);
  if (attribute < 0) return std::nullopt;
  const Handle space(h5_.a_get_space(attribute), h5_.s_close);
  const Handle type(h5_.a_get_type(attribute), h5_.t_close);
  const Handle machine = native(type);
  const hssize_t values = space < 0 ? 0 : h5_.s_get_npoints(space);
  const std::optional<Scalar> scalar = machine < 0 ? std::nullopt : scalar_of(machine);
  // The version of VTKHDF is two numbers, of which the first is what matters. 16 bounds the buffer below.
  if (!scalar || is_float(*scalar) || values < 1 || values > 16) return std::nullopt;
  Array array = make_array(name, Domain::mesh, *scalar, 1);
  array.resize(static_cast<uint64_t>(values));
  if (h5_.a_read(attribute, machine, array.bytes.data()) < 0) return std::nullopt;
  return with_type(*scalar,
                   [&](auto zero) { return static_cast<int64_t>(array.values<decltype(zero)>()[0]); });
}

void LoadedFile::text(const std::string& object, const std::string& name, ByteWriter& out) const {
  const std::optional<std::string> value = text_of(object, name);
  out.put<uint8_t>(value.has_value());
  if (value) out.put_string(*value);
}

void LoadedFile::number(const std::string& object, const std::string& name, ByteWriter& out) const {
  const std::optional<int64_t> value = number_of(object, name);
  out.put<uint8_t>(value.has_value());
  if (value) out.put_zigzag(*value);
}

void answer(const LoadedFile& file, ByteReader& in, ByteWriter& out) {
  const auto question = static_cast<Hdf5Question>(in.get<uint8_t>());
  const std::string path = in.get_string();
  switch (question) {
    case Hdf5Question::is_group:
      return file.is_group(path, out);
    case Hdf5Question::members:
      return file.members(path, out);
    case Hdf5Question::find:
      return file.find(path, out);
    case Hdf5Question::rows: {
      const uint64_t first = in.get_count(), count = in.get_count(), bytes = in.get_count();
      return file.rows(path, first, count, bytes, out);
    }
    case Hdf5Question::text:
      return file.text(path, in.get_string(), out);
    case Hdf5Question::number:
      return file.number(path, in.get_string(), out);
  }
}

/// Negative where it cannot be opened.
hid_t opened(const Hdf5Library& h5, const Source& source) {
  if (h5.open() < 0) return -1;
  h5.e_set_auto(H5E_DEFAULT, nullptr, nullptr);
  h5.pl_set_loading_state(0);  // no code that a file asks for
  const hid_t driver = h5.fd_register(&source_driver(h5));
  const Handle access(h5.p_create(*h5.file_access), h5.p_close);
  const Source* const info = &source;
  const bool ready = driver >= 0 && access >= 0 && h5.p_set_driver(access, driver, &info) >= 0;
  return ready ? h5.f_open(only_name, 0, access) : -1;  // 0: for reading
}

ChildProcess::Answer answers(const Hdf5Library& h5, const Source& source) {
  const hid_t id = opened(h5, source);
  // Nobody closes it: the process ends.
  return [file = LoadedFile(h5, id, source.size()), id](Bytes question) {
    ByteReader in(question);
    ByteWriter out;
    if (id >= 0 && !question.empty()) answer(file, in, out);
    if (question.empty()) out.put<uint8_t>(id >= 0);
    return out.take();
  };
}

}  // namespace

Result<std::function<ChildProcess::Answer()>> hdf5_reader(const Source& source) {
  // The library is loaded before there is a child: loading takes locks that another thread may hold while
  // this process is copied.
  const Hdf5Library* const h5 = loaded_hdf5();
  if (h5 != nullptr) return [h5, &source] { return answers(*h5, source); };
  return failure(ErrorCode::unsupported, source.name() + ": files of HDF5 need its library (" +
                                             MAILLE_HDF5_LIBRARY +
                                             "), which this machine does not have (Debian: libhdf5-103-1)");
}

}  // namespace maille
