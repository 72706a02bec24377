#include "rows.h"

#include <algorithm>

namespace maille::bench {
namespace {

template <class Work>
auto timed(std::vector<double>& seconds, const Work& work) {
  const double start = thread_seconds();
  auto result = work();
  seconds.push_back(thread_seconds() - start);
  return result;
}

bool enough(const std::vector<double>& seconds, size_t runs, double budget) {
  double spent = 0;
  for (const double s : seconds) spent += s;
  return seconds.size() >= runs || (!seconds.empty() && spent > budget);
}

Check check_of(const Codec& codec, const Workload& workload, const Surface& decoded) {
  const Surface original =
      codec.needs_triangles() ? as_triangles(workload.surface, workload.triangles) : workload.surface;
  // A thousandth for what float32 adds to half a step.
  return codec.keeps_lattice() || workload.bits == 0 ? check_round_trip(original, decoded)
                                                     : check_within(original, decoded, 0.501);
}

void split_bytes(Encoded& encoded, const Codec& codec, const Workload& workload) {
  if (!encoded.connectivity) encoded.connectivity = codec.estimate_connectivity(workload);
  if (encoded.connectivity && !encoded.geometry) {
    encoded.geometry = encoded.bytes.size() - std::min<uint64_t>(*encoded.connectivity, encoded.bytes.size());
  }
}

template <class T>
std::string problem_of(const Result<T>& result) {
  return result ? "" : result.error().message;
}

}  // namespace

Row first_run(const Codec& codec, const Workload& workload, Peaks peaks) {
  Row row;
  row.codec = &codec;
  const auto fail = [&row](const char* way, const std::string& problem) {
    row.problem = way + problem;
    return row;
  };
  const auto encode = [&] { return codec.encode(workload); };
  const auto decode = [&] { return codec.decode(row.encoded.bytes, workload); };
  if (peaks == Peaks::measured) row.encode_trial = try_in_child([&] { return problem_of(encode()); });
  if (!row.encode_trial.problem.empty()) return fail("encode: ", row.encode_trial.problem);
  auto encoded = timed(row.encode_seconds, encode);
  if (!encoded) return fail("encode: ", encoded.error().message);
  row.encoded = std::move(*encoded);
  row.encoded.bytes.shrink_to_fit();
  if (peaks == Peaks::measured) row.decode_trial = try_in_child([&] { return problem_of(decode()); });
  if (!row.decode_trial.problem.empty()) return fail("decode: ", row.decode_trial.problem);
  const auto decoded = timed(row.decode_seconds, decode);
  if (!decoded) return fail("decode: ", decoded.error().message);
  row.check = check_of(codec, workload, (*decoded)());
  split_bytes(row.encoded, codec, workload);
  return row;
}

void time_round(std::vector<Row>& rows, const Workload& workload, const Runs& runs) {
  for (Row& row : rows) {
    if (!row.problem.empty()) continue;
    if (!enough(row.encode_seconds, runs.encode, runs.seconds))
      timed(row.encode_seconds, [&] { return row.codec->encode(workload); });
    if (!enough(row.decode_seconds, runs.decode, runs.seconds))
      timed(row.decode_seconds, [&] { return row.codec->decode(row.encoded.bytes, workload); });
  }
}

double million_triangles_per_second(const Workload& workload, const std::vector<double>& seconds) {
  if (seconds.empty()) return 0;
  const double time = *std::min_element(seconds.begin(), seconds.end());
  return time > 0 ? 1e-6 * static_cast<double>(workload.triangles.size() / 3) / time : 0;
}

}  // namespace maille::bench
