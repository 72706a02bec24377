#include "io/http/ranges.h"

#include <maille/version.h>

#include <algorithm>

#include "base/result.h"
#include "io/http/curl.h"

namespace maille {
namespace {

// The first request's range: a file of mode random has its index's first page and the coarsest levels there
// (docs/format.md, 17). One round trip then opens it.
constexpr size_t front_bytes = size_t{64} << 10;
/// For a head, with those of redirections before it; more is no head. Chosen, not swept.
constexpr uint64_t most_head_bytes = uint64_t{256} << 10;
/// What a transfer must bring in HttpOptions::stall_seconds: with the default 3.3 kB a second, so that nobody
/// is kept waiting for longer than the bytes that were asked for take. Chosen, not swept, like the three
/// bounds below.
constexpr uint64_t stall_bytes = uint64_t{64} << 10;
constexpr long connect_seconds = 15;
constexpr long most_redirections = 5;
constexpr double longest_pause = 8;

/// Answers that the same request may not get again: too slow, too many, and what proxies say of servers
/// behind them. 501 and 505 are not among them, as they stay true.
bool is_again_later(int status) {
  return status == 408 || status == 429 || status == 500 || (status >= 502 && status <= 504);
}

std::string reason_of(int status) {
  switch (status) {
    case 401:
      return " (it wants a password)";
    case 403:
      return " (access is not allowed)";
    case 404:
      return " (there is no such file)";
    case 410:
      return " (the file is gone)";
    case 429:
      return " (too many requests)";
    case 503:
      return " (service unavailable)";
    default:
      return "";
  }
}

std::string readable(uint64_t bytes) {
  const bool many = bytes >= uint64_t{1} << 20;
  return std::to_string(bytes >> (many ? 20 : 10)) + (many ? " MiB" : " KiB");
}

}  // namespace

/// The connections of libcurl, which outlive transfers so that they are used again.
struct HttpRanges::Connections {
  const Curl* curl = nullptr;
  CURLM* multi = nullptr;
  ~Connections() {
    if (multi != nullptr) curl->multi_cleanup(multi);
  }
};

/// One request under way. It belongs to HttpRanges::active_ and writes into its piece as bytes come, so that
/// what came before a fault is kept. libcurl holds its address, so it is neither copied nor moved.
class HttpRanges::Transfer {
 public:
  Transfer(HttpRanges& ranges, HttpPiece& to)
      : piece(&to), owner_(&ranges), curl_(*ranges.connections_->curl), easy_(curl_.easy_init()) {}
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;
  ~Transfer() {
    if (easy_ != nullptr) {
      curl_.multi_remove_handle(owner_->connections_->multi, easy_);
      curl_.easy_cleanup(easy_);
    }
    curl_.slist_free_all(headers_);
  }

  bool start() {
    if (easy_ == nullptr) return false;
    set_address();
    set_headers();
    window_begin_ = owner_->now();
    return curl_.multi_add_handle(owner_->connections_->multi, easy_) == CURLM_OK;
  }

  CURL* easy() const { return easy_; }
  /// In the words of libcurl.
  std::string problem(int code) const {
    return *problem_ != 0 ? problem_ : curl_.easy_strerror(static_cast<CURLcode>(code));
  }
  const HttpAnswer& answer() const { return answer_; }
  /// What was decided on the answer's head; nothing before it was judged.
  const std::optional<Verdict>& verdict() const { return verdict_; }
  void judge() {
    if (!verdict_) verdict_ = owner_->judge(answer_, *piece);
  }
  /// Whether fewer than stall_bytes came in the last stall_seconds. Looking begins the next such window, so a
  /// transfer that slows down is noticed within two of them.
  bool is_stalled() {
    if (owner_->now() - window_begin_ < owner_->options_.stall_seconds) return false;
    const bool stalled = window_bytes_ < stall_bytes;
    window_begin_ = owner_->now();
    window_bytes_ = 0;
    return stalled;
  }
  /// Whether all came that the answer announced, which may be less than what was asked for.
  bool is_whole() const { return announced_ == taken_; }
  uint64_t taken() const { return taken_; }

  HttpPiece* piece;

