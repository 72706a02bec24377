#include <algorithm>
#include <array>

#include <maille/mpi.h>

namespace maille::mpi {
namespace {

/// Counts of MPI are ints: so many bytes at most go from one rank to all others at once.
constexpr uint64_t most_at_once = uint64_t{1} << 30;

class MpiRanks final : public Ranks {
 public:
  explicit MpiRanks(MPI_Comm communicator) : communicator_(communicator) {
    MPI_Comm_rank(communicator, &rank_);
    MPI_Comm_size(communicator, &size_);
  }

  unsigned rank() const override { return static_cast<unsigned>(rank_); }
  unsigned size() const override { return static_cast<unsigned>(size_); }

  std::vector<std::vector<std::byte>> exchange(std::vector<std::vector<std::byte>> to) override {
    std::vector<uint64_t> sending, coming(to.size());
    for (const auto& buffer : to) sending.push_back(buffer.size());
    MPI_Alltoall(sending.data(), 1, MPI_UINT64_T, coming.data(), 1, MPI_UINT64_T, communicator_);
    std::vector<std::vector<std::byte>> from(to.size());
    // What stays here is not sent.
    std::vector<std::byte> own;
    std::swap(own, to[rank()]);
    coming[rank()] = sending[rank()] = 0;
    for (size_t r = 0; r < from.size(); ++r) from[r].resize(coming[r]);
    // All buffers of a round together stay below 1 GiB, since their places are ints, too. All ranks need the
    // same number of rounds, which is that of the largest buffer anywhere.
    const uint64_t share = most_at_once / to.size();
    std::array<uint64_t, 1> rounds = {0};
    for (const uint64_t bytes : sending) rounds[0] = std::max(rounds[0], (bytes + share - 1) / share);
    largest(rounds);
    for (uint64_t round = 0; round < rounds[0]; ++round) {
      const Round out(to, round * share, share), in(from, round * share, share);
      std::vector<std::byte> arrived(in.bytes);
      const std::vector<std::byte> packed = out.pack(to);
      MPI_Alltoallv(packed.data(), out.counts.data(), out.places.data(), MPI_BYTE, arrived.data(),
                    in.counts.data(), in.places.data(), MPI_BYTE, communicator_);
      in.unpack(arrived, from);
    }
    from[rank()] = std::move(own);
    return from;
  }

  void add(std::span<uint64_t> numbers) override { reduce(numbers, MPI_SUM); }
  void largest(std::span<uint64_t> numbers) override { reduce(numbers, MPI_MAX); }

 private:
  /// A part of each of some buffers.
  struct Round {
    uint64_t first;
    std::vector<int> counts, places;
    size_t bytes = 0;

    Round(const std::vector<std::vector<std::byte>>& buffers, uint64_t from, uint64_t most) : first(from) {
      for (const auto& buffer : buffers) {
        const uint64_t left = buffer.size() > from ? buffer.size() - from : 0;
        counts.push_back(static_cast<int>(std::min(left, most)));
        places.push_back(static_cast<int>(bytes));
        bytes += static_cast<size_t>(counts.back());
      }
    }
    std::vector<std::byte> pack(const std::vector<std::vector<std::byte>>& buffers) const {
      std::vector<std::byte> packed;
      packed.reserve(bytes);
      for (size_t r = 0; r < buffers.size(); ++r) {
        if (counts[r] == 0) continue;
        const auto begin = buffers[r].begin() + static_cast<ptrdiff_t>(first);
        packed.insert(packed.end(), begin, begin + counts[r]);
      }
      return packed;
    }
    void unpack(const std::vector<std::byte>& packed, std::vector<std::vector<std::byte>>& buffers) const {
      for (size_t r = 0; r < buffers.size(); ++r) {
        if (counts[r] == 0) continue;
        std::copy_n(packed.begin() + places[r], counts[r],
                    buffers[r].begin() + static_cast<ptrdiff_t>(first));
      }
    }
  };

  /// All ranks pass the same number of numbers, so they make the same number of calls.
  void reduce(std::span<uint64_t> numbers, MPI_Op operation) {
    for (size_t at = 0; at < numbers.size(); at += most_at_once / 8) {
      const auto count = static_cast<int>(std::min<uint64_t>(numbers.size() - at, most_at_once / 8));
      MPI_Allreduce(MPI_IN_PLACE, numbers.data() + at, count, MPI_UINT64_T, operation, communicator_);
    }
  }

  MPI_Comm communicator_;
  int rank_ = 0, size_ = 1;
};

}  // namespace

std::unique_ptr<Ranks> ranks(MPI_Comm communicator) {
  return std::make_unique<MpiRanks>(communicator);
}

Result<EncodeReport> encode(MPI_Comm communicator, const RankPart& part, const std::string& path,
                            const EncodeOptions& options, const RanksOptions& how) {
  const std::unique_ptr<Ranks> all = ranks(communicator);
  Result<std::unique_ptr<RanksFile>> opened = file(communicator, path);
  if (!opened) return tl::unexpected(opened.error());
  return maille::encode(part, *all, **opened, options, how);
}

Result<StepReport> append_step(MPI_Comm communicator, const std::string& path, double time,
                               const RankPart& part, const EncodeOptions& options, const RanksOptions& how) {
  const std::unique_ptr<Ranks> all = ranks(communicator);
  Result<std::unique_ptr<RanksFile>> opened = file_to_append(communicator, path);
  if (!opened) return tl::unexpected(opened.error());
  // Behind the lock, so that nobody's step is missed. It must be open in all ranks before any goes on.
  const Result<std::unique_ptr<Source>> before = file_source(path);
  std::vector<uint64_t> failing = {before ? 0u : 1u};
  all->largest(failing);
  if (!before) return tl::unexpected(before.error());
  if (failing[0] != 0) return failure(ErrorCode::cannot_read, path + ": another rank cannot read it");
  return maille::append_step(**before, time, part, *all, **opened, options, how);
}

}  // namespace maille::mpi
