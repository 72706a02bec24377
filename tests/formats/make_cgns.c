// Writes the CGNS files beside it by CGNS' own library (Debian: libcgns-dev). Needed only to change them:
// cc make_cgns.c -lcgns -lm -o make_cgns && ./make_cgns
#include <cgnslib.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRY(call) \
  if (call) cg_error_exit()

static int begin(const char* name, int cell_dimension, int* base) {
  int file;
  TRY(cg_set_file_type(CG_FILE_HDF5));
  TRY(cg_open(name, CG_MODE_WRITE, &file));
  TRY(cg_base_write(file, "Base", cell_dimension, 3, base));
  return file;
}

static void coordinates(int file, int base, int zone, DataType_t type, const void* x, const void* y, const void* z) {
  int c;
  TRY(cg_coord_write(file, base, zone, type, "CoordinateX", x, &c));
  TRY(cg_coord_write(file, base, zone, type, "CoordinateY", y, &c));
  TRY(cg_coord_write(file, base, zone, type, "CoordinateZ", z, &c));
}

// Points of a grid, i fastest, at i, j + shift, k.
static double* grid(const int* size, double shift, int axis) {
  double* values = malloc(sizeof(double) * size[0] * size[1] * size[2]);
  double* to = values;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) *to++ = axis == 0 ? i : axis == 1 ? j + shift : k;
  return values;
}

// Two zones, each with pressures at cells (with a plane of ghosts around) at two times, temperatures at points,
// and a boundary condition.
static void structured(void) {
  int base, file = begin("structured.cgns", 3, &base);
  const char* names[] = {"left", "right"};
  const char* times[] = {"Solution 1", "Solution 2"};
  double values[] = {0.5, 1.5};
  for (int z = 0; z < 2; ++z) {
    const int size[] = {3 + z, 3, 2};
    cgsize_t zone_size[9] = {size[0], size[1], size[2], size[0] - 1, size[1] - 1, size[2] - 1};
    int zone, solution, field, bc;
    TRY(cg_zone_write(file, base, names[z], zone_size, Structured, &zone));
    coordinates(file, base, zone, RealDouble, grid(size, 2 * z, 0), grid(size, 2 * z, 1), grid(size, 2 * z, 2));
    for (int t = 0; t < 2; ++t) {
      double pressure[5 * 4 * 3];
      for (int k = 0, at = 0; k < size[2] + 1; ++k)
        for (int j = 0; j < size[1] + 1; ++j)
          for (int i = 0; i < size[0] + 1; ++i) {
            const int ghost = i == 0 || j == 0 || k == 0 || i == size[0] || j == size[1] || k == size[2];
            pressure[at++] = ghost ? -1 : 1000 * t + 100 * z + i + 10 * j;
          }
      const int rind[] = {1, 1, 1, 1, 1, 1};
      TRY(cg_sol_write(file, base, zone, times[t], CellCenter, &solution));
      TRY(cg_goto(file, base, "Zone_t", zone, "FlowSolution_t", solution, "end"));
      TRY(cg_rind_write(rind));
      TRY(cg_field_write(file, base, zone, solution, RealDouble, "Pressure", pressure, &field));
    }
    if (z == 1) {  // an array that one zone has
      float temperature[24];
      for (int i = 0; i < 24; ++i) temperature[i] = 20 + i;
      TRY(cg_sol_write(file, base, zone, "At points", Vertex, &solution));
      TRY(cg_field_write(file, base, zone, solution, RealSingle, "Temperature", temperature, &field));
    }
    cgsize_t range[] = {1, 1, 1, 1, size[1], size[2]};
    TRY(cg_boco_write(file, base, zone, "inflow", BCInflow, PointRange, 2, range, &bc));
    char pointers[128];
    snprintf(pointers, sizeof pointers, "%-32s%-32s", times[0], times[1]);
    cgsize_t shape[] = {32, 2};
    TRY(cg_ziter_write(file, base, zone, "ZoneIterativeData"));
    TRY(cg_goto(file, base, "Zone_t", zone, "ZoneIterativeData_t", 1, "end"));
    TRY(cg_array_write("FlowSolutionPointers", Character, 2, shape, pointers));
  }
  cgsize_t two = 2;
  TRY(cg_biter_write(file, base, "TimeIterValues", 2));
  TRY(cg_goto(file, base, "BaseIterativeData_t", 1, "end"));
  TRY(cg_array_write("TimeValues", RealDouble, 1, &two, values));
  TRY(cg_close(file));
}