 private:
  template <class Value>
  void set(CURLoption option, Value value) {
    curl_.easy_setopt(easy_, option, value);
  }
  void set_address() {
    set(CURLOPT_URL, owner_->url_.c_str());
    // Nothing but the web: no file:// or gopher:// by way of a redirection, and never from https back to
    // http.
    set(CURLOPT_PROTOCOLS_STR, "http,https");
    const bool safe = owner_->original_.compare(0, 6, "https:") == 0;
    set(CURLOPT_REDIR_PROTOCOLS_STR, safe ? "https" : "http,https");
    set(CURLOPT_FOLLOWLOCATION, 1L);
    set(CURLOPT_MAXREDIRS, most_redirections);
    set(CURLOPT_CONNECTTIMEOUT, connect_seconds);
    // Signals belong to the program. PIPEWAIT: rather wait for a connection that can carry several requests
    // (HTTP/2) than open another.
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_PIPEWAIT, 1L);
    set(CURLOPT_PRIVATE, this);
    set(CURLOPT_ERRORBUFFER, problem_);
    set(CURLOPT_HEADERFUNCTION, take_head);
    set(CURLOPT_HEADERDATA, this);
    set(CURLOPT_WRITEFUNCTION, take_body);
    set(CURLOPT_WRITEDATA, this);
    set(CURLOPT_USERAGENT, (std::string("maille/") + library_version()).c_str());
  }

  void set_headers() {
    const uint64_t first = piece->offset + piece->received, last = piece->offset + piece->out.size() - 1;
    set(CURLOPT_RANGE, (std::to_string(first) + "-" + std::to_string(last)).c_str());
    // Ranges are those of what is sent; packed by the server, they would be of something else.
    headers_ = curl_.slist_append(headers_, "Accept-Encoding: identity");
    if (owner_->fresh_) headers_ = curl_.slist_append(headers_, "Cache-Control: no-cache");
    // With If-Range a server whose file changed sends all of it (status 200), which judge() notices. RFC 9110
    // (13.1.5) forbids weak tags here; those, and dates, are compared with what comes.
    const std::string& etag = owner_->etag_;
    if (!etag.empty() && etag.compare(0, 2, "W/") != 0)
      headers_ = curl_.slist_append(headers_, ("If-Range: " + etag).c_str());
    set(CURLOPT_HTTPHEADER, headers_);
  }

  static size_t take_head(char* data, size_t, size_t size, void* user) {
    Transfer& transfer = *static_cast<Transfer*>(user);
    transfer.head_bytes_ += size;
    transfer.window_bytes_ += size;
    // Returning less than `size` ends the transfer.
    if (transfer.head_bytes_ > most_head_bytes) return 0;
    transfer.answer_.take({data, size});
    return size;
  }

  static size_t take_body(char* data, size_t, size_t size, void* user) {
    Transfer& transfer = *static_cast<Transfer*>(user);
    return transfer.take({reinterpret_cast<const std::byte*>(data), size}) ? size : 0;
  }

  bool take(Bytes bytes) {
    if (!verdict_) {
      // Judged once, when the first byte comes: the head is complete then.
      judge();
      if (verdict_->kind == Verdict::good && answer_.range)
        announced_ = answer_.range->last - answer_.range->first + 1;
    }
    if (verdict_->kind != Verdict::good) return false;
    owner_->statistics_.bytes += bytes.size();
    window_bytes_ += bytes.size();
    if (owner_->whole_) return take_whole(bytes);
    // announced_ fits into the piece, as judge_range() has compared them, so the copy below stays inside.
    if (bytes.size() > announced_ - taken_) {
      verdict_ = {Verdict::again, "the server sent more than it said"};
      return false;
    }
    std::copy(bytes.begin(), bytes.end(), piece->out.begin() + static_cast<ptrdiff_t>(piece->received));
    piece->received += bytes.size();
    taken_ += bytes.size();
    return true;
  }

  bool take_whole(Bytes bytes) {
    ScratchFile& whole = *owner_->whole_;
    // Whatever length the server announced, or none.
    if (bytes.size() > owner_->options_.whole_bytes - whole.size()) {
      verdict_ = {Verdict::fatal, "the server gives no ranges, and the whole file is more than the " +
                                      readable(owner_->options_.whole_bytes) +
                                      " allowed; download it, and open that"};
      return false;
    }
    if (auto written = whole.write_at(whole.size(), bytes); !written) {
      verdict_ = {Verdict::fatal, written.error().message};
      return false;
    }
    return true;
  }

  HttpRanges* owner_;
  const Curl& curl_;
  CURL* easy_;
  curl_slist* headers_ = nullptr;
  char problem_[CURL_ERROR_SIZE] = {};
  HttpAnswer answer_;
  std::optional<Verdict> verdict_;
  uint64_t head_bytes_ = 0;
  uint64_t announced_ = 0;
  uint64_t taken_ = 0;
  double window_begin_ = 0;
  uint64_t window_bytes_ = 0;
};

