#include "rows.h"

#include <algorithm>

namespace maille::bench {
namespace {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

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

}  // namespace

Row first_run(const Codec& codec, const Workload& workload) {
  Row row;
  row.codec = &codec;
  row.encode_trial = try_in_child([&] {
    const auto encoded = codec.encode(workload);
    return encoded ? "" : encoded.error().message;
  });
  if (!row.encode_trial.ok) {
    row.problem = "encode: " + row.encode_trial.problem;
    return row;
  }
  row.encoded = *timed(row.encode_seconds, [&] { return codec.encode(workload); });
  row.encoded.bytes.shrink_to_fit();
  row.decode_trial = try_in_child([&] {
    const auto decoded = codec.decode(row.encoded.bytes, workload);
    return decoded ? "" : decoded.error().message;
  });
  if (!row.decode_trial.ok) {
    row.problem = "decode: " + row.decode_trial.problem;
    return row;
  }
  const auto decoded = timed(row.decode_seconds, [&] { return codec.decode(row.encoded.bytes, workload); });
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
  const double time = median(seconds);
  return time > 0 ? 1e-6 * static_cast<double>(workload.triangles.size() / 3) / time : 0;
}

}  // namespace maille::bench
