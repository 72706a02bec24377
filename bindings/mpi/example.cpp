// A solver that holds a part of a mesh in memory: each rank has a slab of a curved bar, with a field on its
// points and one on its cells. mpirun -n 8 maille-mpi-example flow.maille [RANK-THAT-FAILS how]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include <maille/mpi.h>

namespace {

constexpr uint64_t across = 16, along = 96;

struct Slab {
  maille::Mesh mesh;
  std::vector<uint64_t> point_ids, cell_ids;
};

/// Layers of cells from `first` to before `end`; points between two slabs are in both, under one number.
Slab make_slab(uint64_t first, uint64_t end) {
  using namespace maille;
  Slab slab;
  Array temperature = make_array("T", Domain::point, Scalar::f32, 1);
  Array layer = make_array("layer", Domain::cell, Scalar::i32, 1);
  const uint64_t points_across = across + 1;
  for (uint64_t z = first; z <= end && first < end; ++z) {
    for (uint64_t i = 0; i < points_across * points_across; ++i)
      slab.point_ids.push_back(z * points_across * points_across + i);
  }
  slab.mesh.points.resize(slab.point_ids.size());
  temperature.resize(slab.point_ids.size());
  for (size_t i = 0; i < slab.point_ids.size(); ++i) {
    const uint64_t id = slab.point_ids[i];
    const auto x = static_cast<float>(id % points_across),
               y = static_cast<float>(id / points_across % points_across),
               z = static_cast<float>(id / (points_across * points_across));
    float* const at = &slab.mesh.points.values<float>()[3 * i];
    at[0] = 0.1f * x + 0.001f * z * z;
    at[1] = 0.1f * y;
    at[2] = 0.2f * z;
    temperature.values<float>()[i] = x * x + 0.5f * y * z;
  }
  CellBlock block;
  block.type = CellType::hexahedron;
  for (uint64_t z = first; z < end; ++z) {
    for (uint64_t i = 0; i < across * across; ++i) {
      const uint64_t corner = ((z - first) * points_across + i / across) * points_across + i % across;
      for (const uint64_t up : {uint64_t{0}, points_across * points_across}) {
        for (const uint64_t step : {uint64_t{0}, uint64_t{1}, points_across + 1, points_across})
          block.connectivity.push_back(static_cast<uint32_t>(corner + up + step));
      }
      slab.cell_ids.push_back(z * across * across + i);
    }
  }
  layer.resize(slab.cell_ids.size());
  for (size_t i = 0; i < slab.cell_ids.size(); ++i)
    layer.values<int32_t>()[i] = static_cast<int32_t>(slab.cell_ids[i] / (across * across));
  slab.mesh.blocks.push_back(std::move(block));
  slab.mesh.arrays = {temperature, layer};
  return slab;
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int rank = 0, size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  const auto begin_of = [&](int r) { return along * static_cast<uint64_t>(r) / static_cast<uint64_t>(size); };
  Slab slab = make_slab(begin_of(rank), begin_of(rank + 1));
  // For tests of what happens then.
  if (argc > 3 && std::atoi(argv[2]) == rank) {
    if (std::strcmp(argv[3], "dies") == 0) std::abort();
    if (std::strcmp(argv[3], "other-array") == 0) slab.mesh.arrays[0].name.push_back('p');
    if (std::strcmp(argv[3], "other-point") == 0) slab.mesh.points.values<float>()[0] += 1;
    if (std::strcmp(argv[3], "no-cell") == 0) slab.cell_ids.pop_back();
  }
  maille::EncodeOptions options;
  options.mode = maille::Mode::stream;
  options.order = maille::Order::keep;
  const maille::RankPart part{&slab.mesh, slab.point_ids, slab.cell_ids};
  const auto report = maille::mpi::encode(MPI_COMM_WORLD, part, argc > 1 ? argv[1] : "flow.maille", options,
                                          {.cells_per_piece = 4096});
  if (!report && rank == 0) std::fprintf(stderr, "%s\n", report.error().message.c_str());
  MPI_Finalize();
  return report ? 0 : static_cast<int>(report.error().code);
}