HttpRanges::HttpRanges(std::string url, const HttpOptions& options)
    : original_(std::move(url)), url_(original_), options_(options) {
  connections_ = std::make_unique<Connections>();
  connections_->curl = loaded_curl();
  if (connections_->curl != nullptr) connections_->multi = connections_->curl->multi_init();
  options_.connections = std::max(options_.connections, 1u);
  options_.attempts = std::max(options_.attempts, 1u);
}

HttpRanges::~HttpRanges() = default;

double HttpRanges::now() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

// ---- what answers mean ------------------------------------------------------------------------------------

bool HttpRanges::is_changed(const HttpAnswer& answer) const {
  const auto other = [](const std::string& a, const std::string& b) {
    return !a.empty() && !b.empty() && a != b;
  };
  // Size first, then the tag; the date only where there is no tag, as a date has seconds.
  if (answer.range && answer.range->total && *answer.range->total != size_) return true;
  if (!etag_.empty() && !answer.etag.empty()) return etag_ != answer.etag;
  return other(last_modified_, answer.last_modified);
}

HttpRanges::Verdict HttpRanges::judge_status(int status, const HttpPiece& piece) {
  const std::string what = "the server answered " + std::to_string(status) + reason_of(status);
  if (is_again_later(status)) return {Verdict::again, what};
  // An address that a redirection gave may hold for a while only.
  if (piece.moved && status >= 400) {
    url_ = original_;
    return {Verdict::again, what};
  }
  return {Verdict::fatal, what};
}

/// What an answer's head means. The order matters: what would make every range wrong (packed content) comes
/// first, then a file that changed, then what may be asked for again.
HttpRanges::Verdict HttpRanges::judge(const HttpAnswer& answer, HttpPiece& piece) {
  const bool content = answer.status == 200 || answer.status == 206;
  if (content && !answer.encoding.empty() && answer.encoding != "identity") {
    return {Verdict::fatal, "the server sends it packed (Content-Encoding: " + answer.encoding +
                                "), which has no ranges; switch that off for .maille files"};
  }
  if (!opened_) return judge_front(answer, piece);
  const bool other_size = answer.status == 200 && answer.length && *answer.length != size_;
  if ((content || answer.status == 416) && (other_size || is_changed(answer)))
    return {Verdict::changed, "the file changed on the server while it was read; open it again"};
  // It may have been a server behind a balancer that knows no ranges; attempts are bounded.
  if (answer.status == 200) return {Verdict::again, "the server sent the whole file instead of a range"};
  if (answer.status != 206) return judge_status(answer.status, piece);
  return judge_range(answer, piece);
}

HttpRanges::Verdict HttpRanges::judge_range(const HttpAnswer& answer, const HttpPiece& piece) const {
  if (answer.type.compare(0, 10, "multipart/") == 0)
    return {Verdict::again, "the server sent several parts instead of one range"};
  const uint64_t first = piece.offset + piece.received, end = piece.offset + piece.out.size();
  const auto& range = answer.range;
  if (!range || range->first > range->last)
    return {Verdict::again, "the server sent a range without saying which (Content-Range)"};
  // A server may send less than was asked for; the rest is asked for again.
  if (range->first == first && range->last < end) return {};
  return {Verdict::again, "the server sent other bytes, " + std::to_string(range->first) + ".." +
                              std::to_string(range->last + 1)};
}

HttpRanges::Verdict HttpRanges::judge_front(const HttpAnswer& answer, HttpPiece& piece) {
  // An empty file has no range.
  if (answer.status == 416 && answer.range && answer.range->total == 0) {
    piece.out = {};
    opened_ = true;
    return {};
  }
  if (answer.status == 200) return judge_whole(answer);
  if (answer.status != 206) return judge_status(answer.status, piece);
  if (Verdict verdict = judge_range(answer, piece); verdict.kind != Verdict::good) return verdict;
  if (!answer.range->total) return {Verdict::fatal, "the server does not say how large the file is"};
  size_ = *answer.range->total;
  // A file shorter than the first request.
  piece.out = piece.out.first(static_cast<size_t>(std::min<uint64_t>(size_, piece.out.size())));
  etag_ = answer.etag;
  last_modified_ = answer.last_modified;
  opened_ = true;
  return {};
}

