#pragma once

#include <maille/source.h>
#include <memory>
#include <vector>

namespace maille {

/// Do these bytes begin like a gzip file?
bool is_gzip(Bytes bytes);

/// Unpacks a gzip file of one or several members. Nothing is allocated before all of it was counted. Errors:
/// memory_bound beyond `limit` bytes; malformed_input, naming `name`, for damage or truncation.
Result<std::vector<std::byte>> gunzip(Bytes bytes, uint64_t limit, const std::string& name);

/// The first bytes of what a gzip file holds, at most `count`; fewer when it is damaged.
std::vector<std::byte> gunzip_front(Bytes bytes, size_t count);

/// Packs what is written to it into `sink`. commit() ends the gzip file but does not commit `sink`. The same
/// bytes always give the same file (no time stamp).
std::unique_ptr<Sink> gzip_sink(Sink& sink);

}  // namespace maille
