// The files of a run: tables row by row, states, nodes.
#pragma once
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "run.h"

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
  std::unique_ptr<FILE, int (*)(FILE *)> file_;
  bool first_ = true;
};

class Outputs {
 public:
  Outputs(const SceneFile &scene, const std::string &folder);
  // Rows of every table, and states where the scene asks for them.
  void record();
  void write_last();   // states/last_*.vtu
  void write_nodes();  // nodes/BODY.csv

 private:
  void write_bodies(double t);
  void write_contacts(double t);
  void write_probes(double t);
  void write_states(const std::string &suffix);
  std::string state_path(const std::string &name) const { return folder_ + "/states/" + name + ".vtu"; }

  const SceneFile &scene_;
  std::string folder_;
  Csv bodies_;
  std::unique_ptr<Csv> contacts_, probes_, index_;
  uint32_t recorded_ = 0;
  double last_time_ = 0;
  std::vector<double> last_impulse_;              // [nbody,3]
  std::vector<std::vector<double>> start_;        // positions at the start, for nodes
  std::vector<dfm_pair_report> pairs_;
};

}  // namespace cli
