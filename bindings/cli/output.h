// The files of a run: tables row by row, states, nodes.
#pragma once
#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "file.h"
#include "run.h"
#include "run_folder.h"

namespace cli {

// A table that is only ever whole rows: a block of rows is collected and written at once.
class Csv {
 public:
  Csv(const std::string &path, const std::string &header);
  Csv &cell(const std::string &text);
  Csv &cell(double x);
  Csv &cells(const double *x, int n);
  void end_row();
  void flush();

 private:
  std::string path_, block_;
  File file_;
  bool first_ = true;
};

// A body's nodes by the numbers of its mesh file; `surface`: they are points of its surface,
// not of its cells.
struct FileNodes {
  dfm_body body = 0;
  std::string name;
  bool surface = false;
  std::vector<uint32_t> number;
};

class Outputs {
 public:
  Outputs(const SceneFile &scene, const std::string &folder);
  // Rows of every table, and states where the scene asks for them.
  void record();
  void write_last();   // states/last_*.vtu
  void write_nodes();  // nodes/BODY.csv

 private:
  FileNodes file_nodes(const BodyView &body) const;
  static std::vector<double> node_displacements(const FileNodes &nodes);
  void write_body(double t, uint64_t handle, const std::string &name, const dfm_body_measure &m);
  void write_bodies(double t);
  void write_contacts(double t);
  void write_probes(double t);
  void write_states(const std::string &suffix);
  std::string state_path(const std::string &name) const { return folder_ + "/states/" + name + ".vtu"; }

  const SceneFile &scene_;
  std::string folder_;
  RunFolder held_;
  Csv bodies_;
  std::unique_ptr<Csv> contacts_, probes_, index_;
  uint32_t recorded_ = 0;
  double last_time_ = 0;
  std::map<uint64_t, std::array<double, 3>> last_impulse_;  // N s at the last record, by handle
  std::vector<FileNodes> nodes_;                            // of each body, where the scene asks for them
};

}  // namespace cli