HttpRanges::Verdict HttpRanges::judge_whole(const HttpAnswer& answer) {
  if (answer.length && *answer.length > options_.whole_bytes) {
    return {Verdict::fatal, "the server gives no ranges, and the whole file is " + readable(*answer.length) +
                                ", more than the " + readable(options_.whole_bytes) +
                                " allowed; download it, and open that"};
  }
  auto whole = ScratchFile::create({});
  if (!whole) return {Verdict::fatal, whole.error().message};
  whole_.emplace(*std::move(whole));
  return {};
}

HttpRanges::Verdict HttpRanges::judge_end(const Transfer& transfer, int code) const {
  const auto& verdict = transfer.verdict();
  if (verdict && verdict->kind != Verdict::good) return *verdict;
  const HttpPiece& piece = *transfer.piece;
  // Complete is complete, whatever libcurl says of the connection's end.
  if (opened_ && piece.received == piece.out.size()) return {};
  switch (code) {
    case CURLE_OK:
      if (whole_) return {};
      if (!transfer.is_whole()) return {Verdict::again, "the server sent less than it said"};
      // Servers may cut ranges short, as long as they get on: a short answer that brought something is no
      // fault.
      return {Verdict::again, "the server sent too little", transfer.taken() < stall_bytes};
    case CURLE_TOO_MANY_REDIRECTS:
      return {Verdict::fatal, "more than " + std::to_string(most_redirections) + " redirections"};
    case CURLE_UNSUPPORTED_PROTOCOL:
    case CURLE_URL_MALFORMAT:
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_OUT_OF_MEMORY:
      return {Verdict::fatal, transfer.problem(code)};
    // A server that was there a moment ago may come back; one that cannot be found at the beginning is a
    // wrong address.
    case CURLE_COULDNT_RESOLVE_PROXY:
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
      return {opened_ ? Verdict::again : Verdict::fatal, transfer.problem(code)};
    case CURLE_PARTIAL_FILE:
      return {Verdict::again, "the server sent less than it said"};
    default:
      return {Verdict::again, transfer.problem(code)};
  }
}

tl::unexpected<Error> HttpRanges::give_up(const HttpPiece& piece, const std::string& what) const {
  std::string message = shown_url(original_) + ": bytes " + std::to_string(piece.offset) + ".." +
                        std::to_string(piece.offset + piece.out.size()) + ": " + what;
  if (piece.faults > 1) message += "; asked " + std::to_string(piece.faults) + " times";
  return failure(ErrorCode::network, message);
}

// ---- transfers --------------------------------------------------------------------------------------------

Result<> HttpRanges::start(HttpPiece& piece) {
  ++statistics_.requests;
  piece.moved = url_ != original_;
  active_.push_back(std::make_unique<Transfer>(*this, piece));
  if (active_.back()->start()) return {};
  return failure(ErrorCode::network, shown_url(original_) + ": libcurl cannot begin a transfer");
}

/// One transfer is over, well or not: its piece is done, is asked for again, or is given up.
Result<> HttpRanges::end(size_t transfer, const Verdict& verdict) {
  HttpPiece& piece = *active_[transfer]->piece;
  curl_off_t asked_pause = 0;
  connections_->curl->easy_getinfo(active_[transfer]->easy(), CURLINFO_RETRY_AFTER, &asked_pause);
  active_.erase(active_.begin() + static_cast<ptrdiff_t>(transfer));
  if (verdict.kind == Verdict::good) {
    piece.done = true;
    return {};
  }
  // A whole file begins anew: a connection that was lost leaves no way to go on.
  whole_.reset();
  if (verdict.kind == Verdict::again)
    return verdict.counts ? ask_again(piece, verdict.what, static_cast<double>(asked_pause)) : Result<>();
  piece.faults = 0;
  if (verdict.kind == Verdict::changed)
    changed_ = Error{ErrorCode::network, shown_url(original_) + ": " + verdict.what};
  return changed_ ? tl::unexpected(*changed_) : give_up(piece, verdict.what);
}

// Pauses double with each fault of a piece, up to longest_pause, and are never shorter than the server asks
// for (Retry-After). Both bounds end this: the number of attempts of a piece, and the time since the first
// fault of all. The shift is bounded, so it cannot overflow.
Result<> HttpRanges::ask_again(HttpPiece& piece, const std::string& what, double asked_pause) {
  ++piece.faults;
  if (!first_fault_) first_fault_ = now();
  if (piece.faults >= options_.attempts) return give_up(piece, what);
  const double doubled =
      options_.pause_seconds * static_cast<double>(uint64_t{1} << std::min(piece.faults - 1, 20u));
  piece.not_before = now() + std::max(std::min(doubled, longest_pause), asked_pause);
  if (piece.not_before - *first_fault_ <= options_.retry_seconds) return {};
  if (asked_pause <= 0) return give_up(piece, what);
  return give_up(
      piece, what + ", and asks to wait " + std::to_string(static_cast<uint64_t>(asked_pause)) + " seconds");
}