// Corners of the elements of CGNS at a place of their own, middle nodes at the means that SIDS tells: pairs of
// corners from 1 on, or more for faces, 0 behind each.
struct Element {
  ElementType_t type;
  int corners;
  double at[8][3];
  const char* middles;
};
#define HEXA {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}
#define PENTA {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}
#define PYRA {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}}
#define TETRA {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}
#define HEXA_EDGES "12 23 34 41 15 26 37 48 56 67 78 85 "
#define PENTA_EDGES "12 23 31 14 25 36 45 56 64 "
#define PYRA_EDGES "12 23 34 41 15 25 35 45 "
static const struct Element elements[] = {
    {BAR_3, 2, HEXA, "12 "},
    {TRI_6, 3, PENTA, "12 23 31 "},
    {QUAD_8, 4, HEXA, "12 23 34 41 "},
    {QUAD_9, 4, HEXA, "12 23 34 41 1234 "},
    {TETRA_10, 4, TETRA, "12 23 31 14 24 34 "},
    {PYRA_13, 5, PYRA, PYRA_EDGES},
    {PYRA_14, 5, PYRA, PYRA_EDGES "1234 "},
    {PENTA_15, 6, PENTA, PENTA_EDGES},
    {PENTA_18, 6, PENTA, PENTA_EDGES "1254 2365 3146 "},
    {HEXA_20, 8, HEXA, HEXA_EDGES},
    {HEXA_27, 8, HEXA, HEXA_EDGES "1432 1265 2376 3487 1584 5678 12345678 "},
    {NODE, 1, HEXA, ""},
    {BAR_2, 2, HEXA, ""},
    {TRI_3, 3, PENTA, ""},
    {QUAD_4, 4, HEXA, ""},
    {TETRA_4, 4, TETRA, ""},
    {PYRA_5, 5, PYRA, ""},
    {PENTA_6, 6, PENTA, ""},
    {HEXA_8, 8, HEXA, ""}};
enum { most = 512, kinds = sizeof elements / sizeof *elements };
static float x[most], y[most], z[most];
static cgsize_t points;

// Adds the points of an element and says how many there are.
static int add_element(int kind) {
  const struct Element* e = &elements[kind];
  const cgsize_t first = points;
  for (int c = 0; c < e->corners; ++c, ++points) {
    x[points] = (float)(e->at[c][0] + 2 * kind);
    y[points] = (float)e->at[c][1];
    z[points] = (float)e->at[c][2];
  }
  for (const char* m = e->middles; *m; ++m, ++points) {
    float sum[3] = {0, 0, 0};
    int count = 0;
    for (; *m != ' '; ++m, ++count) {
      const cgsize_t c = first + *m - '1';
      sum[0] += x[c], sum[1] += y[c], sum[2] += z[c];
    }
    x[points] = sum[0] / (float)count, y[points] = sum[1] / (float)count, z[points] = sum[2] / (float)count;
  }
  return (int)(points - first);
}

// Each type of element in a section, then all in one that is MIXED, on the same points.
static void every_element(void) {
  int base, zone, section, solution, field, bc, file = begin("elements.cgns", 3, &base);
  cgsize_t mixed[2 * most], offsets[kinds + 1] = {0}, nodes[most], begin_of[kinds];
  int sizes[kinds], used = 0;
  for (int kind = 0; kind < kinds; ++kind) {
    begin_of[kind] = points;
    sizes[kind] = add_element(kind);
  }
  int numbers[2 * kinds];  // of the solids
  cgsize_t solids = 0;
  for (int kind = 0; kind < 2 * kinds; ++kind) {
    const ElementType_t type = elements[kind % kinds].type;
    if (type >= TETRA_4 && type <= PYRA_13) numbers[solids] = (int)solids, ++solids;
  }
  cgsize_t zone_size[3] = {points, solids, 0};
  TRY(cg_zone_write(file, base, "all", zone_size, Unstructured, &zone));
  coordinates(file, base, zone, RealSingle, x, y, z);
  for (int kind = 0; kind < kinds; ++kind) {
    for (int i = 0; i < sizes[kind]; ++i) nodes[i] = begin_of[kind] + i + 1;
    const char* name = ElementTypeName[elements[kind].type];
    // The names are against the order of elements.
    char reversed[64];
    snprintf(reversed, sizeof reversed, "%c %s", 'z' - kind, name);
    TRY(cg_section_write(file, base, zone, reversed, elements[kind].type, kind + 1, kind + 1, 0, nodes, &section));
    mixed[used++] = elements[kind].type;
    for (int i = 0; i < sizes[kind]; ++i) mixed[used++] = nodes[i];
    offsets[kind + 1] = used;
  }
  TRY(cg_poly_section_write(file, base, zone, "a mixed", MIXED, kinds + 1, 2 * kinds, 0, mixed, offsets, &section));
  TRY(cg_sol_write(file, base, zone, "Flow", CellCenter, &solution));
  TRY(cg_field_write(file, base, zone, solution, Integer, "number", numbers, &field));
  cgsize_t list[] = {2, kinds + 3};
  TRY(cg_boco_write(file, base, zone, "wall", BCWall, PointList, 2, list, &bc));
  TRY(cg_boco_gridlocation_write(file, base, zone, bc, FaceCenter));
  cgsize_t corner[] = {3, 1};
  TRY(cg_boco_write(file, base, zone, "held", BCWall, PointList, 2, corner, &bc));
  TRY(cg_close(file));
}

