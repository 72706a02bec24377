#pragma once

#include <maille/http.h>

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/scratch_file.h"
#include "io/http/answer.h"

namespace maille {

/// A range that is fetched: from `offset` on, as long as `out`. What follows is HttpRanges' own, and kept
/// from one attempt to the next.
struct HttpPiece {
  uint64_t offset = 0;
  std::span<std::byte> out;

  uint64_t received = 0;
  bool done = false;
  bool moved = false;  ///< asked for where a redirection led
  unsigned faults = 0;
  double not_before = 0;  ///< on the clock of HttpRanges
};

/// One file on a server: what it was when it was opened, and ranges of it with all that may go wrong on the
/// way: lost and stalled connections, redirections, servers without ranges, files that change meanwhile.
/// Everything is tried again within bounds of number and time. For one thread at a time.
class HttpRanges {
 public:
  HttpRanges(std::string url, const HttpOptions& options);
  ~HttpRanges();
  HttpRanges(const HttpRanges&) = delete;
  HttpRanges& operator=(const HttpRanges&) = delete;

  /// Fills `front` with the first bytes, as many as there are, and learns the size. From a server that knows
  /// no ranges it takes the whole file: see whole(); `front` is empty then. Errors: network; cannot_read or
  /// write_failed of the temporary file come as network, too.
  Result<> open(std::vector<std::byte>& front);
  uint64_t size() const { return size_; }
  /// The file, where it had to be fetched whole.
  ScratchFile* whole() { return whole_ ? &*whole_ : nullptr; }

  /// Fetches all pieces, several at once. Error: network, after which pieces may be filled in part. Once the
  /// file has changed on the server, all later calls fail, as older blocks do not go with newer ones.
  Result<> fetch(std::span<HttpPiece> pieces);
  /// From now on caches on the way are asked to look again: what they sent had a wrong checksum.
  void distrust_caches() { fresh_ = true; }

  const HttpStatistics& statistics() const { return statistics_; }

 private:
  class Transfer;
  struct Connections;
  /// What an answer or its end means.
  struct Verdict {
    enum Kind { good, again, fatal, changed } kind = good;
    std::string what;
    bool counts = true;  ///< as one of the attempts, and is waited for
  };

  Verdict judge(const HttpAnswer& answer, HttpPiece& piece);
  Verdict judge_front(const HttpAnswer& answer, HttpPiece& piece);
  Verdict judge_range(const HttpAnswer& answer, const HttpPiece& piece) const;
  Verdict judge_whole(const HttpAnswer& answer);
  Verdict judge_status(int status, const HttpPiece& piece);
  bool is_changed(const HttpAnswer& answer) const;
  Verdict judge_end(const Transfer& transfer, int code) const;  ///< `code`: of libcurl
  Result<> run(std::span<HttpPiece> pieces);
  Result<> start(HttpPiece& piece);
  Result<> finish_transfers();
  void remember_redirection(const Transfer& transfer);
  Result<> end_stalled();
  Result<> end(size_t transfer, const Verdict& verdict);
  Result<> ask_again(HttpPiece& piece, const std::string& what, double asked_pause);
  void wait(std::span<const HttpPiece> pieces) const;
  tl::unexpected<Error> give_up(const HttpPiece& piece, const std::string& what) const;
  double now() const;

  // What the user gave, and where redirections led.
  std::string original_, url_;
  HttpOptions options_;
  std::unique_ptr<Connections> connections_;
  std::vector<std::unique_ptr<Transfer>> active_;
  bool opened_ = false;
  bool fresh_ = false;
  uint64_t size_ = 0;
  std::string etag_, last_modified_;
  std::optional<ScratchFile> whole_;
  std::optional<double> first_fault_;
  std::optional<Error> changed_;
  HttpStatistics statistics_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace maille
