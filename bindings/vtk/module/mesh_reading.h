#pragma once

#include <maille/decode.h>
#include <maille/file.h>
#include <maille/geometry.h>
#include <maille/random_access.h>
#include <maille/source.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace maille_vtk {

/// Opens a path, or an address.
maille::Result<std::shared_ptr<const maille::Source>> open(const std::string& name);

/// Threads for decoding, of which there are few sets in a process, and which are never ended: other
/// libraries' destructors may run later. Nullptr for one thread.
maille::Executor* threads(unsigned count);

/// What a pipeline asks for.
struct Request {
  maille::DecodeOptions options;
  std::optional<maille::Box> box;
  maille::Detail detail = maille::Detail::full();  ///< mode random
  unsigned piece = 0, pieces = 1;                  ///< the share of one process

  bool is_whole() const { return !box && pieces == 1 && detail.level == 0; }
};

struct Answer {
  maille::Mesh mesh;
  std::vector<std::string> problems;  ///< what is damaged and was left out
};

maille::Result<Answer> read(const maille::Source& source, const maille::FileInfo& info,
                            const Request& request);

}  // namespace maille_vtk
