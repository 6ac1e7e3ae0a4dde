// A million tetrahedra read from every format that holds them: processor seconds (the least of several
// runs) of reading and repair, and bytes per tetrahedron through the context's memory: the most while
// reading, and what stays. Figures to reach: 5 s, 600 and 400 bytes. --cells N for another number, --csv
// FILE appends rows.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>

#include "../unit/mesh/mesh_support.h"
#include "machine.h"
#include "mesh/raw_mesh.h"

int main(int argc, char **argv) {
  uint32_t cells = 1000000;
  std::string csv;
  for (int k = 1; k + 1 < argc; k += 2) {
    if (std::strcmp(argv[k], "--cells") == 0) cells = static_cast<uint32_t>(std::atoi(argv[k + 1]));
    if (std::strcmp(argv[k], "--csv") == 0) csv = argv[k + 1];
  }
  constexpr int kRuns = 3;
  const dfm::RestMesh beam = dfm::make_beam(dfm::Memory::standard(), 2, 1, 1, cells);
  const std::string folder = test::scratch("mesh_read_bench");
  std::printf("%-10s %10s %8s %10s %10s %12s %12s\n", "format", "cells", "MB", "parse s", "whole s",
              "peak B/cell", "held B/cell");
  for (const char *name : {"a.msh", "a.msh2", "a.vtk", "a.vtu", "a.mesh"}) {
    const std::string path = folder + "/" + name;
    dfm::write_mesh(beam, path);
    double parse = std::numeric_limits<double>::max(), whole = parse;
    size_t peak = 0, held = 0;
    for (int run = 0; run < kRuns; ++run) {
      const double before = bench::process_seconds();
      test::CountedMemory memory;
      dfm::RawMesh raw = dfm::read_raw(memory.hooks, path);
      parse = std::min(parse, bench::process_seconds() - before);
      const dfm::RestMesh mesh = dfm::finish_mesh(path, std::move(raw));
      whole = std::min(whole, bench::process_seconds() - before);
      peak = memory.peak;
      held = memory.held;
    }
    const double each = beam.ntet(), megabytes = double(std::filesystem::file_size(path)) / 1e6;
    std::filesystem::remove(path);
    std::printf("%-10s %10u %8.0f %10.2f %10.2f %12.0f %12.0f\n", name, beam.ntet(), megabytes, parse, whole,
                double(peak) / each, double(held) / each);
    if (!csv.empty())
      std::ofstream(csv, std::ios::app) << bench::machine() << ',' << bench::compiler() << ',' << name << ','
                                        << beam.ntet() << ',' << megabytes << ',' << parse << ',' << whole
                                        << ',' << double(peak) / each << ',' << double(held) / each << '\n';
  }
  return 0;
}
