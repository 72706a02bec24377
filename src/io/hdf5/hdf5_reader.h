#pragma once

#include <maille/source.h>

#include "base/bytes.h"
#include "io/hdf5/child_process.h"
#include "io/hdf5/hdf5_file.h"

namespace maille {

/// What Hdf5File asks its child process: a question, a path and what it needs. An empty message asks whether
/// the file could be opened. Both sides are the same program, so this protocol has no versions.
enum class Hdf5Question : uint8_t { is_group, members, find, rows, text, number };

// A pair: the same fields in the same order, which the child writes and the parent reads.
void put_dataset(const Hdf5Dataset& dataset, ByteWriter& out);
Hdf5Dataset get_dataset(ByteReader& in);

/// What the child is to do for a source, which must be in memory or mapped. Error: unsupported, where there
/// is no library.
Result<std::function<ChildProcess::Answer()>> hdf5_reader(const Source& source);

}  // namespace maille