// Two cubes side by side as polyhedra, with their outer faces in two boundary conditions.
static void polyhedra(void) {
  int base, zone, section, bc, file = begin("polyhedra.cgns", 3, &base);
  const int size[] = {3, 2, 2};
  cgsize_t zone_size[3] = {12, 2, 0};
  TRY(cg_zone_write(file, base, "two", zone_size, Unstructured, &zone));
  coordinates(file, base, zone, RealDouble, grid(size, 0, 0), grid(size, 0, 1), grid(size, 0, 2));
  // The sixth face is between both.
  cgsize_t faces[] = {1, 7, 10, 4, 1, 4, 5, 2, 7, 8, 11, 10, 1, 2, 8,  7, 4, 10, 11, 5, 2, 5,
                      11, 8, 2, 5, 6, 3, 8, 9, 12, 11, 2, 3, 9, 8, 5, 11, 12, 6, 3, 6, 12, 9};
  cgsize_t face_offsets[12], cell_faces[] = {1, 2, 3, 4, 5, 6, -6, 7, 8, 9, 10, 11}, cell_offsets[] = {0, 6, 12};
  for (int i = 0; i < 12; ++i) face_offsets[i] = 4 * i;
  TRY(cg_poly_section_write(file, base, zone, "faces", NGON_n, 1, 11, 0, faces, face_offsets, &section));
  TRY(cg_poly_section_write(file, base, zone, "cells", NFACE_n, 12, 13, 0, cell_faces, cell_offsets, &section));
  cgsize_t list[] = {1}, range[] = {7, 11};
  TRY(cg_boco_write(file, base, zone, "inlet", BCInflow, PointList, 1, list, &bc));
  TRY(cg_boco_gridlocation_write(file, base, zone, bc, FaceCenter));
  TRY(cg_boco_write(file, base, zone, "wall", BCWall, PointRange, 2, range, &bc));
  TRY(cg_boco_gridlocation_write(file, base, zone, bc, FaceCenter));
  TRY(cg_close(file));
}

// The same cubes, of which only the faces are given, with the cells on both of their sides.
static void parents(void) {
  int base, zone, section, file = begin("parents.cgns", 3, &base);
  const int size[] = {3, 2, 2};
  cgsize_t zone_size[3] = {12, 2, 0};
  TRY(cg_zone_write(file, base, "two", zone_size, Unstructured, &zone));
  coordinates(file, base, zone, RealDouble, grid(size, 0, 0), grid(size, 0, 1), grid(size, 0, 2));
  cgsize_t faces[] = {1, 7, 10, 4, 1, 4, 5, 2, 7, 8, 11, 10, 1, 2, 8,  7, 4, 10, 11, 5, 2, 5,
                      11, 8, 2, 5, 6, 3, 8, 9, 12, 11, 2, 3, 9, 8, 5, 11, 12, 6, 3, 6, 12, 9};
  cgsize_t face_offsets[12], sides[44] = {0};
  for (int i = 0; i < 12; ++i) face_offsets[i] = 4 * i;
  for (int i = 0; i < 11; ++i) sides[i] = i < 6 ? 12 : 13;
  sides[11 + 5] = 13;
  TRY(cg_poly_section_write(file, base, zone, "faces", NGON_n, 1, 11, 0, faces, face_offsets, &section));
  TRY(cg_parent_data_write(file, base, zone, section, sides));
  TRY(cg_close(file));
}

int main(void) {
  structured();
  every_element();
  polyhedra();
  parents();
  return 0;
}