Result<> HttpRanges::finish_transfers() {
  int running = 0, left = 0;
  if (connections_->curl->multi_perform(connections_->multi, &running) != CURLM_OK)
    return failure(ErrorCode::network, shown_url(original_) + ": libcurl failed");
  while (const CURLMsg* message = connections_->curl->multi_info_read(connections_->multi, &left)) {
    if (message->msg != CURLMSG_DONE) continue;
    const CURLcode code = message->data.result;
    const auto found = std::find_if(active_.begin(), active_.end(),
                                    [&](const auto& t) { return t->easy() == message->easy_handle; });
    if (found == active_.end()) continue;
    Transfer& transfer = **found;
    // Answers without content are judged by their head, as take() was never called.
    if (code == CURLE_OK) transfer.judge();
    const Verdict verdict = judge_end(transfer, code);
    remember_redirection(transfer);
    MAILLE_CHECK(end(static_cast<size_t>(found - active_.begin()), verdict));
  }
  return {};
}

/// Remembers where a redirection led, so that the next request needs no second way. judge_status() forgets it
/// when that address fails.
void HttpRanges::remember_redirection(const Transfer& transfer) {
  const char* address = nullptr;
  long count = 0;
  connections_->curl->easy_getinfo(transfer.easy(), CURLINFO_REDIRECT_COUNT, &count);
  connections_->curl->easy_getinfo(transfer.easy(), CURLINFO_EFFECTIVE_URL, &address);
  if (count > 0 && transfer.answer().status == 206 && address != nullptr) url_ = address;
}

Result<> HttpRanges::end_stalled() {
  // Backwards, as end() erases.
  for (size_t i = active_.size(); i-- > 0;) {
    if (!active_[i]->is_stalled()) continue;
    MAILLE_CHECK(end(i, {Verdict::again, "the connection stood still"}));
  }
  return {};
}

void HttpRanges::wait(std::span<const HttpPiece> pieces) const {
  // Poll at least four times a second, so that stalls and cancelled pauses are noticed; less where a pause
  // ends sooner.
  double seconds = active_.empty() ? 0 : std::min(options_.stall_seconds / 4, 0.25);
  for (const HttpPiece& piece : pieces) {
    const double pause = piece.not_before - now();
    if (!piece.done && pause > 0) seconds = seconds > 0 ? std::min(seconds, pause) : pause;
  }
  if (seconds <= 0) return;
  connections_->curl->multi_poll(connections_->multi, nullptr, 0,
                                 std::max(static_cast<int>(seconds * 1000), 1), nullptr);
}

// Runs until all pieces are done or one is given up. Each round either starts a request, lets libcurl work,
// or waits; the number of requests is bounded by attempts, as only answers that brought something do not
// count.
Result<> HttpRanges::run(std::span<HttpPiece> pieces) {
  if (connections_->multi == nullptr)
    return failure(ErrorCode::network,
                   shown_url(original_) + ": libcurl is not on this machine, or cannot begin");
  const auto is_under_way = [&](const HttpPiece& piece) {
    return std::any_of(active_.begin(), active_.end(), [&](const auto& t) { return t->piece == &piece; });
  };
  for (;;) {
    bool done = active_.empty();
    for (HttpPiece& piece : pieces) {
      if (piece.done || is_under_way(piece)) continue;
      done = false;
      if (active_.size() < options_.connections && piece.not_before <= now()) MAILLE_CHECK(start(piece));
    }
    if (done) return {};
    MAILLE_CHECK(finish_transfers());
    MAILLE_CHECK(end_stalled());
    wait(pieces);
  }
}

Result<> HttpRanges::open(std::vector<std::byte>& front) {
  front.resize(front_bytes);
  HttpPiece piece{0, front};
  MAILLE_CHECK(fetch({&piece, 1}));
  if (whole_) size_ = whole_->size();
  front.resize(whole_ ? 0 : piece.out.size());
  return {};
}

Result<> HttpRanges::fetch(std::span<HttpPiece> pieces) {
  if (changed_) return tl::unexpected(*changed_);
  first_fault_.reset();
  ++statistics_.round_trips;
  // Transfers of pieces that were given up must not write into memory that is the caller's again.
  auto done = run(pieces);
  active_.clear();
  return done;
}

}  // namespace maille
