#pragma once

#include <maille/source.h>

#include <limits>

namespace maille {

/// Whether this is an address to be fetched: "http://..." or "https://...".
bool is_url(const std::string& text);
/// An address as messages show it: without user and password, and without what follows the "?", which may be
/// a signature. Other text is returned unchanged.
std::string shown_url(const std::string& url);

struct HttpOptions {
  /// Bytes of blocks that are kept to be read again; the least recently used ones go first. At least 1 MiB is
  /// used.
  uint64_t cache_bytes = uint64_t{64} << 20;
  /// A server that does not know ranges sends the whole file. Up to this size it is taken, into a temporary
  /// file; beyond, http_source() fails.
  uint64_t whole_bytes = uint64_t{64} << 20;
  /// What may be fetched in all, so that no large file is fetched whole by accident; see allow().
  uint64_t most_bytes = std::numeric_limits<uint64_t>::max();
  /// Gaps of up to so many bytes between two ranges are fetched along with them, since another request would
  /// cost more. For a box of 1 % of the dragon, 16 KiB take 3 to 5 requests and 131 to 193 kB, no gap 4 to 9
  /// and 119 to 147 kB (docs/history.md).
  uint64_t gap_bytes = 16 << 10;
  unsigned connections = 6;     ///< at once
  unsigned attempts = 5;        ///< to get one range
  double pause_seconds = 0.25;  ///< before the second attempt; doubled from one to the next
  double retry_seconds = 60;    ///< after the first fault of a call, how long new attempts are made
  double stall_seconds = 20;    ///< a transfer that brings next to nothing in so long counts as a fault
};

struct HttpStatistics {
  uint64_t requests = 0;
  uint64_t round_trips = 0;  ///< requests one after the other; those sent at once count as one
  uint64_t bytes = 0;        ///< of files, as received
};

/// A file on a web server.
class HttpSource : public Source {
 public:
  virtual HttpStatistics statistics() const = 0;
  /// Raises HttpOptions::most_bytes: so much more is wanted.
  virtual void allow(uint64_t bytes) const = 0;
};

/// A file on a web server, read by ranges as they are wanted: one request for size and first 64 KiB, then
/// what lies near one another together, the rest at once over several connections. Server faults that pass
/// (lost connections, stalls, 429, 5xx) are tried again within the bounds given. A file that changes in
/// between is noticed by its ETag, date or size, and is an error from then on. Redirections are followed,
/// five at most. Error: network, naming address, range and what was answered; unsupported in a library built
/// without libcurl.
[[nodiscard]] Result<std::unique_ptr<HttpSource>> http_source(const std::string& url,
                                                              const HttpOptions& options = {});

}  // namespace maille
